"""What the checks need to know about every cell, in one pass over the mesh: `cell_shapes`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.findings.decide import decide_areas, decide_loops, decide_polyhedra, decide_volumes
from meshwright.audit.findings.polycells import polygons, polyhedra
from meshwright.audit.findings.tiles import (
    centre_x,
    centre_y,
    centre_z,
    relative_area,
    relative_flat_area,
    relative_volume,
    shortest_edge,
    sides_of_flat_cell,
    sides_of_solid,
    worst_corner_of_quad,
    worst_corner_of_solid,
)
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import CellBlock, Ints, Mesh
from meshwright.audit.metrics.stages import edges as edge_stage
from meshwright.audit.metrics.stages import faces as face_stage
from meshwright.audit.metrics.stages import jacobians as jacobian_stage
from meshwright.audit.metrics.stages import volume as volume_stage
from meshwright.audit.metrics.tile import LANES, Kernel, plan, prepare, run_kernels
from meshwright.audit.parallel import in_parallel

__all__ = ["FLAT", "Shapes", "cell_shapes"]

FLAT = 1e-14
"""A cell with less than this of the volume Lmax**3 (area Lmax**2) has none."""

_UNSURE = 2e-12
"""Relative volumes above this have the right sign in plain floats.

A hex has the worst bound: six faces (a+b).((b+c)x(c+d))/12 of coordinates below M = 3 Lmax, six products of three sums
below 2 M, each off by fewer than 12 u: 48 u M**3 a face, and as much again for the sums: 432 u M**3 = 1.3e-12 Lmax**3.
"""

_CORNER = 1e-14
"""A corner is folded where its scaled Jacobian does not exceed the rounding of the determinant."""

_CHUNK = 512 * LANES


@dataclass(frozen=True, eq=False)
class Shapes:
    """One value per cell row.

    relative: V / Lmax**3 of a solid, A / Lmax**2 of a flat or surface cell; nan where a coordinate is not finite;
    the sign is certain wherever |relative| >= FLAT.  centre (n, 3): as in `tiles.sides_of_solid`.
    folded: some corner Jacobian is 0 or less, seen from the sign of the cell's own volume.
    collapsed: names a point twice or has an edge of no length.
    turned: some face of the cell, as its own node order turns it, does not look away from the cell's centre
    (cells of fixed type in a solid or flat mesh; polyhedra and polygons are judged by the mesh's faces).
    """

    relative: NDArray[np.float64]
    centre: NDArray[np.float64]
    folded: NDArray[np.bool_]
    collapsed: NDArray[np.bool_]
    turned: NDArray[np.bool_]

    @property
    def flat(self) -> NDArray[np.bool_]:
        """Cells without size."""
        return np.abs(self.relative) < FLAT

    @property
    def negative(self) -> NDArray[np.bool_]:
        """Cells of negative volume (area), flat ones not counted."""
        return self.relative <= -FLAT


@once_per_mesh
def cell_shapes(mesh: Mesh) -> Shapes:
    """Measure what the checks need."""
    n = mesh.n_cells
    shapes = Shapes(np.empty(n), np.zeros((n, 3)), *(np.zeros(n, dtype=bool) for _ in range(3)))
    for block in mesh.blocks:
        if not len(block):
            continue
        if block.offsets is None or block.items is None:
            _fixed_block(mesh, block, shapes)
        elif block.type == "polygon":
            _polygon_block(mesh, block.rows, block.offsets, block.items, shapes)
        else:
            _polyhedron_block(mesh, block.rows, block.offsets, block.items, shapes)
    return shapes


def _polygon_block(mesh: Mesh, rows: Ints, offsets: Ints, items: Ints, shapes: Shapes) -> None:
    flat = mesh.dimension == 2
    unsure = np.flatnonzero(polygons(mesh.points, rows, offsets, items, flat, shapes.relative, shapes.centre))
    if flat and len(unsure):
        decide_loops(mesh.points, unsure, rows, offsets, items, shapes.relative)
    shapes.collapsed[rows] = _steps_on_the_spot(mesh.points, offsets, items)


def _polyhedron_block(mesh: Mesh, rows: Ints, starts: Ints, items: Ints, shapes: Shapes) -> None:
    found = faces(mesh)
    table = (starts, items, found.offsets, found.nodes, found.owner)
    unsure = np.flatnonzero(polyhedra(mesh.points, rows, *table, shapes.relative, shapes.centre))
    if len(unsure):
        decide_polyhedra(mesh.points, unsure, rows, *table, shapes.relative)


def _fixed_block(mesh: Mesh, block: CellBlock, shapes: Shapes) -> None:
    """Cells of a fixed type, a chunk at a time, so that no column of the whole block is ever held."""
    name = CELL_TYPES[block.type].corners
    kernels, stages = _kernels_for(name, mesh.dimension)
    batches = plan([(function, stages) for function in kernels.values()])
    prepare(batches, block.nodes)

    def measure(start: int) -> None:
        rows = block.rows[start : start + _CHUNK]
        nodes = block.nodes[start : start + _CHUNK]
        table = np.empty((len(kernels), len(rows)))
        run_kernels(name, mesh.points, nodes, 0, len(rows), batches, table)
        column = dict(zip(kernels, table, strict=True))
        relative = column["relative"]
        _decide(mesh, name, nodes, relative)
        shapes.relative[rows] = relative
        twice = np.zeros(len(rows), dtype=bool)
        _repeats(nodes, CELL_TYPES[name].n_nodes, twice)
        shapes.collapsed[rows] = (column["shortest"] == 0.0) | twice
        if "corner" in column:
            shapes.folded[rows] = column["corner"] <= _CORNER
        if "side" in column:
            shapes.turned[rows] = column["side"] <= 0.0
            for axis in range(3):
                shapes.centre[rows, axis] = mesh.points[nodes[:, 0], axis] + column[f"centre {axis}"]

    for _ in in_parallel(measure, range(0, len(block), _CHUNK)):
        pass


def _kernels_for(name: str, dimension: int) -> tuple[dict[str, Kernel], tuple[Kernel, ...]]:
    """Kernels by the name of their column, in the order they run, and the stages they read."""
    centres: dict[str, Kernel] = {"centre 0": centre_x, "centre 1": centre_y, "centre 2": centre_z}
    if CELL_TYPES[name].dimension == 3:
        kernels: dict[str, Kernel] = {"relative": relative_volume, "shortest": shortest_edge}
        if name != "tet":  # its only Jacobian is the volume
            kernels["corner"] = worst_corner_of_solid
        return {**kernels, "side": sides_of_solid, **centres}, (edge_stage, face_stage, volume_stage, jacobian_stage)
    kernels = {"relative": relative_flat_area if dimension == 2 else relative_area, "shortest": shortest_edge}
    if name == "quad":
        kernels["corner"] = worst_corner_of_quad
    if dimension == 2:
        kernels |= {"side": sides_of_flat_cell, **centres}
    return kernels, (edge_stage, face_stage)


def _decide(mesh: Mesh, name: str, nodes: Ints, relative: NDArray[np.float64]) -> None:
    """Replace the relative sizes too small to trust by those of doubled precision; in place."""
    cell = CELL_TYPES[name]
    unsure = np.flatnonzero(np.abs(relative) <= _UNSURE)
    if not len(unsure):
        return
    if cell.dimension == 3:
        offsets = np.cumsum([0, *(len(face) for face in cell.faces)])
        decide_volumes(mesh.points, unsure, nodes, offsets, np.concatenate(cell.faces), relative)
    elif mesh.dimension == 2:
        decide_areas(mesh.points, unsure, nodes, cell.n_nodes, relative)


@kernel
def _repeats(nodes: Ints, n_corners: int, out: NDArray[np.bool_]) -> None:
    """Whether a cell names one of its corners twice."""
    for c in range(out.size):
        same = 0
        for i in range(1, n_corners):
            for j in range(i):
                same += nodes[c, i] == nodes[c, j]
        out[c] = same > 0


@kernel
def _steps_on_the_spot(points: NDArray[np.float64], offsets: Ints, nodes: Ints) -> NDArray[np.bool_]:
    """Whether two neighbouring corners of a polygon are in one place."""
    out = np.zeros(offsets.size - 1, np.bool_)
    for c in range(out.size):
        p = nodes[offsets[c + 1] - 1]
        for i in range(offsets[c], offsets[c + 1]):
            q = nodes[i]
            out[c] |= points[p, 0] == points[q, 0] and points[p, 1] == points[q, 1] and points[p, 2] == points[q, 2]
            p = q
    return out
