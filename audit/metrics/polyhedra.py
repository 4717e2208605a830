"""How a polyhedron stands to its faces: Fluent's squish and aspect ratio, OpenFOAM's openness, pyramids and flatness.

And the normal of a polygon. Inner functions of the pass in `polytopes`; the definitions are those of the fixed types
in `fluent` and `openfoam`.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT

__all__ = ["area_vector", "balance", "concavity", "flatness", "reach", "slant"]


@inner
def area_vector(x, first, n):  # type: ignore[no-untyped-def]
    """Twice the area vector of a face, its triangles taken in pairs: the product of the diagonals for n = 4.

    So no rounding gives a figure of eight, whose area is zero, a normal of its own.
    """
    nx, ny, nz = 0.0, 0.0, 0.0
    for k in range(2, n, 2):
        a, b, c = first + k, first + (k + 1) % n, first + k - 1
        ux, uy, uz = x[a, 0] - x[first, 0], x[a, 1] - x[first, 1], x[a, 2] - x[first, 2]
        vx, vy, vz = x[b, 0] - x[c, 0], x[b, 1] - x[c, 1], x[b, 2] - x[c, 2]
        nx, ny, nz = nx + uy * vz - uz * vy, ny + uz * vx - ux * vz, nz + ux * vy - uy * vx
    return nx, ny, nz


@inner
def flatness(x, first, n, area, centre, longest2):  # type: ignore[no-untyped-def]
    """|A| of the corners x[first : first + n] over the sum of the areas of the triangles about `centre`.

    1 for triangles, and where there is no area at all.  longest2: squared length of the longest edge.
    """
    if n < 4:
        return 1.0
    total = 0.0
    p = first + n - 1
    for q in range(first, first + n):
        ux, uy, uz = x[p, 0] - centre[0], x[p, 1] - centre[1], x[p, 2] - centre[2]
        vx, vy, vz = x[q, 0] - centre[0], x[q, 1] - centre[1], x[q, 2] - centre[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        total += 0.5 * math.sqrt(nx * nx + ny * ny + nz * nz)
        p = q
    size = math.sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2])
    return 1.0 if size == 0.0 and total <= FLAT * longest2 else size / total


@inner
def slant(areas, centres, m, middle):  # type: ignore[no-untyped-def]
    """(cosine of the largest angle between a face's normal and the way to it, 1 less that) of m faces around `middle`.

    Reduced as smallest signed square of the cotangent, which keeps its digits near 0 and 180 degrees; a face without
    direction counts as a right angle.
    """
    low = np.inf
    for i in range(m):
        dx, dy, dz = centres[i, 0] - middle[0], centres[i, 1] - middle[1], centres[i, 2] - middle[2]
        ax, ay, az = areas[i, 0], areas[i, 1], areas[i, 2]
        nx, ny, nz = ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx
        dot = ax * dx + ay * dy + az * dz
        square = dot * abs(dot) / (nx * nx + ny * ny + nz * nz)
        square = square if square == square else 0.0
        low = square if square < low else low
    cosine = 1.0 / math.sqrt(1.0 + 1.0 / abs(low))
    if low < 0.0:
        return -cosine, 1.0 + cosine
    return cosine, 1.0 / (1.0 + low) / (1.0 + cosine)


@inner
def reach(areas, centres, m, x, k, middle):  # type: ignore[no-untyped-def]
    """(longest over shortest distance from `middle` to the planes of m faces and to k corners, smallest pyramid).

    Distances: inf when the shortest is 0 or rounding of it.  Pyramid: of a face with its apex at `middle`, signed.
    """
    pyramid, low, high = np.inf, np.inf, 0.0
    for i in range(m):
        ax, ay, az = areas[i, 0], areas[i, 1], areas[i, 2]
        dx, dy, dz = centres[i, 0] - middle[0], centres[i, 1] - middle[1], centres[i, 2] - middle[2]
        flux, square = ax * dx + ay * dy + az * dz, ax * ax + ay * ay + az * az
        pyramid = min(pyramid, flux / 3.0)
        d2 = flux * flux / square if square > 0.0 else 0.0
        low, high = min(low, d2), max(high, d2)
    for j in range(k):
        d2 = (x[j, 0] - middle[0]) ** 2 + (x[j, 1] - middle[1]) ** 2 + (x[j, 2] - middle[2]) ** 2
        low, high = min(low, d2), max(high, d2)
    return math.sqrt(high / low) if low > FLAT * FLAT * high else np.inf, pyramid + 0.0  # no negative zero


@inner
def balance(areas, m, volume):  # type: ignore[no-untyped-def]
    """(openness, OpenFOAM's aspect ratio) of a cell with m outward areas and a positive volume."""
    openness, low, high, total = 0.0, np.inf, 0.0, 0.0
    for d in range(3):
        signed = plain = 0.0
        for i in range(m):
            signed += areas[i, d]
            plain += abs(areas[i, d])
        if plain > 0.0:
            openness = max(openness, abs(signed) / plain)
        low, high, total = min(low, plain), max(high, plain), total + plain
    mean = total / 6.0
    compact = volume / (mean * math.sqrt(mean))  # without dimension, so that cells of all sizes get the same digits
    return openness, max(high / low, compact ** (-2.0 / 3.0))


@inner
def concavity(areas, centres, m, longest2):  # type: ignore[no-untyped-def]
    """Largest cosine between the outward area of one of m faces and the way from its centre to that of another.

    Reduced as signed square. Two centres in one place and a face without direction count as 0.  longest2: squared
    length of the longest edge.
    """
    worst = -1.0
    for i in range(m):
        ax, ay, az = areas[i, 0], areas[i, 1], areas[i, 2]
        cx, cy, cz = centres[i, 0], centres[i, 1], centres[i, 2]
        square = ax * ax + ay * ay + az * az
        for j in range(m):
            dx, dy, dz = centres[j, 0] - cx, centres[j, 1] - cy, centres[j, 2] - cz
            apart = dx * dx + dy * dy + dz * dz
            dot, size = ax * dx + ay * dy + az * dz, square * apart if apart > FLAT * FLAT * longest2 else 0.0
            if i != j and (dot * abs(dot) > worst * size if size > 0.0 else worst < 0.0):
                worst = dot * abs(dot) / size if size > 0.0 else 0.0
    return math.copysign(math.sqrt(abs(worst)), worst) + 0.0
