"""The sign of the few cells where plain floats leave it open, decided in doubled precision."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.signs.doubled import relative_area_of_ring, relative_volume_of_rings
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints

__all__ = ["decide_areas", "decide_loops", "decide_polyhedra", "decide_volumes"]

Floats = NDArray[np.float64]


@kernel
def decide_volumes(points: Floats, cells: Ints, nodes: Ints, offsets: Ints, table: Ints, relative: Floats) -> None:
    """relative[c] = V / Lmax**3 of those rows of `nodes` (n, k); offsets, table: corners of the faces of the type."""
    ring = np.empty(table.size, np.int64)
    outward = np.ones(offsets.size - 1, np.int64)
    for c in cells:
        for i in range(table.size):
            ring[i] = nodes[c, table[i]]
        relative[c] = relative_volume_of_rings(points, offsets, ring, outward)


@kernel
def decide_areas(points: Floats, cells: Ints, nodes: Ints, n_corners: int, relative: Floats) -> None:
    """relative[c] = A / Lmax**2 of those triangles or quadrilaterals in the x-y plane."""
    for c in cells:
        relative[c] = relative_area_of_ring(points, nodes[c, :n_corners])


@kernel
def decide_loops(points: Floats, cells: Ints, rows: Ints, starts: Ints, nodes: Ints, relative: Floats) -> None:
    """relative[rows[k]] of those polygons k in the x-y plane."""
    for k in cells:
        relative[rows[k]] = relative_area_of_ring(points, nodes[starts[k] : starts[k + 1]])


@kernel
def decide_polyhedra(
    points: Floats,
    cells: Ints,
    rows: Ints,
    starts: Ints,
    items: Ints,
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    relative: Floats,
) -> None:
    """relative[rows[k]] of those polyhedra k; starts, items: their faces, whose normals leave the owner."""
    for k in cells:
        n = starts[k + 1] - starts[k]
        ring_offsets = np.zeros(n + 1, np.int64)
        outward = np.empty(n, np.int64)
        for j in range(n):
            f = items[starts[k] + j]
            ring_offsets[j + 1] = ring_offsets[j] + offsets[f + 1] - offsets[f]
            outward[j] = 1 if owner[f] == rows[k] else -1
        rings = np.empty(ring_offsets[n], np.int64)
        for j in range(n):
            f = items[starts[k] + j]
            for i in range(offsets[f + 1] - offsets[f]):
                rings[ring_offsets[j] + i] = nodes[offsets[f] + i]
        relative[rows[k]] = relative_volume_of_rings(points, ring_offsets, rings, outward)
