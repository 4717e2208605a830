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
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints, index_array

__all__ = ["KINDS", "POLYGON", "count_half_faces", "emit", "meetings", "pair", "select"]

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


@inner
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


@inner
def _smallest(size: int, a: int, b: int, c: int, d: int) -> int:
    m = a if a < b else b
    if size > 2:
        m = c if c < m else m
    if size > 3:
        m = d if d < m else m
    return m


@inner
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


def count_half_faces(kinds: NDArray[np.uint8], offsets: Ints) -> NDArray[np.int64]:
    """(n_cells + 1,) number of the first half-face of each cell."""
    starts = np.zeros(len(kinds) + 1, np.int64)
    np.cumsum(np.where(kinds == POLYGON, np.diff(offsets), np.append(_COUNT, 0)[kinds]), out=starts[1:])
    return starts


def pair(
    kinds: NDArray[np.uint8], offsets: Ints, nodes: Ints, starts: Ints, n_points: int
) -> tuple[Ints, NDArray[np.bool_]]:
    """(other, crowded), both (half-faces,).

    other: row of the cell on the other side; -1 on the boundary; SECOND where the other side speaks for the
    face, NONE for a half-face that is no face. crowded: more than two cells name these nodes; then the first
    two are paired and each further one stands alone.
    """
    other = np.empty(starts[-1], np.int32)
    # cells of one type all have as many: then nothing need be kept to tell whose a half-face is
    each = int(_COUNT[kinds[0]]) if len(kinds) and kinds[0] != POLYGON and (kinds == kinds[0]).all() else 0
    cell_of = np.empty(0 if each else starts[-1], np.int32)
    crowded = np.zeros(starts[-1], dtype=bool)
    begin = np.zeros(n_points + 1, np.int32)
    _find_buckets(kinds, offsets, nodes, starts, cell_of, other, begin)
    most = begin.max()
    np.cumsum(begin, dtype=np.int32, out=begin)
    bucket = np.empty(begin[-1], np.int32)
    keys = np.empty(most, np.int64), np.empty(most, np.int32)
    _pair(kinds, offsets, nodes, starts, cell_of, each, other, crowded, begin, bucket, *keys)
    return other, crowded


@kernel
def _find_buckets(
    kinds: NDArray[np.uint8], offsets: Ints, nodes: Ints, starts: Ints, cell_of: Ints, other: Ints, begin: Ints
) -> None:
    """Cell of each half-face, and in `other` for the time being its smallest node, m, counted in begin[m + 1]."""
    for c in range(kinds.size):
        n = offsets[c + 1] - offsets[c]
        for h in range(starts[c], starts[c + 1]):
            size, a, b, x, y = _half_face(kinds[c], h - starts[c], offsets[c], n, nodes)
            if cell_of.size:
                cell_of[h] = c
            other[h] = NONE
            if size:
                m = _smallest(size, a, b, x, y)
                other[h] = m
                begin[m + 1] += 1


@kernel
def _pair(
    kinds: NDArray[np.uint8],
    offsets: Ints,
    nodes: Ints,
    starts: Ints,
    cell_of: Ints,
    each: int,
    other: Ints,
    crowded: NDArray[np.bool_],
    begin: Ints,
    bucket: Ints,
    first: NDArray[np.int64],
    second: NDArray[np.int32],
) -> None:
    for h in range(other.size):
        m = other[h]
        if m >= 0:
            bucket[begin[m]] = h
            begin[m] += 1
            other[h] = -1
    # begin[m] has moved on to the end of bucket m, which is where bucket m + 1 starts.
    low = 0
    for p in range(begin.size - 1):
        n_in = begin[p] - low
        for i in range(n_in):
            h = bucket[low + i]
            c = _cell(h, each, cell_of)
            n = offsets[c + 1] - offsets[c]
            size, a, b, x, y = _half_face(kinds[c], h - starts[c], offsets[c], n, nodes)
            first[i], second[i] = _key(size, p, a, b, x, y)
        apart = n_in > _SMALL_BUCKET  # comparing all with all would be slow: sort, and compare neighbours
        if apart:
            _sort_bucket(bucket, low, n_in, first, second)
        for i in range(n_in):
            h = bucket[low + i]
            if other[h] != -1 or crowded[h]:
                continue
            for j in range(i + 1, n_in):
                if first[j] == first[i] and second[j] == second[i]:
                    g = bucket[low + j]
                    _meet(h, g, _cell(h, each, cell_of), _cell(g, each, cell_of), other, crowded)
                elif apart:
                    break
        low = begin[p]


@inner
def _cell(h: int, each: int, cell_of: Ints) -> int:
    return h // each if each else cell_of[h]


@inner
def _meet(h: int, g: int, cell: int, beyond: int, other: Ints, crowded: NDArray[np.bool_]) -> None:
    """Half-face g, of the cell `beyond`, has the nodes of the earlier h, of `cell`: pair them, or leave g alone where
    h is taken already.

    A cell folded flat may name the same face twice; it never becomes its own neighbour.
    """
    if other[h] == -1 and cell != beyond:
        other[h] = beyond
        other[g] = SECOND
    else:
        crowded[h] = True
        crowded[g] = True


@inner
def _sort_bucket(bucket: Ints, low: int, n: int, first: NDArray[np.int64], second: NDArray[np.int32]) -> None:
    """Sort bucket[low : low + n], which ascends, by (first, second) and then by itself; Shell's method."""
    gap = 1
    while 9 * gap < 4 * n:
        gap = 9 * gap // 4 + 1
    while gap > 0:
        for i in range(gap, n):
            x, y, h = first[i], second[i], bucket[low + i]
            j = i - gap
            while j >= 0 and (
                first[j] > x or (first[j] == x and (second[j] > y or (second[j] == y and bucket[low + j] > h)))
            ):
                first[j + gap], second[j + gap], bucket[low + j + gap] = first[j], second[j], bucket[low + j]
                j -= gap
            first[j + gap], second[j + gap], bucket[low + j + gap] = x, y, h
        gap = 4 * gap // 9 if gap > 2 else gap - 1


def emit(
    kinds: NDArray[np.uint8], offsets: Ints, nodes: Ints, starts: Ints, other: Ints, crowded: NDArray[np.bool_]
) -> tuple[Ints, Ints, Ints, Ints, Ints]:
    """(offsets, nodes, owner, neighbour, crowded faces) of all faces, by owner row and then local face."""
    faces = other >= -1
    n_faces = np.count_nonzero(faces)
    longest = _LONGEST[kinds].max(initial=2)
    face_offsets = np.zeros(n_faces + 1, np.int32)
    face_nodes = np.empty(n_faces * longest, np.int32)
    owner = np.empty(n_faces, np.int32)
    _emit(kinds, offsets, nodes, starts, other, face_offsets, face_nodes, owner)
    crowd = np.flatnonzero(crowded[faces]).astype(np.int32)
    return face_offsets, face_nodes[: face_offsets[-1]], owner, other[faces], crowd


def select(kinds: NDArray[np.uint8], offsets: Ints, nodes: Ints, starts: Ints, chosen: NDArray[np.bool_]) -> Ints:
    """(k, 4) the nodes of the half-faces that are chosen (half-faces,), in their order; -1 in the places not used."""
    out = np.full((np.count_nonzero(chosen), 4), -1, nodes.dtype)
    _select(kinds, offsets, nodes, starts, chosen, out)
    return out


@kernel
def _select(
    kinds: NDArray[np.uint8], offsets: Ints, nodes: Ints, starts: Ints, chosen: NDArray[np.bool_], out: Ints
) -> None:
    at = 0
    for c in range(kinds.size):
        for h in range(starts[c], starts[c + 1]):
            if chosen[h]:
                _, a, b, x, y = _half_face(kinds[c], h - starts[c], offsets[c], offsets[c + 1] - offsets[c], nodes)
                out[at, 0], out[at, 1], out[at, 2], out[at, 3] = a, b, x, y
                at += 1


@kernel
def meetings(
    kinds: NDArray[np.uint8], offsets: Ints, nodes: Ints, starts: Ints, other: Ints, crowded: NDArray[np.bool_]
) -> tuple[Ints, Ints, NDArray[np.bool_]]:
    """(first, second, alike) of every side that exactly two cells share: the cells, and whether both walk it alike."""
    n = 0
    for h in range(other.size):
        n += other[h] >= 0 and not crowded[h]
    first, second, alike = np.empty(n, np.int32), np.empty(n, np.int32), np.zeros(n, np.bool_)
    at = 0
    for c in range(kinds.size):
        for h in range(starts[c], starts[c + 1]):
            d = other[h]
            if d < 0 or crowded[h]:
                continue
            size, a, b, x, y = _half_face(kinds[c], h - starts[c], offsets[c], offsets[c + 1] - offsets[c], nodes)
            m = _smallest(size, a, b, x, y)
            key, after = _key(size, m, a, b, x, y), _after(size, m, a, b, x, y)
            first[at], second[at] = c, d
            for g in range(starts[d], starts[d + 1]):
                size, a, b, x, y = _half_face(kinds[d], g - starts[d], offsets[d], offsets[d + 1] - offsets[d], nodes)
                if size and _smallest(size, a, b, x, y) == m and _key(size, m, a, b, x, y) == key:
                    alike[at] = _after(size, m, a, b, x, y) == after
                    break
            at += 1
    return first, second, alike


@inner
def _after(size: int, m: int, a: int, b: int, c: int, d: int) -> int:
    """The node that follows the smallest, m, along a side; of an edge its end."""
    if size == 2 or a == m:
        return b
    if b == m:
        return c
    if c == m and size == 4:
        return d
    return a


@kernel
def _emit(
    kinds: NDArray[np.uint8],
    offsets: Ints,
    nodes: Ints,
    starts: Ints,
    other: Ints,
    face_offsets: Ints,
    face_nodes: Ints,
    owner: Ints,
) -> None:
    f = at = 0
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
            f += 1
            face_offsets[f] = at
