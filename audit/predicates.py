"""Exact signs of the in-circle and in-sphere determinants: rational arithmetic, for the few that floats leave open.

Shewchuk (1997), Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, has the
determinants. A finite double is a rational number, so nothing here is rounded.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

__all__ = ["in_circle", "in_sphere"]

Point = Sequence[float]


def in_circle(a: Point, b: Point, c: Point, d: Point) -> Fraction:
    """Positive when d lies inside the circle through a, b, c, negative outside, 0 on it; points in the x-y plane.

    Whichever way a, b, c turn; 0 when they lie on one line.
    """
    rows = _lifted((a, b, c), d, 2)
    turn = _minor(_less(b, a, 2), _less(c, a, 2))
    return _sign(turn) * sum(
        (rows[i][2] * _minor(rows[j], rows[k]) for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))), Fraction(0)
    )


def in_sphere(a: Point, b: Point, c: Point, d: Point, e: Point) -> Fraction:
    """Positive when e lies inside the sphere through a, b, c, d, negative outside, 0 on it.

    Whichever way a, b, c, d turn; 0 when they lie in one plane.
    """
    rows = _lifted((a, b, c, d), e, 3)
    turn = _det(_less(b, a, 3), _less(c, a, 3), _less(d, a, 3))
    total = Fraction(0)
    for i, sign in enumerate((-1, 1, -1, 1)):
        total += sign * rows[i][3] * _det(*(rows[j] for j in range(4) if j != i))
    return -_sign(turn) * total


def _lifted(points: Sequence[Point], origin: Point, dimension: int) -> list[list[Fraction]]:
    rows = [_less(p, origin, dimension) for p in points]
    return [[*row, sum((x * x for x in row), Fraction(0))] for row in rows]


def _less(a: Point, b: Point, dimension: int) -> list[Fraction]:
    return [Fraction(float(a[i])) - Fraction(float(b[i])) for i in range(dimension)]


def _minor(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    return a[0] * b[1] - a[1] * b[0]


def _det(a: Sequence[Fraction], b: Sequence[Fraction], c: Sequence[Fraction]) -> Fraction:
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def _sign(x: Fraction) -> int:
    return (x > 0) - (x < 0)
