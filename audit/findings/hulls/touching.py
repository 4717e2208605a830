"""Kernels on points and facets of a hull: which points touch a facet that is not theirs, which corners agree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.hulls.boxes import boxes_around
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["MOST", "ROUNDING", "TIGHT", "compare", "facing", "find_touches", "seeds"]

_SPOKE = 1e-6

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

TIGHT = 1e-4
"""Facets of one part touch within this much of their shortest edge: closer than any wall that someone would mesh."""
ROUNDING = 2e-7
"""Or within this much of the whole hull: single precision is no better."""
MOST = 1e-3
"""But never beyond this much of their shortest edge."""

_FACING = 0.8
"""Two facets face each other when their normals are within 37 degrees of opposite; edges of a rim, of parallel."""


@inner
def facing(x: Floats, offsets: Ints, nodes: Ints, normal: Floats, rim: bool, f: int, g: int) -> bool:
    """Whether facets f and g look at each other; edges of a rim, whether they run alongside."""
    if not rim:
        dot = normal[f, 0] * normal[g, 0] + normal[f, 1] * normal[g, 1] + normal[f, 2] * normal[g, 2]
        return dot < -_FACING
    a, b = nodes[offsets[f]], nodes[offsets[f] + 1]
    c, d = nodes[offsets[g]], nodes[offsets[g] + 1]
    uv = uu = vv = 0.0
    for k in range(3):
        u, v = x[b, k] - x[a, k], x[d, k] - x[c, k]
        uv += u * v
        uu += u * u
        vv += v * v
    return uv * uv > _FACING * _FACING * uu * vv


@inner
def _has(nodes: Ints, first: int, last: int, p: int) -> bool:
    found = False
    for i in range(first, last):
        found |= nodes[i] == p
    return found


@inner
def _distance(x: Floats, offsets: Ints, nodes: Ints, centre: Floats, p: int, g: int) -> float:
    """From point p to facet g, an edge or a fan of triangles about its centre: to their planes over them, else to the
    edges around."""
    px, py, pz = x[p, 0], x[p, 1], x[p, 2]
    ox, oy, oz = centre[g, 0], centre[g, 1], centre[g, 2]
    first, last = offsets[g], offsets[g + 1]
    best = np.inf
    a = nodes[last - 1]
    for i in range(first, last):
        b = nodes[i]
        ex, ey, ez = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        dx, dy, dz = px - x[a, 0], py - x[a, 1], pz - x[a, 2]
        ee = ex * ex + ey * ey + ez * ez
        t = min(max((dx * ex + dy * ey + dz * ez) / ee, 0.0), 1.0) if ee > 0.0 else 0.0
        best = min(best, (dx - t * ex) ** 2 + (dy - t * ey) ** 2 + (dz - t * ez) ** 2)
        if last - first > 2:
            ux, uy, uz = x[a, 0] - ox, x[a, 1] - oy, x[a, 2] - oz
            vx, vy, vz = x[b, 0] - ox, x[b, 1] - oy, x[b, 2] - oz
            wx, wy, wz = px - ox, py - oy, pz - oz
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            nn = nx * nx + ny * ny + nz * nz
            s = (wy * vz - wz * vy) * nx + (wz * vx - wx * vz) * ny + (wx * vy - wy * vx) * nz
            t = (uy * wz - uz * wy) * nx + (uz * wx - ux * wz) * ny + (ux * wy - uy * wx) * nz
            # two triangles of the fan meet in a spoke, which neither may miss
            if nn > 0.0 and s >= -_SPOKE * nn and t >= -_SPOKE * nn and s + t <= nn:
                height = wx * nx + wy * ny + wz * nz
                best = min(best, height * height / nn)
        a = b
    return np.sqrt(best)


@kernel
def find_touches(
    x: Floats,
    reach: Floats,
    visit: Ints,
    offsets: Ints,
    nodes: Ints,
    centre: Floats,
    normal: Floats,
    size: Floats,
    starts: Ints,
    around: Ints,
    order: Ints,
    boxes: Floats,
    heap: Floats,
    rim: bool,
    most: float,
    points: Ints,
    facets: Ints,
    distances: Floats,
) -> int:
    """Points within `most` times the local size of a facet that faces one of theirs: how many, for `collected`.

    visit: the points in an order in which neighbours come one after the other.
    """
    n = 0
    near = np.empty(256, np.int32)
    for p in visit:
        if not reach[p] < np.inf:
            continue
        near, count = boxes_around(boxes, heap, x[p], most * reach[p], near)
        for i in range(count):
            g = order[near[i]]
            if _has(nodes, offsets[g], offsets[g + 1], p):
                continue
            faced = False
            for j in range(starts[p], starts[p + 1]):
                if facing(x, offsets, nodes, normal, rim, around[j], g):
                    faced = True
                    break
            if not faced:
                continue
            distance = _distance(x, offsets, nodes, centre, p, g)
            if not distance <= most * min(size[g], reach[p]):
                continue
            if n < points.size:
                points[n], facets[n], distances[n] = p, g, distance
            n += 1
    return n


@kernel
def seeds(
    points: Ints,
    facets: Ints,
    distances: Floats,
    x: Floats,
    reach: Floats,
    offsets: Ints,
    nodes: Ints,
    normal: Floats,
    size: Floats,
    starts: Ints,
    around: Ints,
    part: Ints,
    rim: bool,
) -> Bools:
    """(m,) facets that touch: closely (see TIGHT), or, of two parts of a mesh, at all."""
    out = np.zeros(size.size, np.bool_)
    for t in range(points.size):
        p, g = points[t], facets[t]
        local = min(size[g], reach[p])
        close = distances[t] <= min(MOST * local, max(TIGHT * local, ROUNDING))
        for j in range(starts[p], starts[p + 1]):
            f = around[j]
            if (close or (part[f] != part[g] and not rim)) and facing(x, offsets, nodes, normal, rim, f, g):
                out[f] = True
                out[g] = True
    return out


@kernel
def compare(
    first: Ints,
    second: Ints,
    x: Floats,
    offsets: Ints,
    nodes: Ints,
    centre: Floats,
    within: Floats,
    same: Bools,
    sharing: Bools,
    points: Ints,
    facets: Ints,
) -> int:
    """(points, facets) of the corners of one facet of a pair that lie inside the other, not at its corners: how many,
    for `collected`.

    within (n,): how far apart the facets of a pair may be.  Filled: same (n,), all corners of both
    in common or in one place; sharing (n,), some corner in common.
    """
    n = 0
    for i in range(first.size):
        all_same = offsets[first[i] + 1] - offsets[first[i]] == offsets[second[i] + 1] - offsets[second[i]]
        limit = within[i]
        for turn in range(2):
            f, g = (first[i], second[i]) if turn == 0 else (second[i], first[i])
            for k in range(offsets[f], offsets[f + 1]):
                p = nodes[k]
                if _has(nodes, offsets[g], offsets[g + 1], p):
                    sharing[i] = True
                    continue
                nearest = np.inf
                for j in range(offsets[g], offsets[g + 1]):
                    square = 0.0
                    for d in range(3):
                        square += (x[p, d] - x[nodes[j], d]) ** 2
                    nearest = min(nearest, square)
                if nearest <= limit * limit:
                    continue
                all_same = False
                if _distance(x, offsets, nodes, centre, p, g) <= limit:
                    if n < points.size:
                        points[n], facets[n] = p, g
                    n += 1
        same[i] = all_same
    return n
