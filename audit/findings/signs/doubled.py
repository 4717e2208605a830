"""Volumes and areas of cells in doubled precision: the second opinion where plain floats cannot tell the sign.

A number is a pair of floats, good for about 106 bits; see `doubles`. The differences between nodes are exact in it,
whatever their distance from the origin, and coordinates are brought to the size of 1 by an exact power of two. What is
left is an error near 1e-29 of the cell's extent cubed, fifteen orders of magnitude below the size under which a cell
counts as flat, so that the sign of every cell that is not flat is certain.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.doubles import Pair, minus, plus, times, two_product, two_sum
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints

__all__ = ["relative_area_of_ring", "relative_volume_of_rings"]


@kernel
def _cross_part(a: Pair, b: Pair, c: Pair, d: Pair) -> Pair:
    """a d - b c."""
    return minus(times(a, d), times(b, c))


@kernel
def _offset(points: NDArray[np.float64], p: int, o: int, axis: int, exponent: int) -> Pair:
    """Coordinate `axis` of point p relative to point o, divided by 2**exponent; halves cannot overflow."""
    s, e = two_sum(0.5 * points[p, axis], -0.5 * points[o, axis])
    half = exponent // 2  # two steps, since 2**-exponent itself may overflow
    return math.ldexp(math.ldexp(s, -half), half - exponent), math.ldexp(math.ldexp(e, -half), half - exponent)


@kernel
def _exponent_of(points: NDArray[np.float64], nodes: Ints) -> int:
    """e such that half the extent of the nodes seen from the first one is at most 2**e; -5000 for no extent at all."""
    extent = 0.0
    for i in range(nodes.size):
        for d in range(3):
            extent = max(extent, abs(0.5 * points[nodes[i], d] - 0.5 * points[nodes[0], d]))
    return math.frexp(extent)[1] if extent > 0.0 else -5000


@kernel
def _ring_flux(points: NDArray[np.float64], ring: Ints, origin: int, exponent: int) -> Pair:
    """Six times the volume between point `origin` and a face fanned about its vertex mean, over (2 2**exponent)**3.

    Positive when the right-hand normal of the ring points away from the origin.
    """
    n = ring.size
    sx = sy = sz = (0.0, 0.0)
    for i in range(n):
        sx = plus(sx, _offset(points, ring[i], origin, 0, exponent))
        sy = plus(sy, _offset(points, ring[i], origin, 1, exponent))
        sz = plus(sz, _offset(points, ring[i], origin, 2, exponent))
    total = (0.0, 0.0)
    p = ring[n - 1]
    for i in range(n):
        q = ring[i]
        px, qx = _offset(points, p, origin, 0, exponent), _offset(points, q, origin, 0, exponent)
        py, qy = _offset(points, p, origin, 1, exponent), _offset(points, q, origin, 1, exponent)
        pz, qz = _offset(points, p, origin, 2, exponent), _offset(points, q, origin, 2, exponent)
        total = plus(total, times(_cross_part(py, pz, qy, qz), sx))
        total = plus(total, times(_cross_part(pz, px, qz, qx), sy))
        total = plus(total, times(_cross_part(px, py, qx, qy), sz))
        p = q
    quotient = total[0] / n
    back = two_product(quotient, float(n))
    return two_sum(quotient, ((total[0] - back[0]) - back[1] + total[1]) / n)


@kernel
def _longest_edge(points: NDArray[np.float64], ring: Ints, exponent: int) -> float:
    """Square of the longest edge of a ring, over (2 2**exponent)**2."""
    longest = 0.0
    p = ring[ring.size - 1]
    for q in ring:
        square = 0.0
        for d in range(3):
            square += _offset(points, q, p, d, exponent)[0] ** 2
        longest = max(longest, square)
        p = q
    return longest


@kernel
def relative_area_of_ring(points: NDArray[np.float64], ring: Ints) -> float:
    """Signed area of a ring in the x-y plane over the square of its longest edge; 0 without extent."""
    exponent = _exponent_of(points, ring)
    if exponent == -5000:
        return 0.0
    total = (0.0, 0.0)
    p = ring[ring.size - 1]
    for q in ring:
        px, qx = _offset(points, p, ring[0], 0, exponent), _offset(points, q, ring[0], 0, exponent)
        py, qy = _offset(points, p, ring[0], 1, exponent), _offset(points, q, ring[0], 1, exponent)
        total = plus(total, _cross_part(px, py, qx, qy))
        p = q
    return total[0] / (2.0 * _longest_edge(points, ring, exponent))


@kernel
def relative_volume_of_rings(points: NDArray[np.float64], offsets: Ints, rings: Ints, outward: Ints) -> float:
    """Signed volume of the cell between some faces, over the cube of its longest edge; 0 without extent.

    rings: point rows around each face.  outward: 1 where the ring's normal leaves the cell, -1 where it enters.
    A face with more than three nodes is the fan about their mean.
    """
    exponent = _exponent_of(points, rings)
    if exponent == -5000:
        return 0.0
    total = (0.0, 0.0)
    longest = 0.0
    for f in range(outward.size):
        ring = rings[offsets[f] : offsets[f + 1]]
        flux = _ring_flux(points, ring, rings[0], exponent)
        total = plus(total, (outward[f] * flux[0], outward[f] * flux[1]))
        longest = max(longest, _longest_edge(points, ring, exponent))
    return total[0] / (6.0 * longest * math.sqrt(longest))
