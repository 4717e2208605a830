"""How far two surfaces are apart: the largest distance of a point of one from the nearest point of the other.

Taken at the corners, the middles of sides and the middles of the triangles: between those it can be larger, by no more
than a part of the size of a triangle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.audit.surface import boundary_mesh
from meshwright.repair.bvh import Tree

__all__ = ["Apart", "surface_of", "surfaces_apart"]


@dataclass(frozen=True)
class Apart:
    """there: how far the second surface lies off the first at most, at `there_at`; back: the first off the second."""

    there: float
    there_at: tuple[float, float, float]
    back: float
    back_at: tuple[float, float, float]

    @property
    def hausdorff(self) -> float:
        """The larger of both."""
        return max(self.there, self.back)


def surface_of(mesh: Mesh) -> tuple[Floats, Ints] | None:
    """(points, triangles) of a surface mesh, or of the boundary of a solid one; quads are halved. None in the plane."""
    shell = boundary_mesh(mesh) if mesh.cell_dimension == 3 else mesh
    if shell is None or shell.dimension == 2 or any(block.items is not None for block in shell.blocks):
        return None
    parts = []
    for block in shell.blocks:
        corners = 3 if block.type.startswith("tri") else 4
        nodes = block.nodes[:, :corners].astype(np.int64)
        parts += [nodes[:, [0, k, k + 1]] for k in range(1, corners - 1)]
    return shell.points, np.concatenate(parts)


def surfaces_apart(one: tuple[Floats, Ints], two: tuple[Floats, Ints]) -> Apart:
    """The distances of two surfaces, each (points, triangles)."""
    there, there_at = _furthest(two, one)
    back, back_at = _furthest(one, two)
    return Apart(there, there_at, back, back_at)


def _furthest(of: tuple[Floats, Ints], off: tuple[Floats, Ints]) -> tuple[float, tuple[float, float, float]]:
    x = of[0][of[1]]
    one, two = of[1].astype(np.int64).ravel(), np.roll(of[1], -1, axis=1).ravel()
    # each edge once, though two triangles have it
    _, first = np.unique(np.minimum(one, two) * len(of[0]) + np.maximum(one, two), return_index=True)
    middles = 0.5 * (of[0][one[first]] + of[0][two[first]])
    where = np.concatenate([of[0][np.unique(one)], middles, x.mean(axis=1)])
    away, at = Tree.of(*off).furthest(where)
    px, py, pz = where[at].tolist()
    return away, (px, py, pz)
