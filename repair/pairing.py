"""Which side of a cell lies on which side of another one."""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints

__all__ = ["WALL", "pair_sides"]

WALL = -1
"""Partner of a side that nothing may be done through."""


def pair_sides(sides: Ints, walls: Ints, n_points: int) -> Ints:
    """(h,) for each side the number of the only other one with the same nodes, else WALL.

    sides: (h, w) nodes of each, in any order. walls: (k, w) sides that stay closed though two cells have them. A side
    that more than two cells have is closed for all of them.
    """
    width = sides.shape[1]
    every = np.concatenate([sides, np.asarray(walls, dtype=np.int64).reshape(-1, width)])
    return _pair(np.sort(every, axis=1), len(sides), n_points)


@kernel
def _pair(keys: Ints, n_sides: int, n_points: int) -> Ints:
    """`pair_sides` for sorted rows, the walls behind the sides. Rows are compared with those of the same first node."""
    begin = np.zeros(n_points + 1, np.int64)
    for i in range(keys.shape[0]):
        begin[keys[i, 0] + 1] += 1
    for p in range(n_points):
        begin[p + 1] += begin[p]
    cursor = begin[:-1].copy()
    items = np.empty(keys.shape[0], np.int64)
    for i in range(keys.shape[0]):
        items[cursor[keys[i, 0]]] = i
        cursor[keys[i, 0]] += 1
    partner = np.full(n_sides, WALL, np.int64)
    for i in range(n_sides):
        found, other = 0, WALL
        for j in range(begin[keys[i, 0]], begin[keys[i, 0] + 1]):
            k = items[j]
            same = k != i
            for x in range(1, keys.shape[1]):
                same = same and keys[k, x] == keys[i, x]
            if same:
                found += 1
                other = k if k < n_sides else WALL
        if found == 1:
            partner[i] = other
    return partner
