"""Faces, owners and neighbours of cells that are given as polyhedra, each with its own copy of its faces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import ReadError
from meshwright.audit.mesh import NO_CELL, CellBlock, Faces
from meshwright.audit.readers.source import Source

__all__ = ["Polyhedra", "faces_of_cells"]

Ints = NDArray[np.int64]


def _starts(sizes: Ints) -> Ints:
    return np.concatenate(([0], np.cumsum(sizes)))


@dataclass(frozen=True)
class Polyhedra:
    """offsets: (n+1,) into the faces of all cells.  sizes: (f,) nodes of each face.  nodes: all of them."""

    offsets: Ints
    sizes: Ints
    nodes: Ints

    @classmethod
    def checked(cls, source: Source, n_faces: np.ndarray, sizes: np.ndarray, nodes: Ints) -> Polyhedra:
        """Raises ReadError for a cell of fewer than 4 faces or a face of fewer than 3 nodes."""
        if len(n_faces) and int(n_faces.min()) < 4:
            raise ReadError(source.path, "polyhedra", "4 faces or more in each", str(int(n_faces.min())))
        if len(sizes) and int(sizes.min()) < 3:
            raise ReadError(source.path, "polyhedra", "3 nodes or more in each face", str(int(sizes.min())))
        if int(n_faces.sum()) != len(sizes) or int(sizes.sum()) != len(nodes):
            raise ReadError(source.path, "polyhedra", f"{int(sizes.sum())} nodes of faces", str(len(nodes)))
        return cls(_starts(n_faces), sizes, nodes)


@dataclass
class _Sides:
    """Half-faces: the cell row and the nodes of each."""

    cells: Ints
    sizes: Ints
    nodes: Ints


def _sides_of_block(block: CellBlock) -> list[_Sides]:
    sides = []
    for table in (
        CELL_TYPES[CELL_TYPES[block.type].corners].tri_faces,
        CELL_TYPES[CELL_TYPES[block.type].corners].quad_faces,
    ):
        if len(table):
            nodes = block.nodes.astype(np.int64)[:, table].reshape(-1, table.shape[1])
            cells = np.repeat(block.rows.astype(np.int64), len(table))
            sides.append(_Sides(cells, np.full(len(nodes), table.shape[1]), nodes.ravel()))
    return sides


def faces_of_cells(
    source: Source, plain: Sequence[CellBlock], polyhedra: Sequence[tuple[Polyhedra, Ints]]
) -> tuple[Faces, Ints, Ints]:
    """Faces of all cells, then offsets and items (rows of faces) of the polyhedra in the order given.

    Two sides with the same nodes are one face of two cells; the first to list it owns it and gives its
    direction. Raises ReadError for polygons among polyhedra.
    """
    parts = [side for block in plain for side in _sides_of_block(block)]
    first_polyhedral = sum(len(part.cells) for part in parts)
    parts += [_Sides(np.repeat(rows, np.diff(p.offsets)), p.sizes, p.nodes) for p, rows in polyhedra]
    cells = np.concatenate([part.cells for part in parts])
    sizes = np.concatenate([part.sizes for part in parts])
    nodes = np.concatenate([part.nodes for part in parts])
    if not len(cells):
        raise ReadError(source.path, "polyhedra", "faces", "none")
    partner = _partners(cells, sizes, nodes)
    order = np.argsort(cells, kind="stable")
    rank = np.empty(len(cells), dtype=np.int64)
    rank[order] = np.arange(len(cells))
    owns = (partner < 0) | (rank < rank[partner])
    owners = order[owns[order]]
    face = np.empty(len(cells), dtype=np.int64)
    face[owners] = np.arange(len(owners))
    shared = np.flatnonzero(~owns)
    face[shared] = face[partner[shared]]
    starts = _starts(sizes)
    own_sizes = sizes[owners]
    offsets = _starts(own_sizes)
    picks = np.repeat(starts[owners] - offsets[:-1], own_sizes) + np.arange(int(offsets[-1]))
    neighbour = np.full(len(owners), NO_CELL, dtype=np.int64)
    paired = partner[owners] >= 0
    neighbour[paired] = cells[partner[owners[paired]]]
    faces = Faces(offsets, nodes[picks], cells[owners], neighbour)
    counts = np.concatenate([np.diff(p.offsets) for p, _ in polyhedra])
    return faces, _starts(counts), face[first_polyhedral:]


def _partners(cells: Ints, sizes: Ints, nodes: Ints) -> Ints:
    """(h,) the other half-face with the same nodes, -1 where there is none or more than one."""
    partner = np.full(len(cells), -1, dtype=np.int64)
    starts = _starts(sizes)
    for size in np.flatnonzero(np.bincount(sizes)).tolist():
        mine = np.flatnonzero(sizes == size)
        keys = np.sort(nodes[starts[mine, None] + np.arange(size)], axis=1)
        order = np.lexsort(keys.T[::-1])
        ordered = keys[order]
        same = np.concatenate(([False], (ordered[1:] == ordered[:-1]).all(axis=1), [False]))
        # A run of exactly two: equal to the one before, and neither neighbour of the pair equal as well.
        second = np.flatnonzero(same[1:-1] & ~same[:-2] & ~same[2:]) + 1
        a, b = mine[order[second - 1]], mine[order[second]]
        differ = cells[a] != cells[b]
        partner[a[differ]], partner[b[differ]] = b[differ], a[differ]
    return partner
