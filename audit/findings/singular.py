"""Where a mesh of hexahedra or quadrilaterals is not a grid: singular edges (points), and the cuts that start there.

An edge inside a mesh of hexahedra is regular with four cells around it, an edge of the boundary with one or two; of
quadrilaterals the same holds for points. Sheets of faces that start at a singular edge and go straight on through
regular ones cut the mesh into blocks.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, faces_of_cells, overused_faces
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import NO_CELL, Ints, Mesh

__all__ = ["block_sizes", "cut_faces", "singular_edges", "singular_points"]

_AT_CORNER = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])
"""The three edge neighbours of each corner of a hexahedron."""

_EDGES = CELL_TYPES["hex"].edge_table
_LANES = np.uint64(0x5555555555555555)

Mask = NDArray[np.bool_]


@inner
def _hash(p: int) -> np.uint64:
    """splitmix64 of a point's number."""
    x = np.uint64(p) + np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@inner
def _plus(a: np.uint64, b: np.uint64) -> np.uint64:
    """32 sums of two bits each, without carry between them."""
    return (a ^ b) ^ ((a & b & _LANES) << np.uint64(1))


@kernel
def _gather_around(nodes: Ints, count: NDArray[np.int32], mix: NDArray[np.uint64]) -> None:
    """Cells at every point; and the sum, in 32 lanes modulo 4, of a hash of each edge neighbour once a cell.

    The sum is 0 where all edges at the point have four cells, or eight, and 0 elsewhere once in 2**64 cases.
    """
    h = np.empty(8, np.uint64)
    for c in range(nodes.shape[0]):
        for i in range(8):
            h[i] = _hash(nodes[c, i])
        for i in range(8):
            p = nodes[c, i]
            count[p] += 1
            mix[p] = _plus(mix[p], _plus(h[_AT_CORNER[i, 0]], _plus(h[_AT_CORNER[i, 1]], h[_AT_CORNER[i, 2]])))


@kernel
def _gather_boundary(offsets: Ints, nodes: Ints, rows: Ints, outside: Mask, mix: NDArray[np.uint64]) -> None:
    """Mark the points of boundary faces, and add a hash of their edge neighbours once a face.

    In a flat part of the boundary an edge has two cells and two faces, which makes four again.
    """
    for f in rows:
        for i in range(offsets[f], offsets[f + 1]):
            p = nodes[i]
            before = nodes[i - 1 if i > offsets[f] else offsets[f + 1] - 1]
            after = nodes[i + 1 if i + 1 < offsets[f + 1] else offsets[f]]
            outside[p] = True
            mix[p] = _plus(mix[p], _plus(_hash(before), _hash(after)))


@kernel
def _suspects(count: NDArray[np.int32], mix: NDArray[np.uint64], outside: Mask) -> Mask:
    """Points that may end a singular edge: all but those with eight cells inside, four on the boundary, and sum 0."""
    out = np.empty(count.size, np.bool_)
    for p in range(count.size):
        out[p] = count[p] > 0 and (mix[p] != 0 or count[p] != (4 if outside[p] else 8))
    return out


@kernel
def _edges_between(nodes: Ints, suspect: Mask, count: NDArray[np.int32]) -> NDArray[np.int64]:
    """Edges of hexahedra with two suspect ends, once a cell: smaller point times the number of points plus larger."""
    most = 0
    for p in range(count.size):
        most += count[p] if suspect[p] else 0
    near = np.empty(min(most, nodes.shape[0]), np.int64)
    m = 0
    if most:
        for c in range(nodes.shape[0]):
            many = 0
            for i in range(8):
                many += suspect[nodes[c, i]]
            if many > 1:
                near[m] = c
                m += 1
    out = np.empty(12 * m, np.int64)
    n = 0
    for c in near[:m]:
        for e in range(12):
            a, b = nodes[c, _EDGES[e, 0]], nodes[c, _EDGES[e, 1]]
            if a != b and suspect[a] and suspect[b]:
                out[n] = np.int64(min(a, b)) * suspect.size + max(a, b)
                n += 1
    return out[:n]


@kernel
def _boundary_keys(offsets: Ints, nodes: Ints, rows: Ints, suspect: Mask) -> NDArray[np.int64]:
    """Edges of boundary faces with two suspect ends, in the same way."""
    out = np.empty(4 * rows.size, np.int64)
    n = 0
    for f in rows:
        p = nodes[offsets[f + 1] - 1]
        for i in range(offsets[f], offsets[f + 1]):
            q = nodes[i]
            if suspect[p] and suspect[q] and p != q:
                out[n] = np.int64(min(p, q)) * suspect.size + max(p, q)
                n += 1
            p = q
    return out[:n]


def singular_edges(mesh: Mesh, nodes: Ints) -> tuple[Ints, Ints, Mask]:
    """(edges (m, 2), cells around each, whether on the boundary) of the singular edges of a mesh of hexahedra alone.

    nodes (n, 8): the corners of its cells.
    """
    found = faces(mesh)
    n = len(mesh.points)
    count, mix, outside = np.zeros(n, np.int32), np.zeros(n, np.uint64), np.zeros(n, dtype=bool)
    _gather_around(nodes, count, mix)
    rows = np.flatnonzero(found.neighbour == NO_CELL)
    _gather_boundary(found.offsets, found.nodes, rows, outside, mix)
    suspect = _suspects(count, mix, outside)
    keys, valence = np.unique(_edges_between(nodes, suspect, count), return_counts=True)
    border = np.isin(keys, _boundary_keys(found.offsets, found.nodes, rows, suspect))
    singular = np.where(border, valence > 2, valence != 4)
    keys = keys[singular]
    return np.stack([keys // n, keys % n], axis=1), valence[singular], border[singular]


def singular_points(mesh: Mesh, nodes: Ints) -> tuple[Ints, Ints, Mask]:
    """(points (m,), cells at each, whether on the boundary) of the singular points of a mesh of quadrilaterals."""
    found = faces(mesh)
    count = np.bincount(nodes.ravel(), minlength=len(mesh.points))
    outside = np.zeros(len(mesh.points), dtype=bool)
    edge = found.nodes.reshape(-1, 2)
    outside[edge[found.neighbour == NO_CELL]] = True
    outside[edge[overused_faces(mesh)]] = True
    points = np.flatnonzero(np.where(outside, count > 2, (count != 4) & (count > 0)))
    return points, count[points], outside[points]


def cut_faces(mesh: Mesh, singular: Ints, most: int) -> Mask | None:
    """(f,) inner faces of the sheets that start at singular edges (m, 2) or points (m,); None for more than `most`."""
    found = faces(mesh)
    n = len(mesh.points)
    keys = np.sort(singular @ np.array([n, 1]) if singular.ndim == 2 else singular * (n + 1))
    cut = np.zeros(len(found), dtype=bool)
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
    """Mark the cut faces; returns how many, and stops when they are more than `most`."""
    ends = np.zeros(n_points, np.bool_)
    for key in keys:
        ends[key // n_points] = True
    queue = np.empty(min(most, owner.size) + 1, np.int32)
    n = 0
    for f in range(owner.size):
        if neighbour[f] < 0:
            continue
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
