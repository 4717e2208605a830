"""Kernels that find corners of polygons and polyhedra at which there is no angle.

At a corner of a polyhedron its faces have normals in all directions of space; inside an edge they have two, inside a
face one. The directions are compared by the sine of 0.06 degrees.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints

__all__ = ["straight_corners", "straight_corners_of_polygons"]

Floats = NDArray[np.float64]

_STRAIGHT = 1e-3


@kernel
def straight_corners_of_polygons(points: Floats, offsets: Ints, nodes: Ints, at: Ints, of: Ints) -> int:
    """(points, polygons): corners at which a polygon goes straight on: how many, for `collected`."""
    n = 0
    for c in range(offsets.size - 1):
        first, last = offsets[c], offsets[c + 1]
        for i in range(first, last):
            p = nodes[i]
            a = nodes[i - 1 if i > first else last - 1]
            b = nodes[i + 1 if i + 1 < last else first]
            uu = vv = uv = 0.0
            for d in range(3):
                u, v = points[p, d] - points[a, d], points[b, d] - points[p, d]
                uu += u * u
                vv += v * v
                uv += u * v
            # sin**2 = 1 - cos**2 loses digits only far below the limit
            if uv > 0.0 and uu * vv - uv * uv <= _STRAIGHT * _STRAIGHT * uu * vv:
                if n < at.size:
                    at[n], of[n] = p, c
                n += 1
    return n


@kernel
def straight_corners(
    points: Floats, starts: Ints, cell_faces: Ints, offsets: Ints, nodes: Ints, at: Ints, of: Ints
) -> int:
    """(points, polyhedra): corners at which the faces of a polyhedron have fewer than three directions: how many, for
    `collected`.

    starts, cell_faces: faces of each polyhedron, which are rows of (offsets, nodes).
    """
    n = 0
    n_faces = offsets.size - 1
    normal = np.zeros((n_faces, 3))
    for f in range(n_faces):
        o = nodes[offsets[f]]
        for i in range(offsets[f] + 1, offsets[f + 1] - 1):
            p, q = nodes[i], nodes[i + 1]
            ux, uy, uz = points[p, 0] - points[o, 0], points[p, 1] - points[o, 1], points[p, 2] - points[o, 2]
            vx, vy, vz = points[q, 0] - points[o, 0], points[q, 1] - points[o, 1], points[q, 2] - points[o, 2]
            normal[f, 0] += uy * vz - uz * vy
            normal[f, 1] += uz * vx - ux * vz
            normal[f, 2] += ux * vy - uy * vx
        length = np.sqrt(normal[f, 0] ** 2 + normal[f, 1] ** 2 + normal[f, 2] ** 2)
        for d in range(3):
            normal[f, d] /= length
    # per point, of the cell at hand: rank so far, the first normal, and the normal of the plane of the first two
    seen = np.full(points.shape[0], -1)
    rank = np.zeros(points.shape[0], np.int8)
    one, plane = np.empty((points.shape[0], 3)), np.empty((points.shape[0], 3))
    for c in range(starts.size - 1):
        for i in range(starts[c], starts[c + 1]):
            f = cell_faces[i]
            x, y, z = normal[f, 0], normal[f, 1], normal[f, 2]
            for k in range(offsets[f], offsets[f + 1]):
                p = nodes[k]
                if seen[p] != c:
                    seen[p] = c
                    rank[p] = 1
                    one[p, 0], one[p, 1], one[p, 2] = x, y, z
                if not np.isfinite(x + y + z):
                    rank[p] = 3  # a face without area says nothing
                elif rank[p] == 1:
                    sx = one[p, 1] * z - one[p, 2] * y
                    sy = one[p, 2] * x - one[p, 0] * z
                    sz = one[p, 0] * y - one[p, 1] * x
                    sine = np.sqrt(sx * sx + sy * sy + sz * sz)
                    if not sine <= _STRAIGHT:
                        rank[p] = 2
                        plane[p, 0], plane[p, 1], plane[p, 2] = sx / sine, sy / sine, sz / sine
                elif rank[p] == 2:
                    out = plane[p, 0] * x + plane[p, 1] * y + plane[p, 2] * z
                    if not abs(out) <= _STRAIGHT:
                        rank[p] = 3
        for i in range(starts[c], starts[c + 1]):
            f = cell_faces[i]
            for k in range(offsets[f], offsets[f + 1]):
                p = nodes[k]
                if rank[p] < 3 and seen[p] == c:
                    seen[p] = -1
                    if n < at.size:
                        at[n], of[n] = p, c
                    n += 1
    return n
