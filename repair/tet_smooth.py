"""Moving the points of a tet mesh, each within the star of its tets, to bring down the summed cost of the star.

The steps are damped Newton steps. None is taken that lowers the smallest fitness of the star below `floor`, or makes a
tet worse than its points may have (`least`). Points of one colour share no tet, so the threads of a colour never read
what another one writes and the result does not depend on their number.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.repair.sliding import normal_of, settle
from meshwright.repair.tet_shape import POWER, quality_floor, scaled_cost
from meshwright.repair.tet_stars import LARGEST_STAR, fit_at, star_of, star_quality

__all__ = ["smooth"]

_MOST_STEPS = 4
_LEAST = 1e-5


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
        if f < least or (quality_floor(f) < base[i, 9] and star_quality(base, i, x, y, z) < base[i, 9]):
            return False
    return True


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
        n = star_of(points, tets, begin, items, least, p, base)
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
