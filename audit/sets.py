"""Kernels on sets of nodes: distinct nodes of a cell, unique edges, hashes of node sets, connected parts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.csr import sort_keys
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints

__all__ = [
    "count_edges",
    "count_loop_edges",
    "distinct_by_row",
    "find_parts",
    "hash_rows",
    "place_edges",
    "place_loop_edges",
    "scatter",
    "squeeze_edges",
]


@kernel
def scatter(rows: Ints, starts: Ints, values: Ints, offsets: Ints, items: Ints) -> None:
    """Copy row i of the table (starts, values) to row rows[i] of the table (offsets, items)."""
    for r in range(rows.size):
        to = offsets[rows[r]] - starts[r]
        for i in range(starts[r], starts[r + 1]):
            items[to + i] = values[i]


@kernel
def distinct_by_row(
    cell_offsets: Ints, cell_faces: Ints, offsets: Ints, nodes: Ints, n_points: int
) -> tuple[Ints, Ints]:
    """(offsets, nodes): the distinct nodes of the faces of each cell, ascending."""
    n_cells = cell_offsets.size - 1
    starts = np.zeros(n_cells + 1, np.int32)
    seen_by = np.full(n_points, -1, np.int32)
    most = 0
    for c in range(n_cells):
        n = 0
        for i in range(cell_offsets[c], cell_offsets[c + 1]):
            for p in range(offsets[cell_faces[i]], offsets[cell_faces[i] + 1]):
                n += seen_by[nodes[p]] != c
                seen_by[nodes[p]] = c
        starts[c + 1] = starts[c] + n
        most = max(most, n)
    keys = np.empty(most, np.int64)
    found = np.empty(starts[n_cells], np.int32)
    seen_by[:] = -1
    for c in range(n_cells):
        n = 0
        for i in range(cell_offsets[c], cell_offsets[c + 1]):
            for p in range(offsets[cell_faces[i]], offsets[cell_faces[i] + 1]):
                if seen_by[nodes[p]] != c:
                    seen_by[nodes[p]] = c
                    keys[n] = nodes[p]
                    n += 1
        sort_keys(keys, n)
        for i in range(n):
            found[starts[c] + i] = keys[i]
    return starts, found


@kernel
def count_edges(nodes: Ints, table: Ints, begin: Ints) -> None:
    """Add to begin[p + 1] the edges of the cells `nodes` (n, k) whose smaller end is p."""
    for c in range(nodes.shape[0]):
        for e in range(table.shape[0]):
            a, b = nodes[c, table[e, 0]], nodes[c, table[e, 1]]
            if a != b:
                begin[min(a, b) + 1] += 1


@kernel
def place_edges(nodes: Ints, table: Ints, cursor: Ints, ends: Ints) -> None:
    """Write the larger end of each such edge at the cursor of its smaller one."""
    for c in range(nodes.shape[0]):
        for e in range(table.shape[0]):
            a, b = nodes[c, table[e, 0]], nodes[c, table[e, 1]]
            if a != b:
                low = min(a, b)
                ends[cursor[low]] = max(a, b)
                cursor[low] += 1


@kernel
def count_loop_edges(offsets: Ints, items: Ints, begin: Ints) -> None:
    """`count_edges` for polygons, or the faces of polyhedra."""
    for r in range(offsets.size - 1):
        a = items[offsets[r + 1] - 1]
        for i in range(offsets[r], offsets[r + 1]):
            b = items[i]
            if a != b:
                begin[min(a, b) + 1] += 1
            a = b


@kernel
def place_loop_edges(offsets: Ints, items: Ints, cursor: Ints, ends: Ints) -> None:
    """`place_edges` for polygons, or the faces of polyhedra."""
    for r in range(offsets.size - 1):
        a = items[offsets[r + 1] - 1]
        for i in range(offsets[r], offsets[r + 1]):
            b = items[i]
            if a != b:
                low = min(a, b)
                ends[cursor[low]] = max(a, b)
                cursor[low] += 1
            a = b


@kernel
def squeeze_edges(stops: Ints, ends: Ints) -> Ints:
    """(m, 2) unique edges, sorted; bucket p of `ends` runs from stops[p - 1] to stops[p]. Sorts `ends` in place."""
    m = 0
    start = 0
    keys = np.empty(64, np.int64)
    for p in range(stops.size):
        n = stops[p] - start
        if n > keys.size:
            keys = np.empty(2 * n, np.int64)
        for i in range(n):
            keys[i] = ends[start + i]
        sort_keys(keys, n)
        for i in range(n):
            ends[start + i] = keys[i]
            m += i == 0 or keys[i] != keys[i - 1]
        start = stops[p]
    edges = np.empty((m, 2), np.int32)
    m = 0
    start = 0
    for p in range(stops.size):
        for i in range(start, stops[p]):
            if i == start or ends[i] != ends[i - 1]:
                edges[m, 0] = p
                edges[m, 1] = ends[i]
                m += 1
        start = stops[p]
    return edges


@kernel
def hash_rows(offsets: Ints, items: Ints) -> NDArray[np.uint64]:
    """One number a row; rows with the same items in any order, and as often, get the same."""
    out = np.empty(offsets.size - 1, np.uint64)
    for r in range(out.size):
        total = np.uint64(offsets[r + 1] - offsets[r])
        for i in range(offsets[r], offsets[r + 1]):
            # splitmix64's finaliser: a sum of well mixed numbers does not depend on their order
            x = np.uint64(items[i]) + np.uint64(0x9E3779B97F4A7C15)
            x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            total += x ^ (x >> np.uint64(31))
        out[r] = total
    return out


@kernel
def find_parts(owner: Ints, neighbour: Ints, n_cells: int) -> Ints:
    """(n_cells,) number of the connected part of each cell, parts numbered by their first cell row."""
    parent = np.arange(n_cells).astype(np.int32)
    for f in range(owner.size):
        if neighbour[f] < 0:
            continue
        a, b = owner[f], neighbour[f]
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        while parent[b] != b:
            parent[b] = parent[parent[b]]
            b = parent[b]
        # the lower row becomes the root, so that a root is the first cell of its part
        parent[max(a, b)] = min(a, b)
    part = np.empty(n_cells, np.int32)
    n = 0
    for c in range(n_cells):
        if parent[c] == c:
            part[c] = n
            n += 1
        else:
            part[c] = part[parent[c]]
    return part
