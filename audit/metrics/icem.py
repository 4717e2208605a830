"""ICEM CFD's criteria beyond aspect ratio and determinant."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.angles import internal_angle_deviation
from meshwright.audit.metrics.aspect import (
    FLAT,
    icem_tet_aspect,
    icem_triangle_aspect,
    tet_aspect,
    triangle_aspect,
    triangle_size_skew,
)
from meshwright.audit.metrics.dihedral import SIDES, areas
from meshwright.audit.metrics.fluent import ABOUT_THE_CENTRE, is_flat, slants
from meshwright.audit.metrics.jacobian import corner_determinant, quad_determinant
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import (
    Lane,
    angles,
    degrees,
    edges,
    faces,
    jacobians,
    quad_axes,
    volume,
)
from meshwright.audit.metrics.tile import LANES, Tile, stage, tile_kernel

__all__ = ["LEFT_OUT", "ROWS", "warps"]


@stage
def warps(tile: Tile, out: Lane) -> None:
    """Largest angle between the two triangles of a quadrilateral face, over both diagonals and all faces; needs `edges`.

    The product of the two normals points along the diagonal and has the length of the diagonal times the determinant of
    the face's three edges at a corner. Undefined where one of the triangles is flat.
    """
    quads, x, sides = tile.tables.quads, tile.x, SIDES[len(tile.tables.edges)]
    worst, margin = tile.work[0], tile.work[1]
    for i in range(LANES):
        worst[i], margin[i] = np.inf, np.inf
    for r in range(len(quads)):
        a, b, c, d = quads[r, 0], quads[r, 1], quads[r, 2], quads[r, 3]
        f = len(tile.tables.tris) + r
        ab, bc = tile.edge2[sides[f, 0]], tile.edge2[sides[f, 1]]
        cd, da = tile.edge2[sides[f, 2]], tile.edge2[sides[f, 3]]
        for i in range(LANES):
            ex, ey, ez = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
            fx, fy, fz = x[c, 0, i] - x[b, 0, i], x[c, 1, i] - x[b, 1, i], x[c, 2, i] - x[b, 2, i]
            gx, gy, gz = x[d, 0, i] - x[c, 0, i], x[d, 1, i] - x[c, 1, i], x[d, 2, i] - x[c, 2, i]
            hx, hy, hz = x[a, 0, i] - x[d, 0, i], x[a, 1, i] - x[d, 1, i], x[a, 2, i] - x[d, 2, i]
            # twice the area vectors of the triangles at the corners a, b, c and d
            ax, ay, az = hy * ez - hz * ey, hz * ex - hx * ez, hx * ey - hy * ex
            bx, by, bz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
            cx, cy, cz = fy * gz - fz * gy, fz * gx - fx * gz, fx * gy - fy * gx
            dx, dy, dz = gy * hz - gz * hy, gz * hx - gx * hz, gx * hy - gy * hx
            det = gx * bx + gy * by + gz * bz
            ac, bd = ax * cx + ay * cy + az * cz, bx * dx + by * dy + bz * dz
            px, py, pz = x[c, 0, i] - x[a, 0, i], x[c, 1, i] - x[a, 1, i], x[c, 2, i] - x[a, 2, i]
            qx, qy, qz = x[d, 0, i] - x[b, 0, i], x[d, 1, i] - x[b, 1, i], x[d, 2, i] - x[b, 2, i]
            p2, q2 = px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz
            across_p = bd * abs(bd) / (det * det * p2)
            across_q = ac * abs(ac) / (det * det * q2)
            worst[i] = min(worst[i], across_p, across_q)
            least = min(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz)
            least = min(least, cx * cx + cy * cy + cz * cz, dx * dx + dy * dy + dz * dz)
            longest2 = max(ab[i], bc[i], cd[i], da[i])
            margin[i] = min(margin[i], least - (2.0 * FLAT * longest2) ** 2)
    for i in range(LANES):
        tile.warp[i] = degrees(worst[i]) if margin[i] > 0.0 else np.nan


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
_QUALITY_TYPES = ("tri", "quad", "tet", "pyramid", "wedge", "hex")

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
        systems=("ICEM CFD: Max warp", "HyperMesh: warpage", "PRIMER: warpage"),
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
    Metric(
        id="icem.quality", title="Quality (ICEM)", on=_QUALITY_TYPES, unit="1", low=-1.0, high=1.0, best="high", ideal=1.0,
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
        formula="min over the sides of height / longest edge of the side, over that of the regular cell (sqrt(3)/2, sqrt(2/3)); "
        "with the sign of the volume",
        source="Ansys ICEM CFD help 24.2, pre-mesh quality (quality): height to base length of each side, normalised",
        caveat="ICEM CFD's two help books define tri and tet quality in two ways; the other is icem.quality. On triangles both "
        "are the same number, on tets not: the corner of a cube has 0.5 there and 0.5 here, a 2.3 degree sliver 0.04 and 0.03.",
        kernel={"tri": icem_triangle_aspect, "tet": tet_height},
        stages={"tri": (edges,), "tet": (edges, faces, volume, areas)},
    ),
)  # fmt: skip
