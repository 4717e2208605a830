"""The driver's quality of single cells of first order, and their sizes, for kernels that try places of a point.

The same numbers as `quality.standing`, with one more sign: a triangle or quad that looks against the normal of its
surroundings counts below -1, less than any other. Wedges are left out, since their points are held.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.jit import inner
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.tet_shape import quality_of
from meshwright.repair.vectors import Vector, between, cross, dot

__all__ = ["KINDS", "quality_at", "size_of"]

KINDS = ("tri", "quad", "tet", "pyramid", "hex")
"""Types by number: 0 and 1 are flat cells."""

_TRI, _QUAD, _TET, _PYRAMID, _HEX = range(5)


def _table(rows: list[list[tuple[int, ...]]], width: int) -> Ints:
    """(types, most, width) filled up with -1."""
    out = np.full((len(rows), max(map(len, rows)), width), -1, np.int64)
    for i, entries in enumerate(rows):
        for j, entry in enumerate(entries):
            out[i, j, : len(entry)] = entry
    return out


_FACES = _table([list(CELL_TYPES[name].faces) for name in KINDS], 4)
_TRIADS = CELL_TYPES["hex"].triad_table
_SIMPLICES = _table(
    [
        [(0, 1, 2)],
        [(0, 1, 2), (0, 2, 3)],
        [(0, 1, 2, 3)],
        [(0, 1, 2, 4), (0, 2, 3, 4)],
        [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)],
    ],
    4,
)
"""Triangles or tets that make up a cell; of a hex those around one diagonal."""


@inner
def _length(u: Vector) -> float:
    return math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])


@inner
def _plus(u: Vector, v: Vector) -> Vector:
    return u[0] + v[0], u[1] + v[1], u[2] + v[2]


@inner
def _square(u: Vector) -> float:
    return u[0] * u[0] + u[1] * u[1] + u[2] * u[2]


@inner
def _angles_of_face(points: Floats, cells: Ints, c: int, kind: int, f: int, n: int) -> tuple[float, float]:
    """Largest and smallest cotangent of the corners of a face, squared with their signs; (inf, -inf) for no shape.

    A face with a reflex corner, or with an edge without length, has no shape. A corner costs no root in this way.
    """
    mean = (0.0, 0.0, 0.0)
    if n == 4:
        p, q = cells[c, _FACES[kind, f, 0]], cells[c, _FACES[kind, f, 1]]
        r, s = cells[c, _FACES[kind, f, 2]], cells[c, _FACES[kind, f, 3]]
        mean = cross(between(points, p, r), between(points, q, s))
    high, low = -np.inf, np.inf
    for k in range(n):
        o = cells[c, _FACES[kind, f, k]]
        u = between(points, o, cells[c, _FACES[kind, f, k + 1 if k + 1 < n else 0]])
        v = between(points, o, cells[c, _FACES[kind, f, k - 1 if k > 0 else n - 1]])
        w, along = cross(u, v), dot(u, v)
        if n == 4 and dot(w, mean) < 0.0:
            return np.inf, -np.inf
        cotangent = along * abs(along) / _square(w)
        if not abs(cotangent) >= 0.0:
            return np.inf, -np.inf
        high, low = max(high, cotangent), min(low, cotangent)
    return high, low


@inner
def _angle(square: float) -> float:
    """The angle whose cotangent, squared with its sign, this is."""
    return math.atan2(1.0, math.copysign(math.sqrt(abs(square)), square))


@inner
def _angles(points: Floats, cells: Ints, c: int, kind: int) -> float:
    """1 minus the equiangle skew of a cell."""
    tri_high, tri_low, quad_high, quad_low = -np.inf, np.inf, -np.inf, np.inf
    for f in range(_FACES.shape[1]):
        if _FACES[kind, f, 0] < 0:
            break
        if _FACES[kind, f, 3] < 0:
            high, low = _angles_of_face(points, cells, c, kind, f, 3)
            tri_high, tri_low = max(tri_high, high), min(tri_low, low)
        else:
            high, low = _angles_of_face(points, cells, c, kind, f, 4)
            quad_high, quad_low = max(quad_high, high), min(quad_low, low)
    fit = 1.0
    if tri_high > -np.inf:
        fit = min(_angle(tri_high) * (3.0 / math.pi), (math.pi - _angle(tri_low)) * (1.5 / math.pi))
    if quad_high > -np.inf:
        fit = min(fit, _angle(quad_high) * (2.0 / math.pi), (math.pi - _angle(quad_low)) * (2.0 / math.pi))
    return fit


@inner
def _scaled(u: Vector, v: Vector, w: Vector) -> float:
    """Determinant of three edges over the product of their lengths, squared with its sign."""
    product, det = _square(u) * _square(v) * _square(w), dot(u, cross(v, w))
    return det * abs(det) / product if product > 0.0 else 0.0


@inner
def _hex_jacobian(points: Floats, cells: Ints, c: int) -> float:
    low = 1.0
    for t in range(8):
        o = cells[c, _TRIADS[t, 0]]
        u = between(points, o, cells[c, _TRIADS[t, 1]])
        v = between(points, o, cells[c, _TRIADS[t, 2]])
        w = between(points, o, cells[c, _TRIADS[t, 3]])
        low = min(low, _scaled(u, v, w))
    # the axes through the middles of opposite faces
    a = between(points, cells[c, 0], cells[c, 6])
    b = between(points, cells[c, 1], cells[c, 7])
    d = between(points, cells[c, 2], cells[c, 4])
    e = between(points, cells[c, 3], cells[c, 5])
    u = (a[0] - b[0] - d[0] + e[0], a[1] - b[1] - d[1] + e[1], a[2] - b[2] - d[2] + e[2])
    v = (a[0] + b[0] - d[0] - e[0], a[1] + b[1] - d[1] - e[1], a[2] + b[2] - d[2] - e[2])
    w = (a[0] + b[0] + d[0] + e[0], a[1] + b[1] + d[1] + e[1], a[2] + b[2] + d[2] + e[2])
    low = min(low, _scaled(u, v, w))
    return math.copysign(math.sqrt(abs(low)), low)


@inner
def _pyramid_jacobian(points: Floats, cells: Ints, c: int) -> float:
    """Smallest scaled Jacobian of the tets of a corner of the base, its neighbours and the apex; 2 - v for v over 1."""
    low = np.inf
    t = cells[c, 4]
    for k in range(4):
        o, a, b = cells[c, k], cells[c, (k + 1) % 4], cells[c, (k + 3) % 4]
        u, v, w = between(points, o, a), between(points, o, b), between(points, o, t)
        ka, kb, kt = _length(u), _length(v), _length(w)
        ab, at, bt = _length(between(points, a, b)), _length(between(points, a, t)), _length(between(points, b, t))
        most = max(ka * kb * kt, ka * ab * at, kb * ab * bt, kt * at * bt)
        low = min(low, 2.0 * dot(u, cross(v, w)) / most if most > 0.0 else 0.0)
    size = abs(low)
    return math.copysign(2.0 - size if size > 1.0 else size, low)


@inner
def quality_at(points: Floats, cells: Ints, c: int, kind: int, normal: Vector) -> float:
    """Quality of cell c of the table of point rows (m, 8): see `quality.Standing`.

    kind: its number in `KINDS`. normal: of the surroundings, for flat cells; one that looks the other way is below -1.
    """
    if kind == _TET:
        return float(quality_of(points, cells[c, 0], cells[c, 1], cells[c, 2], cells[c, 3]))
    low = _angles(points, cells, c, kind)
    if kind == _HEX:
        return min(low, _hex_jacobian(points, cells, c))
    if kind == _PYRAMID:
        return min(low, _pyramid_jacobian(points, cells, c))
    own = cross(between(points, cells[c, 0], cells[c, 1]), between(points, cells[c, 0], cells[c, 2]))
    if kind == _QUAD:
        own = cross(between(points, cells[c, 0], cells[c, 2]), between(points, cells[c, 1], cells[c, 3]))
        size = _length(own)
        for k in range(4):
            u = between(points, cells[c, k], cells[c, (k + 1) % 4])
            v = between(points, cells[c, k], cells[c, (k + 3) % 4])
            product = _length(u) * _length(v) * size
            low = min(low, dot(cross(u, v), own) / product if product > 0.0 else 0.0)
    return low if dot(own, normal) > 0.0 else -1.0 - abs(low)


@inner
def size_of(points: Floats, cells: Ints, c: int, kind: int) -> float:
    """Volume of cell c, area of a flat one, without sign."""
    total = 0.0
    area = (0.0, 0.0, 0.0)
    for s in range(_SIMPLICES.shape[1]):
        if _SIMPLICES[kind, s, 0] < 0:
            break
        o = cells[c, _SIMPLICES[kind, s, 0]]
        u = between(points, o, cells[c, _SIMPLICES[kind, s, 1]])
        v = between(points, o, cells[c, _SIMPLICES[kind, s, 2]])
        if kind <= _QUAD:
            area = _plus(area, cross(u, v))
        else:
            total += dot(u, cross(v, between(points, o, cells[c, _SIMPLICES[kind, s, 3]]))) / 6.0
    return 0.5 * _length(area) if kind <= _QUAD else abs(total)
