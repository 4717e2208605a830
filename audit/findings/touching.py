"""Kernels on points and facets of a hull: which points touch a facet that is not theirs, which corners agree."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.boxes import boxes_near
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["MOST", "ROUNDING", "TIGHT", "compare", "facing", "find_touches", "seeds"]

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
def _square_to_segment(p: Floats, a: Floats, b: Floats) -> float:
    """Square of the distance from p to the segment a b."""
    along = length = 0.0
    for d in range(3):
        along += (p[d] - a[d]) * (b[d] - a[d])
        length += (b[d] - a[d]) ** 2
    t = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    square = 0.0
    for d in range(3):
        square += (p[d] - a[d] - t * (b[d] - a[d])) ** 2
    return square


@inner
def _square_to_triangle(p: Floats, a: Floats, b: Floats, c: Floats) -> float:
    """Square of the distance from p to the triangle a b c: to its plane over the triangle, else to its nearest edge."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nn = nx * nx + ny * ny + nz * nz
    if nn > 0.0:
        s = ((wy * vz - wz * vy) * nx + (wz * vx - wx * vz) * ny + (wx * vy - wy * vx) * nz) / nn
        t = ((uy * wz - uz * wy) * nx + (uz * wx - ux * wz) * ny + (ux * wy - uy * wx) * nz) / nn
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
            h = wx * nx + wy * ny + wz * nz
            return h * h / nn
    return min(_square_to_segment(p, a, b), _square_to_segment(p, b, c), _square_to_segment(p, c, a))


@inner
def _distance(x: Floats, offsets: Ints, nodes: Ints, centre: Floats, p: int, g: int) -> float:
    """From point p to facet g, which is a segment, a triangle, or a fan of triangles about its centre."""
    first, last = offsets[g], offsets[g + 1]
    n = last - first
    if n == 2:
        return np.sqrt(_square_to_segment(x[p], x[nodes[first]], x[nodes[first + 1]]))
    if n == 3:
        return np.sqrt(_square_to_triangle(x[p], x[nodes[first]], x[nodes[first + 1]], x[nodes[first + 2]]))
    best = np.inf
    a = nodes[last - 1]
    for i in range(first, last):
        b = nodes[i]
        best = min(best, _square_to_triangle(x[p], centre[g], x[a], x[b]))
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
) -> tuple[Ints, Ints, Floats]:
    """(points, facets, distances): points within `most` times the local size of a facet that faces one of theirs.

    visit: the points in an order in which neighbours come one after the other.
    """
    n = 0
    points, facets, distances = np.empty(64, np.int32), np.empty(64, np.int32), np.empty(64)
    near = np.empty(256, np.int32)
    box = np.empty(6)
    for p in visit:
        if not reach[p] < np.inf:
            continue
        margin = most * reach[p]
        for d in range(3):
            box[d], box[3 + d] = x[p, d] - margin, x[p, d] + margin
        count = boxes_near(boxes, heap, box, near)
        if count > near.size:
            near = np.empty(2 * count, np.int32)
            count = boxes_near(boxes, heap, box, near)
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
            if n == points.size:
                points = np.append(points, points)
                facets = np.append(facets, facets)
                distances = np.append(distances, distances)
            points[n], facets[n], distances[n] = p, g, distance
            n += 1
    return points[:n], facets[:n], distances[:n]


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
) -> tuple[Ints, Ints]:
    """(points, facets) of the corners of one facet of a pair that lie inside the other, not at its corners.

    within (n,): how far apart the facets of a pair may be.  Filled: same (n,), all corners of both
    in common or in one place; sharing (n,), some corner in common.
    """
    n = 0
    points, facets = np.empty(64, np.int32), np.empty(64, np.int32)
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
                    if n == points.size:
                        points, facets = np.append(points, points), np.append(facets, facets)
                    points[n], facets[n] = p, g
                    n += 1
        same[i] = all_same
    return points[:n], facets[:n]
