"""The signed size of cells: what tells a cell from its mirror image, and what moving inner points does not change."""

from __future__ import annotations

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.geometry import cell_geometry
from meshwright.audit.mesh import NO_CELL, Floats, Mesh

__all__ = ["signed_sizes", "warp"]


def signed_sizes(mesh: Mesh) -> Floats:
    """(n_cells,) volume; in the plane the area, positive counter-clockwise; of a shell the cone to its middle.

    0 for cells with a point that is not finite. The corners of second-order cells count alone.
    """
    if mesh.cell_dimension == 3:
        return np.nan_to_num(cell_geometry(mesh).volume)
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


def warp(mesh: Mesh) -> float:
    """The volume that the boundary's quads do not decide: between the two diagonals along which each can be bent."""
    if mesh.cell_dimension != 3:
        return 0.0
    sides = faces(mesh)
    rows = np.flatnonzero((sides.neighbour == NO_CELL) & (np.diff(sides.offsets) == 4))
    x = mesh.points[sides.nodes[sides.offsets[rows].astype(np.int64)[:, None] + np.arange(4)]]
    u, v, w = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], x[:, 3] - x[:, 0]
    return float(np.abs(np.einsum("ij,ij->i", np.cross(u, v), w)).sum()) / 6.0
