"""The frame of a Gmsh file: its $Sections, its format line, the names of its physical groups, two cursors."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.errors import ReadError, UnsupportedError
from meshwright.audit.readers.scan import read_floats, read_ints
from meshwright.audit.readers.source import Source

__all__ = ["BinaryCursor", "Cursor", "FileKind", "Section", "TextCursor", "file_kind", "physical_names", "sections"]

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Names = dict[tuple[int | None, int], str]

_SPACE = b" \t\r\n\f\v"
_SECTION = re.compile(rb"\$([A-Za-z][A-Za-z0-9]{0,63})(?=[ \t\r\n\f\v]|$)")
_NAME = re.compile(r'\s*(?:(\d{1,9})\s+)?(-?\d{1,9})\s+"(.*)"\s*')
_VERSIONS = {"1": 1.0, "2": 2.0, "2.0": 2.0, "2.1": 2.1, "2.2": 2.2, "4": 4.0, "4.0": 4.0, "4.1": 4.1}
_BIGGEST = 2**62


@dataclass(frozen=True)
class Section:
    """`$name`: body from `start` (first byte of the line after the name) to `stop` (the `$` of its end mark)."""

    name: str
    at: int
    start: int
    stop: int


@dataclass(frozen=True)
class FileKind:
    """What $MeshFormat says.  size: bytes of a size_t.  order: "<" or ">", byte order of a binary file."""

    version: float
    binary: bool
    size: int
    order: str


def _after_space(source: Source, at: int) -> int:
    while at < len(source):
        chunk = source.data[at : at + 4096].tobytes()
        kept = len(chunk.lstrip(_SPACE))
        if kept:
            return at + len(chunk) - kept
        at += len(chunk)
    return at


def _end_of(source: Source, name: str, start: int) -> int:
    for mark in (f"$End{name}".encode(), f"$END{name}".encode()):
        at = source.find(mark, start)
        while at >= 0:
            behind = source.data[at + len(mark) : at + len(mark) + 1].tobytes()
            if behind in _SPACE:
                return at
            at = source.find(mark, at + 1)
    raise source.error(len(source), f"$End{name} that closes the section ${name}")


def sections(source: Source) -> list[Section]:
    """All sections in file order; ReadError for text between them or an end mark that is missing."""
    found = []
    at = _after_space(source, 0)
    while at < len(source):
        head = _SECTION.match(source.data[at : at + 80].tobytes())
        if head is None or head[1].startswith((b"End", b"END")):
            raise source.error(at, "the start of a section ($Name)")
        name = head[1].decode("ascii")
        line_end = at + head.end()
        tail = source.data[line_end : line_end + 256].tobytes()
        # The data of a binary section begin right after the newline, so white space must not be skipped at will.
        blanks = len(tail) - len(tail.lstrip(b" \t"))
        newline = tail[blanks : blanks + 2]
        start = line_end + blanks + (2 if newline == b"\r\n" else len(newline[:1].strip(b"$")))
        stop = _end_of(source, name, start)
        found.append(Section(name, at, start, stop))
        at = _after_space(source, stop + len(name) + 4)
    return found


def file_kind(source: Source, section: Section) -> FileKind:
    """Reads the body of $MeshFormat."""
    body = source.text(section.start, min(section.stop, section.start + 256))
    line = re.split(r"[\r\n]", body.lstrip(), maxsplit=1)[0]
    words = line.split()
    if len(words) != 3:
        raise source.error(section.start, "version, file type and data size, such as 4.1 0 8", line)
    version = _VERSIONS.get(words[0])
    if version is None:
        place = f"line {source.line(section.start)}"
        raise UnsupportedError(source.path, place, "MSH version 1, 2, 2.1, 2.2, 4 or 4.1", f"version {words[0]}")
    if words[1] not in ("0", "1"):
        raise source.error(section.start, "file type 0 (text) or 1 (binary)", words[1])
    if words[2] not in ("4", "8"):
        raise source.error(section.start, "data size 4 or 8", words[2])
    binary = words[1] == "1"
    if binary and version < 4 and words[2] != "8":
        raise source.error(section.start, "data size 8 in a binary file of version 2", words[2])
    return FileKind(version, binary, int(words[2]), _byte_order(source, section) if binary else "<")


def _byte_order(source: Source, section: Section) -> str:
    at = source.find(b"\n", section.start) + 1
    one = source.data[at : at + 4].tobytes()
    if one == b"\x01\0\0\0":
        return "<"
    if one == b"\0\0\0\x01":
        return ">"
    raise source.error(at, "the integer 1, which tells the byte order", one.hex(" ") or "nothing", binary=True)


def physical_names(source: Source, section: Section) -> Names:
    """(dimension, number) -> name; the dimension is None in the oldest files, which do not tell it."""
    data = source.data[section.start : section.stop].tobytes()
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    lines = [line for line in re.split(r"\r\n|\r|\n", text) if line.strip()]
    if not lines or not re.fullmatch(r"\s*\d{1,9}\s*", lines[0]):
        raise source.error(section.start, "the number of physical names")
    if int(lines[0]) != len(lines) - 1:
        raise source.error(section.start, f"{lines[0].strip()} physical names", str(len(lines) - 1))
    names: Names = {}
    for line in lines[1:]:
        match = _NAME.fullmatch(line)
        if match is None:
            raise source.error(section.start, 'dimension, number and "name" of a physical group', line)
        key = (int(match[1]) if match[1] else None, int(match[2]))
        if key in names:
            raise source.error(section.start, "each physical group once", line)
        names[key] = match[3]
    return names


class Cursor(Protocol):
    """Reads the numbers of one section in order; `sizes` are the format's size_t. All arrays are 64 bit."""

    at: int

    def ints(self, count: int, what: str) -> Ints:
        """The next `count` integers."""
        ...

    def sizes(self, count: int, what: str) -> Ints:
        """The next `count` counts or numbers of nodes and elements."""
        ...

    def doubles(self, count: int, what: str, *, finite: bool = True) -> Floats:
        """The next `count` numbers."""
        ...

    def finish(self) -> None:
        """ReadError unless nothing but white space is left in the section."""
        ...

    def error(self, expected: str, found: str | None = None) -> ReadError:
        """A ReadError at the present place."""
        ...


def _require_end(cursor: Cursor, section: Section) -> None:
    if cursor.at < section.stop:
        raise cursor.error(f"$End{section.name}")


class TextCursor:
    """`Cursor` over a section of a text file."""

    def __init__(self, source: Source, section: Section) -> None:
        self.source, self.section, self.at = source, section, section.start

    def ints(self, count: int, what: str) -> Ints:
        """The next `count` integers."""
        values, self.at = read_ints(self.source, self.at, self.section.stop, count, what)
        return values

    def sizes(self, count: int, what: str) -> Ints:
        """As `ints`: in text both look alike."""
        return self.ints(count, what)

    def doubles(self, count: int, what: str, *, finite: bool = True) -> Floats:
        """The next `count` numbers."""
        values, self.at = read_floats(self.source, self.at, self.section.stop, count, what, finite=finite)
        return values

    def finish(self) -> None:
        """ReadError unless nothing but white space is left."""
        self.at = _after_space(self.source, self.at)
        _require_end(self, self.section)

    def error(self, expected: str, found: str | None = None) -> ReadError:
        """A ReadError at the present place."""
        return self.source.error(self.at, expected, found)


class BinaryCursor:
    """`Cursor` over a section of a binary file."""

    def __init__(self, source: Source, section: Section, kind: FileKind) -> None:
        self.source, self.section, self.at = source, section, section.start
        self._int = np.dtype(f"{kind.order}i4")
        self._size = np.dtype(f"{kind.order}u{kind.size}")
        self._double = np.dtype(f"{kind.order}f8")

    def take(self, dtype: np.dtype, count: int, what: str) -> NDArray:
        """The next `count` items of that type, as they stand in the file."""
        left = self.section.stop - self.at
        if count < 0 or count * dtype.itemsize > left:
            raise self.error(f"{count} {what} of {dtype.itemsize} bytes", f"{left} bytes up to $End{self.section.name}")
        stop = self.at + count * dtype.itemsize
        values = self.source.data[self.at : stop].view(dtype)
        self.at = stop
        return values

    def ints(self, count: int, what: str) -> Ints:
        """The next `count` integers of 4 bytes."""
        return self.take(self._int, count, what).astype(np.int64)

    def sizes(self, count: int, what: str) -> Ints:
        """The next `count` integers of the file's data size."""
        values = self.take(self._size, count, what)
        if count and int(values.max()) > _BIGGEST:
            raise self.error(what, str(int(values.max())))
        return values.astype(np.int64)

    def doubles(self, count: int, what: str, *, finite: bool = True) -> Floats:
        """The next `count` numbers of 8 bytes."""
        start = self.at
        values = self.take(self._double, count, what).astype(np.float64)
        if finite and not np.isfinite(values).all():
            bad = int(np.flatnonzero(~np.isfinite(values))[0])
            raise self.source.error(start + 8 * bad, f"a finite number ({what})", str(values[bad]), binary=True)
        return values

    def finish(self) -> None:
        """ReadError unless nothing but white space is left."""
        self.at = _after_space(self.source, self.at)
        _require_end(self, self.section)

    def error(self, expected: str, found: str | None = None) -> ReadError:
        """A ReadError at the present place."""
        return self.source.error(self.at, expected, found, binary=True)
