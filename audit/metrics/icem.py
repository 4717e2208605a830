"""ICEM CFD's criteria beyond aspect ratio and determinant."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.metrics.angles import internal_angle_deviation
from meshwright.audit.metrics.aspect import FLAT, tet_aspect, triangle_aspect, triangle_size_skew
from meshwright.audit.metrics.dihedral import areas
from meshwright.audit.metrics.fluent import ABOUT_THE_CENTRE, is_flat, slants
from meshwright.audit.metrics.icem_quality import ROWS as QUALITY
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, angles, degrees, edges, faces, quad_axes, volume
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel
from meshwright.audit.metrics.warp import warps

__all__ = ["LEFT_OUT", "ROWS"]


@tile_kernel
def max_warp(tile: Tile, out: Lane) -> None:
    """Largest angle between the two triangles of a quadrilateral face."""
    for i in range(LANES):
        out[i] = tile.warp[i]


@tile_kernel
def triangle_skew(tile: Tile, out: Lane) -> None:
    """Area over that of the equilateral triangle in the same circumcircle."""
    triangle_size_skew(tile, out)
    for i in range(LANES):
        out[i] = 1.0 - out[i]


@tile_kernel
def quad_skew(tile: Tile, out: Lane) -> None:
    """Acute angle between the lines through the middles of opposite edges, over 90 degrees."""
    a = tile.axis
    for i in range(LANES):
        p2 = a[0, 0, i] ** 2 + a[0, 1, i] ** 2 + a[0, 2, i] ** 2
        q2 = a[1, 0, i] ** 2 + a[1, 1, i] ** 2 + a[1, 2, i] ** 2
        nx = a[0, 1, i] * a[1, 2, i] - a[0, 2, i] * a[1, 1, i]
        ny = a[0, 2, i] * a[1, 0, i] - a[0, 0, i] * a[1, 2, i]
        nz = a[0, 0, i] * a[1, 1, i] - a[0, 1, i] * a[1, 0, i]
        dot = a[0, 0, i] * a[1, 0, i] + a[0, 1, i] * a[1, 1, i] + a[0, 2, i] * a[1, 2, i]
        defined = min(p2, q2) > (FLAT * FLAT) * max(p2, q2)
        angle = degrees(dot * dot / (nx * nx + ny * ny + nz * nz))
        out[i] = angle / 90.0 if defined else np.nan


@tile_kernel
def hex_skew(tile: Tile, out: Lane) -> None:
    """1 minus the largest angle between a face's normal and the line from centre to face centre, over 90 degrees."""
    for i in range(LANES):
        out[i] = 1.0 - degrees(tile.slant[i]) / 90.0


@tile_kernel
def right_angle(tile: Tile, out: Lane) -> None:
    """90 degrees minus the largest deviation of a corner angle from 90 degrees."""
    internal_angle_deviation(tile, out)
    for i in range(LANES):
        out[i] = 90.0 - out[i]


@tile_kernel
def tetra_special(tile: Tile, out: Lane) -> None:
    """Longest edge over smallest height, which stands on the largest face: h = 3 V / A."""
    largest2 = tile.work[0]
    for i in range(LANES):
        largest2[i] = 0.0
    for f in range(tile.face.shape[0]):
        for i in range(LANES):
            largest2[i] = max(largest2[i], tile.area2[f, i])
    for i in range(LANES):
        ratio = math.sqrt(tile.edge_range[1, i]) * math.sqrt(largest2[i]) / (3.0 * abs(tile.volume[i]))
        out[i] = np.inf if is_flat(tile, i) else ratio


# Rows of opposite faces of a hex.
_OPPOSITE = np.array([[0, 1], [2, 4], [3, 5]])


@tile_kernel
def opposite_areas(tile: Tile, out: Lane) -> None:
    """Largest ratio of the areas of two opposite faces; undefined where both of a pair have none."""
    for i in range(LANES):
        out[i] = 0.0
    for r in range(3):
        p, q = tile.area2[_OPPOSITE[r, 0]], tile.area2[_OPPOSITE[r, 1]]
        for i in range(LANES):
            ratio = max(p[i], q[i]) / min(p[i], q[i])
            out[i] = out[i] if out[i] >= ratio else ratio
    for i in range(LANES):
        out[i] = math.sqrt(out[i])


@tile_kernel
def opposite_parallelism(tile: Tile, out: Lane) -> None:
    """Smallest cosine between the normal of a face and the reversed one of its opposite, 0 where one has no direction."""
    for i in range(LANES):
        out[i] = np.inf
    for r in range(3):
        f, g = _OPPOSITE[r, 0], _OPPOSITE[r, 1]
        a, b = tile.face[f], tile.face[g]
        for i in range(LANES):
            dot = -(a[0, i] * b[0, i] + a[1, i] * b[1, i] + a[2, i] * b[2, i])
            product = tile.area2[f, i] * tile.area2[g, i]
            s = dot * abs(dot) / product if product > 0.0 else 0.0
            out[i] = min(out[i], s)
    for i in range(LANES):
        out[i] = math.copysign(math.sqrt(abs(out[i])), out[i])


@tile_kernel
def triangle_radii(tile: Tile, out: Lane) -> None:
    """2 r / R."""
    triangle_aspect(tile, out)
    for i in range(LANES):
        out[i] = 1.0 / out[i] if out[i] < np.inf else 0.0


@tile_kernel
def tet_radii_ratio(tile: Tile, out: Lane) -> None:
    """3 r / R, with the sign of the volume."""
    tet_aspect(tile, out)
    for i in range(LANES):
        out[i] = math.copysign(1.0 / out[i], tile.volume[i]) if out[i] < np.inf else 0.0


LEFT_OUT = {
    "Eriksson skewness": "no published formula: the help names the closest parallelepiped and not how it is fitted",
    "Distortion": "no published reference area or volume; Verdict's distortion is another, documented metric",
    "Max dihedral angle": "no published formula; dihedral.max is the usual quantity of that name",
    "Volume change": "not said which neighbours count, nor whether the ratio can fall below 1",
    "Max sector volume": "no published definition of a sector",
    "Max ratio": "no published formula; gambit.edge_ratio compares all edges of a cell",
    "Min side": "the shortest edge is edge.min; the extra rule for quadrilaterals is published only in outline",
    "Prism thickness": "no published formula",
    "Taper": "no published formula; GAMBIT, Verdict and HyperMesh each have another taper",
    "Hex face aspect ratio": "no published formula",
    "Hex face distortion": "no published formula",
    "Ford": "no published formula",
    "X-size": "no published formula",
    "Max ortho": "no published formula for the criterion by itself; icem.quality says how it reads it",
    "Min ortho": "no published formula",
}
"""Criteria of ICEM CFD without a row, and why: a formula of our own under ICEM's name would be a wrong number."""

_SKEW_HELP = "Ansys ICEM CFD help 24.2, edit-mesh quality metrics (skew)"

ROWS = (
    Metric(
        id="icem.skew", title="Skew (ICEM)", on=("tri", "quad", "hex"), unit="1", low=-1.0, high=1.0, best="high", ideal=1.0,
        degenerate=0.0, systems=("ICEM CFD: Skew",),
        formula="tri A / A of the equilateral in the same circumcircle; quad: acute angle of the mid-lines / 90; "
        "hex: 1 - largest angle between a face's normal and the line from centre to face centre / 90",
        source=_SKEW_HELP,
        caveat="Three quantities under one name. Slides that divide a quad's angle by 180 would give a square 0.5. Negative "
        "for a mirrored hex; undefined for a quad whose mid-line has no length, as in a bow tie.",
        kernel={"tri": triangle_skew, "quad": quad_skew, "hex": hex_skew},
        stages={"tri": (edges,), "quad": (quad_axes,), "hex": (*ABOUT_THE_CENTRE, slants)},
    ),
    Metric(
        id="icem.max_warp", title="Max warp", on=("quad", "pyramid", "wedge", "hex"), unit="deg", low=0.0, high=180.0,
        best="low", ideal=0.0, degenerate=math.nan,
        systems=("ICEM CFD: Max warp", "HyperMesh: warpage", "OptiStruct: warp angle", "ANSYS: warping angle", "PRIMER: warpage"),
        formula="angle between the normals of the two triangles of a quadrilateral face, the worse diagonal, the worst face",
        source="Ansys ICEM CFD help 24.2 (warpage); Oasys PRIMER manual (worse of both diagonals)",
        caveat="180 for a concave face or a bow tie, even in a plane. Undefined where three corners of a face lie on a line.",
        stages=(edges, warps), kernel=max_warp,
    ),
    Metric(
        id="icem.angle", title="Angle (ICEM)", on=("quad", "hex"), unit="deg", low=-180.0, high=90.0, best="high", ideal=90.0,
        degenerate=math.nan, systems=("ICEM CFD: Angle (pre-mesh)",),
        formula="90 - max |T - 90| over the corners of all faces",
        source="Ansys ICEM CFD User's Manual 24.2, pre-mesh quality: largest deviation from 90, on an axis from 0 to 90",
        caveat="The manual's axis runs from 0 to 90, so the deviation is turned round. Negative where a corner opens beyond "
        "180 degrees. 18 is the limit users give.",
        stages=(angles,), kernel=right_angle,
    ),
    Metric(
        id="icem.tetra_special", title="Tetra special", on=("tet",), unit="1", low=1.0, high=math.inf, best="low",
        ideal=math.sqrt(1.5), degenerate=math.inf, systems=("ICEM CFD: Tetra special",),
        formula="longest edge / smallest height",
        source="Ansys ICEM CFD help 24.2 (tetra special)", caveat="sqrt(3/2) = 1.2247 for a regular tet.",
        stages=(edges, faces, volume, areas), kernel=tetra_special,
    ),
    Metric(
        id="icem.opp_face_area_ratio", title="Opposite face area ratio", on=("hex",), unit="1", low=1.0, high=math.inf,
        best="low", ideal=1.0, degenerate=math.inf, systems=("ICEM CFD: Opp face area ratio",),
        formula="max over the three pairs of opposite faces of larger / smaller area",
        source="Ansys ICEM CFD help 24.2 (opposite face area ratio), which shows 0 to 20",
        caveat="Area of the mean plane. Infinite where one face of a pair has no area, undefined where both have none.",
        stages=(edges, faces, areas), kernel=opposite_areas,
    ),
    Metric(
        id="icem.opp_face_parallelism", title="Opposite face parallelism", on=("hex",), unit="1", low=-1.0, high=1.0,
        best="high", ideal=1.0, degenerate=0.0, systems=("ICEM CFD: Opp face parallelism",),
        formula="min over the three pairs of opposite faces of -n1.n2, n the outward unit normals",
        source="Ansys ICEM CFD help 24.2 (opposite face parallelism): dot product of the normals",
        stages=(edges, faces, areas), kernel=opposite_parallelism,
    ),
    Metric(
        id="icem.r_over_R_x2", title="Twice inscribed over circumscribed radius", on=("tri",), unit="1", low=0.0, high=1.0,
        best="high", ideal=1.0, degenerate=0.0, systems=("Gmsh: gamma (tri)",),
        formula="2 r / R, the reciprocal of GAMBIT's aspect ratio",
        source="CFDyna, Meshing for Numerical Simulations; Gmsh reference manual (gamma)",
        caveat="Quoted as ICEM CFD's aspect ratio; the help's own is icem.aspect_ratio: 0.577 for a right isosceles triangle, 0.828 here.",
        kernel=triangle_radii,
    ),
    Metric(
        id="icem.r_over_R_x3", title="Three times inscribed over circumscribed radius", on=("tet",), unit="1", low=-1.0, high=1.0,
        best="high", ideal=1.0, degenerate=0.0, systems=("Gmsh: gamma (tet)",),
        formula="3 r / R, with the sign of the volume; the reciprocal of GAMBIT's aspect ratio",
        source="CFDyna, Meshing for Numerical Simulations; Gmsh reference manual (gamma)",
        caveat="Quoted as ICEM CFD's aspect ratio; the help's own is icem.aspect_ratio: 0.5 for the corner of a cube, 0.732 here.",
        stages=(edges, faces, volume), kernel=tet_radii_ratio,
    ),
    *QUALITY,
)  # fmt: skip
