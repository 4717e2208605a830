"""Moving the points of a tet mesh, each within the star of its tets.

`smooth` brings down the summed cost of the star by damped Newton steps; `raise_worst` raises its smallest fitness by
the active-set method of Freitag and Ollivier-Gooch (Int. J. Numer. Meth. Engng. 40, 1997): step along the shortest
vector of the convex hull of the gradients of the tets that are nearly worst. Neither takes a step that lowers the
smallest fitness of the star (below `floor`, for the first), or makes a tet worse than its points may have
(`least`). Points of one colour share no tet, so the threads of a
colour never read what another one writes and the result does not depend on their number.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.sliding import normal_of, settle
from meshwright.repair.tet_shape import POWER, both, measures, quality, quality_floor, quality_of, scaled_cost

__all__ = [
    "LARGEST_STAR",
    "climb",
    "colours",
    "fit_at",
    "raise_worst",
    "rate",
    "smooth",
    "stars",
    "worst_at_points",
]

_MOST_STEPS = 4
_MOST_ASCENTS = 12
_ACTIVE = 0.04
"""Tets whose fitness is within this part of the smallest one count as worst."""
_LEAST = 1e-5
LARGEST_STAR = 512


@kernel
def stars(tets: Ints, n_points: int) -> tuple[Ints, Ints]:
    """(offsets, items): the rows of the living tets at each point, ascending."""
    begin = np.zeros(n_points + 1, tets.dtype)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            for k in range(4):
                begin[tets[t, k] + 1] += 1
    for p in range(n_points):
        begin[p + 1] += begin[p]
    items = np.empty(begin[n_points], tets.dtype)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            for k in range(4):
                items[begin[tets[t, k]]] = t
                begin[tets[t, k]] += 1
    # each offset has moved on to where the next one was
    for p in range(n_points, 0, -1):
        begin[p] = begin[p - 1]
    begin[0] = 0
    return begin, items


@kernel
def colours(cells: Ints, begin: Ints, items: Ints, moving: Ints) -> tuple[Ints, Ints]:
    """(order, stops): the moving points grouped by colour; no two of one colour share a cell.

    cells: (m, k) point rows; begin, items: cells at each point; moving: point rows, ascending. Greedy.
    """
    n = begin.size - 1
    colour = np.full(n, -1, np.int16)
    taken = np.full(256, -1, np.int64)
    most = 0
    for i in range(moving.size):
        p = moving[i]
        for j in range(begin[p], begin[p + 1]):
            for k in range(cells.shape[1]):
                c = colour[cells[items[j], k]]
                if c >= 0:
                    taken[c] = p
        c = 0
        while c < 255 and taken[c] == p:
            c += 1
        colour[p] = c
        most = max(most, c + 1)
    stops = np.zeros(most + 1, np.int64)
    for i in range(moving.size):
        stops[colour[moving[i]] + 1] += 1
    for c in range(most):
        stops[c + 1] += stops[c]
    cursor = stops[:-1].copy()
    order = np.empty(moving.size, moving.dtype)
    for i in range(moving.size):
        c = colour[moving[i]]
        order[cursor[c]] = moving[i]
        cursor[c] += 1
    return order, stops


@inner
def _star_of(points: Floats, tets: Ints, begin: Ints, items: Ints, least: Floats, p: int, base: Floats) -> int:
    """Write the three other points of each tet of the star, turned so that p comes first; the number of tets.

    base[i, 9]: the quality that tet i may not fall under.
    """
    n = 0
    for i in range(begin[p], begin[p + 1]):
        t = items[i]
        a, b, c, d = tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3]
        if b == p:
            a, b, c, d = b, a, d, c
        elif c == p:
            a, b, c, d = c, a, b, d
        elif d == p:
            a, b, c, d = d, a, c, b
        for k in range(3):
            base[n, k] = points[b, k]
            base[n, 3 + k] = points[c, k]
            base[n, 6 + k] = points[d, k]
        base[n, 9] = max(least[a], least[b], least[c], least[d])
        n += 1
    return n


@inner
def fit_at(base: Floats, i: int, x: float, y: float, z: float) -> tuple[float, float]:
    """(fitness, cost) of tet i of the star with its point at x, y, z."""
    return measures(
        x,
        y,
        z,
        base[i, 0],
        base[i, 1],
        base[i, 2],
        base[i, 3],
        base[i, 4],
        base[i, 5],
        base[i, 6],
        base[i, 7],
        base[i, 8],
    )


@inner
def _forms(base: Floats, n: int, x: float, y: float, z: float, form: Floats) -> None:
    """What volume and edges of each tet of the star are, as polynomials of the step of its point from x, y, z.

    Of a step s, six times the volume is form[i, :3] . s + form[i, 3], the summed squares of the edges are
    3 s . s - 2 form[i, 4:7] . s + form[i, 7].
    """
    for i in range(n):
        ux, uy, uz = base[i, 0] - x, base[i, 1] - y, base[i, 2] - z
        vx, vy, vz = base[i, 3] - x, base[i, 4] - y, base[i, 5] - z
        wx, wy, wz = base[i, 6] - x, base[i, 7] - y, base[i, 8] - z
        px, py, pz = vx - ux, vy - uy, vz - uz
        qx, qy, qz = wx - ux, wy - uy, wz - uz
        rx, ry, rz = wx - vx, wy - vy, wz - vz
        # the gradient of the volume is minus the normal of the far face
        nx, ny, nz = -(py * qz - pz * qy), -(pz * qx - px * qz), -(px * qy - py * qx)
        form[i, 0], form[i, 1], form[i, 2] = nx, ny, nz
        form[i, 3] = -(ux * nx + uy * ny + uz * nz)
        form[i, 4], form[i, 5], form[i, 6] = ux + vx + wx, uy + vy + wy, uz + vz + wz
        s = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + wx * wx + wy * wy + wz * wz
        form[i, 7] = s + px * px + py * py + pz * pz + qx * qx + qy * qy + qz * qz + rx * rx + ry * ry + rz * rz


@inner
def _cost_at(form: Floats, n: int, x: float, y: float, z: float, limit: float) -> float:
    """Summed cost after the step x, y, z; inf where it reaches the limit or a tet is inverted."""
    total = 0.0
    square = 3.0 * (x * x + y * y + z * z)
    for i in range(n):
        det = form[i, 0] * x + form[i, 1] * y + form[i, 2] * z + form[i, 3]
        if not det > 0.0:
            return np.inf
        edges = square - 2.0 * (form[i, 4] * x + form[i, 5] * y + form[i, 6] * z) + form[i, 7]
        total += scaled_cost(edges, det)
        if total >= limit:
            return np.inf
    return total


@inner
def _sound(base: Floats, n: int, x: float, y: float, z: float, least: float) -> bool:
    """Whether, with the point at x, y, z, no tet of the star has a fitness under `least` or a quality that its points
    may not have."""
    for i in range(n):
        f, _cost = fit_at(base, i, x, y, z)
        if f < least or (quality_floor(f) < base[i, 9] and _quality_at(base, i, x, y, z) < base[i, 9]):
            return False
    return True


@inner
def _quality_at(base: Floats, i: int, x: float, y: float, z: float) -> float:
    return quality(
        x, y, z, base[i, 0], base[i, 1], base[i, 2], base[i, 3], base[i, 4], base[i, 5], base[i, 6], base[i, 7],
        base[i, 8],
    )  # fmt: skip


@inner
def _hurts(base: Floats, n: int, x: float, y: float, z: float) -> bool:
    """Whether a tet of the star is worse, with its point at x, y, z, than one of its points may have."""
    for i in range(n):
        if _quality_at(base, i, x, y, z) < base[i, 9]:
            return True
    return False


@inner
def _newton(
    form: Floats, n: int, x: float, y: float, z: float, mx: float, my: float, mz: float
) -> tuple[float, float, float, bool]:
    """The damped Newton step of the summed cost after the step x, y, z; False where there is none that goes down.

    mx, my, mz: unit normal of the plane that the step keeps to, 0 for a free point.
    """
    gx = gy = gz = 0.0
    hxx = hxy = hxz = hyy = hyz = hzz = 0.0
    square = 3.0 * (x * x + y * y + z * z)
    for i in range(n):
        nx, ny, nz = form[i, 0], form[i, 1], form[i, 2]
        det = nx * x + ny * y + nz * z + form[i, 3]
        s = square - 2.0 * (form[i, 4] * x + form[i, 5] * y + form[i, 6] * z) + form[i, 7]
        sx, sy, sz = 6.0 * x - 2.0 * form[i, 4], 6.0 * y - 2.0 * form[i, 5], 6.0 * z - 2.0 * form[i, 6]
        cost = scaled_cost(s, det)
        over_s, over_det = 1.0 / s, 1.0 / det
        a = 1.5 * POWER * cost * over_s
        b = -POWER * cost * over_det
        gx += a * sx + b * nx
        gy += a * sy + b * ny
        gz += a * sz + b * nz
        ss = (1.5 * POWER - 1.0) * a * over_s
        sd = -POWER * a * over_det
        dd = -(POWER + 1.0) * b * over_det
        e = 6.0 * a
        hxx += ss * sx * sx + e + 2.0 * sd * sx * nx + dd * nx * nx
        hyy += ss * sy * sy + e + 2.0 * sd * sy * ny + dd * ny * ny
        hzz += ss * sz * sz + e + 2.0 * sd * sz * nz + dd * nz * nz
        hxy += ss * sx * sy + sd * (sx * ny + sy * nx) + dd * nx * ny
        hxz += ss * sx * sz + sd * (sx * nz + sz * nx) + dd * nx * nz
        hyz += ss * sy * sz + sd * (sy * nz + sz * ny) + dd * ny * nz
    if mx * mx + my * my + mz * mz > 0.5:
        ax, ay, az, bx, by, bz = _across(mx, my, mz)
        ga, gb = gx * ax + gy * ay + gz * az, gx * bx + gy * by + gz * bz
        kx, ky, kz = hxx * ax + hxy * ay + hxz * az, hxy * ax + hyy * ay + hyz * az, hxz * ax + hyz * ay + hzz * az
        haa, hab = ax * kx + ay * ky + az * kz, bx * kx + by * ky + bz * kz
        kx, ky, kz = hxx * bx + hxy * by + hxz * bz, hxy * bx + hyy * by + hyz * bz, hxz * bx + hyz * by + hzz * bz
        hbb = bx * kx + by * ky + bz * kz
        whole = haa * hbb - hab * hab
        if not (haa > 0.0 and whole > 0.0):
            return 0.0, 0.0, 0.0, False
        da, db = -(hbb * ga - hab * gb) / whole, -(haa * gb - hab * ga) / whole
        return da * ax + db * bx, da * ay + db * by, da * az + db * bz, ga * da + gb * db < 0.0
    c1 = hyy * hzz - hyz * hyz
    c2 = hxz * hyz - hxy * hzz
    c3 = hxy * hyz - hxz * hyy
    whole = hxx * c1 + hxy * c2 + hxz * c3
    if not (hxx > 0.0 and hxx * hyy - hxy * hxy > 0.0 and whole > 0.0):
        return 0.0, 0.0, 0.0, False
    c5 = hxx * hzz - hxz * hxz
    c6 = hxy * hxz - hxx * hyz
    c9 = hxx * hyy - hxy * hxy
    dx = -(c1 * gx + c2 * gy + c3 * gz) / whole
    dy = -(c2 * gx + c5 * gy + c6 * gz) / whole
    dz = -(c3 * gx + c6 * gy + c9 * gz) / whole
    return dx, dy, dz, gx * dx + gy * dy + gz * dz < 0.0


@inner
def _across(x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """Two unit vectors square to the unit vector x, y, z and to each other; along the axes where it is along one."""
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        ax, ay, az = 1.0 - x * x, -x * y, -x * z
    elif abs(y) <= abs(z):
        ax, ay, az = -y * x, 1.0 - y * y, -y * z
    else:
        ax, ay, az = -z * x, -z * y, 1.0 - z * z
    size = math.sqrt(ax * ax + ay * ay + az * az)
    ax, ay, az = ax / size, ay / size, az / size
    return ax, ay, az, y * az - z * ay, z * ax - x * az, x * ay - y * ax


@kernel
def smooth(
    points: Floats, tets: Ints, begin: Ints, items: Ints, least: Floats, rows: Ints, floor: float,
    seat: Ints, corners: Floats, beyond: Ints,
) -> int:  # fmt: skip
    """Move each point of `rows` downhill in the summed cost of its star; the number of points that moved.

    least: (n,) quality that no tet at a point may fall under. seat: (n,) triangle of the sheet `corners`, `beyond` (see
    `sliding.Sheet`) that a point keeps to, -1 for one that is free; it changes with the point.
    """
    base = np.empty((LARGEST_STAR, 10))
    form = np.empty((LARGEST_STAR, 8))
    moved = 0
    for r in range(rows.size):
        p = rows[r]
        if begin[p + 1] - begin[p] > LARGEST_STAR:
            continue
        n = _star_of(points, tets, begin, items, least, p, base)
        px, py, pz = points[p, 0], points[p, 1], points[p, 2]
        low = np.inf
        for i in range(n):
            low = min(low, fit_at(base, i, px, py, pz)[0])
        if not low > 0.0:
            continue
        _forms(base, n, px, py, pz, form)
        started = total = _cost_at(form, n, 0.0, 0.0, 0.0, np.inf)
        x = y = z = 0.0
        sits = seat[p]
        mx = my = mz = 0.0
        for _ in range(2):
            if sits >= 0:
                mx, my, mz = normal_of(corners, sits)
            dx, dy, dz, ok = _newton(form, n, x, y, z, mx, my, mz)
            if not ok:
                break
            step, taken = 1.0, False
            for _ in range(_MOST_STEPS):
                tx, ty, tz, on = x + step * dx, y + step * dy, z + step * dz, sits
                if sits >= 0:
                    tx, ty, tz, on, _gap = settle(corners, beyond, sits, px + tx, py + ty, pz + tz)
                    tx, ty, tz = tx - px, ty - py, tz - pz
                new = _cost_at(form, n, tx, ty, tz, total)
                if new < total:
                    x, y, z, sits = tx, ty, tz, on
                    gain = total - new
                    total = new
                    taken = gain > 0.01 * total
                    break
                step *= 0.4
            if not taken:
                break
        # the way downhill may end where the worst tet is worse: turn back a part of the way, as far as that helps
        for _ in range(_MOST_STEPS):
            tx, ty, tz, on = px + x, py + y, pz + z, seat[p]
            if on >= 0:
                tx, ty, tz, on, _gap = settle(corners, beyond, on, tx, ty, tz)
                total = _cost_at(form, n, tx - px, ty - py, tz - pz, started)
            if not total < started * (1.0 - _LEAST):
                break
            if _sound(base, n, tx, ty, tz, min(low, floor)):
                points[p, 0], points[p, 1], points[p, 2] = tx, ty, tz
                seat[p] = on
                moved += 1
                break
            x, y, z = 0.4 * x, 0.4 * y, 0.4 * z
            total = _cost_at(form, n, x, y, z, started)
    return moved


@inner
def shortest_in_hull(g: Floats, n: int, out: Floats) -> float:
    """The shortest vector of the convex hull of the rows of g, by Wolfe-like pairwise steps; its length."""
    weight = np.zeros(n)
    best = 0
    for i in range(n):
        if _dot(g, i, i) < _dot(g, best, best):
            best = i
    weight[best] = 1.0
    for k in range(3):
        out[k] = g[best, k]
    for _ in range(60):
        near, far = -1, -1
        low, high = np.inf, -np.inf
        for i in range(n):
            d = g[i, 0] * out[0] + g[i, 1] * out[1] + g[i, 2] * out[2]
            if d < low:
                low, near = d, i
            if weight[i] > 0.0 and d > high:
                high, far = d, i
        if high - low <= 1e-6 * (out[0] * out[0] + out[1] * out[1] + out[2] * out[2]):
            break
        dx, dy, dz = g[near, 0] - g[far, 0], g[near, 1] - g[far, 1], g[near, 2] - g[far, 2]
        dd = dx * dx + dy * dy + dz * dz
        if not dd > 0.0:
            break
        s = min(weight[far], (high - low) / dd)
        weight[near] += s
        weight[far] -= s
        out[0] += s * dx
        out[1] += s * dy
        out[2] += s * dz
    return math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])


@inner
def _dot(g: Floats, i: int, j: int) -> float:
    return g[i, 0] * g[j, 0] + g[i, 1] * g[j, 1] + g[i, 2] * g[j, 2]


@inner
def _least_at(base: Floats, n: int, x: float, y: float, z: float, least: float) -> float:
    """Smallest fitness of the star with its point at x, y, z, cut short once it is not above `least`."""
    low = np.inf
    for i in range(n):
        low = min(low, fit_at(base, i, x, y, z)[0])
        if low <= least:
            return low
    return low


@inner
def climb(
    base: Floats, n: int, x: float, y: float, z: float, fits: Floats, slopes: Floats, g: Floats,
    sits: int, corners: Floats, beyond: Ints,
) -> tuple[float, float, float, float, int]:  # fmt: skip
    """(x, y, z, smallest fitness, seat) at the top that steps of the active-set method reach from x, y, z.

    base: the star, see `_star_of`. fits (n,), slopes (n, 3), g (3,): scratch; fits holds the fitness of each tet at x,
    y, z. sits: triangle of the sheet that the point keeps to, -1 for one that is free.
    """
    reach = np.inf
    low = np.inf
    for i in range(n):
        low = min(low, fits[i])
        for k in range(0, 9, 3):
            dx, dy, dz = base[i, k] - x, base[i, k + 1] - y, base[i, k + 2] - z
            reach = min(reach, dx * dx + dy * dy + dz * dz)
    reach = math.sqrt(reach)
    if not reach > 0.0:
        return x, y, z, low, sits
    mx = my = mz = 0.0
    step = 0.2 * reach
    h = 1e-5 * reach
    for _ in range(_MOST_ASCENTS):
        if sits >= 0:
            mx, my, mz = normal_of(corners, sits)
        active = 0
        for i in range(n):
            if fits[i] <= low + _ACTIVE * abs(low) + 1e-6:
                slopes[active, 0] = (fit_at(base, i, x + h, y, z)[0] - fit_at(base, i, x - h, y, z)[0]) / (2.0 * h)
                slopes[active, 1] = (fit_at(base, i, x, y + h, z)[0] - fit_at(base, i, x, y - h, z)[0]) / (2.0 * h)
                slopes[active, 2] = (fit_at(base, i, x, y, z + h)[0] - fit_at(base, i, x, y, z - h)[0]) / (2.0 * h)
                out = slopes[active, 0] * mx + slopes[active, 1] * my + slopes[active, 2] * mz
                slopes[active, 0] -= out * mx
                slopes[active, 1] -= out * my
                slopes[active, 2] -= out * mz
                active += 1
        size = shortest_in_hull(slopes, active, g)
        if not size * reach > 1e-4:
            break
        better = False
        for _ in range(7):
            s = step / size
            tx, ty, tz, on = x + s * g[0], y + s * g[1], z + s * g[2], sits
            if sits >= 0:
                tx, ty, tz, on, _gap = settle(corners, beyond, sits, tx, ty, tz)
            new = _least_at(base, n, tx, ty, tz, low)
            if new > low and not _hurts(base, n, tx, ty, tz):
                better = True
                break
            step *= 0.45
        if not better:
            break
        gain = new - low
        x, y, z, sits = tx, ty, tz, on
        low = np.inf
        for i in range(n):
            fits[i] = fit_at(base, i, x, y, z)[0]
            low = min(low, fits[i])
        if gain < 1e-4 * abs(low):
            break
        step *= 1.6
    return x, y, z, low, sits


@kernel
def raise_worst(
    points: Floats, tets: Ints, begin: Ints, items: Ints, least: Floats, rows: Ints, below: float,
    seat: Ints, corners: Floats, beyond: Ints,
) -> int:  # fmt: skip
    """Raise the smallest fitness of the star of each point of `rows` where it is under `below`; points that moved.

    least, seat, corners, beyond: as of `smooth`.
    """
    base = np.empty((LARGEST_STAR, 10))
    fits = np.empty(LARGEST_STAR)
    slopes = np.empty((LARGEST_STAR, 3))
    g = np.empty(3)
    moved = 0
    for r in range(rows.size):
        p = rows[r]
        if begin[p + 1] - begin[p] > LARGEST_STAR:
            continue
        n = _star_of(points, tets, begin, items, least, p, base)
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        started = np.inf
        for i in range(n):
            fits[i] = fit_at(base, i, x, y, z)[0]
            started = min(started, fits[i])
        if not started < below:
            continue
        x, y, z, low, sits = climb(base, n, x, y, z, fits, slopes, g, seat[p], corners, beyond)
        if low > started + _LEAST * abs(started):
            points[p, 0], points[p, 1], points[p, 2] = x, y, z
            seat[p] = sits
            moved += 1
    return moved


@kernel
def rate(points: Floats, tets: Ints, fit: Floats) -> None:
    """Fill in the fitness of every tet, inf in rows that are free."""
    for t in range(tets.shape[0]):
        fit[t] = np.inf
        if tets[t, 0] >= 0:
            fit[t] = both(points, tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3])[0]


@kernel
def worst_at_points(points: Floats, tets: Ints, n_points: int) -> Floats:
    """(n,) quality of the worst tet at each point, inf where there is none."""
    out = np.full(n_points, np.inf)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            q = quality_of(points, tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3])
            for k in range(4):
                out[tets[t, k]] = min(out[tets[t, k]], q)
    return out
