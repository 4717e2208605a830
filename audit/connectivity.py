"""Who touches whom: faces, edges, neighbours, parts. Each is computed once for a mesh, on demand.

Second-order cells take part with their corners alone, except in `nodes_of_cells` and `points_to_cells`.
All tables are int32 arrays in an order that depends on the mesh only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.csr import faces_by_cell, invert, ragged, take, uniform_offsets
from meshwright.audit.errors import MeshError
from meshwright.audit.half_faces import KINDS, count_half_faces, emit, meetings, pair, select
from meshwright.audit.mesh import NO_CELL, CellBlock, Faces, Ints, Mesh, index_array
from meshwright.audit.sets import (
    count_edges,
    count_loop_edges,
    distinct_by_row,
    find_parts,
    hash_rows,
    place_edges,
    place_loop_edges,
    scatter,
    squeeze_edges,
)

__all__ = [
    "HalfFaces",
    "boundary_faces",
    "cell_components",
    "corner_points",
    "duplicate_cells",
    "edges",
    "faces",
    "faces_of_cells",
    "half_faces",
    "nodes_of_cells",
    "overused_faces",
    "points_to_cells",
    "unused_points",
    "used_points",
]

_MOST = np.iinfo(np.int32).max


def faces(mesh: Mesh) -> Faces:
    """The faces of the cells (edges of two nodes for 2-D cells): the file's own, or derived from the cells.

    Derived faces: owner is the lower cell row and sees the face as stored, its normal pointing outward;
    ordered by owner row, then by the owner's local face. A face named by more than two cells pairs the first
    two and stands once more, without neighbour, for each further cell: see `overused_faces`.
    """
    return mesh.faces if mesh.faces is not None else _derived(mesh)[0]


def overused_faces(mesh: Mesh) -> Ints:
    """Rows of the faces whose nodes more than two cells name (or one cell twice), ascending.

    Empty in a face-based mesh, where a face names the two cells it lies between.
    """
    return index_array([]) if mesh.faces is not None else _derived(mesh)[1]


@once_per_mesh
def _derived(mesh: Mesh) -> tuple[Faces, Ints]:
    sides = _half_faces(mesh)
    face_offsets, face_nodes, owner, neighbour, crowd = emit(*sides.cells, sides.other, sides.crowded)
    return Faces(face_offsets, face_nodes, owner, neighbour), index_array(crowd)


@dataclass(frozen=True, eq=False)
class HalfFaces:
    """The sides of all cells (edges of 2-D cells), by cell row and then by local face: a third of what faces take.

    other: (half-faces,) row of the cell beyond; -1 where there is none, less where that cell's half-face tells.
    crowded: (half-faces,) whether more than two cells name these nodes.
    cells: what the kernels know the cells by.
    """

    cells: tuple[NDArray[np.uint8], Ints, Ints, NDArray[np.int64]]
    other: Ints
    crowded: NDArray[np.bool_]

    @property
    def starts(self) -> NDArray[np.int64]:
        """(n_cells + 1,) the first half-face of each cell."""
        return self.cells[3]

    def loops(self, chosen: NDArray[np.bool_]) -> Ints:
        """(k, 4) nodes of the half-faces that are chosen, seen from their cells; -1 in the places that are not used."""
        return select(*self.cells, chosen)

    def meetings(self) -> tuple[Ints, Ints, NDArray[np.bool_]]:
        """(first, second, alike) of every side that exactly two cells share: the cells, whether both walk it alike."""
        first, second, alike = meetings(*self.cells, self.other, self.crowded)
        return first, second, alike


@once_per_mesh
def half_faces(mesh: Mesh) -> HalfFaces:
    """The sides of the cells of a mesh without polyhedra."""
    return _half_faces(mesh)


def _half_faces(mesh: Mesh) -> HalfFaces:
    """The same, not kept: faces, which are, tell as much."""
    offsets, nodes = _corners(mesh)
    kinds = np.empty(mesh.n_cells, np.uint8)
    for block in mesh.blocks:
        kinds[block.rows] = KINDS.index(CELL_TYPES[block.type].corners)
    starts = count_half_faces(kinds, offsets)
    if starts[-1] > _MOST:
        raise MeshError(f"more than {_MOST} cell sides")
    other, crowded = pair(kinds, offsets, nodes, starts, len(mesh.points))
    return HalfFaces((kinds, offsets, nodes, starts), other, crowded)


@once_per_mesh
def faces_of_cells(mesh: Mesh) -> tuple[Ints, Ints]:
    """(offsets (n_cells + 1,), items): rows of the faces of each cell, ascending."""
    found = faces(mesh)
    return faces_by_cell(found.owner, found.neighbour, mesh.n_cells)


def boundary_faces(mesh: Mesh) -> Ints:
    """Rows of the faces that have a cell on one side only."""
    return index_array(np.flatnonzero(faces(mesh).neighbour == NO_CELL))


@once_per_mesh
def nodes_of_cells(mesh: Mesh) -> tuple[Ints, Ints]:
    """(offsets (n_cells + 1,), items): point rows of each cell, all nodes, in VTK order; of a polyhedron ascending."""
    return _joined(mesh, corners_only=False)


@once_per_mesh
def _corners(mesh: Mesh) -> tuple[Ints, Ints]:
    return nodes_of_cells(mesh) if mesh.order == 1 else _joined(mesh, corners_only=True)


def _joined(mesh: Mesh, corners_only: bool) -> tuple[Ints, Ints]:
    if len(mesh.points) > _MOST:
        raise MeshError(f"more than {_MOST} points")
    tables = [(block.rows, *_nodes_of_block(mesh, block, corners_only)) for block in mesh.blocks]
    if len(tables) == 1:
        return tables[0][1:]
    sizes = np.zeros(mesh.n_cells + 1, np.int64)
    for rows, offsets, _ in tables:
        sizes[rows + 1] = np.diff(offsets)
    offsets = index_array(np.cumsum(sizes))
    items = np.empty(offsets[-1], np.int32)
    for rows, starts, nodes in tables:
        scatter(rows, starts, nodes, offsets, items)
    return offsets, index_array(items)


def _nodes_of_block(mesh: Mesh, block: CellBlock, corners_only: bool) -> tuple[Ints, Ints]:
    if block.items is None:
        nodes = block.nodes[:, : CELL_TYPES[block.type].n_corners] if corners_only else block.nodes
        return uniform_offsets(*nodes.shape), index_array(nodes.ravel())
    if block.type == "polygon":
        return ragged(block)
    offsets, nodes = distinct_by_row(*ragged(block), *_face_table(mesh), len(mesh.points))
    return index_array(offsets), index_array(nodes)


def _face_table(mesh: Mesh) -> tuple[Ints, Ints]:
    found = faces(mesh)
    return found.offsets, found.nodes


@once_per_mesh
def points_to_cells(mesh: Mesh) -> tuple[Ints, Ints]:
    """(offsets (n_points + 1,), items): rows of the cells that use each point, ascending."""
    return invert(*nodes_of_cells(mesh), len(mesh.points))


@once_per_mesh
def used_points(mesh: Mesh) -> NDArray[np.bool_]:
    """(n_points,) whether a cell uses the point, be it as a mid-side node; boundary elements do not count as use."""
    used = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.blocks:
        used[_nodes_of_block(mesh, block, corners_only=False)[1]] = True
    used.flags.writeable = False
    return used


@once_per_mesh
def corner_points(mesh: Mesh) -> NDArray[np.bool_]:
    """(n_points,) whether the point is a corner of a cell."""
    corners = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.blocks:
        corners[_nodes_of_block(mesh, block, corners_only=True)[1]] = True
    corners.flags.writeable = False
    return corners


def unused_points(mesh: Mesh) -> Ints:
    """Rows of the points that no cell uses."""
    return index_array(np.flatnonzero(~used_points(mesh)))


@once_per_mesh
def edges(mesh: Mesh) -> Ints:
    """(m, 2) the edges of all cells, each once, smaller point row first, sorted."""
    fixed = [(CELL_TYPES[b.type].edge_table, b.nodes) for b in mesh.blocks if b.items is None]
    loops = [_loops_of_block(mesh, b) for b in mesh.blocks if b.items is not None]
    if len(mesh.points) > _MOST:
        raise MeshError(f"more than {_MOST} points")
    begin = np.zeros(len(mesh.points) + 1, np.int64)
    for table, nodes in fixed:
        count_edges(nodes, table, begin)
    for offsets, items in loops:
        count_loop_edges(offsets, items, begin)
    cursor = np.cumsum(begin)
    ends = np.empty(cursor[-1], np.int32)
    for table, nodes in fixed:
        place_edges(nodes, table, cursor, ends)
    for offsets, items in loops:
        place_loop_edges(offsets, items, cursor, ends)
    return index_array(squeeze_edges(cursor[:-1], ends))


def _loops_of_block(mesh: Mesh, block: CellBlock) -> tuple[Ints, Ints]:
    offsets, items = ragged(block)
    if block.type == "polygon":
        return offsets, items
    used = np.zeros(len(faces(mesh)), dtype=bool)
    used[items] = True
    return take(*_face_table(mesh), index_array(np.flatnonzero(used)))


@once_per_mesh
def cell_components(mesh: Mesh) -> Ints:
    """(n_cells,) number of the part each cell belongs to; cells of one part are connected through faces.

    Parts are numbered from 0 by their first cell row.
    """
    found = faces(mesh)
    return index_array(find_parts(found.owner, found.neighbour, mesh.n_cells))


@once_per_mesh
def duplicate_cells(mesh: Mesh) -> Ints:
    """(m, 2) for each cell with the corners of an earlier one, in any order: its row, the row of the first."""
    offsets, nodes = _corners(mesh)
    order = np.argsort(hashes := hash_rows(offsets, nodes), kind="stable")
    same = hashes[order[1:]] == hashes[order[:-1]]
    candidates = np.union1d(order[1:][same], order[:-1][same])
    first: dict[bytes, int] = {}
    pairs = []
    for row in candidates.tolist():
        key = np.sort(nodes[offsets[row] : offsets[row + 1]]).tobytes()
        if first.setdefault(key, row) != row:
            pairs.append((row, first[key]))
    return index_array(np.array(pairs, np.int32).reshape(-1, 2))
