"""Sizes of cells, and pairs of cells that share an edge and differ too much in size."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, nodes_of_cells
from meshwright.audit.csr import ragged, take
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import CellBlock, Ints, Mesh, index_array

__all__ = ["BoxSizes", "Jumps", "box_sizes", "find_jumps"]

TOLERANCE = 1e-6
"""Relative excess over the largest ratio that is put down to rounding."""

_ALONG = 1e-6
"""Radians between two edges up to which one counts as lying along the other."""

_CROWD = 512
"""Edges at one point up to which all pairs are compared for lying along each other."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BoxSizes:
    """size (n_cells,): longest edge of the box around the corners of a cell, nan where one is not finite.

    low, high (n_points,): smallest and largest positive size of the cells at a point; inf and 0 where there are none.
    """

    size: Floats
    low: Floats
    high: Floats


@once_per_mesh
def box_sizes(mesh: Mesh) -> BoxSizes:
    """Sizes of all cells."""
    found = BoxSizes(np.empty(mesh.n_cells), np.full(len(mesh.points), np.inf), np.zeros(len(mesh.points)))
    for block in mesh.blocks:
        if block.items is None:
            nodes = block.nodes[:, : CELL_TYPES[block.type].n_corners]
            _boxes(mesh.points, block.rows, nodes, found.size, found.low, found.high)
        elif len(block):
            offsets, items = ragged(block) if block.type == "polygon" else take(*nodes_of_cells(mesh), block.rows)
            _ragged_boxes(mesh.points, block.rows, offsets, items, found.size, found.low, found.high)
    return found


@kernel
def _boxes(points: Floats, rows: Ints, nodes: Ints, size: Floats, low: Floats, high: Floats) -> None:
    n = nodes.shape[1]
    for c in range(rows.size):
        p = nodes[c, 0]
        x0 = x1 = points[p, 0]
        y0 = y1 = points[p, 1]
        z0 = z1 = points[p, 2]
        spoiled = 0.0
        for i in range(n):
            p = nodes[c, i]
            x, y, z = points[p, 0], points[p, 1], points[p, 2]
            x0, x1 = min(x0, x), max(x1, x)
            y0, y1 = min(y0, y), max(y1, y)
            z0, z1 = min(z0, z), max(z1, z)
            spoiled += 0.0 * x + 0.0 * y + 0.0 * z  # nan or infinite coordinates spoil the sum
        s = max(x1 - x0, y1 - y0, z1 - z0) + spoiled
        size[rows[c]] = s
        if s > 0.0:
            for i in range(n):
                p = nodes[c, i]
                low[p] = min(low[p], s)
                high[p] = max(high[p], s)


@kernel
def _ragged_boxes(
    points: Floats, rows: Ints, offsets: Ints, items: Ints, size: Floats, low: Floats, high: Floats
) -> None:
    for c in range(rows.size):
        s = 0.0
        for d in range(3):
            least = most = points[items[offsets[c]], d]
            spoiled = 0.0
            for i in range(offsets[c], offsets[c + 1]):
                x = points[items[i], d]
                least, most = min(least, x), max(most, x)
                spoiled += 0.0 * x
            s = max(s + spoiled, most - least + spoiled) if s == s and spoiled == spoiled else math.nan
        size[rows[c]] = s
        if s > 0.0:
            for i in range(offsets[c], offsets[c + 1]):
                low[items[i]] = min(low[items[i]], s)
                high[items[i]] = max(high[items[i]], s)


@dataclass(frozen=True, eq=False)
class Jumps:
    """cells: rows of the cells of all pairs whose sizes differ by more than the limit, ascending.

    ratio: the largest ratio of each to a cell it shares an edge with; neighbour: row of that cell.
    """

    cells: Ints
    ratio: Floats
    neighbour: Ints


def find_jumps(mesh: Mesh, growth: float) -> Jumps:
    """Cells that share an edge (and so every pair that shares a face) and differ by more than the factor `growth`.

    Edges are shared by their nodes, or where one lies along the other from a common end, as at hanging nodes.
    """
    sizes = box_sizes(mesh)
    limit = growth * (1.0 + TOLERANCE)
    with np.errstate(over="ignore"):
        suspect = sizes.high > limit * sizes.low
    none = Jumps(index_array([]), np.empty(0), index_array([]))
    if not suspect.any():
        return none
    parts = [_half_edges(mesh, block, suspect) for block in mesh.blocks if len(block)]
    start, end, cell = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.lexsort((cell, end, start))
    start, end, cell = start[order], end[order], cell[order]
    ratio = np.zeros(mesh.n_cells)
    neighbour = np.full(mesh.n_cells, -1, np.int64)
    _compare(mesh.points, start, end, cell, sizes.size, limit, ratio, neighbour)
    cells = np.flatnonzero(ratio > 0.0)
    return Jumps(index_array(cells), ratio[cells], index_array(neighbour[cells])) if len(cells) else none


def _half_edges(mesh: Mesh, block: CellBlock, suspect: NDArray[np.bool_]) -> tuple[Ints, Ints, Ints]:
    """(start, end, cell) of the edges of the cells of a block, both ways, that start at a suspect point."""
    if block.items is None:
        corners = block.nodes[:, : CELL_TYPES[block.type].n_corners]
        at = np.flatnonzero(suspect[corners].any(axis=1))
        table = CELL_TYPES[block.type].edge_table
        a, b = corners[at][:, table[:, 0]].ravel(), corners[at][:, table[:, 1]].ravel()
        cell = np.repeat(block.rows[at], len(table))
    else:
        (offsets, items), owner = ragged(block), block.rows
        if block.type == "polyhedron":
            found = faces(mesh)
            owner = np.repeat(owner, np.diff(offsets))
            offsets, items = take(found.offsets, found.nodes, items)
        sizes = np.diff(offsets)
        a, cell = items, np.repeat(owner, sizes)
        b = np.roll(a, -1)
        b[offsets[1:] - 1] = a[offsets[:-1]]
    start, end, cell = np.concatenate([a, b]), np.concatenate([b, a]), np.concatenate([cell, cell])
    chosen = suspect[start] & (start != end)
    return start[chosen], end[chosen], cell[chosen]


@kernel
def _compare(
    points: Floats,
    start: Ints,
    end: Ints,
    cell: Ints,
    size: Floats,
    limit: float,
    ratio: Floats,
    neighbour: NDArray[np.int64],
) -> None:
    i = 0
    while i < start.size:
        stop = i
        while stop < start.size and start[stop] == start[i]:
            stop += 1
        j = i
        while j < stop:  # cells with the same edge: each against the smallest and the largest
            k, small, large = j, -1, -1
            while k < stop and end[k] == end[j]:
                c = cell[k]
                if size[c] > 0.0:
                    if small < 0 or size[c] < size[small]:
                        small = c
                    if large < 0 or size[c] > size[large]:
                        large = c
                k += 1
            if small >= 0 and size[large] > limit * size[small]:
                for m in range(j, k):
                    _note(cell[m], small, size, limit, ratio, neighbour)
                    _note(cell[m], large, size, limit, ratio, neighbour)
            j = k
        if stop - i <= _CROWD:
            for j in range(i, stop):
                a = size[cell[j]]
                for k in range(j + 1, stop):
                    b = size[cell[k]]
                    jump = a > 0.0 and b > 0.0 and (a > limit * b or b > limit * a)
                    if jump and end[k] != end[j] and _along(points, start[i], end[j], end[k]):
                        _note(cell[j], cell[k], size, limit, ratio, neighbour)
                        _note(cell[k], cell[j], size, limit, ratio, neighbour)
        i = stop


@kernel
def _note(c: int, other: int, size: Floats, limit: float, ratio: Floats, neighbour: NDArray[np.int64]) -> None:
    """Remember the pair for cell c where it is the worst of that cell yet."""
    a, b = size[c], size[other]
    if not (a > 0.0 and (a > limit * b or b > limit * a)):
        return
    r = a / b if a > b else b / a
    if r > ratio[c] or (r == ratio[c] and other < neighbour[c]):
        ratio[c] = r
        neighbour[c] = other


@kernel
def _along(points: Floats, p: int, q: int, r: int) -> bool:
    """Whether the edges from p to q and from p to r point the same way."""
    ux, uy, uz = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1], points[q, 2] - points[p, 2]
    vx, vy, vz = points[r, 0] - points[p, 0], points[r, 1] - points[p, 1], points[r, 2] - points[p, 2]
    s = max(abs(ux), abs(uy), abs(uz))
    t = max(abs(vx), abs(vy), abs(vz))
    ux, uy, uz, vx, vy, vz = ux / s, uy / s, uz / s, vx / t, vy / t, vz / t
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    dot = ux * vx + uy * vy + uz * vz
    return dot > 0.0 and nx * nx + ny * ny + nz * nz <= _ALONG * _ALONG * dot * dot
