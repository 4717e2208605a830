"""Checks of shells, triangles and quadrilaterals: taper, skew and warp of Nastran and HyperMesh, heights, stretch."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.angles import smallest_angle
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import (
    Lane,
    angles,
    degrees_from_cotangent,
    diagonals,
    edges,
    faces,
    quad_axes,
)
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]

_QUAD = ("quad",)
_TRI = ("tri",)
_WARP = (edges, faces, quad_axes)


@inner
def _area(tile, i):  # type: ignore[no-untyped-def]
    """Area of the cell's only face, 0 when it is flat."""
    a = tile.face[0]
    area = math.sqrt(a[0, i] * a[0, i] + a[1, i] * a[1, i] + a[2, i] * a[2, i])
    return area if area > FLAT * tile.edge_range[1, i] else 0.0


@inner
def _corner_range(tile, low, high):  # type: ignore[no-untyped-def]
    """Smallest and largest triangle of three neighbouring corners over half the area; nan when that is 0."""
    x = tile.x
    for i in range(LANES):
        low[i], high[i] = np.inf, 0.0
    for k in range(4):
        a, b = (k + 1) % 4, (k + 3) % 4
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[k, 0, i], x[a, 1, i] - x[k, 1, i], x[a, 2, i] - x[k, 2, i]
            vx, vy, vz = x[b, 0, i] - x[k, 0, i], x[b, 1, i] - x[k, 1, i], x[b, 2, i] - x[k, 2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            n2 = nx * nx + ny * ny + nz * nz
            low[i] = min(low[i], n2)
            high[i] = max(high[i], n2)
    for i in range(LANES):
        area = _area(tile, i)
        low[i] = math.sqrt(low[i]) / area if area > 0.0 else np.nan
        high[i] = math.sqrt(high[i]) / area if area > 0.0 else np.nan


@tile_kernel
def smallest_corner(tile: Tile, out: Lane) -> None:
    """1 less the smallest corner triangle over half the area."""
    _corner_range(tile, tile.work[0], tile.work[1])
    for i in range(LANES):
        out[i] = 1.0 - tile.work[0, i]


@tile_kernel
def largest_corner(tile: Tile, out: Lane) -> None:
    """Largest corner triangle over half the area."""
    _corner_range(tile, tile.work[0], out)


@tile_kernel
def corner_deviation(tile: Tile, out: Lane) -> None:
    """Largest deviation of that ratio from 1."""
    low, high = tile.work[0], tile.work[1]
    _corner_range(tile, low, high)
    for i in range(LANES):
        above, below = high[i] - 1.0, 1.0 - low[i]
        out[i] = above if above > below or above != above else below


@tile_kernel
def midline_angle(tile: Tile, out: Lane) -> None:
    """Acute angle between the bisectors."""
    a = tile.axis
    for i in range(LANES):
        ux, uy, uz, vx, vy, vz = a[0, 0, i], a[0, 1, i], a[0, 2, i], a[1, 0, i], a[1, 1, i], a[1, 2, i]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        dot = abs(ux * vx + uy * vy + uz * vz)
        cot = dot / math.sqrt(nx * nx + ny * ny + nz * nz)
        out[i] = degrees_from_cotangent(cot) if cot == cot else np.nan


@inner
def _offset(tile, i):  # type: ignore[no-untyped-def]
    """Distance of the corners from the mean plane, over which they lie alternately above and below; nan without a plane."""
    a, t, area = tile.face[0], tile.mode[3], _area(tile, i)
    height = abs(t[0, i] * a[0, i] + t[1, i] * a[1, i] + t[2, i] * a[2, i])
    return height / area if area > 0.0 else np.nan


@tile_kernel
def warp_over_diagonals(tile: Tile, out: Lane) -> None:
    """2 H / (D1 + D2)."""
    x = tile.x
    for i in range(LANES):
        p2 = (x[2, 0, i] - x[0, 0, i]) ** 2 + (x[2, 1, i] - x[0, 1, i]) ** 2 + (x[2, 2, i] - x[0, 2, i]) ** 2
        q2 = (x[3, 0, i] - x[1, 0, i]) ** 2 + (x[3, 1, i] - x[1, 1, i]) ** 2 + (x[3, 2, i] - x[1, 2, i]) ** 2
        out[i] = 2.0 * _offset(tile, i) / (math.sqrt(p2) + math.sqrt(q2))


@tile_kernel
def gap_over_edge(tile: Tile, out: Lane) -> None:
    """100 times the distance between the diagonals, twice that of the corners, over the longest edge."""
    for i in range(LANES):
        out[i] = 200.0 * _offset(tile, i) / math.sqrt(tile.edge_range[1, i])


@tile_kernel
def rise_of_edge(tile: Tile, out: Lane) -> None:
    """Angle between the shortest edge and the mean plane: every edge rises by twice the distance of the corners."""
    x, a, t, least = tile.x, tile.face[0], tile.mode[3], tile.work[0]
    for i in range(LANES):
        least[i] = np.inf
    for k in range(4):
        b = (k + 1) % 4
        for i in range(LANES):
            ux, uy, uz = x[b, 0, i] - x[k, 0, i], x[b, 1, i] - x[k, 1, i], x[b, 2, i] - x[k, 2, i]
            nx, ny, nz = uy * a[2, i] - uz * a[1, i], uz * a[0, i] - ux * a[2, i], ux * a[1, i] - uy * a[0, i]
            least[i] = min(least[i], nx * nx + ny * ny + nz * nz)
    for i in range(LANES):
        rise = 2.0 * abs(t[0, i] * a[0, i] + t[1, i] * a[1, i] + t[2, i] * a[2, i])
        angle = degrees_from_cotangent(math.sqrt(least[i]) / rise)
        out[i] = angle if tile.edge_range[0, i] > 0.0 and _area(tile, i) > 0.0 else np.nan


@tile_kernel
def smallest_height(tile: Tile, out: Lane) -> None:
    """Height over the longest edge of a triangle."""
    for i in range(LANES):
        area = _area(tile, i)
        out[i] = 2.0 * area / math.sqrt(tile.edge_range[1, i]) * tile.unit[i] if area > 0.0 else 0.0


@tile_kernel
def side_over_height(tile: Tile, out: Lane) -> None:
    """sqrt(3)/2 of the longest edge over the height on it."""
    for i in range(LANES):
        area = _area(tile, i)
        out[i] = 0.25 * math.sqrt(3.0) * tile.edge_range[1, i] / area if area > 0.0 else np.inf


@tile_kernel
def triangle_stretch(tile: Tile, out: Lane) -> None:
    """sqrt(12) r / Lmax, r = 2 A over the perimeter."""
    e = tile.edge2
    for i in range(LANES):
        perimeter = math.sqrt(e[0, i]) + math.sqrt(e[1, i]) + math.sqrt(e[2, i])
        area = _area(tile, i)
        inscribed = 2.0 * area / perimeter
        out[i] = math.sqrt(12.0) * inscribed / math.sqrt(tile.edge_range[1, i]) if area > 0.0 else 0.0


@tile_kernel
def quad_stretch(tile: Tile, out: Lane) -> None:
    """sqrt(2) shortest edge / longest diagonal."""
    edge, diagonal = tile.edge_range[0], tile.diagonal_range[1]
    for i in range(LANES):
        out[i] = math.sqrt(2.0 * edge[i] / diagonal[i]) if diagonal[i] > 0.0 else 0.0


@tile_kernel
def diagonal_ratio_inverse(tile: Tile, out: Lane) -> None:
    """Shorter over longer diagonal."""
    low, high = tile.diagonal_range[0], tile.diagonal_range[1]
    for i in range(LANES):
        out[i] = math.sqrt(low[i] / high[i]) if high[i] > 0.0 else 0.0


ROWS = (
    Metric(
        id="hm.min_height", title="Smallest height (HyperMesh)", on=_TRI, unit="L", low=0.0, high=math.inf, best="none", ideal=None,
        degenerate=0.0, systems=("HyperMesh: length (min), minimal normalized height",), formula="2 A / longest edge",
        source="Altair HyperMesh help, element quality calculations", stages=(edges, faces), kernel=smallest_height,
    ),
    Metric(
        id="hm.taper", title="Taper (HyperMesh)", on=_QUAD, unit="1", low=0.0, high=1.0, best="low", ideal=0.0, degenerate=math.nan,
        systems=("HyperMesh: taper",), formula="1 - smallest triangle of three neighbouring corners / (A/2)",
        source="Altair HyperMesh help, element quality calculations; unverified for warped quadrilaterals",
        caveat="Below 0 on warped quadrilaterals, whose triangles are larger than their shadow; reports clamp it, --cells does not.",
        stages=(edges, faces), kernel=smallest_corner,
    ),
    Metric(
        id="hm.warpage_alt", title="Warpage in percent (HyperMesh-Alt)", on=_QUAD, unit="1", low=0.0, high=math.inf, best="low",
        ideal=0.0, degenerate=math.nan, systems=("HyperMesh-Alt: warpage",),
        formula="100 h / Lmax, h the distance between the diagonals, Lmax the longest edge",
        source="Altair HyperMesh help, alternative element checks", stages=_WARP, kernel=gap_over_edge,
    ),
    Metric(
        id="nastran.taper", title="Taper ratio (Nastran)", on=_QUAD, unit="1", low=1.0, high=math.inf, best="low", ideal=1.0,
        degenerate=math.nan, systems=("HyperMesh: taper (Nastran)",), formula="largest triangle of three neighbouring corners / (A/2)",
        source="Altair HyperMesh help, Nastran checks",
        caveat="2 for a quadrilateral with three corners on a line. GEOMCHECK Q4_TAPER counts from 0: see femap.alternate_taper.",
        stages=(edges, faces), kernel=largest_corner,
    ),
    Metric(
        id="femap.alternate_taper", title="Alternate taper (FEMAP)", on=_QUAD, unit="1", low=0.0, high=math.inf, best="low", ideal=0.0,
        degenerate=math.nan, systems=("FEMAP: Alternate Taper", "MSC Nastran: Q4_TAPER"),
        formula="largest |triangle of three neighbouring corners / (A/2) - 1|",
        source="MSC Nastran Quick Reference Guide, GEOMCHECK; unverified, for FEMAP too",
        caveat="Equals hm.taper on plane convex quadrilaterals.", stages=(edges, faces), kernel=corner_deviation,
    ),
    Metric(
        id="nastran.skew", title="Skew angle (Nastran)", on=("tri", "quad"), unit="deg", low=0.0, high=90.0, best="high", ideal=None,
        degenerate=math.nan, systems=("MSC Nastran: Q4_SKEW, T3_SKEW",),
        formula="quad: angle between the mid-lines, at most 90; tri: smallest corner angle",
        source="MSC Nastran Quick Reference Guide, GEOMCHECK; unverified",
        caveat="Higher is better, unlike hm.skew, which is 90 less this value on quadrilaterals. 90 and 60 are ideal.",
        kernel={"tri": smallest_angle, "quad": midline_angle}, stages={"tri": (angles,), "quad": (quad_axes,)},
    ),
    Metric(
        id="nastran.warp", title="Warp coefficient (Nastran)", on=_QUAD, unit="1", low=0.0, high=math.inf, best="low", ideal=0.0,
        degenerate=math.nan, systems=("MSC Nastran: Q4_WARP", "FEMAP: Nastran Warping", "HyperMesh: warpage (Nastran)"),
        formula="2 H / (D1 + D2), H the distance of the corners from the mean plane, D1 and D2 the diagonals",
        source="Altair HyperMesh help, Nastran checks; for FEMAP unverified", stages=_WARP, kernel=warp_over_diagonals,
    ),
    Metric(
        id="salome.warp", title="Warping (Salome)", on=_QUAD, unit="deg", low=0.0, high=90.0, best="low", ideal=0.0,
        degenerate=math.nan, systems=("Salome: warping", "Patran: Warp"),
        formula="asin(h / l), h the distance of the corners from the mean plane, l the shortest half edge",
        source="Salome mesh user guide, Warping; Altair HyperMesh help, Patran checks",
        caveat="Undefined where an edge has no length.", stages=_WARP, kernel=rise_of_edge,
    ),
    Metric(
        id="patran.aspect_ratio", title="Triangle aspect ratio (Patran)", on=_TRI, unit="1", low=1.0, high=math.inf, best="low",
        ideal=1.0, degenerate=math.inf, systems=("Patran: Aspect (tri)",), formula="sqrt(3)/2 max(side / height on it)",
        source="Altair HyperMesh help, Patran checks", caveat="1 / icem.aspect_ratio.", stages=(edges, faces), kernel=side_over_height,
    ),
    Metric(
        id="ideas.stretch", title="Stretch (I-deas)", on=("tri", "quad"), unit="1", low=0.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0, systems=("I-deas: stretch",),
        formula="tri sqrt(12) r / Lmax, r the radius of the inscribed circle; quad sqrt(2) shortest edge / longest diagonal",
        source="Altair HyperMesh help, I-deas checks",
        caveat="Of a quadrilateral 1 - gambit.stretch; slightly above 1 on warped ones.",
        kernel={"tri": triangle_stretch, "quad": quad_stretch},
        stages={"tri": (edges, faces), "quad": (edges, diagonals)},
    ),
    Metric(
        id="seed.quad_diag_ratio_0_1", title="Diagonal ratio from 0 to 1", on=_QUAD, unit="1", low=0.0, high=1.0, best="high",
        ideal=1.0, degenerate=0.0, systems=(), formula="shorter / longer diagonal",
        source="CFDyna, Meshing for Numerical Simulations", caveat="1 / gambit.diagonal_ratio; 1 for every rectangle.",
        stages=(diagonals,), kernel=diagonal_ratio_inverse,
    ),
)  # fmt: skip
