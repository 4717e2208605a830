"""Reading saved audits back: a document of `--format json`, or the report that holds one."""

from __future__ import annotations

import gzip
import hashlib
import json
import re
import zlib
from pathlib import Path
from typing import Any

from meshwright.audit.errors import ReadError
from meshwright.audit.summary import SCHEMA, Summary

__all__ = ["EMBEDDED", "embedded", "is_saved", "read_saved"]

EMBEDDED = "meshwright-audit"
"""Id of the script element of a report that holds its document."""

_LARGEST = 256 * 2**20
_OPENING = re.compile(rb'<script[^>]*\bid="' + EMBEDDED.encode() + rb'"[^>]*>')
_KEYS: dict[str, type | tuple[type, ...]] = {
    "version": str,
    "mesh": dict,
    "zones": list,
    "quality": list,
    "distributions": dict,
    "metrics": dict,
    "definitions": dict,
    "findings": list,
    "gate": dict,
    "notes": list,
}
_INNER: dict[str, dict[str, type | tuple[type, ...]]] = {
    "mesh": {"path": str, "format": str, "cells": dict, "points": int, "dimension": int},
    "gate": {"verdict": str, "rules": list},
}
_RULE_KEYS = ("id", "metric", "stat", "on", "measured", "state", "value_beyond")


def embedded(document: Summary) -> str:
    """The document as the text of a script element: nothing in it ends the element or begins another."""
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def is_saved(path: str | Path) -> bool:
    """Whether the file begins like a saved audit, and not like a mesh."""
    try:
        with Path(path).open("rb") as stream:
            head = stream.read(4096)
        if head[:2] == b"\x1f\x8b":
            with gzip.open(path) as unpacked:
                head = unpacked.read(4096)
    except (OSError, EOFError, zlib.error):
        return False
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")[:4096].lower()
    return start.startswith((b"<!doctype html", b"<html")) or (
        start[:1] == b"{" and b'"schema"' in start and b"meshwright." in start
    )


def read_saved(path: str | Path) -> tuple[Summary, str]:
    """The document of a saved audit, and the SHA-256 of the file; ReadError for anything else.

    Read are `meshwright.audit/1`, `meshwright.audits/1` with one mesh, either in gzip, and HTML reports.
    """
    shown = str(path)
    data = _bytes(Path(path), shown)
    digest = hashlib.sha256(data).hexdigest()
    if data[:2] == b"\x1f\x8b":
        data = _unpacked(data, shown)
    opening = _OPENING.search(data)
    if opening:
        end = data.find(b"</script", opening.end())
        data = data[opening.end() : end if end >= 0 else len(data)]
    elif data.lstrip()[:1] == b"<":
        raise ReadError(shown, "", "a report of meshwright with its data in it", "another page")
    try:
        document = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise ReadError(shown, "", "a saved audit (JSON, or a report of meshwright)", str(error)) from None
    if isinstance(document, dict) and document.get("schema") == "meshwright.audits/1":
        audits = document.get("audits")
        if not isinstance(audits, list) or len(audits) != 1:
            raise ReadError(
                shown, "", "the audit of one mesh", f"{len(audits) if isinstance(audits, list) else 'no'} audits"
            )
        document = audits[0]
    _check(document, shown)
    return document, digest


def _bytes(path: Path, shown: str) -> bytes:
    try:
        with path.open("rb") as stream:
            data = stream.read(_LARGEST + 1)
    except OSError as error:
        raise ReadError(shown, "", "a saved audit", error.strerror or "input/output error") from None
    if len(data) > _LARGEST:
        raise ReadError(shown, "", f"a saved audit of at most {_LARGEST} bytes", "more")
    return data


def _unpacked(data: bytes, shown: str) -> bytes:
    unpacker = zlib.decompressobj(31)
    try:
        found = unpacker.decompress(data, _LARGEST + 1)
    except zlib.error as error:
        raise ReadError(shown, "", "gzip data", str(error)) from None
    if len(found) > _LARGEST or not unpacker.eof:
        raise ReadError(shown, "", f"whole gzip data of at most {_LARGEST} bytes", "more, or an early end")
    return found


def _check(document: Any, shown: str) -> None:
    """ReadError unless all is there that readers of a document rely on."""
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, dict) else type(document).__name__
        raise ReadError(shown, "key 'schema'", repr(SCHEMA), repr(found))
    for place, table, keys in (
        ("", document, _KEYS),
        *((f"{k}.", document.get(k), keys) for k, keys in _INNER.items()),
    ):
        for key, kind in keys.items():
            value = table.get(key) if isinstance(table, dict) else None
            if not isinstance(value, kind):
                names = kind.__name__ if isinstance(kind, type) else "value"
                raise ReadError(shown, f"key '{place}{key}'", f"a {names}", type(value).__name__)
    for rule in document["gate"]["rules"]:
        if not isinstance(rule, dict) or any(key not in rule for key in _RULE_KEYS):
            raise ReadError(shown, "key 'gate.rules'", f"rules with {', '.join(_RULE_KEYS)}", "others")
    for figures in document["metrics"].values():
        ok = isinstance(figures, dict) and all(
            isinstance(f, dict) and {"count", "min", "max", "mean"} <= f.keys() for f in figures.values()
        )
        if not ok:
            raise ReadError(shown, "key 'metrics'", "figures by cell type", "others")
