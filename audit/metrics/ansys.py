"""ANSYS Mechanical and MAPDL shape checks."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.cells import LINEAR_TYPES
from meshwright.audit.metrics.angles import largest_angle
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.face_shapes import ASPECT, BROKEN, COLLAPSED, PARALLEL, face_shapes, flattened
from meshwright.audit.metrics.jacobian import quad_determinant
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.sections import (
    hex_section_aspect,
    hex_section_parallel,
    pyramid_section_aspect,
    tet_section_aspect,
    wedge_section_aspect,
    wedge_section_parallel,
)
from meshwright.audit.metrics.stages import Lane, angles, axes, degrees, edges, faces, jacobians, quad_axes, volume
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["ROWS"]

_SOLIDS = ("tet", "pyramid", "wedge", "hex")
_WITH_QUADS = ("quad", "pyramid", "wedge", "hex")


@tile_kernel
def flat_quality(tile: Tile, out: Lane) -> None:
    """C A / sum of the squared edges."""
    a, e = tile.face[0], tile.edge2
    scale = 6.92820323 if len(e) == 3 else 4.0
    for i in range(LANES):
        out[i] = 0.0
    for r in range(len(e)):
        for i in range(LANES):
            out[i] += e[r, i]
    for i in range(LANES):
        area = math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)
        out[i] = scale * area / out[i] if area >= FLAT * out[i] and out[i] > 0.0 else 0.0


@tile_kernel
def solid_quality(tile: Tile, out: Lane) -> None:
    """C V / sqrt(sum of the squared edges)^3, signed."""
    e = tile.edge2
    n = len(e)
    scale = 124.70765802 if n == 6 else 96.0 if n == 8 else 62.35382905 if n == 9 else 41.56921938
    for i in range(LANES):
        out[i] = 0.0
    for r in range(n):
        for i in range(LANES):
            out[i] += e[r, i]
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        flat = abs(tile.volume[i]) <= FLAT * longest2 * math.sqrt(longest2)
        out[i] = scale * tile.volume[i] / (out[i] * math.sqrt(out[i])) if not flat else 0.0


@tile_kernel
def face_aspect(tile: Tile, out: Lane) -> None:
    """Worst face; inf when a face is flat or all quadrilaterals are lines, nan for a hex flattened along a direction."""
    n = len(tile.tables.quads)
    for i in range(LANES):
        ratio = math.sqrt(tile.face_shape[ASPECT, i])
        ratio = ratio if ratio * FLAT < 1.0 and (n == 0 or tile.face_shape[COLLAPSED, i] < n) else np.inf
        out[i] = ratio if not flattened(tile, i) else np.nan


@tile_kernel
def face_parallel(tile: Tile, out: Lane) -> None:
    """Largest angle between opposite edges of a face; nan where one of them has no direction."""
    for i in range(LANES):
        angle = degrees(tile.face_shape[PARALLEL, i])
        out[i] = angle if tile.face_shape[BROKEN, i] == 0.0 and not flattened(tile, i) else np.nan


@tile_kernel
def solid_jacobian_ratio(tile: Tile, out: Lane) -> None:
    """max |J| / min |J| over the corners where all J have one sign, else inf."""
    j = tile.jacobian
    least, low, high = tile.work[0], tile.work[1], tile.work[2]
    for i in range(LANES):
        least[i], low[i], high[i] = np.inf, np.inf, -np.inf
    for r in range(len(j)):
        for i in range(LANES):
            least[i] = min(least[i], abs(j[r, i]))
            low[i] = min(low[i], j[r, i])
            high[i] = max(high[i], j[r, i])
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        most = max(abs(low[i]), abs(high[i]))
        sound = low[i] * high[i] > 0.0 and most > FLAT * longest2 * math.sqrt(longest2)
        out[i] = most / least[i] if sound else np.inf


@tile_kernel
def quad_jacobian_ratio(tile: Tile, out: Lane) -> None:
    """max J / min J over the corners, inf when one is not positive."""
    quad_determinant(tile, out)
    for i in range(LANES):
        out[i] = 1.0 / out[i] if out[i] > 0.0 else np.inf


@tile_kernel
def warping_factor(tile: Tile, out: Lane) -> None:
    """Height difference of the ends of an edge above the mean plane, over the root of the area."""
    a, t = tile.face[0], tile.mode[3]
    for i in range(LANES):
        area = math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)
        height = 2.0 * abs(t[0, i] * a[0, i] + t[1, i] * a[1, i] + t[2, i] * a[2, i])
        out[i] = height / (area * math.sqrt(area)) if area > FLAT * tile.edge_range[1, i] else np.nan


ROWS = (
    Metric(
        id="ansys.element_quality", title="Element quality (ANSYS)", on=LINEAR_TYPES, unit="1", low=-1.0, high=1.0, best="high",
        ideal=1.0, degenerate=0.0, systems=("ANSYS Mechanical: Element Quality", "ICEM CFD: Workbench shape"),
        formula="C A / sum L^2 (tri 6.928, quad 4); C V / sqrt(sum L^2)^3 (tet 124.708, pyramid 96, wedge 62.354, hex 41.569)",
        source="ANSYS Meshing help, Element Quality",
        caveat="The pyramid constant belongs to the pyramid of equal edges, but one of height 1 on a unit square reaches 1.012; "
        "reports clamp it, --cells does not. Negative when the nodes run the wrong way round.",
        kernel={t: (solid_quality if t in _SOLIDS else flat_quality) for t in LINEAR_TYPES},
        stages={t: ((edges, volume) if t in _SOLIDS else (edges, faces)) for t in LINEAR_TYPES},
    ),
    Metric(
        id="ansys.max_corner_angle", title="Maximum corner angle (ANSYS)", on=LINEAR_TYPES, unit="deg", low=60.0, high=360.0,
        best="low", ideal=None, degenerate=math.nan, systems=("MAPDL: Maximum Corner Angle", "ANSYS Mechanical: Maximum Corner Angle"),
        formula="max over the corners of all faces of the angle between the two edges",
        source="MAPDL Theory Reference, Element Shape Testing",
        caveat="Same number as angle.max. Ideal 60 on triangles, 90 on quadrilaterals. MAPDL looks at cross-sections of solids too.",
        stages=(angles,), kernel=largest_angle,
    ),
    Metric(
        id="ansys.aspect_ratio_faces", title="Aspect ratio of faces (ANSYS)", on=LINEAR_TYPES, unit="1", low=1.0, high=math.inf,
        best="low", ideal=1.0, degenerate=math.inf,
        systems=("MAPDL: Aspect Ratio (tri, quad)", "ANSYS Mechanical: Aspect Ratio (tri, quad)", "Patran: Aspect (quad)"),
        formula="quad: longest / shortest side of the rectangles on its two mid-lines, the worse one; tri: the same for the six "
        "rectangles on medians and lines between middles, over sqrt(3); solids: worst face",
        source="MAPDL Theory Reference, Element Shape Testing",
        caveat="A sheared unit square has a ratio above 1. Faces that have collapsed to a line are left out.",
        stages=(face_shapes,), kernel=face_aspect,
    ),
    Metric(
        id="ansys.aspect_ratio", title="Aspect ratio with cross-sections (ANSYS)", on=_SOLIDS, unit="1", low=1.0, high=math.inf,
        best="low", ideal=None, degenerate=math.inf, systems=("MAPDL: Aspect Ratio (solids)", "ANSYS Mechanical: Aspect Ratio (solids)"),
        formula="worst of ansys.aspect_ratio_faces and the same ratio of cross-sections. Hex: 3 quads through the middles of four "
        "parallel edges; wedge: 1 triangle and 3 quads through edge middles; tet: 6 triangles of an edge and the middle of the "
        "opposite edge; pyramid: 8 triangles of a base edge and the middle of one of the two opposite edges to the apex",
        source="MAPDL Theory Reference, Element Shape Testing; sections of tet and pyramid unverified",
        caveat="A regular tet scores 1.12, the pyramid of equal edges 1.31, the prism of equal edges 2, by their sections. On tets and "
        "pyramids MAPDL may use the nearest point of the opposite edge instead of its middle.",
        kernel={"tet": tet_section_aspect, "pyramid": pyramid_section_aspect, "wedge": wedge_section_aspect, "hex": hex_section_aspect},
        stages={t: ((face_shapes, axes) if t == "hex" else (face_shapes,)) for t in _SOLIDS},
    ),
    Metric(
        id="ansys.parallel_deviation_faces", title="Parallel deviation of faces (ANSYS)", on=_WITH_QUADS, unit="deg", low=0.0,
        high=180.0, best="low", ideal=0.0, degenerate=math.nan, systems=("MAPDL: Parallel Deviation (quad)",),
        formula="largest angle between two opposite edges of a quadrilateral face",
        source="MAPDL Theory Reference, Element Shape Testing",
        caveat="Undefined where one of two opposite edges has no length.",
        stages=(face_shapes,), kernel=face_parallel,
    ),
    Metric(
        id="ansys.parallel_deviation", title="Parallel deviation with cross-sections (ANSYS)", on=("wedge", "hex"), unit="deg",
        low=0.0, high=180.0, best="low", ideal=0.0, degenerate=math.nan,
        systems=("MAPDL: Parallel Deviation (solids)", "ANSYS Mechanical: Parallel Deviation (solids)"),
        formula="worst of ansys.parallel_deviation_faces and the same angle of the 3 quads through the middles of edges",
        source="MAPDL Theory Reference, Element Shape Testing",
        caveat="Sections of a pyramid are triangles, so that its value is that of its faces.",
        kernel={"wedge": wedge_section_parallel, "hex": hex_section_parallel},
        stages={"wedge": (face_shapes,), "hex": (face_shapes, axes)},
    ),
    Metric(
        id="ansys.jacobian_ratio", title="Jacobian ratio (ANSYS)", on=_WITH_QUADS, unit="1", low=1.0, high=math.inf, best="low",
        ideal=1.0, degenerate=math.inf, systems=("MAPDL: Jacobian Ratio", "ANSYS Mechanical: Jacobian Ratio (MAPDL)"),
        formula="max |J| / min |J| over the corners (pyramid: of the base); inf where J changes sign or vanishes",
        source="MAPDL Theory Reference, Element Shape Testing; linear triangles and tets are exempt",
        caveat="MAPDL prints -100 where J changes sign: here that is inf, so that worse is always higher. A mirrored cell keeps the "
        "ratio of its image; look at the volume first.",
        kernel={t: (quad_jacobian_ratio if t == "quad" else solid_jacobian_ratio) for t in _WITH_QUADS},
        stages={t: ((faces,) if t == "quad" else (edges, jacobians)) for t in _WITH_QUADS},
    ),
    Metric(
        id="ansys.warping_factor", title="Warping factor (ANSYS)", on=("quad",), unit="1", low=0.0, high=math.inf, best="low",
        ideal=0.0, degenerate=math.nan, systems=("MAPDL: Warping Factor (by area)",),
        formula="2 h / sqrt(A), h the distance of the corners from the mean plane, A the area",
        source="MAPDL Theory Reference, Element Shape Testing; unverified: 2 h is the height difference along an edge",
        caveat="Shells of known thickness are measured against that instead, which no mesh file tells.",
        stages=(edges, faces, quad_axes), kernel=warping_factor,
    ),
)  # fmt: skip
