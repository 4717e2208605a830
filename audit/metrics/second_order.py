"""Metrics of second-order cells: where the mid-side nodes stand, and the Jacobian of the curved cell at its nodes."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, degrees, edges, faces
from meshwright.audit.metrics.tile import LANES, Tile, stage, tile_kernel

__all__ = ["ROWS"]

_SURFACES = ("tri6", "quad8", "quad9")
_SOLIDS = ("tet10", "pyramid13", "wedge15", "hex20", "hex27")
_ALL = (*_SURFACES, *_SOLIDS)

_PYRAMID, _MORE = 13, 3
"""The table of the pyramid has four points for its apex, three more than nodes."""


@stage
def mid_nodes(tile: Tile, out: Lane) -> None:
    """Fill `bow`: the least signed square of the cotangent between chord and line to the mid node, seen from the ends of
    the edges; the largest |t - 1/2|, t the mid node's place along the chord; the largest square of its distance to
    the chord's line over the chord's length.

    nan: of the first two, no direction is defined. An edge of no length bends without limit unless its mid node lies in
    the same place; then it does not count.
    """
    table, mids, x = tile.tables.edges, tile.tables.mids, tile.x
    cotangent, offset, bulge = tile.bow[0], tile.bow[1], tile.bow[2]
    for i in range(LANES):
        cotangent[i], offset[i], bulge[i] = np.inf, -1.0, -1.0
    for r in range(len(mids)):
        a, b, m = table[r, 0], table[r, 1], mids[r]
        for i in range(LANES):
            ux, uy, uz = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
            vx, vy, vz = x[m, 0, i] - x[a, 0, i], x[m, 1, i] - x[a, 1, i], x[m, 2, i] - x[a, 2, i]
            wx, wy, wz = x[b, 0, i] - x[m, 0, i], x[b, 1, i] - x[m, 1, i], x[b, 2, i] - x[m, 2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            n2 = nx * nx + ny * ny + nz * nz
            u2, v2 = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
            near, far = ux * vx + uy * vy + uz * vz, ux * wx + uy * wy + uz * wz
            first, second = near * abs(near) / n2, far * abs(far) / n2
            cotangent[i] = first if first < cotangent[i] else cotangent[i]
            cotangent[i] = second if second < cotangent[i] else cotangent[i]
            off = 0.5 * abs(near - far) / u2  # t - 1/2 without its rounding about 1/2
            offset[i] = off if off > offset[i] else offset[i]
            bent = n2 / u2 / u2 if u2 > 0.0 else v2 / u2
            bulge[i] = bent if bent > bulge[i] else bulge[i]
    for i in range(LANES):
        sized = offset[i] >= 0.0  # some edge has a length; the cotangent of an angle of 0 is inf
        cotangent[i] = cotangent[i] if sized else np.nan
        offset[i] = offset[i] if sized else np.nan


@tile_kernel
def mid_node_angle(tile: Tile, out: Lane) -> None:
    """Largest angle between a chord and the line from its end to the mid node, in degrees."""
    for i in range(LANES):
        out[i] = degrees(tile.bow[0, i])


@tile_kernel
def mid_node_offset(tile: Tile, out: Lane) -> None:
    """max |t - 1/2|."""
    for i in range(LANES):
        out[i] = tile.bow[1, i]


@tile_kernel
def chordal_ratio(tile: Tile, out: Lane) -> None:
    """max h / L."""
    for i in range(LANES):
        out[i] = math.sqrt(tile.bow[2, i]) if tile.bow[2, i] >= 0.0 else np.inf


@stage
def nodal_jacobians(tile: Tile, out: Lane) -> None:
    """Determinant of the derivatives at the points of the gradient table; needs `faces` for surface cells.

    Of a surface cell the length of the normal, negative where it points against the normal of the corners.
    """
    table, x, work = tile.tables.gradients, tile.x, tile.work
    solid = len(tile.tables.triads) > 0
    nodes = x.shape[0] + (_MORE if x.shape[0] == _PYRAMID else 0)
    low, high, normal = tile.nodal[2], tile.nodal[3], tile.face[0]
    for i in range(LANES):
        low[i], high[i] = np.inf, 0.0
    for p in range(len(table)):
        for k in range(9 if solid else 6):
            for i in range(LANES):
                work[k, i] = 0.0
        for j in range(x.shape[0]):
            for axis in range(3):
                weight = table[p, j, axis]
                if weight != 0.0:  # most are
                    for d in range(3):
                        row = work[3 * axis + d]
                        for i in range(LANES):
                            row[i] += weight * x[j, d, i]
        for i in range(LANES):
            nx = work[1, i] * work[5, i] - work[2, i] * work[4, i]
            ny = work[2, i] * work[3, i] - work[0, i] * work[5, i]
            nz = work[0, i] * work[4, i] - work[1, i] * work[3, i]
            if solid:
                jacobian = nx * work[6, i] + ny * work[7, i] + nz * work[8, i]
            else:
                side = nx * normal[0, i] + ny * normal[1, i] + nz * normal[2, i]
                size = math.sqrt(nx * nx + ny * ny + nz * nz)
                jacobian = size if side > 0.0 else (-size if side < 0.0 else 0.0)
            low[i] = min(low[i], jacobian)
            high[i] = max(high[i], abs(jacobian))
        if p + 1 == nodes:
            for i in range(LANES):
                tile.nodal[0, i], tile.nodal[1, i] = low[i], high[i]


@inner
def _nothing(tile, high, i):  # type: ignore[no-untyped-def]
    """Whether the largest Jacobian is that of a flat cell."""
    longest2 = tile.edge_range[1, i]
    size = longest2 * math.sqrt(longest2) if len(tile.tables.triads) > 0 else longest2
    return high <= FLAT * size


@tile_kernel
def ratio_max_over_min(tile: Tile, out: Lane) -> None:
    """max J / min J at the nodes; inf where the smallest is not positive but for its rounding."""
    for i in range(LANES):
        low, high = tile.nodal[0, i], tile.nodal[1, i]
        out[i] = high / low if low > FLAT * high and not _nothing(tile, high, i) else np.inf


@tile_kernel
def ratio_min_over_max(tile: Tile, out: Lane) -> None:
    """min J / max |J| at the nodes."""
    for i in range(LANES):
        low, high = tile.nodal[0, i], tile.nodal[1, i]
        out[i] = low / high if not _nothing(tile, high, i) else 0.0


@tile_kernel
def ratio_with_centres(tile: Tile, out: Lane) -> None:
    """min J / max |J| at the nodes and the centres of faces and body."""
    for i in range(LANES):
        low, high = tile.nodal[2, i], tile.nodal[3, i]
        out[i] = low / high if not _nothing(tile, high, i) else 0.0


@tile_kernel
def smallest_of_solid(tile: Tile, out: Lane) -> None:
    """min J at the nodes."""
    for i in range(LANES):
        out[i] = tile.nodal[0, i] * tile.unit[i] * tile.unit[i] * tile.unit[i]


@tile_kernel
def smallest_of_surface(tile: Tile, out: Lane) -> None:
    """min J at the nodes."""
    for i in range(LANES):
        out[i] = tile.nodal[0, i] * tile.unit[i] * tile.unit[i]


_APEX = "The apex of a pyramid counts with the limits along its four edges."
_NORMAL = (
    "Of a surface cell J is the length of its normal, negative where that turns against the normal of the corners."
)

ROWS = (
    Metric(
        id="icem.mid_node_angle", title="Mid node angle", on=_ALL, unit="deg", low=0.0, high=180.0, best="low", ideal=0.0,
        degenerate=math.nan, systems=("ICEM CFD: Mid node angle",),
        formula="largest angle, at either end of an edge, between the chord and the line to the mid node",
        source="Ansys ICEM CFD help, mesh quality: mid node angle",
        caveat="0 for a mid node anywhere on its chord, even where that makes the Jacobian vanish: see the offset.",
        kernel=mid_node_angle, stages=(mid_nodes,),
    ),
    Metric(
        id="femgv.midnode_offset", title="Mid node offset", on=_ALL, unit="1", low=0.0, high=math.inf, best="low", ideal=0.0,
        degenerate=math.nan, systems=("FemGV: mid-side node position",),
        formula="max |t - 1/2|, t = (m - a).(b - a) / |b - a|^2: place of the mid node along its chord",
        source="FemGV: mid-side node check",
        caveat="From 1/4 on, the Jacobian of a straight edge is 0 or less at one of its ends (quarter-point elements).",
        kernel=mid_node_offset, stages=(mid_nodes,),
    ),
    Metric(
        id="chordal_ratio_max", title="Chordal deviation over length", on=_ALL, unit="1", low=0.0, high=math.inf, best="low",
        ideal=0.0, degenerate=math.inf, systems=("HyperMesh: chordal deviation, as a share of the edge",),
        formula="max h / L, h the distance of the mid node from the line through the edge's ends, L their distance",
        source="Altair HyperMesh help, element quality: chordal deviation",
        kernel=chordal_ratio, stages=(mid_nodes,),
    ),
    Metric(
        id="ansys.jacobian_ratio_nodes", title="Jacobian ratio at the nodes", on=_ALL, unit="1", low=1.0, high=math.inf,
        best="low", ideal=1.0, degenerate=math.inf, systems=("ANSYS: Jacobian ratio (corner nodes and mid-side nodes)",),
        formula="max J / min J at all nodes; infinite where min J is 0 or less",
        source="Ansys Mechanical APDL Theory Reference 12.1.4, Jacobian ratio",
        caveat=f"The nodes alone do not prove a cell valid. {_APEX} {_NORMAL}",
        kernel=ratio_max_over_min, stages=(edges, faces, nodal_jacobians),
    ),
    Metric(
        id="jacobian_ratio_min_over_max_nodes", title="Smallest over largest Jacobian at the nodes", on=_ALL, unit="1",
        low=-1.0, high=1.0, best="high", ideal=1.0, degenerate=0.0, systems=("ANSYS: Jacobian ratio, new style",),
        formula="min J / max |J| at all nodes; -1 for a mirrored cell",
        source="Ansys Mechanical help, Jacobian ratio (corner nodes): from -1 to 1; here at all nodes",
        caveat=f"The nodes alone do not prove a cell valid. {_APEX} {_NORMAL}",
        kernel=ratio_min_over_max, stages=(edges, faces, nodal_jacobians),
    ),
    Metric(
        id="jacobian_ratio_with_centres", title="Smallest over largest Jacobian at nodes and centres", on=_ALL, unit="1",
        low=-1.0, high=1.0, best="high", ideal=1.0, degenerate=0.0,
        systems=("ICEM CFD: Determinant (3x3x3), with the mid nodes counted",),
        formula="min J / max |J| at the nodes and the centres of faces and body: 27 points of a hexahedron, 21 of a wedge, "
        "22 of a pyramid, 15 of a tetrahedron, 9 of a quadrilateral, 7 of a triangle",
        source="Ansys ICEM CFD help 24.2, determinant 3x3x3, carried over to curved cells; Exodus II's TET15, PYRAMID19, WEDGE21, HEX27",
        caveat=f"Points alone do not prove a cell valid. {_APEX} {_NORMAL}",
        kernel=ratio_with_centres, stages=(edges, faces, nodal_jacobians),
    ),
    Metric(
        id="jacobian.min_nodes", title="Smallest Jacobian at the nodes", on=_SOLIDS, unit="L3", low=-math.inf, high=math.inf,
        best="high", ideal=None, degenerate=0.0, systems=(),
        formula="min J at all nodes, scaled as at the corners of the linear cell: V of a box, 6 V of a straight tetrahedron",
        source="Johnen, Remacle, Geuzaine, Journal of Computational Physics 233 (2013), 359",
        caveat=_APEX, kernel=smallest_of_solid, stages=(faces, nodal_jacobians),
    ),
    Metric(
        id="jacobian.min_nodes_surface", title="Smallest surface Jacobian at the nodes", on=_SURFACES, unit="L2",
        low=-math.inf, high=math.inf, best="high", ideal=None, degenerate=0.0, systems=(),
        formula="min J at all nodes: A of a rectangle, 2 A of a straight triangle",
        source="Johnen, Remacle, Geuzaine, Journal of Computational Physics 233 (2013), 359",
        caveat=_NORMAL, kernel=smallest_of_surface, stages=(faces, nodal_jacobians),
    ),
)  # fmt: skip
