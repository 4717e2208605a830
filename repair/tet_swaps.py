"""Swaps of a tet mesh: removal of faces (2-3 and larger ones) and of edges (3-2, 4-4 and every larger ring).

An edge with a closed ring of m tets is replaced by the best triangulation of the ring, see `tet_rings`. The faces that
lie between two points are replaced by the edge between these, which is the inverse. A swap is made where it lowers the
cost summed over the tets it touches and does not lower their smallest fitness, or where it raises the smallest fitness.

The rows of the tables are dealt out to parts, which are swept at the same time. A sweep reads and writes the rows of
its own part alone: what it would need of another one makes it leave the tet for later. So parts need no locks, and the
result does not depend on the threads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.held import Mask
from meshwright.repair.tet_rings import LARGEST_RING, allowed, hurts, row_cost, without_edge
from meshwright.repair.tet_shape import both, cost_of
from meshwright.repair.tet_topology import replace_cavity

__all__ = ["outward", "rate_again", "swap"]

Parts = NDArray[np.uint8]

_MOST_FACES = 8
"""Faces that one swap removes at most."""
_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]], dtype=np.int64)
_OUTSIDE = -1
"""In place of a ring that leaves the part."""


@inner
def _ring(
    tets: Ints, across: Ints, t: int, a: int, b: int, ring: Ints, around: Ints, fit: Floats, below: float, once: bool,
    part_of: Parts, part: int,
) -> int:  # fmt: skip
    """Number of tets around the edge a-b, 0 where a wall opens the ring or it is too long, _OUTSIDE where it leaves
    the part.

    ring[i], ring[i + 1] with a, b make the tet around[i], positive in this order. once: 0 too where a tet of the ring
    comes before t in a sweep over those of fitness under `below`, so that each edge is tried once.
    """
    start = t
    c = d = -1
    for k in range(4):
        v = tets[t, k]
        if v != a and v != b:
            if c < 0:
                c = v
            else:
                d = v
    # order c, d so that (a, b, c, d) has the orientation of the stored tet: count the parity of the permutation
    ia = ib = ic = id_ = 0
    for k in range(4):
        v = tets[t, k]
        if v == a:
            ia = k
        elif v == b:
            ib = k
        elif v == c:
            ic = k
        else:
            id_ = k
    odd = (ia > ib) + (ia > ic) + (ia > id_) + (ib > ic) + (ib > id_) + (ic > id_)
    if odd % 2:
        c, d = d, c
    n = 0
    first = c
    while True:
        if n >= LARGEST_RING:
            return 0
        ring[n] = c
        around[n] = t
        n += 1
        # cross the face (a, b, d), opposite c
        o = -1
        for k in range(4):
            if tets[t, k] == c:
                o = across[t, k]
        if o < 0:
            return 0
        t = o // 4
        if part_of[t] != part:
            return _OUTSIDE
        if t == start:
            return n if d == first else 0
        if once and t < start and fit[t] < below:
            return 0
        c = d
        d = -1
        for k in range(4):
            v = tets[t, k]
            if v != a and v != b and v != c:
                d = v
        if d < 0:
            return 0


@inner
def _corner(tets: Ints, t: int, p: int) -> int:
    """Which corner of tet t the point p is."""
    for k in range(3):
        if tets[t, k] == p:
            return k
    return 3


@inner
def _next_face(
    tets: Ints, across: Ints, top: int, a: int, b: int, p: int, q: int, part_of: Parts, part: int
) -> tuple[int, int, int]:
    """(tet of a, tet of b, third point) of the face beyond the edge p-q that has a on one side and b on the other.

    top: the tet of a on this side of the edge. The point is -1 where there is no such face in the part.
    """
    for k in range(4):
        v = tets[top, k]
        if v != a and v != p and v != q:
            o = across[top, k]
            if o < 0:
                return -1, -1, -1
            t = o // 4
            if part_of[t] != part:
                return -1, -1, -1
            low = across[t, _corner(tets, t, a)]
            if low < 0 or part_of[low // 4] != part or tets[low // 4, low % 4] != b:
                return -1, -1, -1
            return t, low // 4, tets[t, o % 4]
    return -1, -1, -1


@inner
def _remove_faces(
    points: Floats, tets: Ints, across: Ints, fit: Floats, t: int, f: int,
    by_fitness: bool, floor: float, give: float, old: Ints, new: Ints, polygon: Ints, tops: Ints,
    part_of: Parts, part: int,
) -> tuple[int, int]:  # fmt: skip
    """(tets to remove, tets to make) of the best removal of faces around face f of tet t; (0, 0) where none is allowed.

    The two apexes a, b of the face get an edge, through it and through as many of the faces that lie between the same
    two as pays: those are grown one by one, beyond the edge of the polygon whose new tet is the worst. One face alone
    is the swap 2-3. For the cost it is the only one tried: larger ones leave fewer tets, which the sum takes for a
    gain, and the mean quality falls (skewness of random tets 0.32 against 0.27). old, new: as of `replace_cavity`.
    polygon, tops: corners of the grown polygon, and for the edge that begins at each the tet of a inside it.
    """
    o = across[t, f]
    a, b = tets[t, f], tets[o // 4, o % 4]
    polygon[0], polygon[1], polygon[2] = outward(tets, t, f)
    tops[0], tops[1], tops[2] = t, t, t
    old[0], old[1] = t, o // 4
    old_fit, old_cost = min(fit[t], fit[o // 4]), row_cost(points, tets, t) + row_cost(points, tets, o // 4)
    m, corners, best, best_m = 2, 3, 0.0, 0
    while True:
        low, total, worst = np.inf, 0.0, 0
        for i in range(corners):
            fi, ci = both(points, a, b, polygon[i], polygon[(i + 1) % corners])
            total += ci
            if fi < low:
                low, worst = fi, i
        if allowed(old_fit, old_cost, low, total, by_fitness, floor, give):
            gain = low / old_fit if by_fitness else old_cost - total
            if best_m == 0 or gain > best:
                best, best_m = gain, m
                for i in range(corners):
                    new[i, 0], new[i, 1], new[i, 2], new[i, 3] = a, b, polygon[i], polygon[(i + 1) % corners]
        if m >= 2 * _MOST_FACES or not by_fitness:
            break
        p, q = polygon[worst], polygon[(worst + 1) % corners]
        above, under, w = _next_face(tets, across, tops[worst], a, b, p, q, part_of, part)
        if w < 0:
            break
        for i in range(corners):
            if polygon[i] == w:
                w = -1
        if w < 0:
            break  # a point would be closed in
        for i in range(corners, worst + 1, -1):
            polygon[i], tops[i] = polygon[i - 1], tops[i - 1]
        polygon[worst + 1] = w
        tops[worst] = tops[worst + 1] = above
        old[m], old[m + 1] = above, under
        old_fit = min(old_fit, fit[above], fit[under])
        old_cost += row_cost(points, tets, above) + row_cost(points, tets, under)
        m, corners = m + 2, corners + 1
    return best_m, best_m // 2 + 2 if best_m else 0


@inner
def _cost_without(points: Floats, tets: Ints, t: int, f: int, b: int) -> float:
    """Summed cost of the three tets around the edge from corner f of tet t to b, the point beyond the face."""
    a = tets[t, f]
    p, q, r = outward(tets, t, f)
    total = cost_of(points, a, b, p, q) + cost_of(points, a, b, q, r)
    return total + cost_of(points, a, b, r, p)


@inner
def _within(across: Ints, old: Ints, m: int, part_of: Parts, part: int) -> bool:
    """Whether the neighbours of these tets, whose tables change with them, are of the part too."""
    for i in range(m):
        for k in range(4):
            o = across[old[i], k]
            if o >= 0 and part_of[o // 4] != part:
                return False
    return True


@kernel
def swap(
    points: Floats, tets: Ints, across: Ints, origin: Ints, fit: Floats, free: Ints,
    least: Floats, below: float, by_fitness: bool, floor: float, give: float,
    part_of: Parts, part: int, late: Mask, only_late: bool,
) -> int:  # fmt: skip
    """One sweep of swaps over the tets of a part with a fitness under `below`; the number made. All tables change in
    place.

    fit: (cap,) fitness of each tet, inf in free rows. floor: above it a swap for cost may lower the smallest fitness.
    least: (n,) quality that no tet at a point may fall under.
    give: part by which a swap for cost may raise it: a little leads out of poor local optima, below 0 asks for a gain.
    part_of: (cap,) the part that each row belongs to; only those of `part` are read and written, and `free` holds no
    others. late: (cap,) set for tets that a swap was not tried at because it leaves the part. only_late: sweep those.
    """
    ring = np.empty(LARGEST_RING + 1, np.int64)
    old = np.empty(64, np.int64)
    new = np.empty((64, 4), np.int64)
    rim = np.empty((128, 4), np.int64)
    table = np.empty((LARGEST_RING, LARGEST_RING))
    pick = np.empty((LARGEST_RING, LARGEST_RING), np.int64)
    stack = np.empty((64, 2), np.int64)
    polygon = np.empty(_MOST_FACES + 2, np.int64)
    tops = np.empty(_MOST_FACES + 2, np.int64)
    made = 0
    for t in range(tets.shape[0]):
        if part_of[t] != part or not fit[t] < below or (only_late and not late[t]):
            continue
        done = False
        for e in range(6):
            a, b = tets[t, _EDGES[e, 0]], tets[t, _EDGES[e, 1]]
            m = _ring(tets, across, t, a, b, ring, old, fit, below, not by_fitness, part_of, part)
            if m < 3:
                late[t] |= m == _OUTSIDE
                continue
            n = without_edge(
                points, tets, fit, a, b, ring, m, old, m, least, by_fitness, floor, give, table, pick, new, stack
            )
            if not n:
                continue
            if not _within(across, old, m, part_of, part):
                late[t] = True
                continue
            if replace_cavity(tets, across, old, m, new, n, free, rim, origin):
                rate_again(points, fit, old, m, new, n)
                made += 1
                done = True
                break
        if done:
            continue
        for f in range(4):
            o = across[t, f]
            if o < 0:
                continue
            u = o // 4
            if part_of[u] != part:
                late[t] = True
                continue
            if not by_fitness and fit[u] < below and u < t:
                continue  # tried from the other side
            if not by_fitness:
                most = (row_cost(points, tets, t) + row_cost(points, tets, u)) * (1.0 + give)
                if _cost_without(points, tets, t, f, tets[u, o % 4]) >= most:
                    continue
            m, n = _remove_faces(
                points, tets, across, fit, t, f, by_fitness, floor, give, old, new, polygon, tops, part_of, part
            )
            if n == 0 or hurts(points, new, n, least, 0.0):
                continue
            if not _within(across, old, m, part_of, part):
                late[t] = True
                continue
            if replace_cavity(tets, across, old, m, new, n, free, rim, origin):
                rate_again(points, fit, old, m, new, n)
                made += 1
                break
    return made


@inner
def rate_again(points: Floats, fit: Floats, old: Ints, m: int, new: Ints, n: int) -> None:
    """Fitness of the rows `old`, of m tets that gave way to the n of `new`; see `replace_cavity`."""
    for i in range(n):
        fit[old[i]] = both(points, new[i, 0], new[i, 1], new[i, 2], new[i, 3])[0]
    for i in range(n, m):
        fit[old[i]] = np.inf


@inner
def outward(tets: Ints, t: int, f: int) -> tuple[int, int, int]:
    """The face opposite corner f, running so that its normal points away from that corner."""
    if f == 0:
        return tets[t, 1], tets[t, 2], tets[t, 3]
    if f == 1:
        return tets[t, 0], tets[t, 3], tets[t, 2]
    if f == 2:
        return tets[t, 0], tets[t, 1], tets[t, 3]
    return tets[t, 0], tets[t, 2], tets[t, 1]
