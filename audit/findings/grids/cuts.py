"""Sheets of faces that start at singular edges, go straight on through regular ones and cut a mesh into blocks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces, faces_of_cells, overused_faces
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints, Mesh

__all__ = ["block_sizes", "cut_faces"]

Mask = NDArray[np.bool_]


def cut_faces(mesh: Mesh, singular: Ints, most: int, walls: Mask | None = None) -> Mask | None:
    """(f,) inner faces of the sheets that start at singular edges (m, 2) or points (m,); None for more than `most`.

    walls: (f,) inner faces that are cuts themselves; they go on straight where they end inside.
    """
    found = faces(mesh)
    n = len(mesh.points)
    keys = np.sort(singular @ np.array([n, 1]) if singular.ndim == 2 else singular * (n + 1))
    cut = np.zeros(len(found), dtype=bool) if walls is None else walls.copy()
    table = (found.offsets, found.nodes, found.owner, found.neighbour)
    total = _cut(*table, *faces_of_cells(mesh), keys.astype(np.int64), n, mesh.cell_dimension == 2, most, cut)
    cut[overused_faces(mesh)] = True
    return cut if total <= most else None


@inner
def _other(cell: int, face: int, p: int, q: int, offsets: Ints, nodes: Ints, starts: Ints, items: Ints) -> int:
    """The other face of a cell at the edge (p, q), or at the point p == q; -1 where there is none."""
    for k in range(starts[cell], starts[cell + 1]):
        g = items[k]
        if g == face:
            continue
        has_p = has_q = False
        for i in range(offsets[g], offsets[g + 1]):
            has_p |= nodes[i] == p
            has_q |= nodes[i] == q
        if has_p and has_q:
            return g
    return -1


@inner
def _beyond(cell: int, face: int, owner: Ints, neighbour: Ints) -> int:
    return neighbour[face] if owner[face] == cell else owner[face]


@inner
def _opposed(
    face: int, p: int, q: int, offsets: Ints, nodes: Ints, owner: Ints, neighbour: Ints, starts: Ints, items: Ints
) -> int:
    """The face that goes straight on through the edge (p, q), -1 where there are not four cells around it."""
    ends = (-1, -2)
    for side in range(2):
        cell = owner[face] if side == 0 else neighbour[face]
        g = _other(cell, face, p, q, offsets, nodes, starts, items)
        cell = _beyond(cell, g, owner, neighbour) if g >= 0 else -1
        g = _other(cell, g, p, q, offsets, nodes, starts, items) if cell >= 0 else -1
        ends = (ends[1], g)
    return ends[0] if ends[0] == ends[1] else -1


@kernel
def _cut(
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    neighbour: Ints,
    starts: Ints,
    items: Ints,
    keys: NDArray[np.int64],
    n_points: int,
    flat: bool,
    most: int,
    cut: Mask,
) -> int:
    """Mark the cut faces, beside those marked already; returns how many, and stops when they are more than `most`."""
    ends = np.zeros(n_points, np.bool_)
    for key in keys:
        ends[key // n_points] = True
    queue = np.empty(min(most, owner.size) + 1, np.int32)
    n = 0
    for f in range(owner.size):
        if neighbour[f] < 0:
            continue
        if cut[f]:
            queue[n] = f
            n += 1
        for i in range(offsets[f], offsets[f + 1]):
            p = nodes[i]
            q = p if flat else nodes[i + 1 if i + 1 < offsets[f + 1] else offsets[f]]
            if ends[min(p, q)]:
                key = np.int64(min(p, q)) * n_points + max(p, q)
                at = np.searchsorted(keys, key)
                if at < keys.size and keys[at] == key and not cut[f]:
                    cut[f] = True
                    queue[n] = f
                    n += 1
        if n > most:
            return n
    done = 0
    while done < n:
        f = queue[done]
        done += 1
        for i in range(offsets[f], offsets[f + 1]):
            p = nodes[i]
            q = p if flat else nodes[i + 1 if i + 1 < offsets[f + 1] else offsets[f]]
            g = _opposed(f, p, q, offsets, nodes, owner, neighbour, starts, items)
            if g >= 0 and not cut[g] and neighbour[g] >= 0:
                cut[g] = True
                queue[n] = g
                n += 1
                if n > most:
                    return n
    return n


@inner
def _across(cell: int, face: int, offsets: Ints, nodes: Ints, starts: Ints, items: Ints) -> int:
    """The face of a cell that has no point in common with this one, -1 where there is none or more than one."""
    found = -1
    for k in range(starts[cell], starts[cell + 1]):
        g = items[k]
        apart = g != face
        for i in range(offsets[g], offsets[g + 1]):
            for j in range(offsets[face], offsets[face + 1]):
                apart &= nodes[i] != nodes[j]
        if apart:
            if found >= 0:
                return -1
            found = g
    return found


@kernel
def block_sizes(
    offsets: Ints, nodes: Ints, owner: Ints, neighbour: Ints, starts: Ints, items: Ints, first: Ints, directions: int
) -> NDArray[np.int64]:
    """(blocks, directions) cells along each direction, walked from the cell `first` of each block.

    neighbour: -1 at cuts too.  A direction that returns to its first cell is closed and counted below zero. 0: the
    cell has not as many directions.
    """
    out = np.zeros((first.size, directions), np.int64)
    for b in range(first.size):
        home = first[b]
        d = 0
        used = np.empty(directions, np.int64)
        for k in range(starts[home], starts[home + 1]):
            f = items[k]
            g = _across(home, f, offsets, nodes, starts, items)
            seen = False
            for u in used[:d]:
                seen |= u == f
            if g < 0 or seen or d == directions:
                continue
            used[d] = g
            length = 1
            for way in range(2):
                cell, face = home, f if way == 0 else g
                while True:
                    cell = _beyond(cell, face, owner, neighbour) if neighbour[face] >= 0 else -1
                    if cell < 0 or cell == home or length >= owner.size:
                        break
                    length += 1
                    face = _across(cell, face, offsets, nodes, starts, items)
                    if face < 0:
                        break
                if cell == home:
                    length = -length
                    break
            out[b, d] = length
            d += 1
    return out
