"""Reading: one function for every format. The content of a file decides what it is, not its suffix."""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from meshwright.audit.errors import MeshError, ReadError, UnsupportedError, UsageError, printable
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers.registry import FORMATS, REFUSED_FORMATS, Format, Probe
from meshwright.audit.readers.source import DEFAULT_LIMIT, Source, open_source

__all__ = ["FORMATS", "Format", "guess_format", "read"]

Progress = Callable[[str], None]
_CHUNK = 1 << 20
_BY_NAME = {row.name: row for row in FORMATS}


def read(path: str | os.PathLike[str], *, format: str | None = None, progress: Progress | None = None) -> Mesh:  # noqa: A002
    """The mesh in a file, in an OpenFOAM case folder, or on standard input ("-").

    format: a name of `FORMATS`, to pass over the recognition.  progress: called with a line of text before
    each step. Raises ReadError for a file that cannot be read as a mesh, UnsupportedError where no reader
    knows it, UsageError for an unknown format name.
    """
    name = os.fsdecode(path)
    if format is not None and format not in _BY_NAME:
        raise UsageError(f"unknown format {printable(format)!r}; known are {', '.join(_BY_NAME)}")
    if name != "-" and _is_case(name):
        row, argument = _BY_NAME["openfoam"], None
        if format not in (None, "openfoam"):
            raise ReadError(name, "", f"a file in the format {format}", "an OpenFOAM case")
    else:
        argument = _standard_input() if name == "-" else open_source(path)
        row = _BY_NAME[format] if format else _recognised(Probe.of(argument))
    if progress is not None:
        progress(f"reading {printable(name, 200)} as {row.title}")
    try:
        mesh = _reader(row, name, argument)()
    except MeshError as error:
        raise ReadError(name, "", f"a {row.title} mesh that does not contradict itself", str(error)) from error
    return _checked(name, row, mesh)


def guess_format(path: str | os.PathLike[str]) -> Format:
    """The format of a file or case folder, by its content. Raises ReadError or UnsupportedError."""
    name = os.fsdecode(path)
    return _BY_NAME["openfoam"] if _is_case(name) else _recognised(Probe.of(open_source(path)))


def _is_case(name: str) -> bool:
    return name.lower().endswith(".foam") or ("\0" not in name and Path(name).is_dir())


def _reader(row: Format, name: str, source: Source | None) -> Callable[[], Mesh]:
    module, function = row.reader.split(":")
    reader = getattr(importlib.import_module(module), function)
    if row.name == "openfoam":
        return lambda: reader(name)
    if row.route == "meshio":
        return lambda: reader(source, row.meshio)
    return lambda: reader(source)


def _recognised(probe: Probe) -> Format:
    for row in FORMATS:
        if row.sniff(probe):
            return row
    for refused in REFUSED_FORMATS:
        if refused.sniff(probe):
            expected = f"a format that can be read ({refused.advice})"
            raise UnsupportedError(probe.source.path, "", expected, refused.title)
    start = probe.head[:32]
    shown = (
        f"text that begins with {start!r}" if start.isascii() and b"\0" not in start else f"bytes {start[:16].hex(' ')}"
    )
    claim = [row.title for row in FORMATS if probe.name.endswith(row.suffixes)]
    expected = "a mesh in a known format" + (f" ({' or '.join(claim)} by its name)" if claim else "")
    raise UnsupportedError(probe.source.path, "", expected, shown if start else "white space only")


def _standard_input() -> Source:
    """All of standard input, through a file, so that packed data are met as in any other file."""
    with tempfile.TemporaryDirectory(prefix="meshwright-") as folder:
        path = Path(folder) / "standard-input"
        with path.open("wb") as file:
            left = DEFAULT_LIMIT
            while data := sys.stdin.buffer.read(_CHUNK):
                left -= len(data)
                if left < 0:
                    raise ReadError("-", "", f"at most {DEFAULT_LIMIT} bytes", "more")
                file.write(data)
        try:
            return replace(open_source(path), path="-")
        except ReadError as error:
            raise ReadError("-", error.place, error.expected, error.found) from error


def _checked(name: str, row: Format, mesh: Mesh) -> Mesh:
    if mesh.n_nonfinite:
        raise ReadError(name, "", "finite coordinates", f"{mesh.n_nonfinite} points with nan or inf")
    title = row.title if row.route == "meshio" else mesh.format or row.title
    return mesh if (mesh.path, mesh.format) == (name, title) else replace(mesh, path=name, format=title)
