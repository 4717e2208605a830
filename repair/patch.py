"""A patch for a hole: the triangulation of its rim that bends least, and of those the one of the smallest area.

By dynamic programming over the rim (Barequet and Sharir, "Filling gaps in the boundary of a polyhedron", 1995; with the
largest dihedral angle first, Liepa, "Filling holes in meshes", 2003).
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints

__all__ = ["best_patch"]


def best_patch(rim: Floats, beyond: Floats) -> Ints:
    """(n - 2, 3) triangles over the points rim (n, 3) of a hole, running the way the rim does.

    beyond (n, 3): third corner of the triangle outside each edge i, i + 1, to whose plane the patch should keep.
    """
    pick = _solve(np.ascontiguousarray(rim), np.ascontiguousarray(beyond))
    out, stack = [], [(0, len(rim) - 1)]
    while stack:
        i, j = stack.pop()
        if j - i < 2:
            continue
        k = int(pick[i, j])
        out.append((i, k, j))
        stack += [(i, k), (k, j)]
    return np.array(out, dtype=np.int64)


@inner
def _normal(ax: float, ay: float, az: float, bx: float, by: float, bz: float, cx: float, cy: float, cz: float) -> tuple[
    float, float, float, float
]:  # fmt: skip
    """(unit normal, area) of a triangle; the normal is 0 where it has no area."""
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = math.sqrt(x * x + y * y + z * z)
    if size > 0.0:
        return x / size, y / size, z / size, 0.5 * size
    return 0.0, 0.0, 0.0, 0.0


@inner
def _tri(p: Floats, i: int, j: int, k: int) -> tuple[float, float, float, float]:
    return _normal(p[i, 0], p[i, 1], p[i, 2], p[j, 0], p[j, 1], p[j, 2], p[k, 0], p[k, 1], p[k, 2])


@inner
def _bend(x: float, y: float, z: float, u: float, v: float, w: float) -> float:
    """1 - cosine of the angle between two normals: 0 where the faces go on in one plane, 2 where they fold back."""
    return 1.0 - (x * u + y * v + z * w)


@kernel
def _solve(p: Floats, beyond: Floats) -> Ints:
    """pick[i, j]: third corner over the edge i-j of the best triangulation of the rim from i to j."""
    n = p.shape[0]
    bend = np.zeros((n, n))
    area = np.zeros((n, n))
    pick = np.full((n, n), -1, np.int64)
    normal = np.zeros((n, n, 3))  # of the triangle over i-j inside, or of the one outside where j = i + 1
    for i in range(n - 1):
        x, y, z, _ = _normal(
            p[i + 1, 0], p[i + 1, 1], p[i + 1, 2], p[i, 0], p[i, 1], p[i, 2], beyond[i, 0], beyond[i, 1], beyond[i, 2]
        )
        normal[i, i + 1, 0], normal[i, i + 1, 1], normal[i, i + 1, 2] = x, y, z
    last = n - 1
    lx, ly, lz, _ = _normal(
        p[0, 0], p[0, 1], p[0, 2], p[last, 0], p[last, 1], p[last, 2],
        beyond[last, 0], beyond[last, 1], beyond[last, 2],
    )  # fmt: skip
    for span in range(2, n):
        for i in range(n - span):
            j = i + span
            least, small = np.inf, np.inf
            for k in range(i + 1, j):
                x, y, z, a = _tri(p, i, k, j)
                b = max(bend[i, k], bend[k, j])
                b = max(b, _bend(x, y, z, normal[i, k, 0], normal[i, k, 1], normal[i, k, 2]))
                b = max(b, _bend(x, y, z, normal[k, j, 0], normal[k, j, 1], normal[k, j, 2]))
                if i == 0 and j == last:
                    b = max(b, _bend(x, y, z, lx, ly, lz))
                a += area[i, k] + area[k, j]
                if b < least - 1e-9 or (b <= least + 1e-9 and a < small):
                    least, small = b, a
                    pick[i, j] = k
                    normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = x, y, z
            bend[i, j], area[i, j] = least, small
    return pick
