"""Where the parts of a histogram go, so that no text is cut off and no two lie on each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Labels", "Layout", "labels_for", "lanes_for", "short"]

_WIDE = 0.62
"""Width of a character of figures, in units of the height of the text; fonts differ, this is a wide one."""

_TURN = math.sqrt(0.5)
_GAP = 8.0
_MOST_DECADES = 8


def short(n: int) -> str:
    """A count in few characters, never more than it is: "999", "12.3k", "1M"."""
    for unit, letter in ((10**12, "T"), (10**9, "G"), (10**6, "M"), (10**3, "k")):
        if n >= unit:
            whole = n // unit
            digits = max(0, 3 - len(str(whole)))
            part = str(n % unit * 10**digits // unit).zfill(digits).rstrip("0") if digits else ""
            return f"{whole}.{part}{letter}" if part else f"{whole}{letter}"
    return str(n)


@dataclass(frozen=True)
class Labels:
    """Rows of bin labels.  turned: by 45 degrees.  every: how many bins stand between two that are shown.

    depths: height that each row takes.  reach: how far the first label reaches to the left of the middle of its bin.
    """

    rows: list[list[str]]
    turned: bool
    every: int
    depths: list[float]
    reach: float


def labels_for(rows: list[list[str]], width: int, size: int) -> Labels:
    """How rows of labels fit under bars of a picture that wide: level, else turned, else turned with some left out."""
    n = len(rows[0])
    step = (width - 5 * size) / n
    longest = max(len(text) for row in rows for text in row) * _WIDE * size
    if longest + 0.5 * size <= step:
        return Labels(rows, turned=False, every=1, depths=[size + 3.0 for _ in rows], reach=longest / 2)
    every = max(1, math.ceil(1.25 * size / _TURN / step))
    depths = [(max(map(len, row)) * _WIDE + 1) * size * _TURN + 0.75 * size for row in rows]
    reach = max(len(row[0]) for row in rows) * _WIDE * size * _TURN
    return Labels(rows, turned=True, every=every, depths=depths, reach=reach)


@dataclass(frozen=True)
class Layout:
    """The frame of the bars: left, right, top and floor in units of the view box; step: width of a bin.

    decades: exponents of the lines across; `y` is linear in the logarithm of a count.
    """

    width: int
    height: int
    size: int
    left: float
    right: float
    top: float
    floor: float
    step: float
    decades: tuple[int, ...]
    highest: float
    base: float

    @staticmethod
    def fitting(width: int, height: int, size: int, top: float, labels: Labels, most: int, base: float) -> Layout:
        """The frame that leaves room for the axis of counts, for the labels and for what stands on top."""
        highest = max(1, math.ceil(math.log10(most) - 1e-12))
        every = math.ceil(highest / _MOST_DECADES)
        decades = tuple(range(0, highest + 1, every))
        axis = max(len(short(10**decade)) for decade in decades) * _WIDE * size + _GAP
        n = len(labels.rows[0])
        left = max(axis, labels.reach - (width - axis) / n / 2 + 2)
        right = width - 6.0
        below = sum(labels.depths) + len(labels.rows) * (size + 4)
        floor = max(height - below - 2, top + 40)
        return Layout(
            width, round(max(height, floor + below + 2)), size, left, right, top, floor, (right - left) / n, decades,
            highest, base,
        )  # fmt: skip

    def x(self, k: float) -> float:
        """Left end of bin k."""
        return self.left + k * self.step

    def y(self, count: float) -> float:
        """Height of a count of 1 or more."""
        return self.floor - (self.floor - self.top) * (math.log10(count) + self.base) / (self.highest + self.base)


def lanes_for(positions: Sequence[float]) -> list[int]:
    """A line of text of its own for the label of each mark, so that near ones do not lie on each other."""
    order = sorted(range(len(positions)), key=lambda i: positions[i])
    lanes = [0] * len(positions)
    for lane, i in enumerate(order):
        lanes[i] = lane
    return lanes
