"""Cells from faces: what face-based files (Fluent, OpenFOAM) do not say, namely which cell is a hex.

A face's right-hand normal points from its owner to its neighbour (in 2-D the owner lies left of the edge
0 -> 1). Cells come out in VTK node order so that a right-handed file gives positive cells. Where faces of one
cell contradict each other the majority of them decides, and a tie is decided by the first face of the kind the
base is made of; that some face looks the wrong way is for a check to report, not for the reader to hide.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.csr import faces_by_cell, take
from meshwright.audit.errors import MeshError
from meshwright.audit.mesh import CellBlock, Ints, index_array
from meshwright.audit.parallel import in_parallel
from meshwright.audit.recognition import (
    HEX,
    OTHER,
    PYRAMID,
    TET,
    WEDGE,
    check_closed,
    check_faces,
    guess_kinds,
    loops,
    recognise,
)

__all__ = ["AssemblyError", "blocks_from_faces"]

_KINDS = {"tet": (TET, 4), "pyramid": (PYRAMID, 5), "wedge": (WEDGE, 6), "hex": (HEX, 8)}

_PIECE = 1 << 16
"""Cells that a thread recognises in one go."""


class AssemblyError(MeshError):
    """The faces that name a cell do not enclose it.

    cell: row of the cell.  expected, found: short phrases.
    """

    def __init__(self, cell: int, expected: str, found: str) -> None:
        self.cell = cell
        self.expected = expected
        self.found = found
        super().__init__(f"cell row {cell}: expected {expected}, found {found}")

    def __reduce__(self) -> tuple[type[AssemblyError], tuple[int, str, str]]:
        return type(self), (self.cell, self.expected, self.found)


def blocks_from_faces(
    offsets: Ints, nodes: Ints, owner: Ints, neighbour: Ints, n_cells: int, cell_dimension: int
) -> tuple[CellBlock, ...]:
    """The cells that the faces enclose, one block a type in the order of `CELL_TYPES`, rows ascending.

    offsets (f + 1,), nodes: point rows of each face (edges of two nodes when cell_dimension is 2).
    owner (f,), neighbour (f,): cell rows, neighbour -1 on the boundary.
    3-D: tet, pyramid, wedge and hex where the topology really is that, polyhedron for every other closed cell.
    2-D: tri, quad, polygon.
    Raises AssemblyError for a cell without faces, with too few of them, with a face that names a node twice or
    lies between the cell and itself, or with an edge (2-D: node) that is not in exactly two of its faces;
    MeshError when the arrays contradict each other.
    """
    offsets, nodes, owner, neighbour = (index_array(a) for a in (offsets, nodes, owner, neighbour))
    _check_arrays(offsets, nodes, owner, neighbour, n_cells, cell_dimension)
    face, node = check_faces(offsets, nodes, owner, neighbour)
    if face >= 0:
        what = f"with node {node} twice" if node >= 0 else "with this cell on both sides"
        wanted = "faces of distinct nodes" if node >= 0 else "two different cells at a face"
        raise AssemblyError(int(owner[face]), wanted, f"face {face} {what}")
    _check_every_cell_named(owner, neighbour, n_cells)
    cell_offsets, cell_faces = faces_by_cell(owner, neighbour, n_cells)
    _check_face_counts(cell_offsets, least=cell_dimension + 1)
    if cell_dimension == 2:
        return _flat_blocks(cell_offsets, cell_faces, nodes, owner)
    return _solid_blocks(cell_offsets, cell_faces, offsets, nodes, owner)


def _solid_blocks(
    cell_offsets: Ints, cell_faces: Ints, offsets: Ints, nodes: Ints, owner: Ints
) -> tuple[CellBlock, ...]:
    kinds = np.empty(len(cell_offsets) - 1, np.uint8)
    guess_kinds(cell_offsets, cell_faces, offsets, kinds)
    blocks = []
    for name, (kind, width) in _KINDS.items():
        rows = index_array(np.flatnonzero(kinds == kind))
        if not len(rows):
            continue
        found = np.empty((len(rows), width), np.int32)
        done = np.empty(len(rows), dtype=bool)
        table = (cell_offsets, cell_faces, offsets, nodes, owner)
        pieces = [slice(start, start + _PIECE) for start in range(0, len(rows), _PIECE)]
        list(in_parallel(partial(_recognise, rows, kind, table, found, done), pieces))
        if not done.all():
            kinds[rows[~done]] = OTHER
            rows, found = rows[done], found[done]
        if len(rows):
            blocks.append(CellBlock(name, rows, found))
    rows = index_array(np.flatnonzero(kinds == OTHER))
    if len(rows):
        cell, a, b, uses = check_closed(rows, cell_offsets, cell_faces, offsets, nodes)
        if cell >= 0:
            raise AssemblyError(cell, "every edge in exactly 2 of its faces", f"edge {a}-{b} in {uses}")
        starts, items = take(cell_offsets, cell_faces, rows)
        blocks.append(CellBlock("polyhedron", rows, offsets=starts, items=items))
    return tuple(blocks)


def _recognise(
    rows: Ints, kind: int, table: tuple[Ints, ...], found: Ints, done: NDArray[np.bool_], piece: slice
) -> None:
    recognise(rows[piece], kind, *table, found[piece], done[piece])


def _flat_blocks(cell_offsets: Ints, cell_edges: Ints, nodes: Ints, owner: Ints) -> tuple[CellBlock, ...]:
    around = np.empty(len(cell_edges), np.int32)
    cell, node, n = loops(cell_offsets, cell_edges, nodes, owner, around)
    if cell >= 0 and node >= 0:
        raise AssemblyError(cell, "every node in exactly 2 of its edges", f"node {node} in {n}")
    if cell >= 0:
        of = int(cell_offsets[cell + 1] - cell_offsets[cell])
        raise AssemblyError(cell, "one closed loop of edges", f"a loop of {n} of its {of} edges")
    sizes = np.diff(cell_offsets)
    blocks = []
    for name, size in (("tri", 3), ("quad", 4)):
        rows = index_array(np.flatnonzero(sizes == size))
        if len(rows):
            blocks.append(CellBlock(name, rows, take(cell_offsets, around, rows)[1].reshape(-1, size)))
    rows = index_array(np.flatnonzero(sizes > 4))
    if len(rows):
        starts, items = take(cell_offsets, around, rows)
        blocks.append(CellBlock("polygon", rows, offsets=starts, items=items))
    return tuple(blocks)


def _check_arrays(offsets: Ints, nodes: Ints, owner: Ints, neighbour: Ints, n_cells: int, cell_dimension: int) -> None:
    """Whatever the kernels rely on: they do not check an index again."""
    n = len(owner)
    if cell_dimension not in (2, 3):
        raise MeshError(f"cells of dimension 2 or 3 have faces, not {cell_dimension}")
    if any(a.dtype != np.int32 for a in (offsets, nodes, owner, neighbour)) or 2 * n > np.iinfo(np.int32).max:
        raise MeshError("more than 2**31 nodes or 2**30 faces")
    if n_cells < 1 or not n:
        raise MeshError(f"{n_cells} cells cannot be assembled from {n} faces")
    if len(neighbour) != n or len(offsets) != n + 1 or offsets[0] != 0 or offsets[-1] != len(nodes):
        raise MeshError(f"{n} faces need as many neighbours, and offsets from 0 to {len(nodes)} in {n + 1} entries")
    sizes = np.diff(offsets)
    if owner.min() < 0 or owner.max() >= n_cells or neighbour.min() < -1 or neighbour.max() >= n_cells:
        raise MeshError(f"owner or neighbour of a face is outside 0 to {n_cells - 1}")
    wrong = sizes != 2 if cell_dimension == 2 else sizes < 3
    if wrong.any():
        face = int(np.argmax(wrong))
        wanted = "edges of 2 nodes" if cell_dimension == 2 else "faces of at least 3 nodes"
        raise AssemblyError(int(owner[face]), wanted, f"face {face} of {int(sizes[face])}")
    if nodes.min() < 0:
        raise MeshError(f"node {int(nodes.min())} of a face is negative")


def _check_every_cell_named(owner: Ints, neighbour: Ints, n_cells: int) -> None:
    """A claimed number of cells beyond what the faces can name is refused before anything of that size is made."""
    most = 2 * len(owner)
    if n_cells <= most:
        return
    named = np.zeros(most + 1, dtype=bool)
    for rows in (owner, neighbour[neighbour >= 0]):
        named[rows[rows <= most]] = True
    raise AssemblyError(int(np.argmin(named)), "at least one face", "none")


def _check_face_counts(cell_offsets: Ints, least: int) -> None:
    sizes = np.diff(cell_offsets)
    cell = int(np.argmin(sizes >= least))
    if sizes[cell] < least:
        raise AssemblyError(cell, f"at least {least} faces", str(int(sizes[cell])) if sizes[cell] else "none")
