"""Every section of a Fluent file that carries mesh, read into its record."""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints
from meshwright.audit.readers.fluent.records import (
    CELLS,
    FACES,
    NODES,
    CellRange,
    FaceRange,
    FluentRecords,
    Integers,
    NodeRange,
    Range,
    Tree,
    ZoneName,
)
from meshwright.audit.readers.fluent.sections import Section, SectionScanner
from meshwright.audit.readers.source import Source

__all__ = ["read_records"]

# Element types of section 12: 0 mixed or unsaid, then tri, tet, quad, hex, pyramid, wedge, polyhedron.
_ELEMENT_TYPES = range(8)
# Face types of section 13 beside 0, mixed: the number of nodes, but for 5.
_LINEAR, _TRIANGLE, _QUADRILATERAL, _POLYGON = 2, 3, 4, 5
_MANY = 2**31


def read_records(source: Source) -> FluentRecords:
    """Every section of the file. Raises ReadError."""
    scanner = SectionScanner(source)
    records = FluentRecords()
    while (section := scanner.next_section()) is not None:
        read = _READERS.get(section.number)
        if read is None:
            scanner.skip(section)
        else:
            read(source, scanner, section, records)
    return records


def _dimension(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    at = scanner.at
    words = scanner.rest(section).split()
    if words not in (["2"], ["3"]):
        raise source.error(at, "a dimension of 2 or 3")
    _set_dimension(source, at, int(words[0]), records)


def _set_dimension(source: Source, offset: int, dimension: int, records: FluentRecords) -> None:
    if records.dimension not in (0, dimension):
        raise source.error(offset, f"dimension {records.dimension}, as said before", str(dimension))
    records.dimension = dimension


def _machine(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    """The second number of the machine configuration is 1 where the most significant byte comes first."""
    numbers = scanner.words(section)
    scanner.byte_order = ">" if numbers[1:2] == ["1"] else "<"


def _range(
    source: Source, scanner: SectionScanner, section: Section, what: str, records: FluentRecords
) -> tuple[Range, tuple[int, ...]] | None:
    """The range of a section 10, 12 or 13 and the rest of its header; None for a declaration, which is noted."""
    at = scanner.at
    zone, first, last, *rest = scanner.header(section, 3, 6)
    if zone == 0:
        if first > 1:
            raise source.error(at, f"a declaration of {what} that counts from 1", f"from {first}")
        if records.declared.setdefault(what, (last, at))[0] != last:
            raise source.error(at, f"{records.declared[what][0]} {what}, as declared before", str(last))
        if scanner.has_body():
            raise source.error(scanner.at, f"a zone of {what}: zone 0 only declares how many there are")
        scanner.close(section)
        return None
    _check_range(source, at, what, first, last)
    return Range(zone, first, last, section.start), tuple(rest)


def _check_range(source: Source, at: int, what: str, first: int, last: int) -> None:
    if not 1 <= first <= last:
        raise source.error(at, f"a range of {what} that ends where it begins or later", f"{first} to {last}")
    if last >= _MANY:
        raise source.error(at, f"a range of {what} with numbers below {_MANY}", f"{first} to {last}")


def _nodes(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    at = scanner.at
    ranged = _range(source, scanner, section, NODES, records)
    if ranged is None:
        return
    where, rest = ranged
    if len(rest) > 1:
        _set_dimension(source, at, rest[1], records)
    if records.dimension not in (2, 3):
        raise source.error(at, "a dimension of 2 or 3, in a section (2 ...) or here", str(records.dimension))
    values = scanner.reals(section, len(where) * records.dimension, "coordinates")
    points = values.reshape(-1, records.dimension)
    records.nodes.append(NodeRange(where.zone, where.first, where.last, where.start, points))


def _cells(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    at = scanner.at
    ranged = _range(source, scanner, section, CELLS, records)
    if ranged is None:
        return
    where, rest = ranged
    kind, element = (*rest, *(1, 0)[len(rest) :])[:2]
    if element not in _ELEMENT_TYPES:
        raise source.error(at, "an element type of 0 to 7", str(element))
    types: Ints | int = element
    if scanner.has_body():
        if element:
            raise source.error(scanner.at, f"the end of {section}, since all its cells are of type {element}")
        integers = scanner.integers(section, len(where), "element types")
        types = integers.values
        wrong = (types < 1) | (types >= _ELEMENT_TYPES.stop)
        if wrong.any():
            raise integers.error(source, int(np.argmax(wrong)), "an element type of 1 to 7")
    else:
        scanner.close(section)
    records.cells.append(CellRange(where.zone, where.first, where.last, where.start, kind, types))


def _faces(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    at = scanner.at
    ranged = _range(source, scanner, section, FACES, records)
    if ranged is None:
        return
    where, rest = ranged
    if records.dimension not in (2, 3):
        raise source.error(at, "the dimension, section (2 ...), before the faces")
    kind, size = (*rest, *(0, 0)[len(rest) :])[:2]
    flat = records.dimension == 2
    if size not in ((0, _LINEAR, _POLYGON) if flat else (0, _TRIANGLE, _QUADRILATERAL, _POLYGON)):
        raise source.error(at, f"a face type of a {records.dimension}-D mesh", str(size))
    n = len(where)
    offsets = None
    if size in (0, _POLYGON):
        size = 0
        least = 2 if flat else 3
        source.checked_count(n, (3 + least) * (4 if section.width else 2), scanner.at, FACES)
        integers = scanner.all_integers(section, "faces")
        offsets = np.zeros(n + 1, np.int64)
        bad = _split_lists(integers.values, offsets, least, 2 if flat else _MANY, 2)
        if bad >= 0:
            raise integers.error(source, int(bad), f"{n} faces, each its number of nodes, its nodes and two cells")
    else:
        integers = scanner.integers(section, n * (size + 2), "faces")
    records.faces.append(FaceRange(where.zone, where.first, where.last, where.start, kind, size, integers, offsets))


def _tree(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    at = scanner.at
    first, last, zone, _ = scanner.header(section, 4, 4)
    _check_range(source, at, "parents", first, last)
    source.checked_count(last - first + 1, 4, scanner.at, "parents")
    integers = scanner.all_integers(section, "children")
    offsets = np.zeros(last - first + 2, np.int64)
    bad = _split_lists(integers.values, offsets, 0, _MANY, 0)
    if bad >= 0:
        raise integers.error(source, int(bad), f"{last - first + 1} lists of children, each its length and numbers")
    trees = records.cell_trees if section.number == _CELL_TREE else records.face_trees
    trees.append(Tree(zone, first, last, section.start, offsets, integers))


def _overlap(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    """Section 61: the faces first to last were cut out of the two faces listed for each, of which one may be 0."""
    at = scanner.at
    first, last = scanner.header(section, 2, 2)
    _check_range(source, at, "faces", first, last)
    scanner.integers(section, 2 * (last - first + 1), "parents")
    records.overlaps.append(Range(0, first, last, section.start))


def _overlap_list(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    """Section 62: pairs of a face cut out of another, and that other."""
    count = scanner.header_words(section, 3)[2]
    pairs = scanner.all_integers(section, "faces and their parents")
    n, odd = divmod(len(pairs.values), 2)
    if odd or count.lower() not in (f"{n}", f"{n:x}"):
        raise source.error(section.start, f"{count} pairs of a face and its parent", f"{len(pairs.values)} numbers")
    records.overlaps.append(Integers(pairs.values[0::2], pairs.start, pairs.binary))


def _periodic(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    at = scanner.at
    first, last, *_ = scanner.header(section, 2, 4)
    _check_range(source, at, "pairs", first, last)
    records.periodic.append(scanner.integers(section, 2 * (last - first + 1), "pairs of faces"))


def _edges(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    zone, first, last, *_ = scanner.header(section, 3, 6)
    scanner.skip(section)
    if zone:
        records.n_edges += max(last - first + 1, 0)


def _zone(source: Source, scanner: SectionScanner, section: Section, records: FluentRecords) -> None:
    at = scanner.at
    words = scanner.words(section)
    if len(words) < 2 or not (words[0].isascii() and words[0].isdigit() and len(words[0]) < 10):
        raise source.error(at, "the number, type and name of a zone")
    number, role, name, domain, *_ = *words, "", ""
    new = ZoneName(role, name, domain, section.start)
    old = records.names.setdefault(int(number), new)
    # A multiphase case lists a zone once for each phase ("domain"); the first stands for all.
    if old.domain == new.domain and (old.role, old.name) != (role, name):
        raise source.error(at, f"zone {number} to be “{old.name}” of type {old.role}, as before")


_CELL_TREE = 58
_READERS = {
    2: _dimension,
    4: _machine,
    10: _nodes,
    11: _edges,
    12: _cells,
    13: _faces,
    18: _periodic,
    39: _zone,
    45: _zone,
    _CELL_TREE: _tree,
    59: _tree,
    61: _overlap,
    62: _overlap_list,
}


@kernel
def _split_lists(values: Ints, offsets: Ints, least: int, most: int, extra: int) -> int:
    """Split lists, each written as its length, its items and `extra` more integers.

    offsets (lists + 1,): filled with those of the items alone, from its 0 on. Returns -1, or the index in `values` of
    the first length that is not within `least` to `most` or runs out of the values. Values left over are reported
    at the first of them.
    """
    at = 0
    for i in range(len(offsets) - 1):
        if at >= len(values):
            return at
        length = values[at]
        if length < least or length > most or length > len(values) - at - 1 - extra:
            return at
        offsets[i + 1] = offsets[i] + length
        at += 1 + length + extra
    return -1 if at == len(values) else at
