"""Kernels that pair the half-faces of cells: two cells share a face when they name the same nodes for it.

A half-face is one cell's side of a face; half-faces are numbered by cell row, then by local face. They are
put into buckets by their smallest node with a counting sort and compared inside a bucket by the nodes that
remain. Faces of 2-D cells are their edges. A quad face of a collapsed cell with two equal neighbouring
corners is the triangle it looks like, and one with fewer than three different corners is no face at all.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints, index_array

__all__ = ["KINDS", "POLYGON", "count_half_faces", "emit", "pair"]

KINDS = ("tri", "quad", "tet", "pyramid", "wedge", "hex", "polygon")
"""Cell types by the number the kernels know them by; polyhedra bring their faces along."""

POLYGON = KINDS.index("polygon")
SECOND = -2
NONE = -3

_SMALL_BUCKET = 64

_SIDES = [CELL_TYPES[t].edges if CELL_TYPES[t].dimension == 2 else CELL_TYPES[t].faces for t in KINDS[:POLYGON]]
_COUNT = index_array([len(sides) for sides in _SIDES])
_SIZE = index_array([[len(s) for s in sides] + [0] * (6 - len(sides)) for sides in _SIDES])
_LONGEST = index_array([*_SIZE.max(axis=1).tolist(), 2])
_CORNERS = index_array(
    [[list(s) + [s[0]] * (4 - len(s)) for s in sides] + [[0] * 4] * (6 - len(sides)) for sides in _SIDES]
)


@kernel
def _half_face(kind: int, local: int, start: int, n: int, nodes: Ints) -> tuple[int, int, int, int, int]:
    """(size, a, b, c, d) of one half-face, repeated corners dropped and unused places -1; size 0: no face."""
    if kind == POLYGON:
        size = 2
        a, b = nodes[start + local], nodes[start + (local + 1 if local + 1 < n else 0)]
        c = d = a
    else:
        size = _SIZE[kind, local]
        a = nodes[start + _CORNERS[kind, local, 0]]
        b = nodes[start + _CORNERS[kind, local, 1]]
        c = nodes[start + _CORNERS[kind, local, 2]]
        d = nodes[start + _CORNERS[kind, local, 3]]
    none = np.int32(-1)
    if size == 4:
        if a == b:
            size, b, c, d = 3, c, d, none
        elif b == c:
            size, c, d = 3, d, none
        elif d in (a, c):
            size, d = 3, none
    else:
        d = none
    if size == 3:
        if a in (b, c) or b == c:
            size = 0
    elif size == 2:
        c = none
        if a == b:
            size = 0
    return size, a, b, c, d


@kernel
def _smallest(size: int, a: int, b: int, c: int, d: int) -> int:
    m = min(a, b)
    if size > 2:
        m = min(m, c)
    if size > 3:
        m = min(m, d)
    return m


@kernel
def _key(size: int, m: int, a: int, b: int, c: int, d: int) -> tuple[np.int64, np.int32]:
    """The nodes other than the smallest, m, in order, as two numbers that tell sizes apart."""
    if size == 2:
        return np.int64(a) + np.int64(b) - m, np.int32(-2)
    if a == m:
        x, y, z = b, c, d
    elif b == m:
        x, y, z = a, c, d
    elif c == m:
        x, y, z = a, b, d
    else:
        x, y, z = a, b, c
    if x > y:
        x, y = y, x
    if size == 3:
        return np.int64(x) << 32 | np.int64(y), np.int32(-1)
    if y > z:
        y, z = z, y
    if x > y:
        x, y = y, x
    return np.int64(x) << 32 | np.int64(y), np.int32(z)


@kernel
def count_half_faces(kinds: NDArray[np.uint8], offsets: Ints) -> NDArray[np.int64]:
    """(n_cells + 1,) number of the first half-face of each cell."""
    starts = np.zeros(kinds.size + 1, np.int64)
    for c in range(kinds.size):
        n = offsets[c + 1] - offsets[c] if kinds[c] == POLYGON else _COUNT[kinds[c]]
        starts[c + 1] = starts[c] + n
    return starts


@kernel
def pair(
    kinds: NDArray[np.uint8], offsets: Ints, nodes: Ints, starts: Ints, n_points: int
) -> tuple[Ints, NDArray[np.bool_]]:
    """(other, crowded), both (half-faces,).

    other: row of the cell on the other side; -1 on the boundary; SECOND where the other side speaks for the
    face, NONE for a half-face that is no face. crowded: more than two cells name these nodes; then the first
    two are paired and each further one stands alone.
    """
    n_half = starts[kinds.size]
    other = np.empty(n_half, np.int32)
    cell_of = np.empty(n_half, np.int32)
    crowded = np.zeros(n_half, np.bool_)
    begin = np.zeros(n_points + 1, np.int32)
    for c in range(kinds.size):
        n = offsets[c + 1] - offsets[c]
        for h in range(starts[c], starts[c + 1]):
            size, a, b, x, y = _half_face(kinds[c], h - starts[c], offsets[c], n, nodes)
            cell_of[h] = c
            other[h] = NONE
            if size:
                m = _smallest(size, a, b, x, y)
                other[h] = m  # borrowed until the half-face is in its bucket
                begin[m + 1] += 1
    for p in range(n_points):
        begin[p + 1] += begin[p]
    bucket = np.empty(begin[n_points], np.int32)
    for h in range(n_half):
        m = other[h]
        if m >= 0:
            bucket[begin[m]] = h
            begin[m] += 1
            other[h] = -1
    # begin[m] has moved on to the end of bucket m, which is where bucket m + 1 starts.
    most = low = 0
    for p in range(n_points):
        most = max(most, begin[p] - low)
        low = begin[p]
    first = np.empty(most, np.int64)
    second = np.empty(most, np.int32)
    low = 0
    for p in range(n_points):
        n_in = begin[p] - low
        for i in range(n_in):
            h = bucket[low + i]
            c = cell_of[h]
            n = offsets[c + 1] - offsets[c]
            size, a, b, x, y = _half_face(kinds[c], h - starts[c], offsets[c], n, nodes)
            first[i], second[i] = _key(size, p, a, b, x, y)
        if n_in > _SMALL_BUCKET:
            _pair_sorted(bucket[low : begin[p]], first[:n_in], second[:n_in], cell_of, other, crowded)
        else:
            for i in range(n_in):
                h = bucket[low + i]
                if other[h] != -1 or crowded[h]:
                    continue
                for j in range(i + 1, n_in):
                    if first[j] == first[i] and second[j] == second[i]:
                        _meet(h, bucket[low + j], cell_of, other, crowded)
        low = begin[p]
    return other, crowded


@kernel
def _meet(h: int, g: int, cell_of: Ints, other: Ints, crowded: NDArray[np.bool_]) -> None:
    """Half-face g has the nodes of the earlier h: pair them, or leave g alone where h is taken already.

    A cell folded flat may name the same face twice; it never becomes its own neighbour.
    """
    if other[h] == -1 and cell_of[h] != cell_of[g]:
        other[h] = cell_of[g]
        other[g] = SECOND
    else:
        crowded[h] = True
        crowded[g] = True


@kernel
def _pair_sorted(
    bucket: Ints, first: NDArray[np.int64], second: NDArray[np.int32], cell_of: Ints, other: Ints, crowded: Ints
) -> None:
    """The same for a bucket so full that comparing all with all would be slow."""
    order = np.argsort(second, kind="mergesort")
    order = order[np.argsort(first[order], kind="mergesort")]
    i = 0
    while i < order.size:
        j = i + 1
        while j < order.size and first[order[j]] == first[order[i]] and second[order[j]] == second[order[i]]:
            _meet(bucket[order[i]], bucket[order[j]], cell_of, other, crowded)
            j += 1
        i = j


@kernel
def emit(
    kinds: NDArray[np.uint8], offsets: Ints, nodes: Ints, starts: Ints, other: Ints, crowded: NDArray[np.bool_]
) -> tuple[Ints, Ints, Ints, Ints, Ints]:
    """(offsets, nodes, owner, neighbour, crowded faces) of all faces, by owner row and then local face."""
    n_faces = n_crowded = 0
    for h in range(other.size):
        n_faces += other[h] >= -1
        n_crowded += crowded[h] and other[h] >= -1
    longest = 2
    for c in range(kinds.size):
        longest = max(longest, _LONGEST[kinds[c]])
    face_offsets = np.zeros(n_faces + 1, np.int32)
    face_nodes = np.empty(n_faces * longest, np.int32)
    owner = np.empty(n_faces, np.int32)
    neighbour = np.empty(n_faces, np.int32)
    crowd = np.empty(n_crowded, np.int32)
    f = at = k = 0
    for c in range(kinds.size):
        n = offsets[c + 1] - offsets[c]
        for h in range(starts[c], starts[c + 1]):
            if other[h] < -1:
                continue
            size, a, b, x, y = _half_face(kinds[c], h - starts[c], offsets[c], n, nodes)
            face_nodes[at] = a
            face_nodes[at + 1] = b
            if size > 2:
                face_nodes[at + 2] = x
            if size > 3:
                face_nodes[at + 3] = y
            at += size
            owner[f] = c
            neighbour[f] = other[h]
            if crowded[h]:
                crowd[k] = f
                k += 1
            f += 1
            face_offsets[f] = at
    return face_offsets, face_nodes[:at], owner, neighbour, crowd
