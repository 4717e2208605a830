"""Sums and products of pairs of doubles, good for about 106 bits: for signs that one double leaves open.

A number is a pair (high, low) of floats whose exact sum it is (Dekker 1971; Knuth's two-sum; the algorithms are those
of Hida, Li and Bailey's QD library report, 2000).
"""

from __future__ import annotations

from meshwright.audit.jit import inner

__all__ = ["Pair", "minus", "plus", "times", "two_product", "two_sum"]

Pair = tuple[float, float]

_SPLIT = 134217729.0  # 2**27 + 1


@inner
def two_sum(a: float, b: float) -> Pair:
    """a + b and what rounding takes from it."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@inner
def two_product(a: float, b: float) -> Pair:
    """a * b and what rounding takes from it."""
    p = a * b
    t = _SPLIT * a
    ah = t - (t - a)
    al = a - ah
    t = _SPLIT * b
    bh = t - (t - b)
    bl = b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@inner
def plus(a: Pair, b: Pair) -> Pair:
    """a + b."""
    s, e = two_sum(a[0], b[0])
    t, f = two_sum(a[1], b[1])
    e += t
    u = s + e
    e -= u - s
    e += f
    v = u + e
    return v, e - (v - u)


@inner
def minus(a: Pair, b: Pair) -> Pair:
    """a - b."""
    return plus(a, (-b[0], -b[1]))


@inner
def times(a: Pair, b: Pair) -> Pair:
    """a * b."""
    p, e = two_product(a[0], b[0])
    e += a[0] * b[1] + a[1] * b[0]
    s = p + e
    return s, e - (s - p)
