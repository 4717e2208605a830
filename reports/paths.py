"""What the PATH arguments mean: files, case folders, patterns we expand when the shell did not, and `-`."""

from __future__ import annotations

import glob
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from meshwright.audit.errors import ReadError, UsageError
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers import read
from meshwright.audit.readers.source import DEFAULT_LIMIT

__all__ = ["STDIN", "expand", "open_mesh", "refuse_overwriting"]

STDIN = "-"
_CHUNK = 1 << 20


def expand(paths: Iterable[str]) -> list[str]:
    """The meshes meant, patterns expanded in name order; a pattern that matches nothing stays, to be reported."""
    found: list[str] = []
    for path in paths:
        if path == STDIN or not glob.has_magic(path) or Path(path).exists():
            found.append(path)
        else:
            found += sorted(glob.glob(path, recursive=True)) or [path]  # noqa: PTH207 - absolute patterns too
    return found


def refuse_overwriting(inputs: Iterable[str], outputs: Iterable[str]) -> None:
    """UsageError where an output would replace an input, or two outputs each other."""
    places: set[Path] = {Path(path).resolve() for path in inputs if path != STDIN}
    for output in outputs:
        place = Path(output).resolve()
        if place in places and not (place.exists() and not place.is_file()):
            raise UsageError(f"cannot write {output}: it is also an input or another output")
        places.add(place)


@contextmanager
def open_mesh(path: str, file_format: str | None) -> Iterator[tuple[Mesh, Path]]:
    """Read a mesh, and say where its bytes are as long as the block runs; `-` is spooled to disk first."""
    if path != STDIN:
        yield read(path, format=file_format), Path(path)
        return
    with tempfile.TemporaryDirectory(prefix="meshwright-") as folder:
        spooled = Path(folder) / "stdin"
        with spooled.open("wb") as stream:
            left = DEFAULT_LIMIT
            while chunk := sys.stdin.buffer.read(_CHUNK):
                left -= len(chunk)
                if left < 0:
                    raise ReadError(STDIN, "", f"at most {DEFAULT_LIMIT} bytes", "more")
                stream.write(chunk)
        try:
            mesh = read(spooled, format=file_format)
        except ReadError as error:
            raise type(error)(STDIN, error.place, error.expected, error.found) from None
        yield replace(mesh, path=STDIN), spooled
