"""Taking points of a tet mesh away and putting new ones in, where that raises the worst tets around.

`contract` pulls an inner point into a neighbour: the tets at the edge between them vanish, the others of its star
follow. `insert` opens a cavity around a bad tet, as large as pays, and joins its faces to a new point, which then
climbs to its best place. Both are moves of Klingner and Shewchuk ("Aggressive tetrahedral mesh improvement", 2007);
here a cavity grows by the face that is worst seen from the new point. Neither goes through a wall, and no cavity
swallows a point.
"""

from __future__ import annotations

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.held import Mask
from meshwright.repair.tet_climb import climb
from meshwright.repair.tet_rings import hurts
from meshwright.repair.tet_shape import both
from meshwright.repair.tet_stars import LARGEST_STAR, fit_at
from meshwright.repair.tet_swaps import outward, rate_again
from meshwright.repair.tet_topology import replace_cavity

__all__ = ["contract", "insert"]

_LARGEST_CAVITY = 48
_GAIN = 1.0 + 1e-3
"""Part by which the smallest fitness must rise, so that points do not come and go for nothing."""


@inner
def _star(tets: Ints, across: Ints, start: int, p: int, found: Ints) -> int:
    """Rows of the tets at p, walked from `start`; 0 where a wall cuts through or there are too many."""
    found[0] = start
    n, at = 1, 0
    while at < n:
        t = found[at]
        at += 1
        for k in range(4):
            if tets[t, k] == p:
                continue
            o = across[t, k]
            if o < 0:
                return 0
            u = o // 4
            known = False
            for i in range(n):
                if found[i] == u:
                    known = True
                    break
            if not known:
                if n >= found.size:
                    return 0
                found[n] = u
                n += 1
    return n


@kernel
def contract(
    points: Floats, tets: Ints, across: Ints, origin: Ints, fit: Floats, free: Ints,
    least: Floats, held: Mask, below: float,
) -> int:  # fmt: skip
    """Contract edges of tets of fitness under `below` where the smallest fitness around rises; the number made.

    held (n,): points that stay. The other arguments as of `tet_swaps.swap`.
    """
    old = np.empty(128, np.int64)
    new = np.empty((128, 4), np.int64)
    best = np.empty((128, 4), np.int64)
    rim = np.empty((512, 4), np.int64)
    made = 0
    for t in range(tets.shape[0]):
        if not fit[t] < below:
            continue
        done = False
        for k in range(4):
            gone = tets[t, k]
            if held[gone]:
                continue
            m = _star(tets, across, t, gone, old)
            if m == 0:
                continue
            floor = np.inf
            for i in range(m):
                floor = min(floor, fit[old[i]])
            top, n_best = floor * _GAIN, 0
            for j in range(4):
                if j == k:
                    continue
                into = tets[t, j]
                n, low = 0, np.inf
                for i in range(m):
                    a, b, c, d = tets[old[i], 0], tets[old[i], 1], tets[old[i], 2], tets[old[i], 3]
                    if into == a or into == b or into == c or into == d:
                        continue
                    a, b = (into if a == gone else a), (into if b == gone else b)
                    c, d = (into if c == gone else c), (into if d == gone else d)
                    f, _cost = both(points, a, b, c, d)
                    low = min(low, f)
                    if low <= top:
                        break
                    new[n, 0], new[n, 1], new[n, 2], new[n, 3] = a, b, c, d
                    n += 1
                if low > top and n > 0 and not hurts(points, new, n, least, low):
                    top, n_best = low, n
                    for i in range(n):
                        for q in range(4):
                            best[i, q] = new[i, q]
            if n_best and replace_cavity(tets, across, old, m, best, n_best, free, rim, origin):
                rate_again(points, fit, old, m, best, n_best)
                made += 1
                done = True
            if done:
                break
    return made


@inner
def _rim(tets: Ints, across: Ints, cavity: Ints, n: int, rim: Ints) -> int:
    """Write the outer faces of a cavity, (x, y, z, tet * 4 + face) running outward, into rim; their number."""
    m = 0
    for i in range(n):
        t = cavity[i]
        for f in range(4):
            o = across[t, f]
            inside = False
            if o >= 0:
                for j in range(n):
                    if cavity[j] == o // 4:
                        inside = True
                        break
            if not inside:
                rim[m, 0], rim[m, 1], rim[m, 2] = outward(tets, t, f)
                rim[m, 3] = 4 * t + f
                m += 1
    return m


@inner
def _buried(tets: Ints, cavity: Ints, n: int, rim: Ints, m: int) -> bool:
    """Whether a point of the cavity lies on none of its outer faces."""
    for i in range(n):
        for k in range(4):
            p = tets[cavity[i], k]
            seen = False
            for r in range(m):
                if p == rim[r, 0] or p == rim[r, 1] or p == rim[r, 2]:
                    seen = True
                    break
            if not seen:
                return True
    return False


@inner
def _cone(points: Floats, least: Floats, rim: Ints, m: int, base: Floats) -> None:
    """The outer faces as the star of a point inside; see `tet_stars`."""
    for r in range(m):
        for q in range(3):
            p = rim[r, q]
            for k in range(3):
                base[r, 3 * q + k] = points[p, k]
        base[r, 9] = max(least[rim[r, 0]], least[rim[r, 1]], least[rim[r, 2]])


@kernel
def insert(
    points: Floats, count: Ints, tets: Ints, across: Ints, origin: Ints, fit: Floats, free: Ints,
    least: Floats, below: float,
) -> int:  # fmt: skip
    """Insert points at tets of fitness under `below` where the smallest fitness of the cavity rises; the number made.

    points: (room, 3), of which count[0] are in use. The other arguments as of `tet_swaps.swap`.
    """
    cavity = np.empty(_LARGEST_CAVITY, np.int64)
    rim = np.empty((4 * _LARGEST_CAVITY, 4), np.int64)
    scratch = np.empty((4 * _LARGEST_CAVITY, 4), np.int64)
    new = np.empty((4 * _LARGEST_CAVITY, 4), np.int64)
    base = np.empty((LARGEST_STAR, 10))
    fits = np.empty(LARGEST_STAR)
    slopes = np.empty((LARGEST_STAR, 3))
    g = np.empty(3)
    no_sheet = np.empty((0, 9))
    no_across = np.empty((0, 3), np.int64)
    made = 0
    for t in range(tets.shape[0]):
        if not fit[t] < below or count[0] >= points.shape[0]:
            continue
        x = y = z = 0.0
        for k in range(4):
            x += 0.25 * points[tets[t, k], 0]
            y += 0.25 * points[tets[t, k], 1]
            z += 0.25 * points[tets[t, k], 2]
        cavity[0] = t
        n, best_n, top = 1, 0, 0.0
        old = fit[t]
        # grow by the face that is worst from the new point, and keep the size at which the gain is the largest
        while True:
            m = _rim(tets, across, cavity, n, rim)
            _cone(points, least, rim, m, base)
            low, at = np.inf, -1
            for r in range(m):
                f = fit_at(base, r, x, y, z)[0]
                if f < low:
                    low, at = f, r
            if low > 0.0 and low / old > top and not _buried(tets, cavity, n, rim, m):
                top, best_n = low / old, n
            o = across[rim[at, 3] // 4, rim[at, 3] % 4]
            if o < 0 or n >= _LARGEST_CAVITY:
                break
            cavity[n] = o // 4
            old = min(old, fit[o // 4])
            n += 1
        if best_n == 0:
            continue
        n = best_n
        m = _rim(tets, across, cavity, n, rim)
        _cone(points, least, rim, m, base)
        old = np.inf
        for i in range(n):
            old = min(old, fit[cavity[i]])
        for r in range(m):
            fits[r] = fit_at(base, r, x, y, z)[0]
        x, y, z, low, _seat = climb(base, m, x, y, z, fits, slopes, g, -1, no_sheet, no_across)
        if not low > old * _GAIN:
            continue
        p = count[0]
        points[p, 0], points[p, 1], points[p, 2] = x, y, z
        least[p] = -np.inf
        for r in range(m):
            new[r, 0], new[r, 1], new[r, 2], new[r, 3] = p, rim[r, 0], rim[r, 1], rim[r, 2]
        if hurts(points, new, m, least, low):
            continue
        rows = np.empty(max(n, m), np.int64)
        rows[:n] = cavity[:n]
        if replace_cavity(tets, across, rows, n, new, m, free, scratch, origin):
            rate_again(points, fit, rows, n, new, m)
            count[0] += 1
            made += 1
    return made
