"""From the parts of a Gmsh file, whatever its version, to a `Mesh`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import ORDER_OF_TYPES
from meshwright.audit.errors import ReadError
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.readers.gmsh.elements import GmshElement
from meshwright.audit.readers.source import Source

__all__ = ["ElementPart", "NodePart", "mesh_of_parts"]

Ints = NDArray[np.int64]
Members = Ints | slice
Names = dict[tuple[int | None, int], str]

_DENSE = 8
"""Node numbers are looked up in a table as long as it is at most so many times longer than the nodes."""
_ENTITY = ("point", "curve", "surface", "volume")


@dataclass(frozen=True)
class NodePart:
    """ids: (n,) node numbers.  points: (n, 3)."""

    ids: Ints
    points: NDArray[np.float64]


@dataclass(frozen=True)
class ElementPart:
    """Elements of one Gmsh type.

    ids: (m,).  nodes: (m, k) node numbers.  positions: (m,) place of each among all elements of the file,
    ascending.  physical, elementary: (number, rows of this part) of each physical group and each entity.
    """

    element: GmshElement
    ids: Ints
    nodes: Ints
    positions: Ints
    physical: tuple[tuple[int, Members], ...]
    elementary: tuple[tuple[int, Members], ...]


class _Rows:
    """Row of a node by its number."""

    def __init__(self, source: Source, ids: Ints) -> None:
        self._source, self._n = source, len(ids)
        self._first = int(ids.min()) if self._n else 0
        self._table = self._order = self._sorted = np.empty(0, np.int64)
        if self._first < 0:
            raise ReadError(source.path, "section $Nodes", "node numbers of 0 or more", str(self._first))
        span = int(ids.max()) - self._first + 1 if self._n else 0
        self._consecutive = span == self._n and bool(np.all(ids[1:] > ids[:-1]))
        if self._consecutive:
            return
        if span <= _DENSE * self._n:
            self._table = np.full(span, -1, dtype=np.int64)
            self._table[ids - self._first] = np.arange(self._n)
            twice = self._table[ids - self._first] != np.arange(self._n)
            doubled = ids[twice]
        else:
            self._order = np.argsort(ids, kind="stable")
            self._sorted = ids[self._order]
            doubled = self._sorted[1:][self._sorted[1:] == self._sorted[:-1]]
        if len(doubled):
            raise ReadError(source.path, "section $Nodes", "each node number once", f"{int(doubled[0])} more than once")

    def of(self, part: ElementPart) -> Ints:
        """(m, k) rows of the nodes that make the cells, in VTK order; ReadError for a number no node has."""
        rows, columns = self._of_all(part), part.element.columns
        return rows if columns == tuple(range(part.element.n_nodes)) else rows[:, columns]

    def left_out(self, part: ElementPart) -> Ints:
        """Rows of the nodes that the file gives these elements and the cells do not keep."""
        return np.delete(self._of_all(part), part.element.columns, axis=1).ravel()

    def _of_all(self, part: ElementPart) -> Ints:
        """(m, n_nodes) rows of the nodes as in the file."""
        nodes = part.nodes
        if self._consecutive or len(self._table):
            rows = nodes - self._first
            end = self._n if self._consecutive else len(self._table)
            known = (rows >= 0) & (rows < end)
            if not self._consecutive and known.all():
                rows = self._table[rows]
                known = rows >= 0
        else:
            rows = np.searchsorted(self._sorted, nodes)
            known = np.zeros(nodes.shape, dtype=bool)
            inside = rows < self._n
            known[inside] = self._sorted[rows[inside]] == nodes[inside]
            if known.all():
                rows = self._order[rows]
        if not known.all():
            row, column = np.argwhere(~known)[0]
            place = f"element {int(part.ids[row])}"
            raise ReadError(self._source.path, place, "a node listed in $Nodes", f"node {int(nodes[row, column])}")
        return rows


def mesh_of_parts(
    source: Source, format_name: str, nodes: NodePart, parts: Sequence[ElementPart], names: Names, notes: Sequence[str]
) -> Mesh:
    """The mesh.  names: of physical groups by (dimension or None, number).  Raises ReadError."""
    parts = [part for part in parts if len(part.ids)]
    cell_dimension = max((part.element.dimension for part in parts), default=-1)
    if cell_dimension < 2:
        found = "no elements" if cell_dimension < 0 else "lines and points only" if cell_dimension else "points only"
        raise ReadError(source.path, "section $Elements", "surface or volume elements", found)
    rows = _Rows(source, nodes.ids)
    of_cells = [part for part in parts if part.element.dimension == cell_dimension]
    of_boundary = [part for part in parts if part.element.dimension < cell_dimension]
    groups = _Groups(cell_dimension, any(part.physical for part in parts))
    blocks, cell_ids = _blocks(of_cells, rows, groups)
    boundary, boundary_ids = _blocks(of_boundary, rows, groups)
    losses = Counter[str]()
    spare: list[Ints] = []
    for part in parts:
        if part.element.loss:
            losses[part.element.loss] += len(part.ids)
            spare.append(rows.left_out(part))
    flat = cell_dimension == 2 and not np.any(nodes.points[:, 2])
    zones, empty = groups.zones(names)
    return Mesh(
        points=nodes.points,
        blocks=blocks,
        boundary=boundary,
        zones=zones,
        dimension=2 if flat else 3,
        cell_ids=cell_ids,
        point_ids=nodes.ids,
        boundary_ids=boundary_ids if len(boundary_ids) else None,
        spare_points=_sorted_once(spare) if spare else None,
        path=source.path,
        format=format_name,
        notes=(*(f"{count} {loss}" for loss, count in losses.items()), *empty, *notes),
    )


class _Groups:
    """Collects the members of groups while blocks are made."""

    def __init__(self, cell_dimension: int, physical: bool) -> None:
        self._cell_dimension, self._physical = cell_dimension, physical
        self._members: dict[tuple[int, int], list[Ints]] = {}

    def add(self, part: ElementPart, rows: Ints, nodes: Ints) -> None:
        """Rows: (m,) of the part's elements in the mesh.  nodes: (m, k) point rows."""
        dimension = part.element.dimension
        # Without physical groups the CAD entities are all there is to tell regions and walls apart.
        if not self._physical and dimension < self._cell_dimension - 1:
            return
        for number, members in part.physical if self._physical else part.elementary:
            chosen = nodes[members, 0] if dimension == 0 else rows[members]
            self._members.setdefault((dimension, number), []).append(chosen)

    def zones(self, names: Names) -> tuple[tuple[Zone, ...], tuple[str, ...]]:
        """Zones, cells first, and a note for each named group without elements."""
        zones = []
        for dimension, number in sorted(self._members, key=lambda key: (-key[0], key[1])):
            members = _sorted_once(self._members[dimension, number])
            word = f"{_ENTITY[dimension]} {number}"
            name = names.get((dimension, number), names.get((None, number), f"physical {word}"))
            entity = "cell" if dimension == self._cell_dimension else "face" if dimension else "point"
            kind = "physical group" if self._physical else "entity"
            zones.append(Zone(name if self._physical else word, kind, "", entity, members, number))
        present = {*self._members, *((None, number) for _, number in self._members)} if self._physical else set()
        empty = [name for key, name in names.items() if key not in present]
        notes = (f"physical groups without elements: {', '.join(empty)}",) if empty else ()
        return tuple(zones), notes


def _sorted_once(pieces: list[Ints]) -> Ints:
    """All values in ascending order, each once; a mark for each is several times faster than sorting."""
    values = np.concatenate(pieces)
    marks = np.zeros(int(values.max(initial=-1)) + 1, dtype=bool)
    marks[values] = True
    return np.flatnonzero(marks)


def _blocks(parts: Sequence[ElementPart], rows_of: _Rows, groups: _Groups) -> tuple[tuple[CellBlock, ...], Ints]:
    if not parts:
        return (), np.empty(0, np.int64)
    positions = np.concatenate([part.positions for part in parts])
    marks = np.zeros(int(positions.max()) + 1, dtype=bool)
    marks[positions] = True
    ranks = np.cumsum(marks) - 1
    ids = np.empty(len(positions), dtype=np.int64)
    found: dict[str, list[tuple[Ints, Ints]]] = {}
    for part in parts:
        rows, nodes = ranks[part.positions], rows_of.of(part)
        ids[rows] = part.ids
        groups.add(part, rows, nodes)
        found.setdefault(part.element.type, []).append((rows, nodes))
    blocks = []
    for name in sorted(found, key=ORDER_OF_TYPES.index):
        rows = np.concatenate([pair[0] for pair in found[name]])
        nodes = np.concatenate([pair[1] for pair in found[name]])
        if np.any(rows[1:] < rows[:-1]):
            order = np.argsort(rows)
            rows, nodes = rows[order], nodes[order]
        blocks.append(CellBlock(name, rows, nodes))
    return tuple(blocks), ids
