"""Checks at the axis of rotation and at walls."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces, used_points
from meshwright.audit.findings.face_sets import faces_of_zone, wall_zones
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.signs.polycells import face_vector
from meshwright.audit.findings.signs.shapes import FLAT
from meshwright.audit.geometry import bounds
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, Ints, Zone, index_array
from meshwright.audit.places import plain, text

__all__ = ["BELOW", "LEAST_ANGLE", "ROWS", "axis_of_rotation"]

BELOW = 1e-10
"""How far below the axis, over the diagonal of the mesh's box, rounding may put a point of the axis."""

LEAST_ANGLE = 10.0
"""Degrees from the wall below which the line to the centre of a cell is too oblique: CFX's limit for the minimum."""

Floats = NDArray[np.float64]


def axis_of_rotation(facts: Facts) -> str | None:
    """The axis that the user names; else that of a zone with the role "axis", along its longer extent; else None."""
    if facts.options.axis is not None:
        return facts.options.axis
    for zone in facts.mesh.zones:
        if zone.entity == "face" and zone.role == "axis" and len(zone.members):
            found = faces(facts.mesh)
            rows = faces_of_zone(facts.mesh, zone)
            points = facts.mesh.points[found.nodes.reshape(-1, 2)[rows].ravel()] if len(rows) else np.zeros((1, 3))
            with np.errstate(invalid="ignore"):
                span = np.ptp(points, axis=0)
            return "y" if span[1] > span[0] else "x"
    return None


def points_below_axis(facts: Facts) -> Found | None:
    """Used points on the wrong side of the axis of an axisymmetric mesh."""
    mesh = facts.mesh
    if mesh.dimension != 2:
        return None
    axis = axis_of_rotation(facts)
    if axis is None:
        return None
    low, high = 0.5 * bounds(mesh)
    limit = -2.0 * BELOW * math.hypot(*(high - low).tolist())
    radius = mesh.points[:, 1 if axis == "x" else 0]
    rows = np.flatnonzero((radius < limit) & used_points(mesh))
    if not len(rows):
        return None
    return Found(
        rows,
        f"{counted(len(rows), 'point')} below the {axis} axis, the axis of rotation, by up to "
        f"{-radius[rows].min():.3g}: the radius is negative there and solvers stop; move them onto the axis or "
        "the mesh above it",
        detail={"axis": axis, "lowest": plain(float(radius[rows].min()))},
    )


def wall_orthogonality(facts: Facts) -> Found | None:
    """Cells at walls, by 90 degrees less the angle between the wall's normal and the line from cell to wall centre."""
    mesh = facts.mesh
    zones = wall_zones(mesh)
    if not zones or (mesh.dimension == 3 and mesh.cell_dimension == 2):
        return None
    table: list[dict[str, Any]] = []
    all_cells, low_cells = [], []
    for zone in zones:
        cells, angle = _angles(facts, zone)
        sure = np.isfinite(angle)
        cells, angle = cells[sure], angle[sure]
        if not len(cells):
            continue
        low = cells[angle < LEAST_ANGLE]
        table.append(
            {
                "zone": text(zone.name), "faces": len(cells), "min": float(angle.min()), "mean": float(angle.mean()),
                "below": len(low),
            }
        )  # fmt: skip
        all_cells.append(cells)
        low_cells.append(low)
    if not table:
        return None
    detail: dict[str, Any] = {"limit": LEAST_ANGLE, "zones": table}
    rows = np.unique(np.concatenate(low_cells))
    worst = min(table, key=lambda entry: entry["min"])
    if len(rows):
        return Found(
            rows,
            f"{counted(len(rows), 'cell')} at walls less than {LEAST_ANGLE:g} degrees from the wall (least "
            f"{worst['min']:.3g} degrees, in {worst['zone']}): wall gradients and wall functions are wrong there; make "
            "the first cells stand upright on the wall",
            severity="warning",
            detail=detail,
        )
    return Found(
        np.unique(np.concatenate(all_cells)),
        f"cells stand on {counted(len(table), 'wall zone')} at {worst['min']:.3g} degrees or more (least in "
        f"{worst['zone']}); 90 is upright",
        detail=detail,
    )


def _angles(facts: Facts, zone: Zone) -> tuple[Ints, Floats]:
    """(cells, degrees) of both sides of every face of a wall; nan for cells without size and in solids."""
    mesh = facts.mesh
    found = faces(mesh)
    rows = faces_of_zone(mesh, zone)
    inside = rows[found.neighbour[rows] != NO_CELL]
    at = np.concatenate([rows, inside])
    cells = np.concatenate([found.owner[rows], found.neighbour[inside]])
    angle = _wall_angles(
        mesh.points, found.offsets, found.nodes, index_array(at), index_array(cells), facts.shapes.centre,
        mesh.dimension == 2,
    )  # fmt: skip
    idle = np.abs(facts.shapes.relative[cells]) < FLAT
    for other in mesh.cell_zones:
        if other.role == "solid":
            solid = np.zeros(mesh.n_cells, dtype=bool)
            solid[other.members] = True
            idle |= solid[cells]
    angle[idle] = math.nan
    return cells, angle


@kernel
def _wall_angles(
    points: Floats, offsets: Ints, nodes: Ints, rows: Ints, cells: Ints, centre: Floats, flat: bool
) -> Floats:
    """Angle between each face's plane and the line from the cell's centre to the face's."""
    out = np.empty(rows.size)
    for k in range(rows.size):
        first, last = offsets[rows[k]], offsets[rows[k] + 1]
        p = nodes[first]
        ox, oy, oz = points[p, 0], points[p, 1], points[p, 2]
        extent = 0.0
        for i in range(first + 1, last):
            for d in range(3):
                extent = max(extent, abs(points[nodes[i], d] - points[p, d]))
        scale = 1.0 / extent
        if flat:
            q = nodes[last - 1]
            cx, cy, cz = 0.5 * scale * (points[q, 0] - ox), 0.5 * scale * (points[q, 1] - oy), 0.0
            ax, ay, az = 2.0 * cy, -2.0 * cx, 0.0
        else:
            ax, ay, az, cx, cy, cz, _ = face_vector(points, nodes, first, last, ox, oy, oz, scale)
        c = cells[k]
        dx = cx + scale * (ox - centre[c, 0])
        dy = cy + scale * (oy - centre[c, 1])
        dz = cz + scale * (oz - centre[c, 2])
        ex, ey, ez = ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx
        along, across = ax * dx + ay * dy + az * dz, math.sqrt(ex * ex + ey * ey + ez * ez)
        out[k] = math.degrees(math.atan2(abs(along), across)) if along != 0.0 or across != 0.0 else math.nan
    return out


ROWS = (
    Check(
        "points-below-axis", "error", "Points below the axis of rotation", "point",
        "a negative radius gives negative volumes of revolution", points_below_axis,
    ),
    Check(
        "wall-orthogonality", "info", "Cells upright on walls", "cell",
        "a figure to judge by; a warning where cells lie along the wall", wall_orthogonality,
    ),
)  # fmt: skip
