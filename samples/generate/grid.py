"""`Grid`, what every generator makes, and `Polymesh`, the same mesh as faces with owner and neighbour."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["FACES", "Boundary", "Cells", "Grid", "Polymesh", "extruded", "faces_of", "honeycomb", "joined", "polymesh"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FACES: dict[str, tuple[tuple[int, ...], ...]] = {
    "tri": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tet": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hex": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
"""Outward faces of each cell type (edges with the cell on their left in 2-D)."""


@dataclass(frozen=True)
class Cells:
    """Cells of one type in one zone: `nodes` (n, k) in VTK order; `role` "fluid" or "solid"."""

    type: str
    nodes: Ints
    zone: str
    role: str = "fluid"


@dataclass(frozen=True)
class Boundary:
    """Boundary elements (line, tri or quad) of one named zone; `role`: wall, inlet, outlet, symmetry."""

    type: str
    nodes: Ints
    zone: str
    role: str = "wall"


@dataclass(frozen=True)
class Grid:
    """Points (n, 3), cells in file order, boundary elements; `dimension` 2 means flat, z = 0."""

    points: Floats
    cells: tuple[Cells, ...]
    boundary: tuple[Boundary, ...] = ()
    dimension: int = 3


@dataclass(frozen=True)
class Polymesh:
    """Faces (lists of point rows) whose normal leaves `owner`; zones as (name, role, rows of faces or cells)."""

    points: Floats
    faces: list[tuple[int, ...]]
    owner: Ints
    neighbour: Ints
    n_cells: int
    patches: tuple[tuple[str, str, Ints], ...]
    cell_zones: tuple[tuple[str, str, Ints], ...]
    cell_types: tuple[str, ...] = field(default=())
    dimension: int = 3


def faces_of(grid: Grid) -> tuple[Ints, Ints, Ints]:
    """All half-faces of a grid: nodes (m, 4) padded with -1, their sorted keys (m, 4), their cells (m,)."""
    nodes: list[Ints] = []
    cells: list[Ints] = []
    first = 0
    for part in grid.cells:
        rows = first + np.arange(len(part.nodes))
        for face in FACES[part.type]:
            padded = np.full((len(part.nodes), 4), -1, dtype=np.int64)
            padded[:, : len(face)] = part.nodes[:, face]
            nodes.append(padded)
            cells.append(rows)
        first += len(part.nodes)
    every = np.concatenate(nodes)
    return every, np.sort(every, axis=1), np.concatenate(cells)


def polymesh(grid: Grid) -> Polymesh:
    """The grid as faces: each half-face meets its twin, the lower cell owns; boundary faces by zone."""
    nodes, keys, cells = faces_of(grid)
    _, inverse = np.unique(keys, axis=0, return_inverse=True)
    order = np.lexsort((cells, inverse.ravel()))
    _, starts, counts = np.unique(inverse.ravel()[order], return_index=True, return_counts=True)
    if counts.max() > 2:
        raise ValueError("a face has more than two cells")
    lead = order[starts]
    owner = cells[lead]
    neighbour = np.where(counts == 2, cells[order[np.minimum(starts + 1, len(order) - 1)]], -1)
    zone_of = _zone_of_faces(grid, keys[lead])
    inside = np.flatnonzero((neighbour >= 0) & (zone_of < 0))
    ranking = [inside[np.lexsort((neighbour[inside], owner[inside]))]]
    patches: list[tuple[str, str, Ints]] = []
    placed = len(inside)
    names: dict[str, str] = {part.zone: part.role for part in grid.boundary}
    for number, (name, role) in enumerate(names.items()):
        rows = np.flatnonzero(zone_of == number)
        ranking.append(rows)
        patches.append((name, role, placed + np.arange(len(rows))))
        placed += len(rows)
    rest = np.flatnonzero((neighbour < 0) & (zone_of < 0))
    if len(rest):
        ranking.append(rest)
        patches.append(("unnamed", "wall", placed + np.arange(len(rest))))
    final = np.concatenate(ranking)
    zones: dict[str, tuple[str, list[Ints]]] = {}
    row = 0
    for part in grid.cells:
        zones.setdefault(part.zone, (part.role, []))[1].append(row + np.arange(len(part.nodes)))
        row += len(part.nodes)
    return Polymesh(
        points=grid.points,
        faces=[tuple(int(n) for n in nodes[lead[f]] if n >= 0) for f in final],
        owner=owner[final],
        neighbour=neighbour[final],
        n_cells=row,
        patches=tuple(patches),
        cell_zones=tuple((name, role, np.concatenate(rows)) for name, (role, rows) in zones.items()),
        cell_types=tuple(part.type for part in grid.cells for _ in range(len(part.nodes))),
        dimension=grid.dimension,
    )


def _zone_of_faces(grid: Grid, keys: Ints) -> Ints:
    """Number of the boundary zone each face belongs to, -1 for none."""
    names = list(dict.fromkeys(part.zone for part in grid.boundary))
    table: dict[tuple[int, ...], int] = {}
    for part in grid.boundary:
        padded = np.full((len(part.nodes), 4), -1, dtype=np.int64)
        padded[:, : part.nodes.shape[1]] = part.nodes
        for row in np.sort(padded, axis=1).tolist():
            table[tuple(row)] = names.index(part.zone)
    return np.array([table.get(tuple(row), -1) for row in keys.tolist()], dtype=np.int64)


def joined(*grids: Grid, tolerance: float = 1e-9) -> Grid:
    """Several grids as one, with points nearer than about `tolerance` merged (the first one stays)."""
    points = np.concatenate([g.points for g in grids])
    _, first, inverse = np.unique(np.round(points / tolerance), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    new = rank[inverse.ravel()]
    cells: list[Cells] = []
    boundary: list[Boundary] = []
    shift = 0
    for g in grids:
        cells += [Cells(c.type, new[c.nodes + shift], c.zone, c.role) for c in g.cells]
        boundary += [Boundary(b.type, new[b.nodes + shift], b.zone, b.role) for b in g.boundary]
        shift += len(g.points)
    return Grid(points[first[order]], tuple(cells), tuple(boundary), grids[0].dimension)


def extruded(
    flat: Grid, heights: ArrayLike, sides: tuple[str, str] = ("back", "front"), role: str = "symmetry"
) -> Grid:
    """A flat grid swept along z: tri -> wedge, quad -> hex, lines -> quads; the two ends become zones."""
    z = np.asarray(heights, dtype=float)
    n = len(flat.points)
    points = np.concatenate([flat.points + np.array([0.0, 0.0, height]) for height in z])
    cells: list[Cells] = []
    boundary: list[Boundary] = []
    for k in range(len(z) - 1):
        for c in flat.cells:
            swept = np.hstack([c.nodes + k * n, c.nodes + (k + 1) * n])
            cells.append(Cells({"tri": "wedge", "quad": "hex"}[c.type], swept, c.zone, c.role))
        for b in flat.boundary:
            low, high = b.nodes + k * n, b.nodes + (k + 1) * n
            boundary.append(Boundary("quad", np.hstack([low, high[:, ::-1]]), b.zone, b.role))
    top = (len(z) - 1) * n
    boundary += [Boundary(c.type, c.nodes[:, ::-1], sides[0], role) for c in flat.cells]
    boundary += [Boundary(c.type, c.nodes + top, sides[1], role) for c in flat.cells]
    return Grid(points, tuple(cells), tuple(boundary))


def honeycomb(columns: int, rows: int) -> tuple[Floats, list[list[int]]]:
    """Regular hexagons of side 1: points (n, 3) and the six corners of each, counter-clockwise."""
    turns = np.radians(60.0 * np.arange(6))
    known: dict[tuple[int, int], int] = {}
    points: list[tuple[float, float, float]] = []
    cells: list[list[int]] = []
    for i in range(columns):
        for j in range(rows):
            x0, y0 = 1.5 * i, np.sqrt(3.0) * (j + 0.5 * (i % 2))
            ring: list[int] = []
            for x, y in zip(x0 + np.cos(turns), y0 + np.sin(turns), strict=True):
                key = (round(x * 1e6), round(y * 1e6))
                if key not in known:
                    known[key] = len(points)
                    points.append((float(x), float(y), 0.0))
                ring.append(known[key])
            cells.append(ring)
    return np.array(points), cells
