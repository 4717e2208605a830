"""The journal of a repair: the receipt, every change entity by entity, and the input itself, in one ZIP file.

    receipt.json          what was done, measured before and after, with the SHA-256 of input and output
    steps/03-improve.npz  points moved (row, from, to), removed, added; cells removed and added with their nodes
    input                 the bytes of the input file

`undo` gives the input back, byte for byte, after both hashes have been checked.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from meshwright.audit.errors import ReadError, UsageError, printable
from meshwright.audit.files import replacing
from meshwright.audit.mesh import Mesh
from meshwright.repair.carrying import padded
from meshwright.repair.run import Repair, Step

__all__ = ["RECEIPT", "changes", "receipt", "save_journal", "undo"]

RECEIPT = "meshwright.repair/1"
_CHUNK = 1 << 20
_LONGEST_RECEIPT = 64 << 20


def receipt(done: Repair, source: str, target: str | None) -> dict[str, Any]:
    """What was done, as data. source, target: paths of the input and the output file, the latter None where none was
    written."""
    from importlib.metadata import version  # noqa: PLC0415

    return {
        "schema": RECEIPT,
        "version": version("meshwright"),
        "input": _file(source),
        "output": None if target is None else _file(target),
        "before": _mesh(done.before, done.first.worst, done.first.bad),
        "after": _mesh(done.after, done.last.worst, done.last.bad),
        "changed": done.changed,
        "moved_points": done.moved_points,
        "max_deviation": done.max_deviation,
        "steps": [_step(step) for step in done.steps],
        "refused": list(done.refused),
        "limits": list(done.limits),
        "notes": list(done.notes),
        "boundary": None if done.along is None else asdict(done.along),
        "surface": None if done.apart is None else {"hausdorff": done.apart.hausdorff, **asdict(done.apart)},
        "target": None if done.aim is None else done.aim.as_json(),
    }


def _file(path: str) -> dict[str, Any]:
    file = Path(path)
    if not file.is_file():
        return {"path": path, "sha256": None}
    with file.open("rb") as stream:
        return {"path": path, "sha256": hashlib.file_digest(stream, "sha256").hexdigest()}


def _mesh(mesh: Mesh, worst: float, bad: int) -> dict[str, Any]:
    return {
        "points": len(mesh.points), "cells": mesh.counts, "worst_quality": worst, "inverted_or_degenerate": bad,
        "zones": [{"name": z.name, "entity": z.entity, "count": len(z.members)} for z in mesh.zones],
    }  # fmt: skip


def _step(step: Step) -> dict[str, Any]:
    return {
        "pass": step.name, "state": step.state, "changed": step.changed, "note": step.note, "reason": step.reason,
        "worst_quality": [step.worst_before, step.worst_after],
        "inverted_or_degenerate": [step.bad_before, step.bad_after], "seconds": round(step.seconds, 3),
    }  # fmt: skip


def changes(step: Step) -> dict[str, Any]:
    """Every change of a kept step, as arrays.

    moved_rows (k,), moved_from, moved_to (k, 3): points that are elsewhere, by their row before; removed_points and
    added_points (k,): rows before and after, with their coordinates; removed_cells, added_cells (k,): rows before and
    after, with nodes (k, w), -1 where a cell has fewer: a cell whose nodes changed is removed and added.
    """
    old, new = step.before, step.after
    origin = np.arange(len(new.points)) if step.points_from is None else np.asarray(step.points_from)
    cells_from = np.arange(new.n_cells) if step.cells_from is None else np.asarray(step.cells_from)
    kept = np.flatnonzero(origin >= 0)
    moved = kept[(new.points[kept] != old.points[origin[kept]]).any(axis=1)]
    gone = np.ones(len(old.points), bool)
    gone[origin[kept]] = False
    fresh = np.flatnonzero(origin < 0)
    was, now = padded(old), padded(new)
    name = np.append(origin, -1)[now]
    width = max(was.shape[1], name.shape[1])
    was = np.pad(was, ((0, 0), (0, width - was.shape[1])), constant_values=-1)
    name = np.pad(name, ((0, 0), (0, width - name.shape[1])), constant_values=-1)
    same = (name == was[cells_from]).all(axis=1)
    stays = np.zeros(old.n_cells, bool)
    stays[cells_from[same]] = True
    return {
        "moved_rows": origin[moved], "moved_from": old.points[origin[moved]], "moved_to": new.points[moved],
        "removed_points": np.flatnonzero(gone), "removed_at": old.points[gone],
        "added_points": fresh, "added_at": new.points[fresh],
        "removed_cells": np.flatnonzero(~stays), "removed_nodes": was[~stays],
        "added_cells": np.flatnonzero(~same), "added_nodes": now[~same], "added_from": cells_from[~same],
    }  # fmt: skip


def save_journal(done: Repair, document: dict[str, Any], source: str, path: str) -> None:
    """Write the journal of a repair; `document` is its receipt, `source` the input file."""
    with replacing(path) as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=3) as archive:
        archive.writestr("receipt.json", json.dumps(document, indent=1, ensure_ascii=False, allow_nan=True))
        for i, step in enumerate(s for s in done.steps if s.state == "kept"):
            buffer = io.BytesIO()
            np.savez(buffer, **changes(step))
            archive.writestr(f"steps/{i:02d}-{step.name}.npz", buffer.getvalue())
        digest = hashlib.sha256()
        with Path(source).open("rb") as original, archive.open("input", "w", force_zip64=True) as out:
            while chunk := original.read(_CHUNK):
                digest.update(chunk)
                out.write(chunk)
        if digest.hexdigest() != document["input"]["sha256"]:
            raise UsageError(f"{printable(source, 200)} changed while it was repaired; nothing was written")


def undo(journal: str, repaired: str, target: str) -> str:
    """Give back the input of a repair as `target`; returns its SHA-256.

    Raises ReadError for a file that is no journal or is damaged, UsageError where `repaired` is not the output that the
    journal tells of: it may have been edited since, and undoing would lose that.
    """
    try:
        archive = zipfile.ZipFile(journal)
    except (zipfile.BadZipFile, OSError) as error:
        raise ReadError(journal, "", "a journal of meshwright repair", _words(error)) from None
    with archive:
        document = _receipt_in(archive, journal)
        wanted, made = (_hash_of(document, key, journal) for key in ("input", "output"))
        if _file(repaired)["sha256"] != made:
            raise UsageError(
                f"{printable(repaired, 200)} is not the file that this journal tells of; it was changed or replaced "
                "since. Nothing was written"
            )
        digest = hashlib.sha256()
        with replacing(target) as out:
            for chunk in _chunks(archive, journal):
                digest.update(chunk)
                out.write(chunk)
            if digest.hexdigest() != wanted:
                raise ReadError(journal, "input", f"bytes with SHA-256 {wanted}", digest.hexdigest())
    return wanted


_DAMAGE = (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError)
"""What zipfile raises for a member that is cut, altered, or packed in a way it does not know."""


def _words(error: Exception) -> str:
    return str(error)[:200] or type(error).__name__


def _receipt_in(archive: zipfile.ZipFile, journal: str) -> dict[str, Any]:
    names = archive.namelist()
    for name in ("receipt.json", "input"):
        if names.count(name) != 1:
            raise ReadError(journal, name, "one member of this name in the journal", str(names.count(name)))
    info = archive.getinfo("receipt.json")
    if info.file_size > _LONGEST_RECEIPT:
        raise ReadError(journal, "receipt.json", "a receipt of a sensible size", f"{info.file_size} bytes")
    try:
        document = json.loads(archive.read(info))
    except (*_DAMAGE, ValueError, RecursionError) as error:
        raise ReadError(journal, "receipt.json", "JSON", _words(error)) from None
    if not isinstance(document, dict) or document.get("schema") != RECEIPT:
        raise ReadError(journal, "receipt.json", f"a receipt of schema {RECEIPT}", "something else")
    return document


def _chunks(archive: zipfile.ZipFile, journal: str) -> Iterator[bytes]:
    """The bytes of the input, piece by piece."""
    try:
        with archive.open("input") as stored:
            while chunk := stored.read(_CHUNK):
                yield chunk
    except _DAMAGE as error:
        raise ReadError(journal, "input", "the whole input file", _words(error)) from None


def _hash_of(document: dict[str, Any], key: str, journal: str) -> str:
    part = document.get(key)
    if not isinstance(part, dict) or not isinstance(part.get("sha256"), str):
        raise ReadError(journal, "receipt.json", f"the SHA-256 of the {key}", "none")
    return str(part["sha256"])
