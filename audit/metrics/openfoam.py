"""OpenFOAM's cell metrics, as checkMesh computes them."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.dihedral import areas
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, centres, edges, faces, volume
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]

_ON = ("tet", "pyramid", "wedge", "hex")


@tile_kernel
def openness(tile: Tile, out: Lane) -> None:
    """Largest component of the sum of the area vectors over the sum of its absolute values."""
    total, size = tile.work[0], tile.work[1]
    for i in range(LANES):
        out[i] = 0.0
    for d in range(3):
        for i in range(LANES):
            total[i], size[i] = 0.0, 0.0
        for f in range(tile.face.shape[0]):
            for i in range(LANES):
                total[i] += tile.face[f, d, i]
                size[i] += abs(tile.face[f, d, i])
        for i in range(LANES):
            gap = abs(total[i]) / size[i] if size[i] > 0.0 else 0.0
            out[i] = max(out[i], gap)


@tile_kernel
def area_ratio(tile: Tile, out: Lane) -> None:
    """Largest over smallest face area seen along an axis, or the mean of the three over the area of a cube as large."""
    size = tile.work
    for d in range(3):
        for i in range(LANES):
            size[d, i] = 0.0
        for f in range(tile.face.shape[0]):
            for i in range(LANES):
                size[d, i] += abs(tile.face[f, d, i])
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        p, q, r = size[0, i], size[1, i], size[2, i]
        mean = (p + q + r) / 6.0
        # without dimension before the root, which then gives cells of all sizes the same digits
        compact = max(tile.volume[i], 0.0) / (mean * math.sqrt(mean))
        root = compact ** (-2.0 / 3.0)
        flat = not tile.volume[i] > FLAT * longest2 * math.sqrt(longest2)
        out[i] = np.inf if flat else max(max(p, q, r) / min(p, q, r), root)


@tile_kernel
def smallest_pyramid(tile: Tile, out: Lane) -> None:
    """Smallest signed volume of the pyramids from the cell's centre to its faces."""
    m = tile.centre
    for i in range(LANES):
        out[i] = np.inf
    for f in range(tile.face.shape[0]):
        a, c = tile.face[f], tile.face_centre[f]
        for i in range(LANES):
            dot = a[0, i] * (c[0, i] - m[0, i]) + a[1, i] * (c[1, i] - m[1, i]) + a[2, i] * (c[2, i] - m[2, i])
            out[i] = min(out[i], dot)
    for i in range(LANES):
        # an empty sum of products may be a negative zero
        out[i] = out[i] / 3.0 * tile.unit[i] * tile.unit[i] * tile.unit[i] + 0.0


@tile_kernel
def smallest_flatness(tile: Tile, out: Lane) -> None:
    """Smallest area vector over the sum of the areas of the fan about the face's centre, squared before the extreme.

    Triangles and faces without any area count as flat.
    """
    quads, n, x, fan = tile.tables.quads, len(tile.tables.tris), tile.x, tile.work[0]
    for i in range(LANES):
        out[i] = 1.0
    for r in range(len(quads)):
        a, c, area2 = tile.face[n + r], tile.face_centre[n + r], tile.area2[n + r]
        for i in range(LANES):
            fan[i] = 0.0
        for k in range(4):
            p, q = x[quads[r, k]], x[quads[r, (k + 1) % 4]]
            for i in range(LANES):
                ux, uy, uz = p[0, i] - c[0, i], p[1, i] - c[1, i], p[2, i] - c[2, i]
                vx, vy, vz = q[0, i] - c[0, i], q[1, i] - c[1, i], q[2, i] - c[2, i]
                nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                fan[i] += 0.5 * math.sqrt(nx * nx + ny * ny + nz * nz)
        for i in range(LANES):
            none = area2[i] == 0.0 and fan[i] <= FLAT * tile.edge_range[1, i]
            ratio2 = (a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2) / (fan[i] * fan[i])
            out[i] = min(out[i], 1.0 if none else ratio2)
    for i in range(LANES):
        out[i] = math.sqrt(out[i])


@tile_kernel
def concavity(tile: Tile, out: Lane) -> None:
    """Largest cosine between a face's normal and the line from its centre to that of another face.

    Reduced as a signed square. Each line serves both faces; one without length or a face without direction counts as 0,
    which OpenFOAM too takes for concave.
    """
    n = tile.face.shape[0]
    per_area = tile.work
    for f in range(n):
        for i in range(LANES):
            per_area[f, i] = 1.0 / tile.area2[f, i] if tile.area2[f, i] > 0.0 else 0.0
    for i in range(LANES):
        out[i] = -np.inf
    for f in range(n):
        a, p, u = tile.face[f], tile.face_centre[f], per_area[f]
        for g in range(f + 1, n):
            b, q, v = tile.face[g], tile.face_centre[g], per_area[g]
            for i in range(LANES):
                dx, dy, dz = q[0, i] - p[0, i], q[1, i] - p[1, i], q[2, i] - p[2, i]
                d2 = dx * dx + dy * dy + dz * dz
                here = a[0, i] * dx + a[1, i] * dy + a[2, i] * dz
                there = -(b[0, i] * dx + b[1, i] * dy + b[2, i] * dz)
                worse = max(here * abs(here) * u[i], there * abs(there) * v[i])
                worse = worse / d2 if d2 > 0.0 else 0.0
                out[i] = max(out[i], worse)
    for i in range(LANES):
        out[i] = math.copysign(math.sqrt(abs(out[i])), out[i]) + 0.0


ROWS = (
    Metric(
        id="openfoam.openness", title="Openness", on=(*_ON, "polyhedron"), unit="1", low=0.0, high=1.0, best="low", ideal=0.0, degenerate=0.0,
        systems=("OpenFOAM checkMesh: cell openness",),
        formula="max over the axes k of |sum of A_k| / sum of |A_k|, A the outward area vectors of the faces",
        source="OpenFOAM, primitiveMeshCheck.C (closedCells); the limit there is 1e-6",
        caveat="A cell given by its nodes is closed: only rounding is left. It tells something of polyhedra given by their faces.",
        stages=(faces,), kernel=openness, polytope="openness",
    ),
    Metric(
        id="openfoam.aspect_ratio", title="Aspect ratio (OpenFOAM)", on=(*_ON, "polyhedron"), unit="1", low=1.0, high=math.inf, best="low",
        ideal=1.0, degenerate=math.inf, systems=("OpenFOAM checkMesh: aspect ratio",),
        formula="S_k = sum over faces of |A_k|; max[max S / min S, (S_x + S_y + S_z) / 6 V^(2/3)]; inf for V <= 0",
        source="OpenFOAM, primitiveMeshCheck.C (cellAspectRatio); the limit there is 1000",
        caveat="Depends on the axes: a cell turned against them scores another number. 1 for a cube along the axes; a mirrored cell is inf.",
        stages=(edges, faces, volume), kernel=area_ratio, polytope="balance",
    ),
    Metric(
        id="openfoam.min_pyramid", title="Smallest face pyramid", on=(*_ON, "polyhedron"), unit="L3", low=-math.inf, high=math.inf, best="high",
        ideal=None, degenerate=0.0, systems=("OpenFOAM checkMesh: face pyramids", "OpenFOAM meshQualityDict: minVol"),
        formula="min over faces of A.(c_f - C)/3, C the cell's centre, c_f the face's, A the outward area vector",
        source="OpenFOAM, primitiveMeshCheck.C (facePyramids)",
        caveat="OpenFOAM counts each face from both sides; here the smallest of the cell's own. Not positive: not star-shaped from its centre.",
        stages=(faces, centres), kernel=smallest_pyramid, polytope="pyramid",
    ),
    Metric(
        id="openfoam.min_flatness", title="Smallest face flatness", on=(*_ON, "polyhedron"), unit="1", low=0.0, high=1.0, best="high", ideal=1.0,
        degenerate=1.0, systems=("OpenFOAM checkMesh: face flatness",),
        formula="min over quadrilateral faces of |A| / sum of the areas of the four triangles about the face's centre",
        source="OpenFOAM, primitiveMeshCheck.C (faceFlatness)",
        caveat="1 for triangles, and for a face without any area, which has no shape. OpenFOAM passes over a bow tie; its net area of 0 scores 0 here.",
        stages=(edges, faces, areas, centres), kernel=smallest_flatness, polytope="flatness",
    ),
    Metric(
        id="openfoam.concave", title="Concavity", on=(*_ON, "polyhedron"), unit="1", low=-1.0, high=1.0, best="low", ideal=None, degenerate=0.0,
        systems=("OpenFOAM checkMesh: concave cells",),
        formula="max over pairs of faces of A.(c_g - c_f) / |A||c_g - c_f|, A the outward area vector of f",
        source="OpenFOAM, primitiveMeshCheck.C (concaveCells): concave above -1e-6",
        caveat="-0.707 for a cube. Above -1e-6 the centre of some face is not behind the plane of another. Mirrored cells count as concave.",
        stages=(edges, faces, areas, centres), kernel=concavity, polytope="concavity",
    ),
)  # fmt: skip
