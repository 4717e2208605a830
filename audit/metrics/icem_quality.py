"""ICEM CFD's quality: another quantity for every cell type, and in each of the two help books."""

from __future__ import annotations

import math

from meshwright.audit.cells import LINEAR_TYPES
from meshwright.audit.jit import inner
from meshwright.audit.metrics.angles import internal_angle_deviation
from meshwright.audit.metrics.aspect import icem_tet_aspect, icem_triangle_aspect
from meshwright.audit.metrics.dihedral import SIDES, areas
from meshwright.audit.metrics.fluent import is_flat
from meshwright.audit.metrics.jacobian import corner_determinant, quad_determinant
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, angles, edges, faces, jacobians, volume
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel
from meshwright.audit.metrics.warp import warps

__all__ = ["ROWS"]


@tile_kernel
def tet_height(tile: Tile, out: Lane) -> None:
    """Smallest height over the longest edge of the face it stands on, 1 for a regular tet, with the sign of the volume."""
    base2, sides = tile.work[0], SIDES[len(tile.tables.edges)]
    for i in range(LANES):
        base2[i] = 0.0
    for f in range(tile.face.shape[0]):
        a, b, c = tile.edge2[sides[f, 0]], tile.edge2[sides[f, 1]], tile.edge2[sides[f, 2]]
        for i in range(LANES):
            # area times longest edge, squared, the edge in units of the cell's longest
            share = max(a[i], b[i], c[i]) / tile.edge_range[1, i]
            base2[i] = max(base2[i], tile.area2[f, i] * share)
    for i in range(LANES):
        ratio = 3.0 * tile.volume[i] / (math.sqrt(base2[i]) * math.sqrt(tile.edge_range[1, i]))
        out[i] = 0.0 if is_flat(tile, i) else math.sqrt(1.5) * ratio


@inner
def _and(low, part):  # type: ignore[no-untyped-def]
    """The smaller of two scores; one that is not defined counts as 0."""
    part = part if part == part else 0.0
    return part if part < low else low


@tile_kernel
def wedge_quality(tile: Tile, out: Lane) -> None:
    """Determinant or 1 - warp / 90, the smaller."""
    corner_determinant(tile, out)
    for i in range(LANES):
        out[i] = _and(out[i], 1.0 - tile.warp[i] / 90.0)


@tile_kernel
def hex_quality(tile: Tile, out: Lane) -> None:
    """Determinant, 1 - deviation from right angles / 90 or 1 - warp / 180, the smallest."""
    corner_determinant(tile, out)
    deviation = tile.work[0]
    internal_angle_deviation(tile, deviation)
    for i in range(LANES):
        out[i] = _and(_and(out[i], 1.0 - deviation[i] / 90.0), 1.0 - tile.warp[i] / 180.0)


ROWS = (
    Metric(
        id="icem.quality", title="Quality (ICEM)", on=LINEAR_TYPES, unit="1", low=-1.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0, systems=("ICEM CFD: Quality (edit mesh)",),
        formula="tri and tet: icem.aspect_ratio; quad and pyramid: determinant; wedge: min(determinant, 1 - warp/90); "
        "hex: min(determinant, 1 - max |T - 90|/90, 1 - warp/180), T the corner angles of the faces",
        source="Ansys ICEM CFD help 24.2, edit-mesh quality metrics (quality)",
        caveat="The help gives the hex's second part as 'max orthogonality', below 0 beyond 90 degrees from right angles, without "
        "a formula. Read as the corner angles of the Angle criterion: an angle between two face normals never is that far off. "
        "A part that is not defined counts as 0. Pre-mesh quality differs for tri and tet: icem.quality_premesh.",
        kernel={
            "tri": icem_triangle_aspect, "tet": icem_tet_aspect, "quad": quad_determinant, "pyramid": corner_determinant,
            "wedge": wedge_quality, "hex": hex_quality,
        },
        stages={
            "tri": (edges,), "tet": (edges, faces, volume), "quad": (faces,), "pyramid": (edges, jacobians),
            "wedge": (edges, jacobians, warps), "hex": (edges, jacobians, angles, warps),
        },
    ),
    Metric(
        id="icem.quality_premesh", title="Pre-mesh quality (ICEM)", on=("tri", "tet"), unit="1", low=-1.0, high=1.0, best="high",
        ideal=1.0, degenerate=0.0, systems=("ICEM CFD: Quality (pre-mesh)",),
        formula="min over the sides of height / longest edge of the side, divided by that of the regular cell, sqrt(3)/2 or sqrt(2/3); "
        "with the sign of the volume",
        source="Ansys ICEM CFD help 24.2, pre-mesh quality (quality): height to base length of each side, normalised",
        caveat="ICEM CFD's two help books define tri and tet quality in two ways; the other is icem.quality. On triangles both "
        "are the same number, on tets not: a needle ten times as high as wide has 0.022 there and 0.106 here.",
        kernel={"tri": icem_triangle_aspect, "tet": tet_height},
        stages={"tri": (edges,), "tet": (edges, faces, volume, areas)},
    ),
)  # fmt: skip
