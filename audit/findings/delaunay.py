"""The check on Delaunay violations: a cell whose circumcircle or circumsphere holds the far corner of a neighbour."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.findings.empty_spheres import (
    COCIRCULAR,
    OPEN,
    VIOLATES,
    deepest,
    judge_shell,
    judge_tets,
    judge_triangles,
)
from meshwright.audit.findings.face_sets import bordering
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.geometry import in_safe_units
from meshwright.audit.mesh import Ints, Mesh, index_array
from meshwright.audit.predicates import in_circle, in_sphere

__all__ = ["ROWS", "Violations", "violating_faces"]


@dataclass(frozen=True, eq=False)
class Violations:
    """faces: rows of the faces that violate and that nothing forbids to swap, ascending.  apexes (m, 2): the far
    corners of their owner and neighbour.  cocircular: how many more are on the circle as far as coordinates tell.
    constrained: how many violate, but lie between zones or on a feature.
    """

    faces: Ints
    apexes: Ints
    cocircular: int
    constrained: int


def violating_faces(facts: Facts) -> Violations | None:
    """Test every face between two triangles or two tetrahedra; None in a mesh without any.

    Cells without size and pairs of cells that overlap are left out: other checks have them.
    """
    mesh = facts.mesh
    total = np.full(mesh.n_cells, -1, np.int64)
    for block in mesh.blocks:
        if CELL_TYPES[block.type].corners in ("tri", "tet") and len(block):
            corners = CELL_TYPES[block.type].n_corners
            total[block.rows] = block.nodes[:, :corners].sum(axis=1, dtype=np.int64)
    if not np.any(total >= 0):
        return None
    total[facts.shapes.flat | ~np.isfinite(facts.shapes.relative)] = -1
    found = faces(mesh)
    points = in_safe_units(mesh)[0].points
    state = np.zeros(len(found), np.uint8)
    if mesh.cell_dimension == 2 and mesh.dimension == 3:
        judge_shell(points, found.nodes, found.owner, found.neighbour, total, state)
    else:
        value, band = np.empty(len(found)), np.empty(len(found))
        if mesh.dimension == 2:
            judge_triangles(points, found.nodes, found.owner, found.neighbour, total, state, value, band)
        else:
            judge_tets(points, found.offsets, found.nodes, found.owner, found.neighbour, total, state, value, band)
        for row in np.flatnonzero(state == OPEN).tolist():
            state[row] = VIOLATES if _exactly(mesh, points, total, row) > Fraction(band[row]) else COCIRCULAR
    rows = index_array(np.flatnonzero(state == VIOLATES))
    fixed = bordering(mesh, rows)
    if mesh.cell_dimension == 2 and mesh.dimension == 3:
        fixed = fixed | _sharp(mesh, rows, facts.options.feature_angle)
    free = index_array(rows[~fixed])
    return Violations(free, _apexes(mesh, total, free), int(np.count_nonzero(state == COCIRCULAR)), int(fixed.sum()))


def _apexes(mesh: Mesh, total: NDArray[np.int64], rows: Ints) -> Ints:
    found = faces(mesh)
    start = found.offsets[rows].astype(np.int64)
    base = np.zeros(len(rows), np.int64)
    for i in range(mesh.cell_dimension):
        base += found.nodes[start + i]
    return index_array(np.stack([total[side[rows]] - base for side in (found.owner, found.neighbour)], axis=1))


def _exactly(mesh: Mesh, points: NDArray[np.float64], total: NDArray[np.int64], row: int) -> Fraction:
    found = faces(mesh)
    corners = found.nodes[found.offsets[row] : found.offsets[row + 1]]
    near, far = _apexes(mesh, total, index_array([row]))[0]
    test = in_circle if mesh.cell_dimension == 2 else in_sphere
    return test(*(points[p].tolist() for p in (*corners, near, far)))


def _sharp(mesh: Mesh, rows: Ints, angle: float) -> NDArray[np.bool_]:
    """Edges of a surface at which the normals of its two triangles differ by more than `angle` degrees."""
    found = faces(mesh)
    normal = np.zeros((2, len(rows), 3))
    for side, cells in enumerate((found.owner[rows], found.neighbour[rows])):
        for block in mesh.blocks:
            at = np.searchsorted(block.rows, cells)
            here = np.flatnonzero((at < len(block)) & (block.rows[np.minimum(at, len(block) - 1)] == cells))
            if len(here) and CELL_TYPES[block.type].corners == "tri":
                a, b, c = (mesh.points[block.nodes[at[here], i]] for i in range(3))
                normal[side, here] = np.cross(b - a, c - a)
    # which way the two triangles turn does not matter: the edge tells
    a, b = (mesh.points[found.nodes[found.offsets[rows] + i]] for i in range(2))
    flip = _runs(mesh, found.owner[rows], rows) == _runs(mesh, found.neighbour[rows], rows)
    normal[1, flip] *= -1.0
    cosine = np.einsum("ij,ij->i", normal[0], normal[1])
    sine = np.linalg.norm(np.cross(normal[0], normal[1]), axis=1)
    return np.degrees(np.arctan2(sine, cosine)) > angle


def _runs(mesh: Mesh, cells: Ints, rows: Ints) -> NDArray[np.bool_]:
    """Whether the triangle runs along the edge from its first node to its second."""
    found = faces(mesh)
    a, b = (found.nodes[found.offsets[rows] + i] for i in range(2))
    out = np.zeros(len(rows), dtype=bool)
    for block in mesh.blocks:
        if CELL_TYPES[block.type].corners != "tri" or not len(block):
            continue
        at = np.minimum(np.searchsorted(block.rows, cells), len(block) - 1)
        here = block.rows[at] == cells
        nodes = block.nodes[at, :3]
        for i in range(3):
            out |= here & (nodes[:, i] == a) & (nodes[:, (i + 1) % 3] == b)
    return out


def delaunay_violations(facts: Facts) -> Found | None:
    """Cells with a neighbour's far corner inside their circle or sphere."""
    found = violating_faces(facts)
    if found is None or not len(found.faces):
        return None
    mesh = facts.mesh
    table = faces(mesh)
    inside = np.zeros(mesh.n_cells, dtype=bool)
    inside[table.owner[found.faces]] = True
    inside[table.neighbour[found.faces]] = True
    rows = np.flatnonzero(inside)
    detail: dict[str, Any] = {
        "faces": len(found.faces),
        "cocircular_faces": found.cocircular,
        "constrained_faces": found.constrained,
    }
    pairs = counted(len(found.faces), "edge" if mesh.cell_dimension == 2 else "face")
    if mesh.cell_dimension == 2:
        excess = _angle_sums(mesh, found) - 180.0
        detail["max_angle_sum_excess"] = float(excess.max())
        measure = f"opposite angles add up to as much as {180.0 + excess.max():.6g} degrees"
        advice = "swap those edges where the two triangles form a convex quadrilateral"
    else:
        depth = float(deepest(in_safe_units(mesh)[0].points, table.offsets, table.nodes, found.faces, found.apexes))
        detail["max_relative_depth"] = depth
        measure = f"a corner lies as deep as {100.0 * depth:.3g} % of the radius inside a sphere"
        advice = "swap faces (2-3, 3-2, 4-4) if the mesh is to be Delaunay"
    return Found(
        rows,
        f"{counted(len(rows), 'cell')} with the far corner of a neighbour inside their circumscribed "
        f"{'circle' if mesh.cell_dimension == 2 else 'sphere'}, across {pairs}; {measure}. Harmless to most solvers; "
        f"{advice}",
        detail=detail,
    )


def _angle_sums(mesh: Mesh, found: Violations) -> NDArray[np.float64]:
    """Sum of the two angles opposite to each violating edge, degrees."""
    table = faces(mesh)
    points = in_safe_units(mesh)[0].points
    a, b = (points[table.nodes[table.offsets[found.faces] + i]] for i in range(2))
    total = np.zeros(len(found.faces))
    for k in range(2):
        o = points[found.apexes[:, k]]
        u, v = a - o, b - o
        total += np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.einsum("ij,ij->i", u, v))
    return np.degrees(total)


ROWS = (
    Check(
        "delaunay-violations", "info", "Delaunay violations", "cell",
        "solvers do not ask for a Delaunay mesh; generators that promise one do", delaunay_violations,
    ),
)  # fmt: skip
