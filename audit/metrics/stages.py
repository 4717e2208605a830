"""Geometry that several metrics share, computed once per tile. A metric names the stages it reads."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner
from meshwright.audit.metrics.tile import LANES, Tile, stage

__all__ = [
    "angles",
    "axes",
    "centres",
    "corner",
    "degrees",
    "degrees_from_cotangent",
    "diagonals",
    "edges",
    "faces",
    "jacobians",
    "quad_axes",
    "volume",
    "widen",
]

Lane = NDArray[np.float64]


@stage
def edges(tile: Tile, out: Lane) -> None:
    """Squared edge lengths and their extremes."""
    table, x = tile.tables.edges, tile.x
    low, high = tile.edge_range[0], tile.edge_range[1]
    for i in range(LANES):
        low[i], high[i] = np.inf, 0.0
    for r in range(len(table)):
        a, b = table[r, 0], table[r, 1]
        for i in range(LANES):
            d2 = (x[b, 0, i] - x[a, 0, i]) ** 2 + (x[b, 1, i] - x[a, 1, i]) ** 2 + (x[b, 2, i] - x[a, 2, i]) ** 2
            tile.edge2[r, i] = d2
            low[i] = min(low[i], d2)
            high[i] = max(high[i], d2)


@stage
def diagonals(tile: Tile, out: Lane) -> None:
    """Extremes of the squared diagonals."""
    table, x = tile.tables.diagonals, tile.x
    low, high = tile.diagonal_range[0], tile.diagonal_range[1]
    for i in range(LANES):
        low[i], high[i] = np.inf, 0.0
    for r in range(len(table)):
        a, b = table[r, 0], table[r, 1]
        for i in range(LANES):
            d2 = (x[b, 0, i] - x[a, 0, i]) ** 2 + (x[b, 1, i] - x[a, 1, i]) ** 2 + (x[b, 2, i] - x[a, 2, i]) ** 2
            low[i] = min(low[i], d2)
            high[i] = max(high[i], d2)


@stage
def faces(tile: Tile, out: Lane) -> None:
    """Area vectors, outward in a positive cell; that of a quadrilateral is half the product of its diagonals."""
    tris, quads = tile.tables.tris, tile.tables.quads
    for r in range(len(tris) + len(quads)):
        if r < len(tris):
            a, b, c, d = tris[r, 0], tris[r, 1], tris[r, 0], tris[r, 2]
        else:
            a, b, c, d = (
                quads[r - len(tris), 0],
                quads[r - len(tris), 2],
                quads[r - len(tris), 1],
                quads[r - len(tris), 3],
            )
        x, area = tile.x, tile.face[r]
        for i in range(LANES):
            ux, uy, uz = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
            vx, vy, vz = x[d, 0, i] - x[c, 0, i], x[d, 1, i] - x[c, 1, i], x[d, 2, i] - x[c, 2, i]
            area[0, i] = 0.5 * (uy * vz - uz * vy)
            area[1, i] = 0.5 * (uz * vx - ux * vz)
            area[2, i] = 0.5 * (ux * vy - uy * vx)


@stage
def volume(tile: Tile, out: Lane) -> None:
    """Signed volume by the divergence theorem over faces fanned about their vertex mean.

    Exact for planar and for bilinear faces: over such a face the mean of position is the vertex mean as far as the
    flux is concerned, plus a term that the two halves of each diagonal share.
    """
    tris, quads = tile.tables.tris, tile.tables.quads
    x = tile.x
    for i in range(LANES):
        tile.volume[i] = 0.0
    for r in range(len(tris)):
        a, b, c = tris[r, 0], tris[r, 1], tris[r, 2]
        for i in range(LANES):
            tile.volume[i] += (
                x[a, 0, i] * (x[b, 1, i] * x[c, 2, i] - x[b, 2, i] * x[c, 1, i])
                + x[a, 1, i] * (x[b, 2, i] * x[c, 0, i] - x[b, 0, i] * x[c, 2, i])
                + x[a, 2, i] * (x[b, 0, i] * x[c, 1, i] - x[b, 1, i] * x[c, 0, i])
            ) / 6.0
    for r in range(len(quads)):
        a, b, c, d = quads[r, 0], quads[r, 1], quads[r, 2], quads[r, 3]
        for i in range(LANES):
            # (a + b) . ((b + c) x (c + d)) / 12 sums the six determinants of the fan.
            sx, sy, sz = x[a, 0, i] + x[b, 0, i], x[a, 1, i] + x[b, 1, i], x[a, 2, i] + x[b, 2, i]
            tx, ty, tz = x[b, 0, i] + x[c, 0, i], x[b, 1, i] + x[c, 1, i], x[b, 2, i] + x[c, 2, i]
            ux, uy, uz = x[c, 0, i] + x[d, 0, i], x[c, 1, i] + x[d, 1, i], x[c, 2, i] + x[d, 2, i]
            tile.volume[i] += (sx * (ty * uz - tz * uy) + sy * (tz * ux - tx * uz) + sz * (tx * uy - ty * ux)) / 12.0


@stage
def jacobians(tile: Tile, out: Lane) -> None:
    """Determinant of the edge triple at each corner; the apex of a pyramid has none."""
    triads = tile.tables.triads
    x = tile.x
    low, high = tile.jacobian_range[0], tile.jacobian_range[1]
    for i in range(LANES):
        low[i], high[i] = np.inf, 0.0
    for r in range(len(triads)):
        o, a, b, c = triads[r, 0], triads[r, 1], triads[r, 2], triads[r, 3]
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[o, 0, i], x[a, 1, i] - x[o, 1, i], x[a, 2, i] - x[o, 2, i]
            vx, vy, vz = x[b, 0, i] - x[o, 0, i], x[b, 1, i] - x[o, 1, i], x[b, 2, i] - x[o, 2, i]
            wx, wy, wz = x[c, 0, i] - x[o, 0, i], x[c, 1, i] - x[o, 1, i], x[c, 2, i] - x[o, 2, i]
            j = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
            tile.jacobian[r, i] = j
            low[i] = min(low[i], j)
            high[i] = max(high[i], abs(j))


@stage
def axes(tile: Tile, out: Lane) -> None:
    """Principal axes B_k and mixed modes X_kl of a hex (Verdict's, divided by 4)."""
    x, axis, mode = tile.x, tile.axis, tile.mode
    for d in range(3):
        for i in range(LANES):
            # differences across the first local direction, then their sums and differences along the other two
            p, q, r, s = (
                x[1, d, i] - x[0, d, i],
                x[2, d, i] - x[3, d, i],
                x[5, d, i] - x[4, d, i],
                x[6, d, i] - x[7, d, i],
            )
            axis[0, d, i] = 0.25 * (p + q + r + s)
            mode[0, d, i] = 0.25 * ((q + s) - (p + r))
            mode[1, d, i] = 0.25 * ((r + s) - (p + q))
        for i in range(LANES):
            bottom_front, bottom_back = x[0, d, i] + x[1, d, i], x[2, d, i] + x[3, d, i]
            top_front, top_back = x[4, d, i] + x[5, d, i], x[6, d, i] + x[7, d, i]
            axis[1, d, i] = 0.25 * ((bottom_back - bottom_front) + (top_back - top_front))
            axis[2, d, i] = 0.25 * ((top_front + top_back) - (bottom_front + bottom_back))
            mode[2, d, i] = 0.25 * ((top_back - top_front) - (bottom_back - bottom_front))


@stage
def quad_axes(tile: Tile, out: Lane) -> None:
    """Bisectors X1, X2 and hour-glass vector T of a quadrilateral."""
    x = tile.x
    for d in range(3):
        for i in range(LANES):
            tile.axis[0, d, i] = 0.5 * ((x[1, d, i] - x[0, d, i]) + (x[2, d, i] - x[3, d, i]))
            tile.axis[1, d, i] = 0.5 * ((x[2, d, i] - x[1, d, i]) + (x[3, d, i] - x[0, d, i]))
            tile.mode[3, d, i] = 0.25 * ((x[0, d, i] - x[1, d, i]) + (x[2, d, i] - x[3, d, i]))


@inner
def degrees_from_cotangent(c):  # type: ignore[no-untyped-def]
    """Angle in 0..180 degrees whose cotangent is c; accurate to a few ulp at both ends, where acos is not.

    Cephes' rational approximation of atan on |t| <= 0.66 (Moshier, Methods and Programs for Mathematical Functions),
    written without branches so that the loop over the lanes becomes vector code.
    """
    steep = abs(c) > 1.0
    t = abs(1.0 / c) if steep else abs(c)
    upper = t > 0.66
    t = (t - 1.0) / (t + 1.0) if upper else t
    z = t * t
    p = (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1) * z
         - 1.228866684490136173410e2) * z - 6.485021904942025371773e1  # fmt: skip
    q = ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z + 4.328810604912902668951e2) * z
         + 4.853903996359136964868e2) * z + 1.945506571482613964425e2  # fmt: skip
    arc = t + t * z * p / q
    arc = arc + 0.25 * math.pi if upper else arc
    arc = arc if steep else 0.5 * math.pi - arc
    return (math.pi - arc if c < 0.0 else arc) * (180.0 / math.pi)


@inner
def degrees(square):  # type: ignore[no-untyped-def]
    """Angle from the signed square of its cotangent."""
    return degrees_from_cotangent(math.copysign(math.sqrt(abs(square)), square))


@inner
def corner(ux, uy, uz, vx, vy, vz):  # type: ignore[no-untyped-def]
    """Signed square of the cotangent between two edges (nan where one has no length), and their cross product."""
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    dot = ux * vx + uy * vy + uz * vz
    return dot * abs(dot) / (nx * nx + ny * ny + nz * nz), nx, ny, nz


@inner
def widen(small, large, reflex, corner, turned):  # type: ignore[no-untyped-def]
    """The extremes with one more corner; nan leaves them as they are."""
    small = corner if corner > small and not turned else small
    large = corner if corner < large and not turned else large
    reflex = corner if corner > reflex and turned else reflex
    return small, large, reflex


@stage
def angles(tile: Tile, out: Lane) -> None:
    """Extreme corner angles of the faces, reduced as signed squares of the cotangent u.v / |u x v|.

    They fall monotonically with the angle and need no square root at every corner. At a reflex corner of a
    quadrilateral (its normal against the face's) the angle is 360 degrees minus the plain one.
    """
    tris, quads, x, work = tile.tables.tris, tile.tables.quads, tile.x, tile.work
    small, large, reflex = work[3], work[4], work[5]
    for shape in range(2):
        shapeless = tile.shapeless[shape]
        for i in range(LANES):
            small[i], large[i], reflex[i], shapeless[i] = -np.inf, np.inf, -np.inf, 0.0
        if shape == 0:
            for r in range(len(tris)):
                a, b, c = tris[r, 0], tris[r, 1], tris[r, 2]
                for i in range(LANES):
                    ex, ey, ez = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
                    fx, fy, fz = x[c, 0, i] - x[b, 0, i], x[c, 1, i] - x[b, 1, i], x[c, 2, i] - x[b, 2, i]
                    gx, gy, gz = x[a, 0, i] - x[c, 0, i], x[a, 1, i] - x[c, 1, i], x[a, 2, i] - x[c, 2, i]
                    # all three corners have the same cross product
                    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
                    n2 = nx * nx + ny * ny + nz * nz
                    s0, s1, s2 = (
                        -(ex * gx + ey * gy + ez * gz),
                        -(fx * ex + fy * ey + fz * ez),
                        -(gx * fx + gy * fy + gz * fz),
                    )
                    s0, s1, s2 = s0 * abs(s0) / n2, s1 * abs(s1) / n2, s2 * abs(s2) / n2
                    shapeless[i] += (s0 != s0) + (s1 != s1) + (s2 != s2)
                    low, high, _ = widen(small[i], large[i], 0.0, s0, False)
                    low, high, _ = widen(low, high, 0.0, s1, False)
                    small[i], large[i], _ = widen(low, high, 0.0, s2, False)
        else:
            for r in range(len(quads)):
                a, b, c, d = quads[r, 0], quads[r, 1], quads[r, 2], quads[r, 3]
                for i in range(LANES):
                    ex, ey, ez = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
                    fx, fy, fz = x[c, 0, i] - x[b, 0, i], x[c, 1, i] - x[b, 1, i], x[c, 2, i] - x[b, 2, i]
                    gx, gy, gz = x[d, 0, i] - x[c, 0, i], x[d, 1, i] - x[c, 1, i], x[d, 2, i] - x[c, 2, i]
                    hx, hy, hz = x[a, 0, i] - x[d, 0, i], x[a, 1, i] - x[d, 1, i], x[a, 2, i] - x[d, 2, i]
                    s0, ax, ay, az = corner(ex, ey, ez, -hx, -hy, -hz)
                    s1, bx, by, bz = corner(fx, fy, fz, -ex, -ey, -ez)
                    s2, cx, cy, cz = corner(gx, gy, gz, -fx, -fy, -fz)
                    s3, dx, dy, dz = corner(hx, hy, hz, -gx, -gy, -gz)
                    # the normals of two opposite corners add up to twice the area vector of the face
                    nx, ny, nz = ax + cx, ay + cy, az + cz
                    shapeless[i] += (s0 != s0) + (s1 != s1) + (s2 != s2) + (s3 != s3)
                    low, high, back = small[i], large[i], reflex[i]
                    low, high, back = widen(low, high, back, s0, ax * nx + ay * ny + az * nz < 0.0)
                    low, high, back = widen(low, high, back, s1, bx * nx + by * ny + bz * nz < 0.0)
                    low, high, back = widen(low, high, back, s2, cx * nx + cy * ny + cz * nz < 0.0)
                    low, high, back = widen(low, high, back, s3, dx * nx + dy * ny + dz * nz < 0.0)
                    small[i], large[i], reflex[i] = low, high, back
        if len(tris if shape == 0 else quads) == 0:
            tile.angle[2 * shape : 2 * shape + 2] = np.nan
            continue
        for i in range(LANES):
            defined = large[i] < np.inf or small[i] > -np.inf
            low, high = degrees(small[i]), degrees(large[i])
            tile.angle[2 * shape, i] = low if defined else np.nan
            tile.angle[2 * shape + 1, i] = high if defined else np.nan
        concave = False
        for i in range(LANES):
            concave |= reflex[i] > -np.inf
        for i in range(LANES if concave else 0):
            if reflex[i] > -np.inf:
                tile.angle[2 * shape + 1, i] = 360.0 - degrees(reflex[i])


@inner
def _triangle_area(ux, uy, uz, vx, vy, vz):  # type: ignore[no-untyped-def]
    """Area of the triangle with these two sides."""
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return 0.5 * math.sqrt(nx * nx + ny * ny + nz * nz)


@stage
def centres(tile: Tile, out: Lane) -> None:
    """Centres of the faces, the areas of their fans, and the centre of the cell, by OpenFOAM's rules; needs `faces`.

    A face is fanned about the mean of its corners, its centre weighs the triangles by their area. The cell is cut into
    pyramids over its faces with the apex at the mean of the face centres, its centre weighs them by their signed volume.
    """
    tris, quads, x, work = tile.tables.tris, tile.tables.quads, tile.x, tile.work
    n = len(tris) + len(quads)
    for r in range(len(tris)):
        a, c = tile.face[r], tile.face_centre[r]
        for i in range(LANES):
            tile.face_fan[r, i] = math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)
        for d in range(3):
            for i in range(LANES):
                c[d, i] = (x[tris[r, 0], d, i] + x[tris[r, 1], d, i] + x[tris[r, 2], d, i]) / 3.0
    for r in range(len(quads)):
        p, q, s, t = x[quads[r, 0]], x[quads[r, 1]], x[quads[r, 2]], x[quads[r, 3]]
        c, fan = tile.face_centre[len(tris) + r], tile.face_fan[len(tris) + r]
        for i in range(LANES):
            mx = 0.25 * (p[0, i] + q[0, i] + s[0, i] + t[0, i])
            my = 0.25 * (p[1, i] + q[1, i] + s[1, i] + t[1, i])
            mz = 0.25 * (p[2, i] + q[2, i] + s[2, i] + t[2, i])
            px, py, pz = p[0, i] - mx, p[1, i] - my, p[2, i] - mz
            qx, qy, qz = q[0, i] - mx, q[1, i] - my, q[2, i] - mz
            sx, sy, sz = s[0, i] - mx, s[1, i] - my, s[2, i] - mz
            tx, ty, tz = t[0, i] - mx, t[1, i] - my, t[2, i] - mz
            pq, qs = _triangle_area(px, py, pz, qx, qy, qz), _triangle_area(qx, qy, qz, sx, sy, sz)
            st, tp = _triangle_area(sx, sy, sz, tx, ty, tz), _triangle_area(tx, ty, tz, px, py, pz)
            total = pq + qs + st + tp
            share = 1.0 / (3.0 * total) if total > 0.0 else 0.0
            fan[i] = total
            c[0, i] = mx + share * (pq * (px + qx) + qs * (qx + sx) + st * (sx + tx) + tp * (tx + px))
            c[1, i] = my + share * (pq * (py + qy) + qs * (qy + sy) + st * (sy + ty) + tp * (ty + py))
            c[2, i] = mz + share * (pq * (pz + qz) + qs * (qz + sz) + st * (sz + tz) + tp * (tz + pz))
    for d in range(
        8
    ):  # 0 to 2 the mean of the face centres, 3 to 5 the weighted sum about it, 6 the weights, 7 their size
        for i in range(LANES):
            work[d, i] = 0.0
    for r in range(n):
        for d in range(3):
            for i in range(LANES):
                work[d, i] += tile.face_centre[r, d, i] * (1.0 / n)
    for r in range(n):
        a, c = tile.face[r], tile.face_centre[r]
        for i in range(LANES):
            dx, dy, dz = c[0, i] - work[0, i], c[1, i] - work[1, i], c[2, i] - work[2, i]
            w = a[0, i] * dx + a[1, i] * dy + a[2, i] * dz
            work[6, i] += w
            work[7, i] += (abs(a[0, i]) + abs(a[1, i]) + abs(a[2, i])) * (abs(dx) + abs(dy) + abs(dz))
            work[3, i] += w * dx
            work[4, i] += w * dy
            work[5, i] += w * dz
    for i in range(LANES):  # a volume that is nothing but rounding gives no centre
        sized = abs(work[6, i]) > 1e-14 * work[7, i]
        work[6, i] = 0.75 / work[6, i] if sized else 0.0
    for d in range(3):
        for i in range(LANES):
            tile.centre[d, i] = work[d, i] + work[3 + d, i] * work[6, i]
