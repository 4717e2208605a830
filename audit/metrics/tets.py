"""Checks of tets by their heights: collapse, aspect ratio, stretch, and the angles between faces."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import tet_volume
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, degrees, edges, faces, volume
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]

_ON = ("tet",)
_STAGES = (edges, faces, volume)


@inner
def _area_range(tile, low, high):  # type: ignore[no-untyped-def]
    """Squared areas of the smallest and the largest face."""
    for i in range(LANES):
        low[i], high[i] = np.inf, 0.0
    for f in range(4):
        a = tile.face[f]
        for i in range(LANES):
            a2 = a[0, i] * a[0, i] + a[1, i] * a[1, i] + a[2, i] * a[2, i]
            low[i] = min(low[i], a2)
            high[i] = max(high[i], a2)


@tile_kernel
def square_root_collapse(tile: Tile, out: Lane) -> None:
    """Smallest height over the root of its face's area, over 1.24; that is on the largest face."""
    low, high, size = tile.work[0], tile.work[1], tile.work[2]
    _area_range(tile, low, high)
    tet_volume(tile, size)
    for i in range(LANES):
        area = math.sqrt(high[i])
        out[i] = 3.0 * abs(size[i]) / (1.24 * area * math.sqrt(area)) if size[i] != 0.0 else 0.0


@tile_kernel
def height_ratio(tile: Tile, out: Lane) -> None:
    """Longest over shortest height, which is largest over smallest face."""
    low, high, size = tile.work[0], tile.work[1], tile.work[2]
    _area_range(tile, low, high)
    tet_volume(tile, size)
    for i in range(LANES):
        out[i] = math.sqrt(high[i] / low[i]) if size[i] != 0.0 else np.inf


@tile_kernel
def edge_over_height(tile: Tile, out: Lane) -> None:
    """Longest edge over smallest height, 3 V over the largest face."""
    low, high, size = tile.work[0], tile.work[1], tile.work[2]
    _area_range(tile, low, high)
    tet_volume(tile, size)
    for i in range(LANES):
        out[i] = math.sqrt(tile.edge_range[1, i] * high[i]) / (3.0 * abs(size[i])) if size[i] != 0.0 else np.inf


@tile_kernel
def height_over_edge(tile: Tile, out: Lane) -> None:
    """The reciprocal."""
    low, high, size = tile.work[0], tile.work[1], tile.work[2]
    _area_range(tile, low, high)
    tet_volume(tile, size)
    for i in range(LANES):
        out[i] = 3.0 * abs(size[i]) / math.sqrt(tile.edge_range[1, i] * high[i]) if size[i] != 0.0 else 0.0


@tile_kernel
def stretch(tile: Tile, out: Lane) -> None:
    """sqrt(24) r / Lmax, r = 3 |V| over the area of all faces."""
    size, surface = tile.work[0], tile.work[1]
    tet_volume(tile, size)
    for i in range(LANES):
        surface[i] = 0.0
    for f in range(4):
        a = tile.face[f]
        for i in range(LANES):
            surface[i] += math.sqrt(a[0, i] * a[0, i] + a[1, i] * a[1, i] + a[2, i] * a[2, i])
    for i in range(LANES):
        longest = math.sqrt(tile.edge_range[1, i])
        out[i] = math.sqrt(24.0) * 3.0 * abs(size[i]) / (surface[i] * longest) if size[i] != 0.0 else 0.0


@tile_kernel
def edge_angle(tile: Tile, out: Lane) -> None:
    """Largest deviation from 90 degrees of the angle between two faces; nan where a face is flat."""
    work = tile.work
    small, large, flat = work[0], work[1], work[2]
    for i in range(LANES):
        small[i], large[i], flat[i] = -np.inf, np.inf, 0.0
    for f in range(4):
        a = tile.face[f]
        for i in range(LANES):
            a2 = a[0, i] * a[0, i] + a[1, i] * a[1, i] + a[2, i] * a[2, i]
            flat[i] += 1.0 if math.sqrt(a2) <= 1e-14 * tile.edge_range[1, i] else 0.0
    for f in range(3):
        for g in range(f + 1, 4):
            a, b = tile.face[f], tile.face[g]
            for i in range(LANES):
                ax, ay, az, bx, by, bz = a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i]
                nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
                dot = -(ax * bx + ay * by + az * bz)  # both normals point outwards
                s = dot * abs(dot) / (nx * nx + ny * ny + nz * nz)
                small[i] = s if s > small[i] else small[i]
                large[i] = s if s < large[i] else large[i]
    for i in range(LANES):
        deviation = max(90.0 - degrees(small[i]), degrees(large[i]) - 90.0)
        out[i] = deviation if flat[i] == 0.0 else np.nan


ROWS = (
    Metric(
        id="hm.tet_collapse", title="Tetra collapse (HyperMesh)", on=_ON, unit="1", low=0.0, high=1.001, best="high", ideal=None,
        degenerate=0.0, systems=("HyperMesh: tetra collapse",),
        formula="min over corners of height / sqrt(area of the opposite face), over 1.24",
        source="Altair HyperMesh help, element quality calculations",
        caveat="The constant is rounded: a regular tet scores 1.0007. OptiStruct divides by 1.2408 instead.",
        stages=_STAGES, kernel=square_root_collapse,
    ),
    Metric(
        id="femap.tet_collapse", title="Tet collapse (FEMAP)", on=_ON, unit="1", low=1.0, high=math.inf, best="low", ideal=1.0,
        degenerate=math.inf, systems=("FEMAP: Tet Collapse",),
        formula="longest / shortest distance of a corner from the opposite face",
        source="CFDyna, Meshing for Numerical Simulations",
        caveat="Blind to slivers: in a flat tet of four points near a square all heights shrink alike, and it scores 1.",
        stages=_STAGES, kernel=height_ratio,
    ),
    Metric(
        id="nastran.tetraar", title="Tet aspect ratio (Nastran)", on=_ON, unit="1", low=math.sqrt(1.5), high=math.inf, best="low",
        ideal=math.sqrt(1.5), degenerate=math.inf,
        systems=("MSC Nastran: TETRAAR, TET_AR", "HyperMesh: vol. aspect ratio", "ICEM CFD: Tetra special"),
        formula="longest edge / smallest height", source="Altair HyperMesh help, Nastran checks and *elementtestaltitudeaspect",
        caveat="1.2247 for a regular tet.", stages=_STAGES, kernel=edge_over_height,
    ),
    Metric(
        id="simlab.collapse_ratio", title="Collapse ratio (SimLab)", on=_ON, unit="1", low=0.0, high=math.sqrt(2.0 / 3.0), best="high",
        ideal=math.sqrt(2.0 / 3.0), degenerate=0.0, systems=("SimLab: tet collapse ratio",),
        formula="smallest height / longest edge", source="Altair SimLab help, element quality",
        caveat="0.8165 for a regular tet; 1 / nastran.tetraar.", stages=_STAGES, kernel=height_over_edge,
    ),
    Metric(
        id="simlab.tet_stretch", title="Tet stretch (SimLab)", on=_ON, unit="1", low=0.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0, systems=("SimLab: stretch (tet)",), formula="sqrt(24) r / Lmax, r the radius of the inscribed sphere",
        source="Altair SimLab help, element quality", caveat="The reciprocal of Verdict's tet aspect ratio.",
        stages=_STAGES, kernel=stretch,
    ),
    Metric(
        id="optistruct.edge_angle", title="Edge angle (OptiStruct)", on=_ON, unit="deg", low=0.0, high=90.0, best="low", ideal=None,
        degenerate=math.nan, systems=("OptiStruct: edge angle (CTETRA)",),
        formula="largest |90 - angle between two faces| of the six edges",
        source="Altair OptiStruct help, CTETRA element checks", caveat="19.47 for a regular tet, whose faces meet at 70.53.",
        stages=(edges, faces), kernel=edge_angle,
    ),
)  # fmt: skip
