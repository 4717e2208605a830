"""What a file is checked for around meshio: damage and features that it would pass over in silence.

`check_source` looks before meshio does, `stated_counts` tells how many points and elements the file itself
claims, to be compared with what came back.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable

from meshwright.audit.errors import ReadError, UnsupportedError
from meshwright.audit.readers.source import Source

__all__ = ["check_source", "stated_counts"]

_TEXT = (
    *("abaqus", "avsucd", "flac3d", "nastran", "permas", "tecplot", "obj", "stl", "ply", "su2", "medit", "netgen"),
    *("mdpa", "off", "dolfin-xml", "tetgen"),
)
# Python's float() takes 1_000.5 and digits of any script, so meshio does; no mesh format does.
_UNDERSCORED = rb"(?<![^\s,])[-+]?[0-9]+(?:_[0-9]+)+(?:\.[0-9]*)?(?![^\s,])"
# Free field, short field (8 columns each) and long field (16): the third is the coordinate system.
_LOCAL_GRID = rb"(?m)^GRID(?: *,[^,\n]*, *[1-9]| {4}[^\n,]{8} {0,7}[1-9]|\* {3}[^\n,]{16} {0,15}[1-9])"
_NASTRAN_ELEMENTS = frozenset(
    (
        *("CTRIA3", "CTRIA6", "CTRIAR", "CTRAX6", "CTRIAX6", "CQUAD4", "CQUAD8", "CQUADR", "CQUAD9", "CSHEAR"),
        *("CTETRA", "CPYRA", "CPYRAM", "CPENTA", "CHEXA", "CBEAM", "CBUSH", "CBUSH1D", "CROD", "CGAP", "CBAR"),
        *("CTUBE", "CELAS1", "CELAS2"),
    )
)
_MEDIT_END = 54
_SU2_ONCE = (b"NDIME", b"NPOIN", b"NELEM")
_SU2_COUNTS = (b"NPOIN", b"NELEM", b"MARKER_ELEMS")
_NUMBER = rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_SU2_POINT = {
    dimension: re.compile(rb"%s(?:\s+%s){%d}(?:\s+[0-9]+){0,2}" % (_NUMBER, _NUMBER, max(0, dimension - 1)))
    for dimension in (0, 2, 3)
}

Counts = tuple[int | None, int | None]


def check_source(source: Source, name: str) -> tuple[str, ...]:
    """Notes for the ledger. Raises ReadError or UnsupportedError where meshio would return a wrong mesh."""
    if name in _TEXT and not (source.data == 0).any():
        _check_spelling(source)
    check = _CHECKS.get(name)
    return check(source) if check else ()


def stated_counts(source: Source, name: str) -> Counts:
    """(points, elements) that the file says it has; None where the format or the reader does not tell."""
    tell = _COUNTS.get(name)
    return tell(source) if tell else (None, None)


def _match(source: Source, pattern: bytes) -> re.Match[bytes] | None:
    return re.search(pattern, source.data.data)


def _numbers(source: Source, pattern: bytes) -> list[int]:
    """The integers that a pattern finds, at most 18 digits each."""
    return [int(digits) for digits in re.findall(pattern, source.data.data)]


def _check_spelling(source: Source) -> None:
    bad = _match(source, _UNDERSCORED)
    if bad:
        raise source.error(bad.start(), "a number", bad[0].decode())
    for match in re.finditer(rb"(?:[^\x00-\x7f])+", source.data.data):
        if any(c.isdecimal() for c in match[0].decode("utf-8", "ignore")):
            raise source.error(match.start(), "numbers in ASCII digits")


def _nastran(source: Source) -> tuple[str, ...]:
    include = _match(source, rb"(?mi)^\s*INCLUDE\b")
    if include:
        place = f"line {source.line(include.start())}"
        raise UnsupportedError(source.path, place, "one Nastran file without INCLUDE", source.quote(include.start()))
    system = _match(source, rb"(?m)^CORD[12][RCS]\b")
    if system and _match(source, _LOCAL_GRID):
        place = f"line {source.line(system.start())}"
        expected = "grid points in the basic coordinate system"
        raise UnsupportedError(source.path, place, expected, "local coordinate systems")
    cards = Counter(card.decode() for card in re.findall(rb"(?m)^(C[A-Z0-9]{2,7})(?=[*, ])", source.data.data))
    unread = [f"{card} ({n})" for card, n in cards.items() if card not in _NASTRAN_ELEMENTS and card[:4] != "CORD"]
    return (f"cards that are not read: {', '.join(sorted(unread)[:20])}",) if unread else ()


def _once(pattern: bytes, what: str) -> Callable[[Source], tuple[str, ...]]:
    def check(source: Source) -> tuple[str, ...]:
        found = [match.start() for match in re.finditer(pattern, source.data.data)]
        if len(found) > 1:
            raise source.error(found[1], f"one {what}", "a second one")
        return ()

    return check


def _medit(source: Source) -> tuple[str, ...]:
    order = {b"\x01\0\0\0": "little", b"\0\0\0\x01": "big"}.get(source.data[:4].tobytes())
    if order is None:
        return _once(rb"(?m)^\s*MeshVersionFormatted\b", "MeshVersionFormatted")(source)
    # A chain of sections, each with the place of the next; the last one is called End.
    version = int.from_bytes(source.data[4:8].tobytes(), order)  # type: ignore[arg-type]
    width = 4 if version < 3 else 8
    at = 8
    while True:
        keyword = int.from_bytes(source.data[at : at + 4].tobytes(), order)  # type: ignore[arg-type]
        if keyword == _MEDIT_END and at + 4 <= len(source):
            return ()
        following = int.from_bytes(source.data[at + 4 : at + 4 + width].tobytes(), order)  # type: ignore[arg-type]
        if not at < following <= len(source) - 4:
            raise source.error(
                at, "a chain of sections up to the section End", f"a link to byte {following}", binary=True
            )
        at = following


def _stl(source: Source) -> tuple[str, ...]:
    size = len(source)
    if size >= 84 and size == 84 + 50 * int.from_bytes(source.data[80:84].tobytes(), "little"):
        return ()
    if _match(source, rb"\A\s*solid\b") is None:
        count = int.from_bytes(source.data[80:84].tobytes(), "little")
        raise source.error(80, f"{count} facets of 50 bytes", f"{size - 84} bytes", binary=True)
    opened, closed = (len(re.findall(rb"(?mi)^\s*" + word, source.data.data)) for word in (rb"facet\s", rb"endfacet\b"))
    if opened != closed or _match(source, rb"(?i)endsolid[^\r\n]*\s*\Z") is None:
        raise source.error(size, f"endsolid after {opened} complete facets", f"{closed} complete ones")
    return ()


def _su2(source: Source) -> tuple[str, ...]:
    """After a count there are as many lines of numbers, then another keyword."""
    left, key, key_at, at, dimension, columns = 0, b"", 0, 0, 0, 0
    once = set()
    for line in source.data.tobytes().splitlines(keepends=True):
        text = line.split(b"%", 1)[0].strip()
        if b"=" in text:
            if left:
                raise source.error(at, f"{left} more lines for line {source.line(key_at)}", text.decode("latin-1"))
            key, key_at = text.partition(b"=")[0].strip(), at
            if key in _SU2_ONCE and key in once:
                place = f"line {source.line(at)}"
                raise UnsupportedError(source.path, place, f"one zone, so one {key.decode()}", "a second one")
            once.add(key)
            if key in _SU2_COUNTS:
                word = re.match(rb"\s*([0-9]{1,18})(?!\S)", text.partition(b"=")[2])
                if not word:
                    raise source.error(at, "a number of lines", text.decode("latin-1"))
                left, columns = int(word[1]), 0
            elif key == b"NDIME":
                dimension = int(text[-1:]) if re.search(rb"=\s*[23]\Z", text) else 0
        elif text and left:
            left -= 1
            words = text.split()
            columns = columns or len(words)
            if key == b"NPOIN" and not (len(words) == columns and _SU2_POINT[dimension].fullmatch(text)):
                raise source.error(
                    at, f"{dimension} coordinates, and the point's number or none", text.decode("latin-1")
                )
        elif text and key in _SU2_COUNTS:
            raise source.error(at, "a keyword with =", text.decode("latin-1"))
        at += len(line)
    if left:
        raise source.error(at, f"{left} more lines for line {source.line(key_at)}", "end of file")
    return ()


_CHECKS: dict[str, Callable[[Source], tuple[str, ...]]] = {
    "nastran": _nastran,
    "medit": _medit,
    "mdpa": _once(rb"(?m)^\s*Begin\s+Nodes\b", "block of nodes"),
    "stl": _stl,
    "su2": _su2,
}


def _vtk(source: Source) -> Counts:
    points = _numbers(source, rb"(?m)^POINTS +([0-9]{1,18})\b")
    cells = _numbers(source, rb"(?m)^CELLS +([0-9]{1,18})\b")
    types = _numbers(source, rb"(?m)^CELL_TYPES +([0-9]{1,18})\b")
    return points[0] if points else None, types[0] if types and cells else None


def _vtu(source: Source) -> Counts:
    points = _numbers(source, rb'<Piece\b[^>]*\bNumberOfPoints="([0-9]{1,18})"')
    cells = _numbers(source, rb'<Piece\b[^>]*\bNumberOfCells="([0-9]{1,18})"')
    return sum(points), sum(cells)


def _avs(source: Source) -> Counts:
    head = _match(source, rb"\A(?:#[^\n]*\n)*\s*" + rb"([0-9]{1,18})\s+" * 4 + rb"([0-9]{1,18})\s")
    if head is None:
        return None, None
    points, cells, *data = (int(group) for group in head.groups())
    n_lines = len(re.findall(rb"(?m)^(?!#)[^\n]*\S", source.data.data))
    if not any(data) and n_lines != 1 + points + cells:
        raise ReadError(source.path, "", f"{points} lines of points and {cells} of cells", f"{n_lines - 1} lines")
    return points, cells


def _ply(source: Source) -> Counts:
    head = source.data[: max(0, source.find(b"end_header"))].tobytes()
    counts = {name: int(n) for name, n in re.findall(rb"(?m)^element +(\w+) +([0-9]{1,18})\b", head)}
    text = source.data.tobytes()
    if b"format ascii" in head:
        lines = [line for line in text[len(head) :].splitlines()[1:] if line.strip()]
        if len(lines) != sum(counts.values()):
            found = f"{len(lines)} lines"
            raise ReadError(source.path, "", f"{sum(counts.values())} elements after the header", found)
    return counts.get(b"vertex"), counts.get(b"face")


def _off(source: Source) -> Counts:
    lines = [text for line in source.data.tobytes().splitlines() if (text := line.split(b"#", 1)[0].strip())]
    words = b" ".join(lines[:3]).split()[1:3]
    if len(words) != 2 or not all(re.fullmatch(rb"[0-9]{1,9}", word) for word in words):
        return None, None
    points, faces = int(words[0]), int(words[1])
    rows = lines[-faces:] if faces else []
    header = len(lines) - points - faces
    if header not in (1, 2):
        raise ReadError(source.path, "", f"{points} points and {faces} faces", f"{len(lines)} lines")
    for row in rows:
        size = re.match(rb"[0-9]{1,9}(?=\s)", row)
        if not size or not re.match(rb"[0-9]+(?:\s+[0-9]+){%d}(?!\S)" % int(size[0]), row):
            raise ReadError(source.path, "faces", "whole numbers of points", row.decode("latin-1"))
    return points, faces


def _dolfin(source: Source) -> Counts:
    points = _numbers(source, rb'<vertices\b[^>]*\bsize="([0-9]{1,18})"')
    cells = _numbers(source, rb'<cells\b[^>]*\bsize="([0-9]{1,18})"')
    vertices = len(re.findall(rb"<vertex\b", source.data.data))
    if points and points[0] != vertices:
        raise ReadError(source.path, "", f"{points[0]} vertices", str(vertices))
    return points[0] if points else None, cells[0] if cells else None


_COUNTS: dict[str, Callable[[Source], Counts]] = {
    "vtk": _vtk,
    "vtu": _vtu,
    "avsucd": _avs,
    "ply": _ply,
    "off": _off,
    "dolfin-xml": _dolfin,
}
