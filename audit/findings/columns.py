"""Columns of cells that stand on walls: the layers of a boundary layer, found by walking from face to opposite face."""

from __future__ import annotations

import math
from dataclasses import dataclass
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.connectivity import faces, faces_of_cells
from meshwright.audit.csr import take
from meshwright.audit.findings.face_sets import faces_of_zone, wall_zones
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import NO_CELL, Ints, Mesh, Zone, index_array
from meshwright.audit.surface_edges import fan_of_face, surface_edges

__all__ = ["END_OF_LAYERS", "Columns", "wall_columns"]

END_OF_LAYERS, TOO_HIGH, BOUNDARY, LONGEST = 0, 1, 2, 3
"""Why a column ends: the next cell is no prism, or is as high as wide; a boundary or wall; too many layers."""

_MOST = 10_000

_FLAT = 0.5
"""Height of the first cell over its width up to which a column counts as a layer at all, and not as the mesh itself."""

_ONE_AT_A_TIME = Lock()

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Columns:
    """The columns on one wall zone; one for each face and each side of it that has a cell (not of a solid).

    cell: the first cell.  layers: how many cells are flatter than wide.  reason: why it ends.
    first, last, total: height of the first and last layer, of all.  least, most: smallest and largest ratio of a
    layer's height to that of the one before; nan for fewer than two layers.
    pairs (m, 2): columns of faces that share an edge (a point in 2-D), where the wall has cells on one side only.
    """

    zone: Zone
    cell: Ints
    layers: Ints
    reason: Ints
    first: Floats
    last: Floats
    total: Floats
    least: Floats
    most: Floats
    pairs: Ints


def wall_columns(mesh: Mesh) -> tuple[Columns, ...]:
    """Walk the columns of every wall zone, once for a mesh; none for a shell.

    A cell carries a column on when it is a prism over the face it was entered by: one other face has no corner in
    common with that, all the rest an edge. So do hexahedra, wedges over a triangle, polyhedra made of such prisms even
    where an edge of the upper face has closed, and quadrilaterals in 2-D.
    Its height is the distance between the means of the corners of the two faces, its width the side of a square (an
    equilateral triangle) of the area of the face, in 2-D the length of the edge. A column ends before the first cell
    that is not lower than wide, and has no layers where its first cell is higher than half its width. Where it goes on
    to another wall, it ends with its highest cell, the middle one of several.
    """
    with _ONE_AT_A_TIME:  # two checks ask for them, in threads of their own
        return _all_columns(mesh)


@once_per_mesh
def _all_columns(mesh: Mesh) -> tuple[Columns, ...]:
    zones = wall_zones(mesh)
    if not zones or (mesh.dimension == 3 and mesh.cell_dimension == 2):
        return ()
    found = faces(mesh)
    walls = np.zeros(len(found), dtype=bool)
    rows = [faces_of_zone(mesh, zone) for zone in zones]
    for of_zone in rows:
        walls[of_zone] = True
    solid = np.zeros(mesh.n_cells, dtype=bool)
    for other in mesh.cell_zones:
        if other.role == "solid":
            solid[other.members] = True
    return tuple(_of_zone(mesh, zone, of_zone, walls, solid) for zone, of_zone in zip(zones, rows, strict=True))


def _of_zone(mesh: Mesh, zone: Zone, rows: Ints, walls: Mask, solid: Mask) -> Columns:
    found = faces(mesh)
    place = np.tile(np.arange(len(rows)), 2)
    cell = np.concatenate([found.owner[rows], found.neighbour[rows]])
    kept = (cell != NO_CELL) & ~solid[cell]
    place, cell = place[kept], cell[kept]
    n = len(cell)
    layers, reason = np.zeros(n, np.int64), np.zeros(n, np.int64)
    figures = np.full((n, 5), np.nan)
    _walk(
        mesh.points, found.offsets, found.nodes, found.owner, found.neighbour, *faces_of_cells(mesh), walls,
        index_array(rows[place]), index_array(cell), mesh.dimension == 2, layers, reason, figures,
    )  # fmt: skip
    one_sided = np.bincount(place, minlength=len(rows)) == 1
    column = np.full(len(rows), -1, dtype=np.int64)
    column[place] = np.arange(n)
    column[~one_sided] = -1
    pairs = column[_neighbours(mesh, rows)] if layers.any() else np.empty((0, 2), np.int64)
    pairs = pairs[(pairs >= 0).all(axis=1)]
    first, last, total, least, most = figures.T
    return Columns(
        zone, index_array(cell), index_array(layers), index_array(reason),
        first, last, total, least, most, index_array(pairs),
    )  # fmt: skip


def _neighbours(mesh: Mesh, rows: Ints) -> Ints:
    """(m, 2) places in `rows` of faces that share an edge, or in 2-D a point."""
    found = faces(mesh)
    offsets, nodes = take(found.offsets, found.nodes, rows)
    if mesh.cell_dimension == 3:
        sides = surface_edges(offsets, nodes, np.zeros((len(rows), 3)), len(mesh.points))[1]
        return sides[sides[:, 0] >= 0]
    order = np.argsort(nodes, kind="stable")
    ranked, of = nodes[order], order // 2
    first = np.flatnonzero(ranked[1:] == ranked[:-1])
    return np.stack([of[first], of[first + 1]], axis=1)


@inner
def _opposite(base: int, cell: int, offsets: Ints, nodes: Ints, starts: Ints, items: Ints) -> int:
    """The face of a prism opposite to `base`, -1 where the cell is no prism over it."""
    common = 2 if offsets[base + 1] - offsets[base] > 2 else 1
    found = -1
    for k in range(starts[cell], starts[cell + 1]):
        g = items[k]
        if g == base:
            continue
        shared = 0
        for i in range(offsets[g], offsets[g + 1]):
            for j in range(offsets[base], offsets[base + 1]):
                shared += nodes[i] == nodes[j]
        if shared == 0 and found < 0:
            found = g
        elif shared != common:
            return -1
    return found


@inner
def _centre(points: Floats, offsets: Ints, nodes: Ints, f: int, ox: float, oy: float, oz: float) -> tuple:
    x = y = z = 0.0
    n = offsets[f + 1] - offsets[f]
    for i in range(offsets[f], offsets[f + 1]):
        p = nodes[i]
        x += points[p, 0] - ox
        y += points[p, 1] - oy
        z += points[p, 2] - oz
    return x / n, y / n, z / n


@inner
def _width(points: Floats, offsets: Ints, nodes: Ints, f: int) -> float:
    o = nodes[offsets[f]]
    size = offsets[f + 1] - offsets[f]
    x, y, z, s = fan_of_face(points, offsets, nodes, f)
    area = 0.5 * math.sqrt(x * x + y * y + z * z)
    if size == 2:
        p = nodes[offsets[f] + 1]
        return math.hypot(points[p, 0] - points[o, 0], points[p, 1] - points[o, 1])
    return s * math.sqrt(area * (4.0 / math.sqrt(3.0) if size == 3 else 1.0))


@kernel
def _walk(
    points: Floats,
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    neighbour: Ints,
    starts: Ints,
    items: Ints,
    walls: Mask,
    base: Ints,
    first: Ints,
    flat: bool,
    layers: Ints,
    reason: Ints,
    figures: Floats,
) -> None:
    height = np.empty(_MOST)
    for k in range(base.size):
        f, c = base[k], first[k]
        n = 0
        why = LONGEST
        while n < _MOST:
            g = _opposite(f, c, offsets, nodes, starts, items)
            if g < 0:
                why = END_OF_LAYERS
                break
            o = nodes[offsets[f]]
            ax, ay, az = _centre(points, offsets, nodes, f, points[o, 0], points[o, 1], points[o, 2])
            bx, by, bz = _centre(points, offsets, nodes, g, points[o, 0], points[o, 1], points[o, 2])
            s = max(abs(bx - ax), abs(by - ay), abs(bz - az))
            h = s * math.sqrt(((bx - ax) / s) ** 2 + ((by - ay) / s) ** 2 + ((bz - az) / s) ** 2)
            width = _width(points, offsets, nodes, f)
            if not (h > 0.0 and h < width and (n > 0 or h <= _FLAT * width)):
                why = TOO_HIGH
                break
            height[n] = h
            n += 1
            onward = neighbour[g] if owner[g] == c else owner[g]
            if onward < 0 or walls[g] or onward == first[k]:
                why = BOUNDARY
                if walls[g]:  # the layers of the other wall begin beyond the highest cell
                    low = high = -1
                    most = height[:n].max() * (1.0 - 1e-6)
                    for i in range(n):
                        if height[i] >= most:
                            low, high = i if low < 0 else low, i
                    n = (low + high) // 2 + 1
                break
            f, c = g, onward
        layers[k], reason[k] = n, why
        if n > 0:
            total = 0.0
            for i in range(n):
                total += height[i]
            figures[k, 0], figures[k, 1], figures[k, 2] = height[0], height[n - 1], total
        if n > 1:
            least = most = height[1] / height[0]
            for i in range(2, n):
                least = min(least, height[i] / height[i - 1])
                most = max(most, height[i] / height[i - 1])
            figures[k, 3], figures[k, 4] = least, most
