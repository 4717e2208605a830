"""Where a mesh of hexahedra or quadrilaterals is not a grid: its singular edges or points.

An edge inside a mesh of hexahedra is regular with four cells around it, an edge of the boundary with one or two; of
quadrilaterals the same holds for points.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, overused_faces
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import NO_CELL, Ints, Mesh

__all__ = ["singular_edges", "singular_points"]

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
