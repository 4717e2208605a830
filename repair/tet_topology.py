"""A tet mesh that can be rewired in place: neighbour table, and the one operation that every swap is made of.

`Tables` of a mesh of m tets, with room for more: `tets` (cap, 4) point rows, first entry -1 where a row is free;
`across` (cap, 4): 4 * neighbour + its face for the face opposite each corner, WALL where nothing may be swapped
through it: the boundary, faces between zones, faces that the file lists inside. `origin` (cap,): the
row, in the mesh before, of a cell that the tet descends from. `free`: stack of free rows, its height in free[0].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints
from meshwright.repair.pairing import WALL, pair_sides

Mask = NDArray[np.bool_]

__all__ = ["WALL", "neighbours", "replace_cavity", "wall_points"]

_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]], dtype=np.int64)


@inner
def _sorted3(a: int, b: int, c: int) -> tuple[int, int, int]:
    if a > b:
        a, b = b, a
    if b > c:
        b, c = c, b
    if a > b:
        a, b = b, a
    return a, b, c


def neighbours(tets: Ints, walls: Ints) -> Ints:
    """(m, 4) neighbour table of these tets; `walls` (k, 3) are faces that stay closed though both sides have a tet."""
    return pair_sides(tets, _FACES, walls)


@inner
def replace_cavity(
    tets: Ints, across: Ints, old: Ints, n_old: int, new: Ints, n_new: int, free: Ints, rim: Ints, origin: Ints
) -> bool:
    """Put the tets `new[:n_new]` in the place of the rows `old[:n_old]`; False (nothing changed) where they do not fit.

    rim: (k, 4) scratch. On return old[:n_new] holds the
    rows of the new tets. The outer faces of both must be the same.
    """
    n_rim = 0
    for i in range(n_old):
        t = old[i]
        for f in range(4):
            o = across[t, f]
            inside = False
            if o >= 0:
                for j in range(n_old):
                    if old[j] == o // 4:
                        inside = True
                        break
            if not inside:
                if n_rim >= rim.shape[0]:
                    return False
                a, b, c = _sorted3(tets[t, _FACES[f, 0]], tets[t, _FACES[f, 1]], tets[t, _FACES[f, 2]])
                rim[n_rim, 0], rim[n_rim, 1], rim[n_rim, 2], rim[n_rim, 3] = a, b, c, o
                n_rim += 1
    if n_new - n_old > free[0]:
        return False
    for i in range(n_new, n_old):
        tets[old[i], 0] = -1
        free[0] += 1
        free[free[0]] = old[i]
    for i in range(n_old, n_new):
        old[i] = free[free[0]]
        free[0] -= 1
        origin[old[i]] = origin[old[0]]
    for i in range(n_new):
        t = old[i]
        for k in range(4):
            tets[t, k] = new[i, k]
            across[t, k] = -2
    for i in range(n_new):
        t = old[i]
        for f in range(4):
            if across[t, f] != -2:
                continue
            a, b, c = _sorted3(tets[t, _FACES[f, 0]], tets[t, _FACES[f, 1]], tets[t, _FACES[f, 2]])
            met = False
            for r in range(n_rim):
                if rim[r, 0] == a and rim[r, 1] == b and rim[r, 2] == c:
                    o = rim[r, 3]
                    across[t, f] = o
                    if o >= 0:
                        across[o // 4, o % 4] = 4 * t + f
                    met = True
                    break
            if met:
                continue
            for j in range(i + 1, n_new):
                u = old[j]
                for g in range(4):
                    x, y, z = _sorted3(tets[u, _FACES[g, 0]], tets[u, _FACES[g, 1]], tets[u, _FACES[g, 2]])
                    if x == a and y == b and z == c:
                        across[t, f] = 4 * u + g
                        across[u, g] = 4 * t + f
                        met = True
            if not met:
                across[t, f] = WALL
    return True


@kernel
def wall_points(tets: Ints, across: Ints, n_points: int) -> Mask:
    """(n,) whether a face that is closed meets the point: the points that stay where they are."""
    held = np.zeros(n_points, np.bool_)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            for f in range(4):
                if across[t, f] < 0:
                    for k in range(3):
                        held[tets[t, _FACES[f, k]]] = True
    return held
