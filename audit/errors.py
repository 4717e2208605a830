"""The error tree. Every error a user can meet is one of these and reads as one line.

MeshwrightError
    ReadError        a file could not be read as a mesh: where, what was expected, what was found
        UnsupportedError   the file is a mesh, but of a kind no reader here understands
    MeshError        arrays handed to `Mesh` contradict each other
    UsageError       the caller asked for something that does not exist
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["MeshError", "MeshwrightError", "ReadError", "UnsupportedError", "UsageError"]

_LONGEST_QUOTE = 80


class MeshwrightError(Exception):
    """Root of all deliberate errors."""


class UsageError(MeshwrightError):
    """The caller asked for a metric, format or option that does not exist."""


class MeshError(MeshwrightError):
    """The arrays of a mesh contradict each other (shape, index out of range, two blocks of one type)."""


class ReadError(MeshwrightError):
    """A file could not be read as a mesh.

    path: the file as the user named it.  place: "line 12", "byte 4096", "section (12 ...)", or "".
    expected, found: short phrases; `found` is cut and made printable, since it quotes hostile bytes.
    """

    def __init__(self, path: str | Path, place: str, expected: str, found: str) -> None:
        self.path = str(path)
        self.place = place
        self.expected = expected
        self.found = printable(found)
        super().__init__(str(self))

    def __str__(self) -> str:
        where = f"{self.path}: {self.place}" if self.place else self.path
        return f"{printable(where, 400)}: expected {self.expected}, found {self.found}"

    def __reduce__(self) -> tuple[type[ReadError], tuple[str, str, str, str]]:
        return type(self), (self.path, self.place, self.expected, self.found)


class UnsupportedError(ReadError):
    """No reader claims the file."""


def printable(text: str, longest: int = _LONGEST_QUOTE) -> str:
    """One printable line of at most `longest` characters; everything else escaped."""
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape", "replace").decode("ascii") for c in text)
    return shown if len(shown) <= longest else shown[: longest - 1] + "…"
