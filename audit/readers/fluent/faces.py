"""The faces of a Fluent file put in the order of their numbers, and which of them take part in the mesh.

The right-hand normal of a 3-D face points into its first cell c0, of which `Faces` makes the owner that the normal
leaves: nodes are stored reversed. In 2-D c0 lies left of the edge, as `Faces` has it. (So it is in every file seen,
whatever program wrote it; a face without c0 belongs to c1 and is stored the other way round.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.csr import take
from meshwright.audit.errors import ReadError
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, Faces, Ints
from meshwright.audit.readers.fluent.records import CELLS, FACES, FaceRange, FluentRecords, Integers, Range, Tree
from meshwright.audit.readers.source import Source

__all__ = ["Live", "faces_by_number", "live_part"]

_PARENT_CELLS, _PARENT_FACES = 32, 31
_INTERIOR = 2
_INT32_END = 2**31


@dataclass(frozen=True)
class Live:
    """What takes part in the mesh, by number - 1.

    cells (n,): False for parents of refined cells.  faces (f,): False for parents and for faces cut out of others.
    parents (f,): faces that were split.  parent (f,): number - 1 of the face that each was split from, or -1.
    """

    cells: NDArray[np.bool_]
    faces: NDArray[np.bool_]
    parents: NDArray[np.bool_]
    parent: Ints

    @property
    def n_cut(self) -> int:
        """How many faces are left out because they were cut out of others."""
        return int(np.count_nonzero(~self.faces & ~self.parents))

    def kept(self, sides: Faces) -> Faces:
        """The faces that take part, with rows of cells for numbers."""
        ids = np.arange(1, len(sides) + 1)
        if self.cells.all() and self.faces.all():
            return Faces(sides.offsets, sides.nodes, sides.owner, sides.neighbour, ids)
        kept = np.flatnonzero(self.faces)
        offsets, nodes = take(sides.offsets, sides.nodes, kept)
        owner, neighbour = self.rows_of_cells(sides.owner[kept]), self.rows_of_cells(sides.neighbour[kept])
        return Faces(offsets, nodes, owner, neighbour, ids[kept])

    def rows_of_cells(self, numbers: Ints) -> Ints:
        """Rows of these cells (number - 1), NO_CELL staying what it is."""
        return np.where(numbers == NO_CELL, NO_CELL, (np.cumsum(self.cells) - 1)[numbers])


def faces_by_number(source: Source, records: FluentRecords, n_points: int, n_cells: int) -> Faces:
    """All faces in the order of their numbers, owner and neighbour being numbers of cells - 1.

    Raises ReadError for a node or cell outside 1 to n_points or n_cells, for a face without two different sides, and
    for one of an interior zone that has a cell on one side only.
    """
    ranges = sorted(records.faces, key=lambda zone: zone.first)
    n_faces = ranges[-1].last
    n_nodes = sum(zone.n_nodes for zone in ranges)
    offsets: Ints = np.zeros(n_faces + 1, np.int32 if n_nodes < _INT32_END else np.int64)
    nodes = np.empty(n_nodes, np.int32)
    owner = np.empty(n_faces, np.int32)
    neighbour = np.empty(n_faces, np.int32)
    for zone in ranges:
        start, stop = zone.first - 1, zone.last
        own = np.arange(len(zone) + 1) * zone.size if zone.offsets is None else zone.offsets
        offsets[start : stop + 1] = own + offsets[start]
        lead = int(zone.offsets is not None)
        starts, cells = offsets[start : stop + 1], (owner[start:stop], neighbour[start:stop])
        bad = int(_store(zone.integers.values, lead, starts, nodes, *cells, n_points, n_cells))
        if bad < 0 and zone.kind == _INTERIOR and neighbour[start:stop].min() == NO_CELL:
            bad = int(np.argmin(neighbour[start:stop]))
        if bad >= 0:
            raise _bad_face(source, zone, bad, n_points, n_cells)
    return Faces(offsets, nodes, owner, neighbour)


@kernel
def _store(
    values: Ints, lead: int, offsets: Ints, nodes: Ints, owner: Ints, neighbour: Ints, n_points: int, n_cells: int
) -> int:
    """Store the faces of one zone so that normals leave the owner; the row of the first bad one, or -1."""
    at = 0
    for row in range(len(owner)):
        start = offsets[row]
        size = offsets[row + 1] - start
        at += lead
        for i in range(size):
            if values[at + i] < 1 or values[at + i] > n_points:
                return row
        c0, c1 = values[at + size], values[at + size + 1]
        if c0 < 0 or c1 < 0 or c0 > n_cells or c1 > n_cells or c0 == c1:
            return row
        turned = (c0 > 0) == (size > 2)
        for i in range(size):
            nodes[start + i] = values[at + (size - 1 - i if turned else i)] - 1
        if c0 > 0:
            owner[row], neighbour[row] = c0 - 1, c1 - 1
        else:
            owner[row], neighbour[row] = c1 - 1, NO_CELL
        at += size + 2
    return -1


def _bad_face(source: Source, zone: FaceRange, row: int, n_points: int, n_cells: int) -> ReadError:
    """What is wrong with a face that was refused."""
    lead = int(zone.offsets is not None)
    begin = row * zone.size if zone.offsets is None else int(zone.offsets[row])
    size = zone.size if zone.offsets is None else int(zone.offsets[row + 1]) - begin
    begin += row * (2 + lead) + lead
    name = f"face {zone.first + row}"
    for i in range(begin, begin + size):
        if not 1 <= zone.integers.values[i] <= n_points:
            return zone.integers.error(source, i, f"a node of 1 to {n_points} ({name})")
    for i in (begin + size, begin + size + 1):
        if not 0 <= zone.integers.values[i] <= n_cells:
            return zone.integers.error(source, i, f"a cell of 1 to {n_cells}, or 0 for none ({name})")
    sides = zone.integers.values[begin + size : begin + size + 2]
    if sides[0] == sides[1]:
        return zone.integers.error(source, begin + size + 1, f"two different cells beside {name}")
    place = begin + size + int(np.argmin(sides))
    return zone.integers.error(source, place, f"a cell on either side of {name}, which is in an interior zone")


def live_part(source: Source, records: FluentRecords, sides: Faces, n_cells: int) -> Live:
    """Which cells and faces take part. Raises ReadError where a tree contradicts the faces."""
    n_faces = len(sides)
    cells = np.ones(n_cells, dtype=bool)
    for part in records.cells:
        if part.kind == _PARENT_CELLS:
            cells[part.first - 1 : part.last] = False
    for tree in records.cell_trees:
        _check_tree(source, tree, n_cells, CELLS)
        cells[tree.first - 1 : tree.last] = False
    parents = np.zeros(n_faces, dtype=bool)
    parent = np.full(n_faces, -1, np.int32)
    for zone in records.faces:
        if zone.kind == _PARENT_FACES:
            parents[zone.first - 1 : zone.last] = True
    for tree in records.face_trees:
        _check_tree(source, tree, n_faces, FACES)
        parents[tree.first - 1 : tree.last] = True
        parent[tree.children - 1] = np.repeat(np.arange(tree.first - 1, tree.last), np.diff(tree.offsets))
    cut = np.zeros(n_faces, dtype=bool)
    for overlap in records.overlaps:
        if isinstance(overlap, Range):
            if overlap.last > n_faces:
                raise source.error(overlap.start, f"{FACES} of 1 to {n_faces}", str(overlap.last))
            cut[overlap.first - 1 : overlap.last] = True
        else:
            _check_numbers(source, overlap, n_faces, FACES)
            cut[overlap.values - 1] = True
    for pairs in records.periodic:
        _check_numbers(source, pairs, n_faces, FACES)
    live = Live(cells, ~(parents | cut), parents, parent)
    _check_sides(source, sides, live)
    return live


def _check_tree(source: Source, tree: Tree, n: int, what: str) -> None:
    if tree.last > n:
        raise source.error(tree.start, f"{what} of 1 to {n}", str(tree.last))
    _check_numbers(source, Integers(tree.children, tree.integers.start, tree.integers.binary), n, what)


def _check_numbers(source: Source, integers: Integers, n: int, what: str) -> None:
    wrong = (integers.values < 1) | (integers.values > n)
    if wrong.any():
        found = str(int(integers.values[np.argmax(wrong)]))
        raise source.error(integers.start, f"numbers of {what} of 1 to {n}", found, binary=integers.binary)


def _check_sides(source: Source, sides: Faces, live: Live) -> None:
    if not live.cells.any():
        raise ReadError(source.path, "", "cells that are not parents of others", "none")
    if live.cells.all():
        return
    beside = np.concatenate((sides.owner[live.faces], sides.neighbour[live.faces]))
    wrong = beside[(beside != NO_CELL) & ~live.cells[beside]]
    if wrong.size:
        raise ReadError(source.path, f"cell {int(wrong[0]) + 1}", "no unsplit face beside a parent cell", "one")
