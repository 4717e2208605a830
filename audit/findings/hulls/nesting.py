"""Which closed pieces of a surface lie inside which others."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.hulls.boxes import box_tree, boxes_near
from meshwright.audit.findings.hulls.collect import collected
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["nesting"]

Floats = NDArray[np.float64]


def nesting(
    points: Floats,
    offsets: Ints,
    nodes: Ints,
    corners: Ints,
    shell: Ints,
    whole: NDArray[np.bool_],
    low: Floats,
    high: Floats,
) -> tuple[Ints, Ints]:
    """(inside, depth) of `Shells`: how often a ray upward from a corner of a piece crosses each of the others."""
    n = len(whole)
    inside, depth = np.full(n, -1), np.zeros(n, np.int64)
    sound = whole & np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
    pieces = np.flatnonzero(sound)
    if len(pieces) < 2:
        return inside, depth
    tree = box_tree(low[pieces], high[pieces])
    holders = _holders(low[pieces], high[pieces], tree.order, tree.boxes, tree.nodes)
    if not holders.any():
        return inside, depth
    cells = np.flatnonzero(sound[shell])
    cell_low, cell_high = _cell_boxes(points, offsets, nodes, corners, cells)
    tree = box_tree(cell_low, cell_high)
    first = np.unique(shell, return_index=True)[1]
    size = np.prod(high - low, axis=1)
    for k in pieces[holders].tolist():
        start = int(nodes[offsets[first[k]]])
        table = (points, offsets, nodes, corners, shell, cells, start, tree.order, tree.boxes, tree.nodes)
        (crossed,) = collected(partial(_crossings, *table), np.int32)
        around, times = np.unique(crossed[crossed != k], return_counts=True)
        around = around[times % 2 == 1]
        depth[k] = len(around)
        if len(around):
            inside[k] = around[np.argmin(size[around])]
    return inside, depth


@kernel
def _holders(low: Floats, high: Floats, order: Ints, boxes: Floats, heap: Floats) -> NDArray[np.bool_]:
    """(m,) whether the box of a piece lies strictly inside that of another."""
    out = np.zeros(low.shape[0], np.bool_)
    near = np.empty(256, np.int32)
    box = np.empty(6)
    for s in range(out.size):
        for d in range(3):
            box[d] = box[3 + d] = low[s, d]
        count = boxes_near(boxes, heap, box, near)
        if count > near.size:
            near = np.empty(2 * count, np.int32)
            count = boxes_near(boxes, heap, box, near)
        for i in range(count):
            t = order[near[i]]
            held = t != s
            for d in range(3):
                held &= low[t, d] < low[s, d] and high[s, d] < high[t, d]
            out[s] |= held
    return out


@kernel
def _cell_boxes(points: Floats, offsets: Ints, nodes: Ints, corners: Ints, cells: Ints) -> tuple[Floats, Floats]:
    low, high = np.full((cells.size, 3), np.inf), np.full((cells.size, 3), -np.inf)
    for i in range(cells.size):
        c = cells[i]
        for k in range(offsets[c], offsets[c] + corners[c]):
            for d in range(3):
                low[i, d] = min(low[i, d], points[nodes[k], d])
                high[i, d] = max(high[i, d], points[nodes[k], d])
    return low, high


@inner
def _left(points: Floats, a: int, b: int, x: float, y: float) -> float:
    """Which side of the line a b, seen from above, a place is on; exactly opposite for b a."""
    if a > b:
        return -_left_ordered(points, b, a, x, y)
    return _left_ordered(points, a, b, x, y)


@inner
def _left_ordered(points: Floats, a: int, b: int, x: float, y: float) -> float:
    ax, ay = points[a, 0] - x, points[a, 1] - y
    bx, by = points[b, 0] - x, points[b, 1] - y
    return ax * by - ay * bx


@kernel
def _crossings(
    points: Floats,
    offsets: Ints,
    nodes: Ints,
    corners: Ints,
    shell: Ints,
    cells: Ints,
    start: int,
    order: Ints,
    boxes: Floats,
    heap: Floats,
    out: Ints,
) -> int:
    """Pieces that the ray from point `start` towards +z crosses, once for each triangle it goes through: how many, for
    `collected`.

    The number of times an edge winds past the ray is counted by half-open intervals of y, so that a ray through an
    edge or a corner goes through one of the triangles beside it.
    """
    x, y, z = points[start, 0], points[start, 1], points[start, 2]
    box = np.array([x, y, z, x, y, np.inf])
    near = np.empty(64, np.int32)
    count = boxes_near(boxes, heap, box, near)
    if count > near.size:
        near = np.empty(count, np.int32)
        boxes_near(boxes, heap, box, near)
    n = 0
    for i in range(count):
        c = cells[order[near[i]]]
        o = nodes[offsets[c]]
        for k in range(offsets[c] + 1, offsets[c] + corners[c] - 1):
            p, q = nodes[k], nodes[k + 1]
            winding = 0
            for e in range(3):
                a, b = (o, p) if e == 0 else (p, q) if e == 1 else (q, o)
                below_a, below_b = points[a, 1] <= y, points[b, 1] <= y
                if below_a == below_b:
                    continue
                side = _left(points, a, b, x, y)
                if below_a and side > 0.0:
                    winding += 1
                elif below_b and side < 0.0:
                    winding -= 1
            if winding == 0:
                continue
            ux, uy, uz = points[p, 0] - points[o, 0], points[p, 1] - points[o, 1], points[p, 2] - points[o, 2]
            vx, vy, vz = points[q, 0] - points[o, 0], points[q, 1] - points[o, 1], points[q, 2] - points[o, 2]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            height = (points[o, 0] - x) * nx + (points[o, 1] - y) * ny + (points[o, 2] - z) * nz
            if (height > 0.0) == (nz > 0.0) and nz != 0.0:
                if n < out.size:
                    out[n] = shell[c]
                n += 1
    return n
