"""Sums and products of pairs of doubles, which hold 106 bits: for signs that one double leaves open."""

from __future__ import annotations

from meshwright.audit.jit import inner

__all__ = ["Pair", "minus", "plus", "times", "two_product", "two_sum"]

Pair = tuple[float, float]
"""A number as a double and what rounding took from it."""


@inner
def two_sum(a: float, b: float) -> Pair:
    """a + b and what rounding takes from it (Knuth)."""
    s = a + b
    v = s - a
    return s, (a - (s - v)) + (b - v)


@inner
def two_product(a: float, b: float) -> Pair:
    """a * b and what rounding takes from it (Dekker, Veltkamp's splitting)."""
    p = a * b
    c = 134217729.0 * a
    ah = c - (c - a)
    al = a - ah
    c = 134217729.0 * b
    bh = c - (c - b)
    bl = b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@inner
def plus(a: Pair, b: Pair) -> Pair:
    """a + b."""
    s, e = two_sum(a[0], b[0])
    return two_sum(s, e + a[1] + b[1])


@inner
def minus(a: Pair, b: Pair) -> Pair:
    """a - b."""
    return plus(a, (-b[0], -b[1]))


@inner
def times(a: Pair, b: Pair) -> Pair:
    """a * b."""
    p, e = two_product(a[0], b[0])
    return two_sum(p, e + a[0] * b[1] + a[1] * b[0])
