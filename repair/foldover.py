"""The foldover-free energy of a mesh and its gradient: finite for tangled cells, infinite in the limit for flat ones.

After Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov, "Foldover-free maps in 50 lines of code" (ACM Trans.
Graph. 40, 2021): at each corner of each cell, J maps the corner of the ideal cell to the real one, and
chi(e, det) = (det + sqrt(e^2 + det^2)) / 2 stands for its determinant, positive however inverted the corner is. The
energy is the sum of (|J|^2 / (d chi^(2/d)))^p. For e = 0 it is the inverse mean ratio of the corner to the power p.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints

__all__ = ["gather", "ideal_corners", "plane_energy", "smallest_determinants", "solid_energy"]

_ANGLE_POWER = 0.5
"""Of the angle term. Above 1 it is not convex enough to find its minimum in the strained corners of a block."""
_HALF_ROOT3 = 0.5 * math.sqrt(3.0)


def ideal_corners(corners: str) -> Floats:
    """(d, d) edges of a corner of the ideal cell, one per column: of a cube, a square, or of equilateral triangles."""
    if corners == "tri":
        return np.array([[1.0, 0.5], [0.0, _HALF_ROOT3]])
    if corners == "quad":
        return np.eye(2)
    if corners == "wedge":
        return np.array([[1.0, 0.5, 0.0], [0.0, _HALF_ROOT3, 0.0], [0.0, 0.0, 1.0]])
    if corners == "tet":
        return np.array([[1.0, 0.5, 0.5], [0.0, _HALF_ROOT3, _HALF_ROOT3 / 3.0], [0.0, 0.0, math.sqrt(2.0 / 3.0)]])
    if corners == "pyramid":
        return np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, math.sqrt(0.5)]])
    return np.eye(3)


@inner
def _chi(e: float, det: float) -> tuple[float, float]:
    """chi(e, det) and its derivative by det."""
    root = math.sqrt(e * e + det * det)
    if root == 0.0:
        return 0.0, 0.5
    # for a negative det the same value without the cancellation
    chi = 0.5 * e * e / (root - det) if det < 0.0 else 0.5 * (det + root)
    return chi, chi / root


@kernel
def smallest_determinants(points: Floats, cells: Ints, triads: Ints, inverse: Floats) -> Floats:
    """(m,) smallest determinant of J over the corners of each cell.

    cells (m, k), triads (c, 1 + d), inverse (d, d) of the ideal corner.
    """
    d = inverse.shape[0]
    whole = np.linalg.det(inverse)
    out = np.full(cells.shape[0], np.inf)
    for i in range(cells.shape[0]):
        for q in range(triads.shape[0]):
            o, a, b = cells[i, triads[q, 0]], cells[i, triads[q, 1]], cells[i, triads[q, 2]]
            ux, uy, uz = points[a, 0] - points[o, 0], points[a, 1] - points[o, 1], points[a, 2] - points[o, 2]
            vx, vy, vz = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1], points[b, 2] - points[o, 2]
            if d == 2:
                det = ux * vy - uy * vx
            else:
                c = cells[i, triads[q, 3]]
                wx, wy, wz = points[c, 0] - points[o, 0], points[c, 1] - points[o, 1], points[c, 2] - points[o, 2]
                det = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
            out[i] = min(out[i], det * whole)
    return out


@kernel
def solid_energy(
    points: Floats, cells: Ints, triads: Ints, inverse: Floats, e: float, power: float, angles: float,
    start: int, stop: int, energy: Floats, slope: Floats,
) -> None:  # fmt: skip
    """Write the energy of cells start to stop, and its gradient by each of their nodes, slope (m, k, 3).

    angles: weight of a second term, the inverse scaled Jacobian |j| |k| |l| / det of the columns of J, which knows the
    angles of a corner and not the lengths of its edges; for e = 0 alone.
    With e = 0 a cell with a corner of no or negative volume has the energy inf.
    """
    third = 1.0 / 3.0
    for i in range(start, stop):
        total = 0.0
        slope[i, :, :] = 0.0
        for q in range(triads.shape[0]):
            so, sa, sb, sc = triads[q, 0], triads[q, 1], triads[q, 2], triads[q, 3]
            o, a, b, c = cells[i, so], cells[i, sa], cells[i, sb], cells[i, sc]
            ux, uy, uz = points[a, 0] - points[o, 0], points[a, 1] - points[o, 1], points[a, 2] - points[o, 2]
            vx, vy, vz = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1], points[b, 2] - points[o, 2]
            wx, wy, wz = points[c, 0] - points[o, 0], points[c, 1] - points[o, 1], points[c, 2] - points[o, 2]
            # columns of J = [u v w] inverse; inverse is upper triangular
            r00, r01, r02 = inverse[0, 0], inverse[0, 1], inverse[0, 2]
            r11, r12, r22 = inverse[1, 1], inverse[1, 2], inverse[2, 2]
            jx, jy, jz = ux * r00, uy * r00, uz * r00
            kx, ky, kz = ux * r01 + vx * r11, uy * r01 + vy * r11, uz * r01 + vz * r11
            lx = ux * r02 + vx * r12 + wx * r22
            ly = uy * r02 + vy * r12 + wy * r22
            lz = uz * r02 + vz * r12 + wz * r22
            # cofactors: the gradient of det by each column
            ax, ay, az = ky * lz - kz * ly, kz * lx - kx * lz, kx * ly - ky * lx
            bx, by, bz = ly * jz - lz * jy, lz * jx - lx * jz, lx * jy - ly * jx
            cx, cy, cz = jy * kz - jz * ky, jz * kx - jx * kz, jx * ky - jy * kx
            det = jx * ax + jy * ay + jz * az
            chi, rise = _chi(e, det)
            if not chi > 0.0:
                total = np.inf
                break
            norm = jx * jx + jy * jy + jz * jz + kx * kx + ky * ky + kz * kz + lx * lx + ly * ly + lz * lz
            shape = norm * third / chi ** (2.0 * third)
            value = shape**power
            total += value
            f = power * value
            s = 2.0 * f / norm
            t = -2.0 * third * f * rise / chi
            sj = sk = sl = s
            if angles > 0.0:
                jj, kk, ll = jx * jx + jy * jy + jz * jz, kx * kx + ky * ky + kz * kz, lx * lx + ly * ly + lz * lz
                skew = angles * (math.sqrt(jj * kk * ll) / det) ** _ANGLE_POWER
                total += skew
                skew *= _ANGLE_POWER
                sj, sk, sl, t = s + skew / jj, s + skew / kk, s + skew / ll, t - skew / det
            gx, gy, gz = sj * jx + t * ax, sj * jy + t * ay, sj * jz + t * az
            hx, hy, hz = sk * kx + t * bx, sk * ky + t * by, sk * kz + t * bz
            mx, my, mz = sl * lx + t * cx, sl * ly + t * cy, sl * lz + t * cz
            dux, duy, duz = (
                gx * r00 + hx * r01 + mx * r02,
                gy * r00 + hy * r01 + my * r02,
                gz * r00 + hz * r01 + mz * r02,
            )
            dvx, dvy, dvz = hx * r11 + mx * r12, hy * r11 + my * r12, hz * r11 + mz * r12
            dwx, dwy, dwz = mx * r22, my * r22, mz * r22
            slope[i, sa, 0] += dux
            slope[i, sa, 1] += duy
            slope[i, sa, 2] += duz
            slope[i, sb, 0] += dvx
            slope[i, sb, 1] += dvy
            slope[i, sb, 2] += dvz
            slope[i, sc, 0] += dwx
            slope[i, sc, 1] += dwy
            slope[i, sc, 2] += dwz
            slope[i, so, 0] -= dux + dvx + dwx
            slope[i, so, 1] -= duy + dvy + dwy
            slope[i, so, 2] -= duz + dvz + dwz
        energy[i] = total


@kernel
def plane_energy(
    points: Floats, cells: Ints, triads: Ints, inverse: Floats, e: float, power: float, angles: float,
    start: int, stop: int, energy: Floats, slope: Floats,
) -> None:  # fmt: skip
    """`solid_energy` for cells in the x-y plane."""
    r00, r01, r11 = inverse[0, 0], inverse[0, 1], inverse[1, 1]
    for i in range(start, stop):
        total = 0.0
        slope[i, :, :] = 0.0
        for q in range(triads.shape[0]):
            so, sa, sb = triads[q, 0], triads[q, 1], triads[q, 2]
            o, a, b = cells[i, so], cells[i, sa], cells[i, sb]
            ux, uy = points[a, 0] - points[o, 0], points[a, 1] - points[o, 1]
            vx, vy = points[b, 0] - points[o, 0], points[b, 1] - points[o, 1]
            jx, jy = ux * r00, uy * r00
            kx, ky = ux * r01 + vx * r11, uy * r01 + vy * r11
            det = jx * ky - jy * kx
            chi, rise = _chi(e, det)
            if not chi > 0.0:
                total = np.inf
                break
            norm = jx * jx + jy * jy + kx * kx + ky * ky
            value = (0.5 * norm / chi) ** power
            total += value
            f = power * value
            s = 2.0 * f / norm
            t = -f * rise / chi
            sj = sk = s
            if angles > 0.0:
                jj, kk = jx * jx + jy * jy, kx * kx + ky * ky
                skew = angles * (math.sqrt(jj * kk) / det) ** _ANGLE_POWER
                total += skew
                skew *= _ANGLE_POWER
                sj, sk, t = s + skew / jj, s + skew / kk, t - skew / det
            gx, gy = sj * jx + t * ky, sj * jy - t * kx
            hx, hy = sk * kx - t * jy, sk * ky + t * jx
            dux, duy = gx * r00 + hx * r01, gy * r00 + hy * r01
            dvx, dvy = hx * r11, hy * r11
            slope[i, sa, 0] += dux
            slope[i, sa, 1] += duy
            slope[i, sb, 0] += dvx
            slope[i, sb, 1] += dvy
            slope[i, so, 0] -= dux + dvx
            slope[i, so, 1] -= duy + dvy
        energy[i] = total


@kernel
def gather(begin: Ints, places: Ints, slope: Floats, rows: Ints, d: int, out: Floats) -> None:
    """Sum the gradients of the cells at each point of `rows` into out (len(rows), d), in the order of the cells."""
    flat = slope.reshape(-1, 3)
    for r in range(rows.size):
        p = rows[r]
        for i in range(begin[p], begin[p + 1]):
            for k in range(d):
                out[r, k] += flat[places[i], k]
