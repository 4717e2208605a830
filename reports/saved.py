"""Reading saved audits back: a document of `--format json`, or the report that holds one."""

from __future__ import annotations

import gzip
import hashlib
import json
import re
import zlib
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from meshwright.audit.errors import ReadError, printable
from meshwright.audit.summary import SCHEMA, Summary

__all__ = ["EMBEDDED", "embedded", "is_saved", "read_saved"]

EMBEDDED = "meshwright-audit"
"""Id of the script element of a report that holds its document."""

_LARGEST = 256 * 2**20
_OPENING = re.compile(rb'<script[^>]*\bid="' + EMBEDDED.encode() + rb'"[^>]*>')


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
        document = json.loads(data.decode("utf-8-sig"), parse_constant=_no_constant)
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
    """ReadError unless the document is what its published schema says, and agrees with itself."""
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, dict) else type(document).__name__
        raise ReadError(shown, "key 'schema'", repr(SCHEMA), repr(found))
    error = next(_validator().iter_errors(document), None)
    if error is not None:
        place = ".".join(map(str, error.absolute_path)) or "the document"
        rule = f"{error.validator} {json.dumps(error.validator_value)[:120]}"
        raise ReadError(
            shown, f"key {printable(place)!r}", f"what the schema {SCHEMA} says ({rule})", repr(error.instance)[:200]
        )
    for id_, entry in document.get("histograms", {}).items():
        if not _is_histogram(entry):
            raise ReadError(
                shown, f"key 'histograms.{printable(id_)}'", "ascending edges, a count for each bin", "others"
            )
    for id_, rows in document.get("zone_metrics", {}).items():
        if any(row["zone"] is not None and row["zone"] >= len(document["zones"]) for row in rows):
            raise ReadError(shown, f"key 'zone_metrics.{printable(id_)}'", "places of zones", "a place behind the last")
    lost = sorted(document["metrics"].keys() - document["definitions"].keys())
    if lost:
        raise ReadError(shown, "key 'definitions'", f"a definition of {printable(lost[0])}", "none")


def _is_histogram(entry: dict[str, Any]) -> bool:
    """Whether bins, labels and counts of an entry fit; 1e300 is an integer to the schema, but no count."""
    n, edges = len(entry["labels"]), [float(edge) for edge in entry["edges"]]
    rows = entry["counts"].values()
    counted = all(len(row) == n and all(isinstance(k, int) and k < 2**53 for k in row) for row in rows)
    ascending = len(edges) == n + 1 and edges == sorted(set(edges))
    return ascending and counted and (entry["mirrored"] is None or len(entry["mirrored"]) == n)


@cache
def _validator() -> Any:
    from jsonschema import Draft202012Validator  # noqa: PLC0415 - wanted where a saved audit is read

    text = files("meshwright.reports").joinpath("schema", "audit-1.schema.json").read_text("utf-8")
    return Draft202012Validator(json.loads(text))


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no JSON")
