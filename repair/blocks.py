"""Structured blocks of quads and hexes: their i, j(, k) grids of points, and passes that place the points inside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, points_to_cells
from meshwright.audit.errors import MeshError
from meshwright.audit.findings.grids.cuts import cut_faces
from meshwright.audit.findings.grids.singular import singular_edges, singular_points
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import NO_CELL, CellBlock, Faces, Floats, Ints, Mesh, index_array
from meshwright.audit.sets import find_parts
from meshwright.repair.carrying import padded, with_points
from meshwright.repair.held import border_faces, held_points
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.quality import standing
from meshwright.repair.sizes import signed_sizes

__all__ = ["Closed", "Grid", "Place", "inside", "on_grids", "structured_grids"]

Mask = NDArray[np.bool_]
Closed = tuple[bool, ...]

_LATTICE = {"quad": [0, 1, 3, 2], "hex": [0, 1, 3, 2, 4, 5, 7, 6]}
"""Corners in the order of binary numbers: bit a of the place tells the end of direction a at which a corner lies."""
_SAME = 1e-9
"""Moves of all points of a block below this part of the edges there are rounding: the block stays as it is."""
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Grid:
    """One structured block.

    points: (n0 + 1, n1 + 1[, n2 + 1]) point rows; in a closed direction the last layer is the first one again.
    closed: which directions return to their start. cells: (n0 * n1[ * n2],) rows of its cells.
    """

    points: Ints
    closed: Closed
    cells: Ints

    @property
    def name(self) -> str:
        """Its size, for people."""
        return "block of " + " x ".join(str(n - 1) for n in self.points.shape) + " cells"


Place = Callable[[Floats, Closed], Floats]
"""(points of a grid (n0 + 1, n1 + 1[, n2 + 1], d), its closed directions) -> the same with those inside elsewhere."""


def inside(closed: Closed) -> tuple[slice, ...]:
    """Index of the points inside: not on a side of the block; in a closed direction each layer once."""
    return tuple(slice(0, -1) if turn else slice(1, -1) for turn in closed)


def on_grids(mesh: Mesh, options: Options, place: Place) -> Outcome:
    """Place the inner points of each structured block anew, where that makes its worst cell no worse.

    A block is left as it is, and told of, where `place` raises MeshError, where points inside are held, or where a
    cell would be worse than the worst one that moves with it was. No point on a side of a block moves.
    """
    if mesh.cell_dimension == 2 and np.ptp(mesh.points[:, 2]) > 0.0:
        raise MeshError(
            "structured blocks of quads are placed in a plane z = constant; this mesh is a surface in space"
        )
    held = held_points(mesh, options)
    d = mesh.cell_dimension
    around = np.diff(points_to_cells(mesh)[0])
    points = np.array(mesh.points)
    refused: list[str] = []
    placed: list[Grid] = []
    grids = structured_grids(mesh)
    for i, grid in enumerate(grids):
        options.tell("place", i, len(grids))
        rows = grid.points[inside(grid.closed)]
        if not rows.size or held[rows].all():
            continue
        if held[rows].any():
            refused.append(f"{_named(mesh, grid)} has {np.count_nonzero(held[rows])} held points inside and stays")
            continue
        if (around[rows] != 2**d).any():
            refused.append(f"{_named(mesh, grid)} touches other cells with points inside and stays")
            continue
        old = mesh.points[grid.points][..., :d]
        try:
            new = place(old, grid.closed)
        except MeshError as error:
            refused.append(f"{_named(mesh, grid)}: {error}")
            continue
        if not _same(old, new, grid):
            points[rows, :d] = new[inside(grid.closed)]
            placed.append(grid)
    if not grids:
        refused.append("no structured block with points inside was found")
    if placed:
        refused += _without_worse(mesh, points, placed)
    moved = int(np.count_nonzero((points != mesh.points).any(axis=1)))
    return Outcome(with_points(mesh, points), moved, "points moved", refused=tuple(refused))


def _named(mesh: Mesh, grid: Grid) -> str:
    middle = mesh.points[grid.points].reshape(-1, 3).mean(axis=0)
    return f"the {grid.name} around ({', '.join(f'{x:.4g}' for x in middle)})"


def _same(old: Floats, new: Floats, grid: Grid) -> bool:
    """Whether no point inside has moved by more than rounding, measured by its shortest edge in the new place."""
    edge = np.full(new.shape[:-1], np.inf)
    for axis in range(len(grid.closed)):
        gap = np.linalg.norm(np.diff(new, axis=axis), axis=-1)
        first, last = [(0, 0)] * gap.ndim, [(0, 0)] * gap.ndim
        first[axis], last[axis] = (1, 0), (0, 1)
        edge = np.minimum(edge, np.pad(gap, first, constant_values=np.inf))
        edge = np.minimum(edge, np.pad(gap, last, constant_values=np.inf))
    at = inside(grid.closed)
    way = np.linalg.norm(new[at] - old[at], axis=-1)
    return bool((way <= _SAME * edge[at] + 16.0 * np.finfo(float).eps * np.abs(old).max()).all())


def _without_worse(mesh: Mesh, points: Floats, placed: list[Grid]) -> list[str]:
    """Put the blocks back into `points` whose worst cell would be worse, or that would have more bad ones; which."""
    (before, bad_before), (after, bad_after) = _judged(mesh), _judged(with_points(mesh, points))
    refused = []
    elsewhere = np.append((points != mesh.points).any(axis=1), False)
    corners = padded(mesh)
    for grid in placed:
        old, new = before[grid.cells], after[grid.cells]
        moved = elsewhere[corners[grid.cells]].any(axis=1)
        low, fresh = old[moved].min(initial=np.inf), new[moved].min(initial=np.inf)
        more = int(np.count_nonzero(bad_after[grid.cells])) - int(np.count_nonzero(bad_before[grid.cells]))
        if more > 0:
            refused.append(f"{_named(mesh, grid)} stays: it would have {more} more cells inverted or turned over")
        elif fresh < low - _ROUNDING:
            refused.append(f"{_named(mesh, grid)} stays: its worst cell would fall from {low:.9g} to {fresh:.9g}")
        else:
            continue
        points[grid.points] = mesh.points[grid.points]
    return refused


def _judged(mesh: Mesh) -> tuple[Floats, Mask]:
    """(quality, whether inverted) of each cell; a quad that is turned over whole is, though its quality is good."""
    flat = mesh
    if mesh.cell_dimension == 2 and mesh.dimension == 3:  # in a plane z = constant
        flat = replace(mesh, points=mesh.points * [1.0, 1.0, 0.0], dimension=2)
    quality, sizes = standing(mesh).quality, signed_sizes(flat)
    turned = sizes * np.sum(sizes) <= 0.0
    return quality, (quality <= 0.0) | turned


def structured_grids(mesh: Mesh) -> list[Grid]:
    """The blocks of the first-order quads or hexes of a mesh that have points inside, by their first cell.

    Blocks end at the boundary, at cells of other types, at borders of zones and listed elements, and at the sheets of
    faces that go straight on from singular edges (points) and from where such a border ends. A block whose closed
    direction comes back shifted or turned is none.
    """
    kind = "hex" if mesh.cell_dimension == 3 else "quad"
    chosen = [block for block in mesh.blocks if block.type == kind and len(block)]
    if not chosen:
        return []
    rows, nodes = chosen[0].rows, chosen[0].nodes
    into = np.full(mesh.n_cells, -1, np.int64)
    into[rows] = np.arange(len(rows))
    zones = [replace(zone, members=into[zone.members][into[zone.members] >= 0]) for zone in mesh.cell_zones]
    part = Mesh(
        mesh.points, (CellBlock(kind, np.arange(len(rows)), nodes),), zones=tuple(zones), dimension=mesh.dimension
    )
    found = faces(part)
    singular = (singular_edges if kind == "hex" else singular_points)(part, nodes)[0]
    walls = (border_faces(part) | _listed(mesh, found)) & (found.neighbour != NO_CELL)
    cut = cut_faces(part, singular, len(found), walls)
    if cut is None:
        return []
    neighbour = index_array(np.where(cut, NO_CELL, found.neighbour))
    lattice = nodes[:, _LATTICE[kind]].astype(np.int64)
    across = _across(lattice, found.offsets, found.nodes, found.owner, neighbour)
    component = find_parts(found.owner, neighbour, len(rows))
    first, count = np.unique(component, return_index=True, return_counts=True)[1:]
    corner, frame, sizes, closed = _measure(lattice, across, first, count)
    grids = []
    for b in np.flatnonzero((sizes >= 2).all(axis=1) & (sizes.prod(axis=1) == count)):
        table = np.full(sizes[b] + 1, -1, np.int64)
        cells = np.empty(count[b], np.int64)
        # the walk is in three directions; a flat grid has one layer of points in the third
        if _fill(lattice, across, corner[b], frame[b], np.append(sizes[b], 1)[:3],
                 table if table.ndim == 3 else table[:, :, None], cells) and _closes(table, closed[b]):  # fmt: skip
            grids.append(Grid(table, tuple(closed[b].tolist()), rows[cells]))
    return grids


def _listed(mesh: Mesh, found: Faces) -> Mask:
    """(faces,) those with an element of their own in the file."""
    width = 4 if mesh.cell_dimension == 3 else 2
    kind = "quad" if width == 4 else "line"
    out = np.zeros(len(found), bool)
    listed = [b.nodes[:, :width] for b in mesh.boundary if b.items is None and CELL_TYPES[b.type].corners == kind]
    if listed:
        both = np.sort(np.concatenate([*listed, found.nodes.reshape(-1, width)]), axis=1)
        number = np.unique(both, axis=0, return_inverse=True)[1].ravel()
        n = len(both) - len(found)
        out = np.isin(number[n:], number[:n])
    return out


def _closes(table: Ints, closed: Mask) -> bool:
    """Whether closed directions meet their first layer again point by point, and no point stands twice elsewhere."""
    for axis, turn in enumerate(closed):
        if turn:
            table = np.moveaxis(table, axis, 0)
            if not np.array_equal(table[0], table[-1]):
                return False
            table = np.moveaxis(table[:-1], 0, axis)
    return len(np.unique(table)) == table.size


@kernel
def _across(lattice: Ints, offsets: Ints, nodes: Ints, owner: Ints, neighbour: Ints) -> Ints:
    """(m, 2 d): the cell on side 2 * direction + end of each cell, -1 at cuts."""
    m, width = lattice.shape
    d = 3 if width == 8 else 2
    out = np.full((m, 2 * d), -1, np.int64)
    for f in range(owner.size):
        if neighbour[f] < 0:
            continue
        for way in range(2):
            cell, other = (owner[f], neighbour[f]) if way == 0 else (neighbour[f], owner[f])
            every, some = width - 1, 0
            for i in range(offsets[f], offsets[f + 1]):
                at = _place_of(lattice, cell, nodes[i])
                every &= at
                some |= at
            for a in range(d):
                if every >> a & 1:
                    out[cell, 2 * a + 1] = other
                elif not some >> a & 1:
                    out[cell, 2 * a] = other
    return out


@inner
def _place_of(lattice: Ints, cell: int, point: int) -> int:
    """Place of a point among the corners of a cell, -1 where it is none."""
    for b in range(lattice.shape[1]):
        if lattice[cell, b] == point:
            return b
    return -1


@inner
def _step(lattice: Ints, across: Ints, cell: int, seen: Ints, axis: int, way: int) -> int:
    """The cell beyond the end `way` of direction `axis`, as the frame `seen` has it; -1 at a cut.

    seen: (2 ** d,) points of the cell in the order of the frame; becomes those of the cell beyond.
    """
    width = lattice.shape[1]
    every, some = width - 1, 0
    for b in range(width):
        if (b >> axis & 1) == way:
            at = _place_of(lattice, cell, seen[b])
            every &= at
            some |= at
    side = -1
    for a in range(across.shape[1] // 2):
        if every >> a & 1:
            side = 2 * a + 1
        elif not some >> a & 1:
            side = 2 * a
    beyond = across[cell, side] if side >= 0 else -1
    if beyond < 0:
        return -1
    every, some = width - 1, 0
    for b in range(width):
        if (b >> axis & 1) == way:
            at = _place_of(lattice, beyond, seen[b])
            if at < 0:
                return -1
            every &= at
            some |= at
    flip = 0
    for a in range(across.shape[1] // 2):
        if every >> a & 1 or not some >> a & 1:
            flip = 1 << a
    for b in range(width):
        if (b >> axis & 1) == way:
            seen[b ^ (1 << axis)] = seen[b]
    for b in range(width):
        if (b >> axis & 1) != way:  # these are the common points now: the far ones lie opposite
            seen[b ^ (1 << axis)] = lattice[beyond, _place_of(lattice, beyond, seen[b]) ^ flip]
    return beyond


@kernel
def _measure(lattice: Ints, across: Ints, first: Ints, count: Ints) -> tuple[Ints, Ints, Ints, Mask]:
    """(corner cell, its points as framed, (blocks, d) cells along each direction, which are closed) of each block.

    first, count: a cell of each block and how many it has.
    """
    d = across.shape[1] // 2
    corner = first.copy()
    frame = np.empty((first.size, lattice.shape[1]), np.int64)
    sizes = np.ones((first.size, d), np.int64)
    closed = np.zeros((first.size, d), np.bool_)
    for block in range(first.size):
        seen = lattice[first[block]].copy()
        cell = first[block]
        for axis in range(d):
            ahead = seen.copy()
            home, here = cell, cell
            for _ in range(count[block]):
                here = _step(lattice, across, here, ahead, axis, 0)
                if here < 0 or here == home:
                    break
                cell = here
                seen[:] = ahead
        corner[block] = cell
        frame[block] = seen
        for axis in range(d):
            ahead = seen.copy()
            here = cell
            for _ in range(count[block]):
                here = _step(lattice, across, here, ahead, axis, 1)
                if here < 0 or here == cell:
                    break
                sizes[block, axis] += 1
            closed[block, axis] = here == cell
    return corner, frame, sizes, closed


@kernel
def _fill(lattice: Ints, across: Ints, corner: int, frame: Ints, size: Ints, table: Ints, cells: Ints) -> bool:
    """Write the points of the grid and its cells, walking from the corner; whether all cells fit together."""
    width = lattice.shape[1]
    d = across.shape[1] // 2
    row_cell, row_seen = corner, frame.copy()
    n = 0
    for i in range(size[0]):
        column_cell, column_seen = row_cell, row_seen.copy()
        for j in range(size[1]):
            cell, seen = column_cell, column_seen.copy()
            for k in range(size[2]):
                if cell < 0:
                    return False
                cells[n] = cell
                n += 1
                for b in range(width):
                    x, y, z = i + (b & 1), j + (b >> 1 & 1), k + (b >> 2)
                    if table[x, y, z] >= 0 and table[x, y, z] != seen[b]:
                        return False
                    table[x, y, z] = seen[b]
                if d == 3 and k + 1 < size[2]:
                    cell = _step(lattice, across, cell, seen, 2, 1)
            if j + 1 < size[1]:
                column_cell = _step(lattice, across, column_cell, column_seen, 1, 1)
                if column_cell < 0:
                    return False
        if i + 1 < size[0]:
            row_cell = _step(lattice, across, row_cell, row_seen, 0, 1)
            if row_cell < 0:
                return False
    return True
