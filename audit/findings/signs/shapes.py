"""What the checks need to know about every cell, in one pass over the mesh: `cell_shapes`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.findings.signs.decide import decide_areas, decide_loops, decide_polyhedra, decide_volumes
from meshwright.audit.findings.signs.polycells import polygons, polyhedra
from meshwright.audit.findings.signs.tiles import (
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
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.stages import centres as centre_stage
from meshwright.audit.metrics.stages import edges as edge_stage
from meshwright.audit.metrics.stages import faces as face_stage
from meshwright.audit.metrics.stages import jacobians as jacobian_stage
from meshwright.audit.metrics.stages import volume as volume_stage
from meshwright.audit.metrics.tile import LANES, Kernel, plan, prepare, run_kernels
from meshwright.audit.parallel import in_parallel

__all__ = ["FLAT", "Shapes", "cell_shapes"]

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

    places = tuple(list(kernels).index(word) if word in kernels else -1 for word in ("corner", "side", "centre 0"))
    shapes_of = (shapes.relative, shapes.centre, shapes.folded, shapes.collapsed, shapes.turned)

    def measure(start: int) -> None:
        rows = block.rows[start : start + _CHUNK]
        nodes = block.nodes[start : start + _CHUNK]
        table = np.empty((len(kernels), len(rows)))
        run_kernels(name, mesh.points, nodes, 0, len(rows), batches, table)
        _decide(mesh, name, nodes, table[0])
        _keep(mesh.points, rows, nodes, CELL_TYPES[name].n_nodes, table, *places, *shapes_of)

    for _ in in_parallel(measure, range(0, len(block), _CHUNK)):
        pass


def _kernels_for(name: str, dimension: int) -> tuple[dict[str, Kernel], tuple[Kernel, ...]]:
    """Kernels by the name of their column, in the order they run, and the stages they read."""
    centres: dict[str, Kernel] = {"centre 0": centre_x, "centre 1": centre_y, "centre 2": centre_z}
    if CELL_TYPES[name].dimension == 3:
        kernels: dict[str, Kernel] = {"relative": relative_volume, "shortest": shortest_edge}
        if name != "tet":  # its only Jacobian is the volume
            kernels["corner"] = worst_corner_of_solid
        stages = (edge_stage, face_stage, centre_stage, volume_stage, jacobian_stage)
        return {**kernels, "side": sides_of_solid, **centres}, stages
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
def _keep(
    points: NDArray[np.float64],
    rows: Ints,
    nodes: Ints,
    n_corners: int,
    table: NDArray[np.float64],
    corner: int,
    side: int,
    middle: int,
    relative: NDArray[np.float64],
    centre: NDArray[np.float64],
    folded: NDArray[np.bool_],
    collapsed: NDArray[np.bool_],
    turned: NDArray[np.bool_],
) -> None:
    """Write the columns of these cells where their rows say.

    table (k, n): row 0 the relative size, row 1 the shortest edge; corner, side, middle: rows of the worst corner, the
    worst side and the first of the three of the centre relative to the first node, -1 where there are none.
    """
    for c in range(rows.size):
        row = rows[c]
        relative[row] = table[0, c]
        same = 0
        for i in range(1, n_corners):
            for j in range(i):
                same += nodes[c, i] == nodes[c, j]
        collapsed[row] = same > 0 or table[1, c] == 0.0
        if corner >= 0:
            folded[row] = table[corner, c] <= _CORNER
        if side >= 0:
            turned[row] = table[side, c] <= 0.0
        if middle >= 0:
            for axis in range(3):
                centre[row, axis] = points[nodes[c, 0], axis] + table[middle + axis, c]


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
