"""Removal of edges that lie in a flat part of the boundary: the 2-2 swap, and the same with more tets at the edge.

Two boundary faces in one plane with the edge a-b between them are the halves of a flat quadrilateral a, c, b, d. A tet
of these four points has no volume, and with it the ring of tets around the edge is closed: the edge can be removed like
one inside, and the quadrilateral is halved the other way. Only edges with a point that may slide are removed: all
boundary faces around such a point are in one plane, or in one smooth piece, and in one zone.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.tet_rings import LARGEST_RING, without_edge
from meshwright.repair.tet_swaps import outward, rate_again
from meshwright.repair.tet_topology import replace_cavity

__all__ = ["flip"]

_FLAT = 1e-9
"""Sine of the angle between two faces up to which they are in one plane: the volume must not change."""


@inner
def _open_ring(
    tets: Ints, across: Ints, t: int, f: int, a: int, b: int, c: int, ring: Ints, around: Ints
) -> int:  # fmt: skip
    """Number of points of the ring around a-b from c, the third point of the boundary face f of tet t, to the other
    boundary face; 0 where it is too long or comes back. ring[i], ring[i + 1], a, b: the points of tet around[i]."""
    ring[0] = c
    n = 0
    while n + 2 <= LARGEST_RING:
        around[n] = t
        d = -1
        out = -1
        for k in range(4):
            v = tets[t, k]
            if v == ring[n]:
                out = k
            elif v != a and v != b:
                d = v
        n += 1
        ring[n] = d
        o = across[t, out]
        if o < 0:
            return n + 1
        t = o // 4
    return 0


@inner
def _in_plane(points: Floats, a: int, b: int, c: int, d: int) -> bool:
    """Whether the triangles a, b, c and a, b, d lie in one plane, on both sides of a-b."""
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    wx, wy, wz = points[d, 0] - points[a, 0], points[d, 1] - points[a, 1], points[d, 2] - points[a, 2]
    mx, my, mz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
    sizes = (mx * mx + my * my + mz * mz) * (nx * nx + ny * ny + nz * nz)
    if not mx * nx + my * ny + mz * nz < 0.0:
        return False
    det = mx * wx + my * wy + mz * wz
    return abs(det) * math.sqrt(ux * ux + uy * uy + uz * uz) <= _FLAT * math.sqrt(sizes)


@kernel
def flip(
    points: Floats, tets: Ints, across: Ints, origin: Ints, fit: Floats, free: Ints, least: Floats, seat: Ints,
    below: float, by_fitness: bool, floor: float, give: float,
) -> int:  # fmt: skip
    """One sweep over the boundary faces of tets with a fitness under `below`; the number of edges removed.

    seat (n,): below 0 for points that may not slide. The rest as of `tet_swaps.swap`.
    """
    ring = np.empty(LARGEST_RING + 1, np.int64)
    old = np.empty(64, np.int64)
    new = np.empty((64, 4), np.int64)
    rim = np.empty((128, 4), np.int64)
    table = np.empty((LARGEST_RING, LARGEST_RING))
    pick = np.empty((LARGEST_RING, LARGEST_RING), np.int64)
    stack = np.empty((64, 2), np.int64)
    made = 0
    for t in range(tets.shape[0]):
        if tets[t, 0] < 0 or not fit[t] < below:
            continue
        done = False
        for f in range(4):
            if done or across[t, f] >= 0:
                continue
            face = outward(tets, t, f)
            for k in range(3):
                # the face looks outward: with the apex behind c, the tet b, a, c, apex is the positive one
                b, a, c = face[k], face[(k + 1) % 3], face[(k + 2) % 3]
                if seat[a] < 0 and seat[b] < 0:
                    continue
                m = _open_ring(tets, across, t, f, a, b, c, ring, old)
                # a tet alone at an edge of a flat part has no volume: there is nothing to halve
                if m < 3 or not _in_plane(points, a, b, c, ring[m - 1]):
                    continue
                n = without_edge(
                    points,
                    tets,
                    fit,
                    a,
                    b,
                    ring,
                    m,
                    old,
                    m - 1,
                    least,
                    by_fitness,
                    floor,
                    give,
                    table,
                    pick,
                    new,
                    stack,
                )
                if not n:
                    continue
                if replace_cavity(tets, across, old, m - 1, new, n, free, rim, origin):
                    rate_again(points, fit, old, m - 1, new, n)
                    made += 1
                    done = True
                    break
    return made
