"""A tree of boxes around triangles: the nearest one to a point, and those whose boxes meet.

The triangles stand along a space-filling curve, leaves of a few of them in a row, and the tree above is the complete
binary one: the children of node i are 2i + 1 and 2i + 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.audit.parallel import in_parallel
from meshwright.repair.curve import along_curve
from meshwright.repair.sliding import closest_on

__all__ = ["Tree"]

_LEAF = 4
_PIECE = 4096
"""Points that a thread takes at a time."""


@dataclass(frozen=True, eq=False)
class Tree:
    """corners (m, 9) of the triangles; order (m,): their rows along the curve; boxes (nodes, 6): low, high."""

    corners: Floats
    order: Ints
    boxes: Floats

    @classmethod
    def of(cls, points: Floats, tris: Ints) -> Tree:
        """The tree of triangles (m, 3) of points (n, 3)."""
        corners = np.ascontiguousarray(points[tris].reshape(-1, 9))
        x = corners.reshape(-1, 3, 3)
        low, high = x.min(axis=1), x.max(axis=1)
        order = along_curve(0.5 * (low + high))
        leaves = 1
        while leaves * _LEAF < len(order):
            leaves *= 2
        boxes = np.empty((2 * leaves - 1, 6))
        boxes[:, :3], boxes[:, 3:] = np.inf, -np.inf
        leaf = leaves - 1 + np.arange(len(order)) // _LEAF
        np.minimum.at(boxes[:, :3], leaf, low[order])
        np.maximum.at(boxes[:, 3:], leaf, high[order])
        while leaves > 1:
            leaves //= 2
            at = leaves - 1 + np.arange(leaves)
            boxes[at, :3] = np.minimum(boxes[2 * at + 1, :3], boxes[2 * at + 2, :3])
            boxes[at, 3:] = np.maximum(boxes[2 * at + 1, 3:], boxes[2 * at + 2, 3:])
        return cls(corners, order, boxes)

    def nearest(self, points: Floats) -> tuple[Floats, Ints]:
        """(distance, triangle) of the nearest triangle to each of points (n, 3); inf and -1 where there is none."""
        away, which = np.full(len(points), np.inf), np.full(len(points), -1, np.int64)
        if not len(self.order):
            return away, which
        where = np.ascontiguousarray(points, dtype=np.float64)

        def one(start: int) -> None:
            _nearest(self.corners, self.order, self.boxes, where, start, min(start + _PIECE, len(where)), away, which)

        for _ in in_parallel(one, list(range(0, len(where), _PIECE))):
            pass
        return away, which

    def meeting(self) -> Ints:
        """(k, 2) pairs of triangles whose boxes meet, the smaller row first."""
        if not len(self.order):
            return np.empty((0, 2), np.int64)
        count = _meeting(self.corners, self.order, self.boxes, np.empty((0, 2), np.int64))
        pairs = np.empty((count, 2), np.int64)
        _meeting(self.corners, self.order, self.boxes, pairs)
        return pairs


@inner
def _gap(boxes: Floats, i: int, x: float, y: float, z: float) -> float:
    """Squared distance of a point to box i."""
    dx = max(boxes[i, 0] - x, 0.0, x - boxes[i, 3])
    dy = max(boxes[i, 1] - y, 0.0, y - boxes[i, 4])
    dz = max(boxes[i, 2] - z, 0.0, z - boxes[i, 5])
    return dx * dx + dy * dy + dz * dz


@kernel
def _nearest(
    corners: Floats, order: Ints, boxes: Floats, points: Floats, start: int, stop: int, away: Floats, which: Ints
) -> None:
    first = boxes.shape[0] // 2  # of the leaves
    stack = np.empty(128, np.int64)
    for p in range(start, stop):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        best, at = np.inf, -1
        stack[0] = 0
        top = 1
        while top:
            top -= 1
            i = stack[top]
            if _gap(boxes, i, x, y, z) >= best:
                continue
            if i >= first:
                begin = (i - first) * _LEAF
                for k in range(begin, min(begin + _LEAF, order.size)):
                    d = closest_on(corners, order[k], x, y, z)[3]
                    if d < best or (d == best and order[k] < at):
                        best, at = d, order[k]
            else:
                a, b = 2 * i + 1, 2 * i + 2
                if _gap(boxes, a, x, y, z) < _gap(boxes, b, x, y, z):
                    a, b = b, a
                stack[top], stack[top + 1] = a, b
                top += 2
        away[p], which[p] = np.sqrt(best), at


@inner
def _box_of(corners: Floats, t: int, out: Floats) -> None:
    for k in range(3):
        a, b, c = corners[t, k], corners[t, 3 + k], corners[t, 6 + k]
        out[k], out[3 + k] = min(a, b, c), max(a, b, c)


@kernel
def _meeting(corners: Floats, order: Ints, boxes: Floats, pairs: Ints) -> int:
    """Write the pairs as far as there is room; their number."""
    first = boxes.shape[0] // 2
    stack = np.empty(128, np.int64)
    mine, other = np.empty(6), np.empty(6)
    n = 0
    for t in range(corners.shape[0]):
        _box_of(corners, t, mine)
        stack[0] = 0
        top = 1
        while top:
            top -= 1
            i = stack[top]
            apart = False
            for k in range(3):
                apart = apart or boxes[i, k] > mine[3 + k] or boxes[i, 3 + k] < mine[k]
            if apart:
                continue
            if i < first:
                stack[top], stack[top + 1] = 2 * i + 1, 2 * i + 2
                top += 2
                continue
            begin = (i - first) * _LEAF
            for j in range(begin, min(begin + _LEAF, order.size)):
                u = order[j]
                if u <= t:
                    continue
                _box_of(corners, u, other)
                apart = False
                for k in range(3):
                    apart = apart or other[k] > mine[3 + k] or other[3 + k] < mine[k]
                if not apart:
                    if n < pairs.shape[0]:
                        pairs[n, 0], pairs[n, 1] = t, u
                    n += 1
    return n
