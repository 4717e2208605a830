"""Kernels that recognise a cell from its faces: tet, pyramid, wedge, hex, or a closed polyhedron or polygon.

All of them take `cell_offsets`/`cell_faces` (faces of each cell), `offsets`/`nodes` (nodes of each face) and
`owner` (a face's right-hand normal leaves its owner, so the owner sees it as stored and the neighbour reversed).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.csr import sort_keys
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["OTHER", "check_closed", "check_faces", "guess_kinds", "loops", "recognise"]

OTHER, TET, PYRAMID, WEDGE, HEX = range(5)

Flags = NDArray[np.bool_]


@kernel
def check_faces(offsets: Ints, nodes: Ints, owner: Ints, neighbour: Ints) -> tuple[int, int]:
    """(face, node) of the first face that names a node twice, (face, -1) of one with the same cell on both
    sides, (-1, -1) when there is neither.
    """
    longest = 0
    for f in range(owner.size):
        longest = max(longest, offsets[f + 1] - offsets[f])
    keys = np.empty(longest, np.int64)
    for f in range(owner.size):
        if owner[f] == neighbour[f]:
            return f, -1
        start, n = offsets[f], offsets[f + 1] - offsets[f]
        if n <= 4:
            for i in range(n):
                for j in range(i):
                    if nodes[start + i] == nodes[start + j]:
                        return f, nodes[start + i]
            continue
        for i in range(n):
            keys[i] = nodes[start + i]
        sort_keys(keys, n)
        for i in range(1, n):
            if keys[i] == keys[i - 1]:
                return f, keys[i]
    return -1, -1


@kernel
def guess_kinds(cell_offsets: Ints, cell_faces: Ints, offsets: Ints, kinds: NDArray[np.uint8]) -> None:
    """Fill kinds (n_cells,): the only type of the four that each cell can be by the sizes of its faces, or OTHER."""
    for c in range(kinds.size):
        n_tri = n_quad = 0
        for i in range(cell_offsets[c], cell_offsets[c + 1]):
            size = offsets[cell_faces[i] + 1] - offsets[cell_faces[i]]
            n_tri += size == 3
            n_quad += size == 4
        kind = OTHER
        if n_tri + n_quad == cell_offsets[c + 1] - cell_offsets[c]:
            if n_tri == 4 and n_quad == 0:
                kind = TET
            elif n_tri == 4 and n_quad == 1:
                kind = PYRAMID
            elif n_tri == 2 and n_quad == 3:
                kind = WEDGE
            elif n_tri == 0 and n_quad == 6:
                kind = HEX
        kinds[c] = kind


@inner
def _recognise_one(
    faces: Ints, cell: int, base: int, top: bool, offsets: Ints, nodes: Ints, owner: Ints, out: Ints
) -> bool:
    """Fill `out` with the cell's nodes in VTK order; False where the faces do not form that cell.

    The base is read so that its normal points into the cell; each base edge finds the one side face that
    holds it, whose other nodes stand above (all sides must agree), and what is left must be the top.
    """
    f = faces[base]
    start = offsets[f]
    k = offsets[f + 1] - start
    inward = owner[f] != cell
    for i in range(k):
        out[i] = nodes[start + (i if inward else k - 1 - i)]
    used = 1 << base
    agree = 1
    side_size = 4 if top else 3
    for i in range(k):
        a, b = out[i], out[(i + 1) % k]
        found = False
        for j in range(faces.size):
            f = faces[j]
            s = offsets[f]
            if used >> j & 1 or offsets[f + 1] - s != side_size:
                continue
            for p in range(side_size):
                if nodes[s + p] != a:
                    continue
                after = nodes[s + (p + 1 if p + 1 < side_size else 0)]
                before = nodes[s + (p - 1 if p else side_size - 1)]
                if after == b:
                    over_a, forward = before, True
                elif before == b:
                    over_a, forward = after, False
                else:
                    break
                found = True
                used |= 1 << j
                agree += forward == (owner[f] == cell)
                opposite = nodes[s + (p + 2) % side_size] if top else over_a
                here = k + i if top else k
                there = k + (i + 1) % k if top else k
                if i == 0:
                    out[here] = over_a
                    out[there] = opposite
                elif out[here] != over_a or (i + 1 == k and out[there] != opposite):
                    return False
                else:
                    out[there] = opposite
                break
            if found:
                break
        if not found:
            return False
    n = 2 * k if top else k + 1
    for i in range(k):
        for j in range(k, n):
            if out[i] == out[j]:
                return False
    if top:
        j = 0
        while used >> j & 1:
            j += 1
        f = faces[j]
        s = offsets[f]
        p = 0
        while p < k and nodes[s + p] != out[k]:
            p += 1
        if offsets[f + 1] - s != k or p == k:
            return False
        forward = nodes[s + (p + 1) % k] == out[k + 1]
        for i in range(1, k):
            if nodes[s + ((p + i) % k if forward else (p - i) % k)] != out[k + i]:
                return False
        agree += forward == (owner[f] == cell)
    if 2 * agree < faces.size:
        out[1], out[k - 1] = out[k - 1], out[1]
        if top:
            out[k + 1], out[n - 1] = out[n - 1], out[k + 1]
    return True


@kernel
def recognise(
    rows: Ints,
    kind: int,
    cell_offsets: Ints,
    cell_faces: Ints,
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    out: Ints,
    done: Flags,
) -> None:
    """Fill done (n,): whether the faces of each of `rows` form a cell of that kind, and out: its nodes in VTK order."""
    base_size = 3 if kind in (TET, WEDGE) else 4
    for r in range(rows.size):
        faces = cell_faces[cell_offsets[rows[r]] : cell_offsets[rows[r] + 1]]
        base = 0
        while offsets[faces[base] + 1] - offsets[faces[base]] != base_size:
            base += 1
        done[r] = _recognise_one(faces, rows[r], base, kind in (WEDGE, HEX), offsets, nodes, owner, out[r])


@kernel
def check_closed(
    rows: Ints, cell_offsets: Ints, cell_faces: Ints, offsets: Ints, nodes: Ints
) -> tuple[int, int, int, int]:
    """(row, node, node, uses) of the first edge that is not in exactly two faces of its cell, row -1 for none."""
    most = 0
    for r in range(rows.size):
        n = 0
        for i in range(cell_offsets[rows[r]], cell_offsets[rows[r] + 1]):
            n += offsets[cell_faces[i] + 1] - offsets[cell_faces[i]]
        most = max(most, n)
    keys = np.empty(most, np.int64)
    for r in range(rows.size):
        n = 0
        for i in range(cell_offsets[rows[r]], cell_offsets[rows[r] + 1]):
            f = cell_faces[i]
            last = np.int64(nodes[offsets[f + 1] - 1])
            for p in range(offsets[f], offsets[f + 1]):
                node = np.int64(nodes[p])
                keys[n] = min(last, node) << 32 | max(last, node)
                last = node
                n += 1
        sort_keys(keys, n)
        i = 0
        while i < n:
            j = i + 1
            while j < n and keys[j] == keys[i]:
                j += 1
            if j - i != 2:
                return rows[r], keys[i] >> 32, keys[i] & 0x7FFFFFFF, j - i
            i = j
    return -1, 0, 0, 0


@kernel
def loops(cell_offsets: Ints, cell_edges: Ints, nodes: Ints, owner: Ints, out: Ints) -> tuple[int, int, int]:
    """Chain the edges of each 2-D cell to one loop, written at cell_offsets into `out`.

    Owner on the left of its edges: counter-clockwise, by the majority of the edges; a tie keeps the direction
    of the first edge. Returns (row, node, uses) of the first cell where a node is not in exactly two edges,
    (row, -1, length) where the edges form more than one loop, (-1, 0, 0) when all is well.
    """
    most = 0
    for c in range(cell_offsets.size - 1):
        most = max(most, cell_offsets[c + 1] - cell_offsets[c])
    keys = np.empty(2 * most, np.int64)
    for c in range(cell_offsets.size - 1):
        start = cell_offsets[c]
        n = cell_offsets[c + 1] - start
        for i in range(n):
            e = cell_edges[start + i]
            keys[2 * i] = np.int64(nodes[2 * e]) << 32 | i
            keys[2 * i + 1] = np.int64(nodes[2 * e + 1]) << 32 | i
        sort_keys(keys, 2 * n)
        for i in range(n):
            if keys[2 * i] >> 32 != keys[2 * i + 1] >> 32 or (i and keys[2 * i] >> 32 == keys[2 * i - 1] >> 32):
                node = keys[2 * i] >> 32
                if i and node == keys[2 * i - 1] >> 32:
                    node = keys[2 * i - 1] >> 32
                uses = 0
                for j in range(2 * n):
                    uses += keys[j] >> 32 == node
                return c, node, uses
        local = 0
        first = cell_edges[start]
        node = nodes[2 * first] if owner[first] == c else nodes[2 * first + 1]
        origin = node
        agree = length = 0
        while True:
            e = cell_edges[start + local]
            forward = nodes[2 * e] == node
            agree += forward == (owner[e] == c)
            out[start + length] = node
            length += 1
            node = nodes[2 * e + 1] if forward else nodes[2 * e]
            if node == origin:
                break
            at = np.searchsorted(keys[: 2 * n], np.int64(node) << 32)
            pair = (keys[at] & 0x7FFFFFFF, keys[at + 1] & 0x7FFFFFFF)
            local = pair[1] if pair[0] == local else pair[0]
        if length != n:
            return c, -1, length
        if 2 * agree < n:
            out[start : start + n] = out[start : start + n][::-1].copy()
    return -1, 0, 0
