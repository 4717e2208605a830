"""Which side of a cell lies on which side of another one, and what agrees with what through that."""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["WALL", "components", "pair_sides"]

WALL = -1
"""Partner of a side that nothing may be done through."""

_CROWDED = -2
"""Partner, while pairing, of a side that more than two cells or a wall have."""


def pair_sides(cells: Ints, corners: Ints, walls: Ints) -> Ints:
    """(m, s) for each side of each cell `s * cell + side` of the only other one with the same nodes, else WALL.

    cells: (m, k) point rows. corners: (s, w) which of the k are the nodes of a side, in any order. walls: (k, w) sides
    that stay closed though two cells have them. A side that more than two cells have is closed for all of them.
    """
    closed = np.ascontiguousarray(walls, dtype=cells.dtype).reshape(-1, corners.shape[1])
    n = len(cells) * len(corners)
    narrow = n + len(closed) < 2**31
    partner: Ints = np.full(n, WALL, np.int32 if narrow else np.int64)
    # most sides are two of a kind: the table is made for that, and larger where it is not so
    bits = max(4, int(0.75 * (n + len(closed))).bit_length())
    while not _pair(cells, corners, closed, np.full(1 << bits, -1, partner.dtype), partner):
        partner[:] = WALL
        bits += 1
    return partner.reshape(len(cells), len(corners))


@inner
def _write_sorted(cells: Ints, corners: Ints, walls: Ints, side: int, out: Ints) -> None:
    """The nodes of a side, ascending; sides behind those of the cells are walls."""
    s, w = corners.shape
    n = cells.shape[0] * s
    for i in range(w):
        v = cells[side // s, corners[side % s, i]] if side < n else walls[side - n, i]
        j = i
        while j > 0 and out[j - 1] > v:
            out[j] = out[j - 1]
            j -= 1
        out[j] = v


@inner
def _same(one: Ints, two: Ints) -> bool:
    same = True
    for i in range(one.size):
        same = same and one[i] == two[i]
    return same


@kernel
def _pair(cells: Ints, corners: Ints, walls: Ints, table: Ints, partner: Ints) -> bool:
    """Fill in `partner`; False where the table, (2^b,) of -1, is too small. It has room for the sides by a hash of all
    their nodes: no point is too busy for it."""
    nodes, other = np.empty(corners.shape[1], np.int64), np.empty(corners.shape[1], np.int64)
    last = table.size - 1
    n, used = partner.size, 0
    for turn in range(n + walls.shape[0]):
        side = n + turn if turn < walls.shape[0] else turn - walls.shape[0]  # walls first
        _write_sorted(cells, corners, walls, side, nodes)
        mix = np.uint64(0)
        for v in nodes:
            mix = (mix ^ np.uint64(v)) * np.uint64(0x9E3779B97F4A7C15)
            mix ^= mix >> np.uint64(32)
        at = np.int64(mix & np.uint64(last))
        while table[at] >= 0:
            _write_sorted(cells, corners, walls, table[at], other)
            if _same(nodes, other):
                break
            at = (at + 1) & last
        first = table[at]
        if first < 0:
            if 8 * used > 7 * table.size:
                return False
            used += 1
            table[at] = side
        elif side >= n:
            continue  # the same wall twice
        elif first >= n:
            partner[side] = _CROWDED
        elif partner[first] == WALL:
            partner[first], partner[side] = side, first
        else:
            if partner[first] >= 0:
                partner[partner[first]] = _CROWDED
                partner[first] = _CROWDED
            partner[side] = _CROWDED
    for side in range(n):
        partner[side] = max(partner[side], WALL)
    return True


@kernel
def components(n: int, first: Ints, second: Ints, alike: Ints) -> tuple[Ints, Ints, Ints]:
    """(component, turned, torn) of n cells or faces: which are joined, whether each is turned against the first of its
    component, and those at which that contradicts itself.

    first, second (k,): pairs that meet. alike (k,): 1 where one of the two must be turned for them to agree.
    """
    above = np.empty(n, first.dtype)
    turned = np.zeros(n, np.uint8)
    torn = np.zeros(n, np.bool_)
    for c in range(n):
        above[c] = c
    for i in range(first.size):
        a, by_a = _root(above, turned, first[i])
        b, by_b = _root(above, turned, second[i])
        flips = by_a ^ by_b ^ np.uint8(alike[i])
        if a < b:
            above[b], turned[b] = a, flips
        elif b < a:
            above[a], turned[a] = b, flips
        elif flips:
            torn[first[i]] = True
    component = np.empty(n, above.dtype)
    found = 0
    for c in range(n):
        root, _ = _root(above, turned, c)
        if root == c:
            component[c] = found
            found += 1
        else:
            component[c] = component[root]
    return component, turned, np.flatnonzero(torn)


@inner
def _root(above: Ints, turned: Ints, c: int) -> tuple[int, np.uint8]:
    """(first one joined to c, whether c is turned against it); what lies on the way is hung straight under it."""
    root, way = c, np.uint8(0)
    while above[root] != root:
        way ^= turned[root]
        root = above[root]
    whole = way
    while above[c] != root and c != root:
        up, own = above[c], turned[c]
        above[c], turned[c] = root, way
        way ^= own
        c = up
    return root, whole
