"""The signed size of cells: what tells a cell from its mirror image, and what moving inner points does not change."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.geometry import cell_geometry
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import NO_CELL, CellBlock, Floats, Ints, Mesh
from meshwright.audit.parallel import in_parallel

__all__ = ["signed_sizes", "warp"]

_PIECE = 1 << 14
"""Cells that a thread takes at a time."""


def signed_sizes(mesh: Mesh) -> Floats:
    """(n_cells,) volume; in the plane the area, positive counter-clockwise; of a shell the cone to its middle.

    0 for cells with a point that is not finite. The corners of second-order cells count alone. A quad that is not flat
    stands for the mean of its two diagonals, seen from both its cells, so that the sum depends on the boundary alone.
    """
    if mesh.cell_dimension == 3 and any(block.items is not None for block in mesh.blocks):
        return np.nan_to_num(cell_geometry(mesh).volume)
    if mesh.cell_dimension == 3:
        return _volumes_of(mesh)
    out = np.zeros(mesh.n_cells)
    flat = mesh.dimension == 2
    used = np.concatenate([block.nodes.ravel() for block in mesh.blocks if block.items is None] or [np.empty(0, int)])
    centre = mesh.points[used].mean(axis=0) if len(used) else np.zeros(3)
    for block in mesh.blocks:
        if block.items is not None:
            continue
        x = mesh.points[block.nodes[:, : CELL_TYPES[block.type].n_corners]] - centre
        for k in range(1, x.shape[1] - 1):
            u, v = (x[:, k] - x[:, 0], x[:, k + 1] - x[:, 0]) if flat else (x[:, k], x[:, k + 1])
            fan = np.cross(u, v)
            out[block.rows] += 0.5 * fan[:, 2] if flat else np.einsum("ij,ij->i", x[:, 0], fan) / 6.0
    return np.nan_to_num(out)


def _volumes_of(mesh: Mesh) -> Floats:
    out = np.zeros(mesh.n_cells)
    for block in mesh.blocks:
        kind = CELL_TYPES[block.type]
        sides = np.array([[*side, *[-1] * (4 - len(side))] for side in kind.faces])

        def one(start: int, block: CellBlock = block, sides: Ints = sides) -> None:
            rows = block.rows[start : start + _PIECE]
            _volumes(mesh.points, block.nodes[start : start + _PIECE], sides, rows, out)

        for _ in in_parallel(one, range(0, len(block), _PIECE)):
            pass
    return out


@inner
def _det(x: Floats, y: Floats, z: Floats) -> float:
    return x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) + x[2] * (y[0] * z[1] - y[1] * z[0])


@kernel
def _volumes(points: Floats, nodes: Ints, sides: Ints, rows: Ints, out: Floats) -> None:
    """Sum over the sides of the cones to the first corner, which is the origin to all."""
    x = np.empty((4, 3))
    for c in range(nodes.shape[0]):
        o = nodes[c, 0]
        total = 0.0
        for f in range(sides.shape[0]):
            size = 3 if sides[f, 3] < 0 else 4
            for i in range(size):
                for a in range(3):
                    x[i, a] = points[nodes[c, sides[f, i]], a] - points[o, a]
            if size == 3:
                total += _det(x[0], x[1], x[2])
            else:
                one = _det(x[0], x[1], x[2]) + _det(x[0], x[2], x[3])
                total += 0.5 * (one + _det(x[0], x[1], x[3]) + _det(x[1], x[2], x[3]))
        out[rows[c]] = total / 6.0 if math.isfinite(total) else 0.0


def warp(mesh: Mesh) -> float:
    """The volume that the boundary's quads do not decide: between the two diagonals along which each can be bent."""
    if mesh.cell_dimension != 3:
        return 0.0
    sides = faces(mesh)
    rows = np.flatnonzero((sides.neighbour == NO_CELL) & (np.diff(sides.offsets) == 4))
    x = mesh.points[sides.nodes[sides.offsets[rows].astype(np.int64)[:, None] + np.arange(4)]]
    u, v, w = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], x[:, 3] - x[:, 0]
    return float(np.abs(np.einsum("ij,ij->i", np.cross(u, v), w)).sum()) / 6.0
