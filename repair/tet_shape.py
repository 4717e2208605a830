"""What makes a tetrahedron good: the two measures that the passes on tets raise.

`fitness` is the score of the worst feature of a tet, by which a change is allowed: no change may lower the smallest
fitness around it. It joins the three figures that solvers complain about, so that one is not bought with another:
smallest and largest dihedral angle and the scaled Jacobian. 1 - cos and 1 + cos stand for the angles, since they rise
and fall with them and need no arc cosine.
`cost` is smooth, infinite for a flat tet and 1 for the regular one: a power of the inverse mean ratio of Liu and Joe
(BIT 34, 1994). Its sum over a neighbourhood is what smoothing and swapping bring down.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.mesh import Floats

__all__ = ["POWER", "both", "cost_of", "measures", "quality", "quality_floor", "quality_of", "scaled_cost"]

_SMALL_ANGLE = 1.5
_LARGE_ANGLE = 0.75
_JACOBIAN = 0.35
"""Weights of the three figures: each is 0 for a flat tet, and they meet near 20.7 degrees, 150.6 degrees and 0.276."""

POWER = 1.25
"""Exponent of the cost. Higher ones favour the worst tets, lower ones the mean; measured on the benchmark meshes."""

_REGULAR = 12.0 * math.sqrt(3.0)
"""Summed squares of the edges to the power 3/2, over six times the volume, of a regular tet."""

_FLAT = 1e-14
"""A six-fold volume below this part of the cubed longest edge counts as none: rounding decides its sign."""


@inner
def scaled_cost(total: float, det: float) -> float:
    """Cost from the summed squares of the six edges and six times the volume."""
    ratio = total * math.sqrt(total) / (_REGULAR * det)
    return ratio * math.sqrt(math.sqrt(ratio))


@inner
def measures(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float,
    cx: float, cy: float, cz: float, dx: float, dy: float, dz: float,
) -> tuple[float, float]:  # fmt: skip
    """(fitness, cost) of the tet a, b, c, d; (-1, inf) where it is flat or inverted."""
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = cx - ax, cy - ay, cz - az
    wx, wy, wz = dx - ax, dy - ay, dz - az
    # normals of the faces at a: n_d of (a, b, c), n_c of (a, d, b), n_b of (a, c, d); all point into the tet
    n_dx, n_dy, n_dz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    det = n_dx * wx + n_dy * wy + n_dz * wz
    uu, vv, ww = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    px, py, pz = cx - bx, cy - by, cz - bz
    qx, qy, qz = dx - bx, dy - by, dz - bz
    rx, ry, rz = dx - cx, dy - cy, dz - cz
    pp, qq, rr = px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz, rx * rx + ry * ry + rz * rz
    longest = max(uu, vv, ww, pp, qq, rr)
    if not det > _FLAT * longest * math.sqrt(longest):
        return -1.0, np.inf
    n_cx, n_cy, n_cz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    n_bx, n_by, n_bz = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
    n_ax, n_ay, n_az = -(n_bx + n_cx + n_dx), -(n_by + n_cy + n_dy), -(n_bz + n_cz + n_dz)
    a2 = n_ax * n_ax + n_ay * n_ay + n_az * n_az
    b2 = n_bx * n_bx + n_by * n_by + n_bz * n_bz
    c2 = n_cx * n_cx + n_cy * n_cy + n_cz * n_cz
    d2 = n_dx * n_dx + n_dy * n_dy + n_dz * n_dz
    ia, ib, ic, id_ = 1.0 / math.sqrt(a2), 1.0 / math.sqrt(b2), 1.0 / math.sqrt(c2), 1.0 / math.sqrt(d2)
    c0 = -(n_ax * n_bx + n_ay * n_by + n_az * n_bz) * ia * ib
    c1 = -(n_ax * n_cx + n_ay * n_cy + n_az * n_cz) * ia * ic
    c2_ = -(n_ax * n_dx + n_ay * n_dy + n_az * n_dz) * ia * id_
    c3 = -(n_bx * n_cx + n_by * n_cy + n_bz * n_cz) * ib * ic
    c4 = -(n_bx * n_dx + n_by * n_dy + n_bz * n_dz) * ib * id_
    c5 = -(n_cx * n_dx + n_cy * n_dy + n_cz * n_dz) * ic * id_
    low = min(c0, c1, c2_, c3, c4, c5)
    high = max(c0, c1, c2_, c3, c4, c5)
    corner = max(uu * vv * ww, uu * pp * qq, vv * pp * rr, ww * qq * rr)
    jacobian = det * math.sqrt(2.0 / corner)
    fit = min(_SMALL_ANGLE * (1.0 - high), _LARGE_ANGLE * (1.0 + low), _JACOBIAN * jacobian)
    total = uu + vv + ww + pp + qq + rr
    return fit, scaled_cost(total, det)


@inner
def both(points: Floats, a: int, b: int, c: int, d: int) -> tuple[float, float]:
    """(fitness, cost) of a tet by its point rows."""
    return measures(
        points[a, 0], points[a, 1], points[a, 2], points[b, 0], points[b, 1], points[b, 2],
        points[c, 0], points[c, 1], points[c, 2], points[d, 0], points[d, 1], points[d, 2],
    )  # fmt: skip


@inner
def cost_of(points: Floats, a: int, b: int, c: int, d: int) -> float:
    """The cost alone of a tet by its point rows, inf where it is inverted; not where it is flat to rounding."""
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    wx, wy, wz = points[d, 0] - points[a, 0], points[d, 1] - points[a, 1], points[d, 2] - points[a, 2]
    det = (uy * vz - uz * vy) * wx + (uz * vx - ux * vz) * wy + (ux * vy - uy * vx) * wz
    if not det > 0.0:
        return np.inf
    total = _square(ux, uy, uz) + _square(vx, vy, vz) + _square(wx, wy, wz)
    total += (
        _square(vx - ux, vy - uy, vz - uz) + _square(wx - ux, wy - uy, wz - uz) + _square(wx - vx, wy - vy, wz - vz)
    )
    return scaled_cost(total, det)


@inner
def quality(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float,
    cx: float, cy: float, cz: float, dx: float, dy: float, dz: float,
) -> float:  # fmt: skip
    """The quality by which the driver judges (`quality.standing`): the smaller of the scaled Jacobian and 1 - skew."""
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = cx - ax, cy - ay, cz - az
    wx, wy, wz = dx - ax, dy - ay, dz - az
    det = (uy * vz - uz * vy) * wx + (uz * vx - ux * vz) * wy + (ux * vy - uy * vx) * wz
    ab, ac, ad = _square(ux, uy, uz), _square(vx, vy, vz), _square(wx, wy, wz)
    bc = _square(cx - bx, cy - by, cz - bz)
    bd = _square(dx - bx, dy - by, dz - bz)
    cd = _square(dx - cx, dy - cy, dz - cz)
    corner = max(ab * ac * ad, ab * bc * bd, ac * bc * cd, ad * bd * cd)
    if not (det > 0.0 and corner > 0.0):
        return -1.0
    one_low, one_high = _cosines(ab, ac, bc)
    two_low, two_high = _cosines(ab, ad, bd)
    three_low, three_high = _cosines(ac, ad, cd)
    four_low, four_high = _cosines(bc, bd, cd)
    smallest = math.acos(min(1.0, max(one_high, two_high, three_high, four_high)))
    largest = math.acos(max(-1.0, min(one_low, two_low, three_low, four_low)))
    return min(det * math.sqrt(2.0 / corner), smallest * (3.0 / math.pi), (math.pi - largest) * (1.5 / math.pi))


@inner
def quality_floor(fit: float) -> float:
    """What `quality` is not under where the fitness is `fit`: dear to compute, it is often not needed.

    The scaled Jacobian J is at least fit / _JACOBIAN. At each corner it is at most sqrt(2) times the sine of each face
    angle there, so that every face angle is between asin(J / sqrt(2)) and the rest to 180 degrees.
    """
    return (1.5 / (math.pi * math.sqrt(2.0) * _JACOBIAN)) * fit


@inner
def _square(x: float, y: float, z: float) -> float:
    return x * x + y * y + z * z


@inner
def _cosines(a: float, b: float, c: float) -> tuple[float, float]:
    """Smallest and largest cosine of the angles of a triangle by its squared sides."""
    p = 0.5 * (b + c - a) / math.sqrt(b * c)
    q = 0.5 * (a + c - b) / math.sqrt(a * c)
    r = 0.5 * (a + b - c) / math.sqrt(a * b)
    return min(p, q, r), max(p, q, r)


@inner
def quality_of(points: Floats, a: int, b: int, c: int, d: int) -> float:
    """`quality` of a tet by its point rows."""
    return quality(
        points[a, 0], points[a, 1], points[a, 2], points[b, 0], points[b, 1], points[b, 2],
        points[c, 0], points[c, 1], points[c, 2], points[d, 0], points[d, 1], points[d, 2],
    )  # fmt: skip
