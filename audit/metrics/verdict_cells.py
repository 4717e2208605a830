"""Verdict's metrics of quadrilaterals, pyramids, wedges and hexes that follow from the corners."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.roots import cube_roots
from meshwright.audit.metrics.stages import Lane
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel
from meshwright.audit.metrics.verdict_corners import CENTRE, CONDITION, JACOBIAN, ODDY, SCALED, SHAPE, SUM

__all__ = [
    "hex_condition",
    "hex_mean_frobenius",
    "hex_oddy",
    "hex_scaled_jacobian",
    "hex_shape",
    "pyramid_scaled_jacobian",
    "pyramid_shape",
    "quad_condition",
    "quad_distortion",
    "quad_frobenius",
    "quad_mean_frobenius",
    "quad_oddy",
    "quad_scaled_jacobian",
    "quad_shape",
    "shear",
    "wedge_condition",
    "wedge_distortion",
    "wedge_frobenius",
    "wedge_mean_frobenius",
    "wedge_scaled_jacobian",
    "wedge_shape",
]

_UNIT_WEDGE = 2.0 / math.sqrt(3.0)
"""1 / J at any corner of the unit wedge."""


@tile_kernel
def quad_scaled_jacobian(tile: Tile, out: Lane) -> None:
    """Smallest sine of a corner, signed by the mean normal."""
    out[:] = tile.corner[SCALED]


@tile_kernel
def hex_scaled_jacobian(tile: Tile, out: Lane) -> None:
    """Smallest normalised determinant, at the corners and of the axes at the centre."""
    corner, centre = tile.corner[SCALED], tile.corner[CENTRE]
    for i in range(LANES):
        out[i] = min(corner[i], centre[i])


@tile_kernel
def wedge_scaled_jacobian(tile: Tile, out: Lane) -> None:
    """Smallest normalised determinant, over that of the unit wedge."""
    for i in range(LANES):
        out[i] = _UNIT_WEDGE * tile.corner[SCALED, i]


@tile_kernel
def shear(tile: Tile, out: Lane) -> None:
    """The scaled Jacobian of the corners alone; 0 where one is folded."""
    for i in range(LANES):
        out[i] = max(tile.corner[SCALED, i], 0.0)


@tile_kernel
def quad_shape(tile: Tile, out: Lane) -> None:
    """2 min J / (e1^2 + e2^2)."""
    for i in range(LANES):
        out[i] = 2.0 * tile.corner[SHAPE, i]


@tile_kernel
def hex_shape(tile: Tile, out: Lane) -> None:
    """3 min J^(2/3) / sum e^2."""
    cube_roots(tile.corner[SHAPE], out)
    for i in range(LANES):
        out[i] *= 3.0


@tile_kernel
def wedge_shape(tile: Tile, out: Lane) -> None:
    """3 min (2 J / sqrt(3))^(2/3) / sum e^2."""
    square = tile.work[0]
    for i in range(LANES):
        square[i] = _UNIT_WEDGE * _UNIT_WEDGE * tile.corner[SHAPE, i]
    cube_roots(square, out)
    for i in range(LANES):
        out[i] *= 3.0


@tile_kernel
def quad_condition(tile: Tile, out: Lane) -> None:
    """max (e1^2 + e2^2) / 2 J; inf where a corner is folded or flat."""
    for i in range(LANES):
        out[i] = 0.5 / tile.corner[SHAPE, i]


@tile_kernel
def quad_frobenius(tile: Tile, out: Lane) -> None:
    """max (e1^2 + e2^2) / 2 |e1 x e2|."""
    for i in range(LANES):
        out[i] = 0.5 * tile.corner[CONDITION, i]


@tile_kernel
def quad_mean_frobenius(tile: Tile, out: Lane) -> None:
    """Mean over the corners of (e1^2 + e2^2) / 2 |e1 x e2|."""
    for i in range(LANES):
        out[i] = 0.125 * tile.corner[SUM, i]


@tile_kernel
def hex_condition(tile: Tile, out: Lane) -> None:
    """Largest condition number of the corners over 3."""
    for i in range(LANES):
        out[i] = tile.corner[CONDITION, i] / 3.0


@tile_kernel
def hex_mean_frobenius(tile: Tile, out: Lane) -> None:
    """Mean condition number of the corners over 3."""
    for i in range(LANES):
        out[i] = tile.corner[SUM, i] / 24.0


@tile_kernel
def quad_oddy(tile: Tile, out: Lane) -> None:
    """Largest of the corners' numbers."""
    out[:] = tile.corner[ODDY]


@tile_kernel
def hex_oddy(tile: Tile, out: Lane) -> None:
    """Largest of the numbers of the corners and of the centre."""
    cube_roots(tile.corner[ODDY], out)


@tile_kernel
def quad_distortion(tile: Tile, out: Lane) -> None:
    """Smallest corner J, which is four times that of the map from [-1, 1]^2, over the area; 0 when flat."""
    for i in range(LANES):
        nx, ny, nz = tile.face[0, 0, i], tile.face[0, 1, i], tile.face[0, 2, i]
        area = math.sqrt(nx * nx + ny * ny + nz * nz)
        out[i] = tile.corner[JACOBIAN, i] / area if area > FLAT * tile.edge_range[1, i] else 0.0


@inner
def _wedge_cubes(tile, r, cubes):  # type: ignore[no-untyped-def]
    """Cube of the Frobenius aspect at corner r, over that of the unit wedge: 3/256 (1.5 sum e^2 - sum ei.ej)^3 / J^2."""
    triads, x = tile.tables.triads, tile.x
    o, a, b, d = triads[r, 0], triads[r, 1], triads[r, 2], triads[r, 3]
    for i in range(LANES):
        ux, uy, uz = x[a, 0, i] - x[o, 0, i], x[a, 1, i] - x[o, 1, i], x[a, 2, i] - x[o, 2, i]
        vx, vy, vz = x[b, 0, i] - x[o, 0, i], x[b, 1, i] - x[o, 1, i], x[b, 2, i] - x[o, 2, i]
        wx, wy, wz = x[d, 0, i] - x[o, 0, i], x[d, 1, i] - x[o, 1, i], x[d, 2, i] - x[o, 2, i]
        total = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
        mixed = ux * vx + uy * vy + uz * vz + vx * wx + vy * wy + vz * wz + wx * ux + wy * uy + wz * uz
        j = tile.jacobian[r, i]
        longest2 = tile.edge_range[1, i]
        n = 1.5 - mixed / total
        part = j / total
        cube = 0.01171875 * n * n * n / (part * part / total)
        cubes[i] = cube if abs(j) > FLAT * longest2 * math.sqrt(longest2) else np.inf


@tile_kernel
def wedge_frobenius(tile: Tile, out: Lane) -> None:
    """Largest Frobenius aspect of the corners, of either sign."""
    cubes, worst = tile.work[0], tile.work[1]
    for i in range(LANES):
        worst[i] = 0.0
    for r in range(6):
        _wedge_cubes(tile, r, cubes)
        for i in range(LANES):
            worst[i] = max(worst[i], cubes[i])
    cube_roots(worst, out)


@tile_kernel
def wedge_condition(tile: Tile, out: Lane) -> None:
    """The same; inf where a corner is folded or flat."""
    wedge_frobenius(tile, out)
    for i in range(LANES):
        out[i] = out[i] if tile.jacobian_range[0, i] > 0.0 else np.inf


@tile_kernel
def wedge_mean_frobenius(tile: Tile, out: Lane) -> None:
    """Mean Frobenius aspect of the corners, of either sign."""
    cubes, roots = tile.work[0], tile.work[1]
    for i in range(LANES):
        out[i] = 0.0
    for r in range(6):
        _wedge_cubes(tile, r, cubes)
        cube_roots(cubes, roots)
        for i in range(LANES):
            out[i] += roots[i] / 6.0


@tile_kernel
def wedge_distortion(tile: Tile, out: Lane) -> None:
    """Smallest corner J over twice the volume, signed by J; 0 when flat."""
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        size = abs(tile.volume[i])
        out[i] = tile.jacobian_range[0, i] / (2.0 * size) if size > FLAT * longest2 * math.sqrt(longest2) else 0.0


@inner
def _gap(tile, a, b, i):  # type: ignore[no-untyped-def]
    """Distance of corners a and b."""
    x = tile.x
    return math.sqrt((x[b, 0, i] - x[a, 0, i]) ** 2 + (x[b, 1, i] - x[a, 1, i]) ** 2 + (x[b, 2, i] - x[a, 2, i]) ** 2)


@tile_kernel
def pyramid_scaled_jacobian(tile: Tile, out: Lane) -> None:
    """Smallest of the four tets of a base corner, its two neighbours and the apex; 2 - v for a v above 1."""
    for i in range(LANES):
        out[i] = np.inf
    for k in range(4):
        a, b = (k + 1) % 4, (k + 3) % 4
        for i in range(LANES):
            ka, kb, ab = _gap(tile, k, a, i), _gap(tile, k, b, i), _gap(tile, a, b, i)
            kt, at, bt = _gap(tile, k, 4, i), _gap(tile, a, 4, i), _gap(tile, b, 4, i)
            most = max(ka * kb * kt, ka * ab * at, kb * ab * bt, kt * at * bt)
            value = 2.0 * tile.jacobian[k, i] / most if most > 0.0 else 0.0
            out[i] = min(out[i], value)
    for i in range(LANES):
        size = abs(out[i])
        out[i] = math.copysign(2.0 - size if size > 1.0 else size, out[i])


@tile_kernel
def pyramid_shape(tile: Tile, out: Lane) -> None:
    """Shape of the base, times the cosine of the slant, times the height to the longest edge over sqrt(2) or its inverse."""
    x, base = tile.x, tile.face[4]
    for i in range(LANES):
        out[i] = np.inf
    for k in range(4):
        a, b = (k + 1) % 4, (k + 3) % 4
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[k, 0, i], x[a, 1, i] - x[k, 1, i], x[a, 2, i] - x[k, 2, i]
            vx, vy, vz = x[b, 0, i] - x[k, 0, i], x[b, 1, i] - x[k, 1, i], x[b, 2, i] - x[k, 2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            total = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz
            j = -(nx * base[0, i] + ny * base[1, i] + nz * base[2, i])  # the base's normal points out of the pyramid
            out[i] = min(out[i], j / total if total > 0.0 else 0.0)
    for i in range(LANES):
        ax, ay, az = base[0, i], base[1, i], base[2, i]
        area = math.sqrt(ax * ax + ay * ay + az * az)
        px = x[4, 0, i] - 0.25 * (x[0, 0, i] + x[1, 0, i] + x[2, 0, i] + x[3, 0, i])
        py = x[4, 1, i] - 0.25 * (x[0, 1, i] + x[1, 1, i] + x[2, 1, i] + x[3, 1, i])
        pz = x[4, 2, i] - 0.25 * (x[0, 2, i] + x[1, 2, i] + x[2, 2, i] + x[3, 2, i])
        height = -(px * ax + py * ay + pz * az) / area
        slant = height / math.sqrt(px * px + py * py + pz * pz)
        ideal = math.sqrt(0.5 * tile.edge_range[1, i])
        ratio = min(height, ideal) / max(height, ideal)
        sound = area > FLAT * tile.edge_range[1, i] and height > FLAT * ideal and out[i] > 0.0
        out[i] = 2.0 * out[i] / area * slant * ratio if sound else 0.0
