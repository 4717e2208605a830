"""Verdict's metrics of triangles and tetrahedra."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.angles import skew_of_face
from meshwright.audit.metrics.aspect import FLAT, tet_radii
from meshwright.audit.metrics.roots import cube_roots
from meshwright.audit.metrics.stages import Lane, degrees
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = [
    "tet_aspect_gamma",
    "tet_aspect_ratio",
    "tet_collapse",
    "tet_condition",
    "tet_frobenius",
    "tet_inradius",
    "tet_mean_ratio",
    "tet_scaled_jacobian",
    "tet_shape",
    "tet_skew",
    "tri_aspect_ratio",
    "tri_condition",
    "tri_inradius",
    "tri_scaled_jacobian",
    "tri_shape",
]

_DIHEDRAL = math.degrees(math.acos(1.0 / 3.0))
"""Angle between two faces of the regular tetrahedron."""

# Rows of the edge table at each corner of a tet and round each of its faces, and the two faces at each edge.
_AT_CORNER = np.array([[0, 2, 3], [0, 1, 4], [1, 2, 5], [3, 4, 5]])
_ROUND_FACE = np.array([[0, 1, 2], [0, 3, 4], [1, 4, 5], [2, 3, 5]])
_FACES_AT_EDGE = np.array([[0, 1], [0, 2], [0, 3], [1, 3], [1, 2], [2, 3]])


@inner
def _twice_area(tile, i):  # type: ignore[no-untyped-def]
    """Twice the area of a triangle, 0 when it is flat."""
    a = tile.face[0]
    twice = 2.0 * math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)
    return twice if twice >= 2.0 * FLAT * tile.edge_range[1, i] else 0.0


@tile_kernel
def tri_scaled_jacobian(tile: Tile, out: Lane) -> None:
    """Sine of the smallest angle over that of 60 degrees."""
    e = tile.edge2
    for i in range(LANES):
        most = math.sqrt(max(e[0, i] * e[1, i], e[1, i] * e[2, i], e[2, i] * e[0, i]))
        out[i] = 2.0 / math.sqrt(3.0) * _twice_area(tile, i) / most if most > 0.0 else 0.0


@tile_kernel
def tri_shape(tile: Tile, out: Lane) -> None:
    """4 sqrt(3) A / sum e^2."""
    e = tile.edge2
    for i in range(LANES):
        total = e[0, i] + e[1, i] + e[2, i]
        out[i] = 2.0 * math.sqrt(3.0) * _twice_area(tile, i) / total if total > 0.0 else 0.0


@tile_kernel
def tri_condition(tile: Tile, out: Lane) -> None:
    """sum e^2 / 4 sqrt(3) A."""
    e = tile.edge2
    for i in range(LANES):
        twice = _twice_area(tile, i)
        out[i] = (e[0, i] + e[1, i] + e[2, i]) / (2.0 * math.sqrt(3.0) * twice) if twice > 0.0 else np.inf


@tile_kernel
def tri_aspect_ratio(tile: Tile, out: Lane) -> None:
    """Longest edge times perimeter over 4 sqrt(3) A."""
    e = tile.edge2
    for i in range(LANES):
        twice = _twice_area(tile, i)
        product = math.sqrt(tile.edge_range[1, i]) * (math.sqrt(e[0, i]) + math.sqrt(e[1, i]) + math.sqrt(e[2, i]))
        out[i] = product / (2.0 * math.sqrt(3.0) * twice) if twice > 0.0 else np.inf


@tile_kernel
def tri_inradius(tile: Tile, out: Lane) -> None:
    """2 r / R."""
    e = tile.edge2
    for i in range(LANES):
        a, b, c = math.sqrt(e[0, i]), math.sqrt(e[1, i]), math.sqrt(e[2, i])
        twice = _twice_area(tile, i)
        out[i] = 4.0 * (twice / (a * b)) * (twice / (c * (a + b + c))) if twice > 0.0 else 0.0


@inner
def _jacobian(tile, i):  # type: ignore[no-untyped-def]
    """6 V, signed, 0 when the tet is flat."""
    j, longest2 = tile.jacobian[0, i], tile.edge_range[1, i]
    return j if abs(j) >= 6.0 * FLAT * longest2 * math.sqrt(longest2) else 0.0


@inner
def _sums(tile, edges, surface):  # type: ignore[no-untyped-def]
    """Sum of the squared edges, total face area."""
    for i in range(LANES):
        edges[i], surface[i] = 0.0, 0.0
    for r in range(6):
        for i in range(LANES):
            edges[i] += tile.edge2[r, i]
    for f in range(4):
        a = tile.face[f]
        for i in range(LANES):
            surface[i] += math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)


@tile_kernel
def tet_scaled_jacobian(tile: Tile, out: Lane) -> None:
    """sqrt(2) 6 V over the largest product of the three edges at a corner."""
    e = tile.edge2
    for i in range(LANES):
        out[i] = 0.0
    for k in range(4):
        p, q, r = _AT_CORNER[k, 0], _AT_CORNER[k, 1], _AT_CORNER[k, 2]
        for i in range(LANES):
            out[i] = max(out[i], math.sqrt(e[p, i] * e[q, i]) * math.sqrt(e[r, i]))
    for i in range(LANES):
        out[i] = math.sqrt(2.0) * tile.jacobian[0, i] / out[i] if out[i] > 0.0 else 0.0


@inner
def _shape_cubed(tile, out):  # type: ignore[no-untyped-def]
    """Cube of the shape: 432 (6 V)^2 / (sum e^2)^3, of either orientation."""
    e = tile.edge2
    for i in range(LANES):
        total = e[0, i] + e[1, i] + e[2, i] + e[3, i] + e[4, i] + e[5, i]
        j = _jacobian(tile, i)
        part = j / total
        out[i] = 432.0 * part * part / total if j != 0.0 else 0.0


@tile_kernel
def tet_shape(tile: Tile, out: Lane) -> None:
    """12 (3 V)^(2/3) / sum e^2; 0 for an inverted tet."""
    cube = tile.work[0]
    _shape_cubed(tile, cube)
    cube_roots(cube, out)
    for i in range(LANES):
        out[i] = out[i] if tile.jacobian[0, i] > 0.0 else 0.0


@tile_kernel
def tet_frobenius(tile: Tile, out: Lane) -> None:
    """sum e^2 / 12 (3 |V|)^(2/3)."""
    cube = tile.work[0]
    _shape_cubed(tile, cube)
    cube_roots(cube, out)
    for i in range(LANES):
        out[i] = 1.0 / out[i]


@tile_kernel
def tet_condition(tile: Tile, out: Lane) -> None:
    """sqrt(sum e^2 sum A^2) / 18 V: the Frobenius condition number against the regular tet, over 3.

    The Gram matrix of the regular tet's edges is half of the identity plus ones, so the norm of the Jacobian is half the
    sum of e^2, and that of its inverse half the sum of the squared gradients of the shape functions, A / 3 V long.
    """
    edges, faces = tile.work[0], tile.work[1]
    for i in range(LANES):
        edges[i], faces[i] = 0.0, 0.0
    for r in range(6):
        for i in range(LANES):
            edges[i] += tile.edge2[r, i]
    for f in range(4):
        a = tile.face[f]
        for i in range(LANES):
            faces[i] += a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2
    for i in range(LANES):
        j = _jacobian(tile, i)
        out[i] = math.sqrt(edges[i]) * math.sqrt(faces[i]) / (3.0 * j) if j > 0.0 else np.inf


@tile_kernel
def tet_mean_ratio(tile: Tile, out: Lane) -> None:
    """6 sqrt(2) V / Lrms^3, signed."""
    e = tile.edge2
    for i in range(LANES):
        mean2 = (e[0, i] + e[1, i] + e[2, i] + e[3, i] + e[4, i] + e[5, i]) / 6.0
        out[i] = math.sqrt(2.0) * tile.jacobian[0, i] / (mean2 * math.sqrt(mean2)) if mean2 > 0.0 else 0.0


@tile_kernel
def tet_aspect_gamma(tile: Tile, out: Lane) -> None:
    """Lrms^3 / 6 sqrt(2) |V|."""
    e = tile.edge2
    for i in range(LANES):
        mean2 = (e[0, i] + e[1, i] + e[2, i] + e[3, i] + e[4, i] + e[5, i]) / 6.0
        out[i] = mean2 * math.sqrt(mean2) / (math.sqrt(2.0) * abs(_jacobian(tile, i)))
    for i in range(LANES):
        out[i] = out[i] if _jacobian(tile, i) != 0.0 else np.inf


@tile_kernel
def tet_aspect_ratio(tile: Tile, out: Lane) -> None:
    """Longest edge over 2 sqrt(6) r, r = 3 |V| / total area."""
    edges, surface = tile.work[0], tile.work[1]
    _sums(tile, edges, surface)
    for i in range(LANES):
        j = abs(_jacobian(tile, i))
        out[i] = math.sqrt(tile.edge_range[1, i]) * surface[i] / (math.sqrt(6.0) * j) if j > 0.0 else np.inf


@tile_kernel
def tet_collapse(tile: Tile, out: Lane) -> None:
    """Smallest height over the longest edge of the face below it, signed."""
    e = tile.edge2
    for i in range(LANES):
        out[i] = 0.0
    for f in range(4):
        a, p, q, r = tile.face[f], _ROUND_FACE[f, 0], _ROUND_FACE[f, 1], _ROUND_FACE[f, 2]
        for i in range(LANES):
            area2 = a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2
            out[i] = max(out[i], math.sqrt(area2) * math.sqrt(max(e[p, i], e[q, i], e[r, i])))
    for i in range(LANES):
        j = _jacobian(tile, i)  # else the height of a flat tet on a line would be one rounding over another
        out[i] = 0.5 * j / out[i] if j != 0.0 else 0.0


@tile_kernel
def tet_inradius(tile: Tile, out: Lane) -> None:
    """Smallest inradius of the twelve tets between the corners, the edge middles and the centre, over the circumradius.

    The four at the corners are half as large as the tet. The eight of the octahedron left, V / 16 each, have a face of
    A / 4 and three faces between half the lines that join the middles of opposite edges, whose areas all eight share.
    """
    x, radius, surface, largest = tile.x, tile.work[0], tile.work[1], tile.work[2]
    tet_radii(tile, radius, surface)
    for i in range(LANES):
        largest[i] = 0.0
    for f in range(4):
        a = tile.face[f]
        for i in range(LANES):
            largest[i] = max(largest[i], a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)
    for i in range(LANES):
        # four times half of each line: corner 0 is the origin
        ux, uy, uz = (
            x[2, 0, i] + x[3, 0, i] - x[1, 0, i],
            x[2, 1, i] + x[3, 1, i] - x[1, 1, i],
            x[2, 2, i] + x[3, 2, i] - x[1, 2, i],
        )
        vx, vy, vz = (
            x[1, 0, i] + x[3, 0, i] - x[2, 0, i],
            x[1, 1, i] + x[3, 1, i] - x[2, 1, i],
            x[1, 2, i] + x[3, 2, i] - x[2, 2, i],
        )
        wx, wy, wz = (
            x[1, 0, i] + x[2, 0, i] - x[3, 0, i],
            x[1, 1, i] + x[2, 1, i] - x[3, 1, i],
            x[1, 2, i] + x[2, 2, i] - x[3, 2, i],
        )
        p2 = (uy * vz - uz * vy) ** 2 + (uz * vx - ux * vz) ** 2 + (ux * vy - uy * vx) ** 2
        q2 = (vy * wz - vz * wy) ** 2 + (vz * wx - vx * wz) ** 2 + (vx * wy - vy * wx) ** 2
        r2 = (wy * uz - wz * uy) ** 2 + (wz * ux - wx * uz) ** 2 + (wx * uy - wy * ux) ** 2
        inside = (math.sqrt(p2) + math.sqrt(q2) + math.sqrt(r2)) / 32.0
        j = _jacobian(tile, i)
        area = max(surface[i] / 3.0, (0.25 * math.sqrt(largest[i]) + inside) * (16.0 / (3.0 * (1.0 + math.sqrt(3.0)))))
        out[i] = (j / area) * (abs(j) / radius[i]) if j != 0.0 else 0.0


@tile_kernel
def tet_skew(tile: Tile, out: Lane) -> None:
    """Worst of the equi-angle skew of the faces' corners, ideal 60, and of the angles between faces, ideal 70.53 degrees.

    1 for a flat tet.
    """
    small, large = tile.work[0], tile.work[1]
    for i in range(LANES):
        small[i], large[i] = -np.inf, np.inf
    for r in range(6):
        a, b = tile.face[_FACES_AT_EDGE[r, 0]], tile.face[_FACES_AT_EDGE[r, 1]]
        for i in range(LANES):
            # area vectors have |a x b| = 3/2 |V| |e|, and the angle between faces is the supplement of theirs
            dot = a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i]
            part = -4.0 * dot / abs(tile.jacobian[0, i])
            square = part * abs(part) / tile.edge2[r, i]
            small[i] = square if square > small[i] else small[i]
            large[i] = square if square < large[i] else large[i]
    for i in range(LANES):
        corners = skew_of_face(tile.angle[0, i], tile.angle[1, i], 60.0)
        between = skew_of_face(degrees(small[i]), degrees(large[i]), _DIHEDRAL)
        skew = corners if corners > between else between
        out[i] = skew if tile.shapeless[0, i] == 0.0 and _jacobian(tile, i) != 0.0 else 1.0
