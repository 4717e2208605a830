"""The rigid motion that takes one surface onto another: guesses from their shape, the best of all, its axis."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.hulls.boxes import boxes_near
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints

__all__ = ["Motion", "best_fit", "guesses", "nearest"]

Floats = NDArray[np.float64]

_STILL = 1e-7
"""Radians below which a rotation is none."""


@dataclass(frozen=True, eq=False)
class Motion:
    """x -> turn x + shift."""

    turn: Floats
    shift: Floats

    def __call__(self, x: Floats) -> Floats:
        """Move points (n, 3)."""
        moved: Floats = x @ self.turn.T + self.shift
        return moved

    @property
    def angle(self) -> float:
        """Of the rotation, radians, 0 to pi."""
        sine = 0.5 * math.hypot(*self._twist)
        return math.atan2(sine, 0.5 * (float(np.trace(self.turn)) - 1.0))

    @property
    def _twist(self) -> tuple[float, float, float]:
        r = self.turn
        return float(r[2, 1] - r[1, 2]), float(r[0, 2] - r[2, 0]), float(r[1, 0] - r[0, 1])

    @property
    def is_translation(self) -> bool:
        """Whether nothing is turned."""
        return self.angle < _STILL

    def axis(self) -> tuple[Floats, Floats, float]:
        """(direction, a point on the axis, shift along it) of a rotation."""
        twist = np.array(self._twist)
        size = float(np.linalg.norm(twist))
        if size > 1e-6:
            direction = twist / size
        else:  # half a turn: the direction is kept, R + 1 = 2 d d'
            columns = self.turn + np.eye(3)
            direction = columns[:, int(np.argmax(np.diag(columns)))]
            direction = direction / np.linalg.norm(direction)
        along = float(direction @ self.shift)
        across = self.shift - along * direction
        # (1 - R) p = across, p taken at right angles to the axis
        point = np.linalg.lstsq(np.eye(3) - self.turn, across, rcond=1e-9)[0]
        return direction, point - (point @ direction) * direction, along


def guesses(
    centres: tuple[Floats, Floats], areas: tuple[Floats, Floats], normals: tuple[Floats, Floats], *, flat: bool
) -> Iterator[Motion]:
    """Motions that take the first surface to the second, should they be alike: facets' centres, areas, normals.

    The translation; turns about the coordinate axes and about the line in which two planes meet; the turns that take
    one set of principal axes to the other.  flat: everything happens in the x-y plane.
    """
    middle = [a @ c / a.sum() for c, a in zip(centres, areas, strict=True)]
    ahead = [a @ n for n, a in zip(normals, areas, strict=True)]
    turns = [np.eye(3)]
    directions = [np.eye(3)[2]] if flat else [*np.eye(3), np.cross(ahead[0], -ahead[1])]
    for direction in directions:
        length = float(np.linalg.norm(direction))
        if length > 0.0:
            turns += _turn_about(direction / length, ahead[0], -ahead[1])
    spreads = [((c - m) * a[:, None]).T @ (c - m) / a.sum() for c, a, m in zip(centres, areas, middle, strict=True)]
    frames = [np.linalg.eigh(spread)[1] for spread in spreads]
    for signs in itertools.product((1.0, -1.0), repeat=3):
        turn = frames[1] @ np.diag(signs) @ frames[0].T
        if np.linalg.det(turn) > 0.0:
            turns.append(turn)
    for turn in turns:
        yield Motion(turn, middle[1] - turn @ middle[0])


def _turn_about(axis: Floats, start: Floats, end: Floats) -> list[Floats]:
    """The turn about an axis that takes one direction to another, as seen along the axis."""
    start, end = start - (start @ axis) * axis, end - (end @ axis) * axis
    if not start @ start > 0.0 or not end @ end > 0.0:
        return []
    sine, cosine = float(axis @ np.cross(start, end)), float(start @ end)
    size = math.hypot(sine, cosine)
    sine, cosine = sine / size, cosine / size
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return [cosine * np.eye(3) + sine * cross + (1.0 - cosine) * np.outer(axis, axis)]


def best_fit(start: Floats, end: Floats, weights: Floats) -> Motion:
    """The motion that takes points (n, 3) to others with the least sum of squares (Kabsch 1976)."""
    total = weights.sum()
    a, b = weights @ start / total, weights @ end / total
    u, _, v = np.linalg.svd(((end - b) * weights[:, None]).T @ (start - a))
    turn = u @ np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ v)))]) @ v
    return Motion(turn, b - turn @ a)


@kernel
def nearest(x: Floats, reach: Floats, order: Ints, boxes: Floats, heap: Floats) -> tuple[Ints, Floats]:
    """(which, distance): the nearest of the points in a tree to each of x (n, 3), within reach (n,); else -1, inf."""
    which, distance = np.full(reach.size, -1), np.full(reach.size, np.inf)
    near = np.empty(256, np.int32)
    box = np.empty(6)
    for i in range(reach.size):
        for d in range(3):
            box[d], box[3 + d] = x[i, d] - reach[i], x[i, d] + reach[i]
        count = boxes_near(boxes, heap, box, near)
        if count > near.size:
            near = np.empty(2 * count, np.int32)
            count = boxes_near(boxes, heap, box, near)
        best = reach[i] * reach[i]
        for k in range(count):
            square = 0.0
            for d in range(3):
                square += (x[i, d] - boxes[near[k], d]) ** 2
            if square < best or (square == best and (which[i] < 0 or order[near[k]] < which[i])):
                best = square
                which[i] = order[near[k]]
                distance[i] = np.sqrt(square)
    return which, distance
