"""A tree of boxes around triangles: the nearest one to a point, and those whose boxes meet.

The triangles are halved again and again across the longest side of what their centres span, down to leaves of a few in
a row, so that the tree is the complete binary one: the children of node i are 2i + 1 and 2i + 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.audit.parallel import in_parallel
from meshwright.repair.sliding import closest_on

__all__ = ["Tree"]

_LEAF = 4
_SAMPLE = 32
"""Every so many points are looked at first where only the furthest one is asked for."""
_PIECE = 4096
"""Points that a thread takes at a time."""


@dataclass(frozen=True, eq=False)
class Tree:
    """corners (m, 9) of the triangles; order (m,): their rows, leaf by leaf; boxes (nodes, 6): low, high."""

    corners: Floats
    order: Ints
    boxes: Floats

    @classmethod
    def of(cls, points: Floats, tris: Ints) -> Tree:
        """The tree of triangles (m, 3) of points (n, 3)."""
        corners = np.ascontiguousarray(points[tris].reshape(-1, 9))
        x = corners.reshape(-1, 3, 3)
        low, high = x.min(axis=1), x.max(axis=1)
        leaves = 1
        while leaves * _LEAF < len(corners):
            leaves *= 2
        order = _halved(0.5 * (low + high), leaves)
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
        if len(self.order):
            self._find(points, np.arange(len(points)), -1.0, away, which)
        return away, which

    def furthest(self, points: Floats) -> tuple[float, int]:
        """(distance, row) of the one of points (n, 3), n > 0, that is furthest from its nearest triangle.

        Faster than `nearest`: a point need not be followed once a triangle is nearer than another point is far.
        """
        away, which = np.full(len(points), np.inf), np.full(len(points), -1, np.int64)
        if len(self.order):
            # every so many first: they tell the others how far is far
            first = np.arange(0, len(points), _SAMPLE)
            self._find(points, first, -1.0, away, which)
            rest = np.flatnonzero(which < 0)
            self._find(points, rest, float(away[first].max()) ** 2 * (1.0 - 1e-12), away, which)
        at = int(np.argmax(away))
        return float(away[at]), at

    def _find(self, points: Floats, rows: Ints, enough: float, away: Floats, which: Ints) -> None:
        """Fill in what belongs to these points; a squared distance up to `enough` need not be the smallest."""
        where = np.ascontiguousarray(points, dtype=np.float64)

        def one(start: int) -> None:
            _nearest(self.corners, self.order, self.boxes, where, rows[start : start + _PIECE], enough, away, which)

        for _ in in_parallel(one, list(range(0, len(rows), _PIECE))):
            pass

    def meeting(self) -> Ints:
        """(k, 2) pairs of triangles whose boxes meet, the smaller row first."""
        if not len(self.order):
            return np.empty((0, 2), np.int64)
        count = _meeting(self.corners, self.order, self.boxes, np.empty((0, 2), np.int64))
        pairs = np.empty((count, 2), np.int64)
        _meeting(self.corners, self.order, self.boxes, pairs)
        return pairs


@kernel
def _halved(centres: Floats, leaves: int) -> Ints:
    """The rows of the centres (m, 3) in an order in which every node of the tree is halved across its longest side."""
    order = np.arange(centres.shape[0])
    begin, count = np.empty(64, np.int64), np.empty(64, np.int64)
    begin[0], count[0] = 0, leaves
    top = 1
    while top:
        top -= 1
        first, n = begin[top], count[top]
        last = min(first + n * _LEAF, order.size)
        middle = first + n // 2 * _LEAF
        if n == 1 or middle >= last:
            if n > 1:
                begin[top], count[top] = first, n // 2
                top += 1
            continue
        axis, widest = 0, -1.0
        for a in range(3):
            low, high = np.inf, -np.inf
            for i in range(first, last):
                low, high = min(low, centres[order[i], a]), max(high, centres[order[i], a])
            if high - low > widest:
                axis, widest = a, high - low
        _select(centres, order, first, last - 1, middle, axis)
        begin[top], count[top] = first, n // 2
        begin[top + 1], count[top + 1] = middle, n // 2
        top += 2
    return order


@inner
def _select(centres: Floats, order: Ints, low: int, high: int, middle: int, axis: int) -> None:
    """Hoare's selection: what stands before `middle` in order[low : high + 1] is then not beyond what stands there."""
    while low < high:
        pivot = centres[order[(low + high) // 2], axis]
        i, j = low, high
        while i <= j:
            while centres[order[i], axis] < pivot:
                i += 1
            while centres[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@inner
def _gap(boxes: Floats, i: int, x: float, y: float, z: float) -> float:
    """Squared distance of a point to box i."""
    dx = max(boxes[i, 0] - x, 0.0, x - boxes[i, 3])
    dy = max(boxes[i, 1] - y, 0.0, y - boxes[i, 4])
    dz = max(boxes[i, 2] - z, 0.0, z - boxes[i, 5])
    return dx * dx + dy * dy + dz * dz


@kernel
def _nearest(
    corners: Floats, order: Ints, boxes: Floats, points: Floats, rows: Ints, enough: float, away: Floats, which: Ints
) -> None:
    first = boxes.shape[0] // 2  # of the leaves
    stack = np.empty(128, np.int64)
    for p in rows:
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        best, at = np.inf, -1
        stack[0] = 0
        top = 1
        while top and best > enough:
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
