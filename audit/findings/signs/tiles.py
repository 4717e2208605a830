"""Tile kernels of the checks: how thick, how well-cornered and how right-handed a cell is.

Written for the engine of the metrics, so that cells are gathered, scaled and vectorised in one place. All numbers
are free of units, whatever the size of the mesh.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.metrics.stages import Lane
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = [
    "centre_x",
    "centre_y",
    "centre_z",
    "relative_area",
    "relative_flat_area",
    "relative_volume",
    "shortest_edge",
    "sides_of_flat_cell",
    "sides_of_solid",
    "worst_corner_of_quad",
    "worst_corner_of_solid",
]


@tile_kernel
def _longest_edge(tile: Tile, out: Lane) -> None:
    """Square of the longest edge, never 0, so that a cell without size gets 0 and not nan."""
    for i in range(LANES):
        out[i] = tile.edge_range[1, i] if tile.edge_range[1, i] > 0.0 else 1.0


@tile_kernel
def relative_volume(tile: Tile, out: Lane) -> None:
    """V / Lmax**3, signed."""
    _longest_edge(tile, out)
    for i in range(LANES):
        out[i] = tile.volume[i] / (out[i] * math.sqrt(out[i]))


@tile_kernel
def relative_flat_area(tile: Tile, out: Lane) -> None:
    """A / Lmax**2 of a cell in the x-y plane, positive when it runs counter-clockwise."""
    _longest_edge(tile, out)
    for i in range(LANES):
        out[i] = tile.face[0, 2, i] / out[i]


@tile_kernel
def relative_area(tile: Tile, out: Lane) -> None:
    """|A| / Lmax**2 of a surface cell."""
    _longest_edge(tile, out)
    a = tile.face[0]
    for i in range(LANES):
        out[i] = math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2) / out[i]


@tile_kernel
def shortest_edge(tile: Tile, out: Lane) -> None:
    """Square of the shortest edge, in the tile's own unit: only good for telling 0."""
    for i in range(LANES):
        out[i] = tile.edge_range[0, i]


@tile_kernel
def worst_corner_of_solid(tile: Tile, out: Lane) -> None:
    """Smallest corner Jacobian over its three edge lengths, counted positive where it has the sign of the volume."""
    triads = tile.tables.triads
    x, y, z = tile.x[:, 0], tile.x[:, 1], tile.x[:, 2]
    for i in range(LANES):
        out[i] = 1.0
    for r in range(len(triads)):
        o, a, b, c = triads[r, 0], triads[r, 1], triads[r, 2], triads[r, 3]
        for i in range(LANES):
            u = (x[a, i] - x[o, i]) ** 2 + (y[a, i] - y[o, i]) ** 2 + (z[a, i] - z[o, i]) ** 2
            v = (x[b, i] - x[o, i]) ** 2 + (y[b, i] - y[o, i]) ** 2 + (z[b, i] - z[o, i]) ** 2
            w = (x[c, i] - x[o, i]) ** 2 + (y[c, i] - y[o, i]) ** 2 + (z[c, i] - z[o, i]) ** 2
            sizes = u * v * w
            jacobian = tile.jacobian[r, i] if tile.volume[i] >= 0.0 else -tile.jacobian[r, i]
            scaled = jacobian / math.sqrt(sizes if sizes > 0.0 else 1.0)
            out[i] = min(out[i], scaled)


@tile_kernel
def worst_corner_of_quad(tile: Tile, out: Lane) -> None:
    """Smallest sine of a corner, seen along the mean normal of the quadrilateral: 0 or less where it is concave."""
    x, y, z, a = tile.x[:, 0], tile.x[:, 1], tile.x[:, 2], tile.face[0]
    for i in range(LANES):
        out[i] = 1.0
    for o in range(4):
        p, q = (o + 1) % 4, (o + 3) % 4
        for i in range(LANES):
            ux, uy, uz = x[p, i] - x[o, i], y[p, i] - y[o, i], z[p, i] - z[o, i]
            vx, vy, vz = x[q, i] - x[o, i], y[q, i] - y[o, i], z[q, i] - z[o, i]
            along = a[0, i] * (uy * vz - uz * vy) + a[1, i] * (uz * vx - ux * vz) + a[2, i] * (ux * vy - uy * vx)
            sizes = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz)
            sizes *= a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2
            out[i] = min(out[i], along / math.sqrt(sizes if sizes > 0.0 else 1.0))


@tile_kernel
def sides_of_solid(tile: Tile, out: Lane) -> None:
    """Smallest A.(c_f - C) over the cell's own faces: 0 or less where it has a left-handed one.

    c_f is the area-weighted centre of the face fanned about its vertex mean. C is OpenFOAM's cell centre, except
    that the pyramids of the faces count by their magnitude, so that one reversed face does not move the point it
    is judged from. C stays in work[0:3] for the kernels that hand it on.
    """
    n, work = tile.face.shape[0], tile.work
    for d in range(7):  # 0 to 2 the weighted sum, 3 to 5 the mean of the face centres, 6 the weights
        for i in range(LANES):
            work[d, i] = 0.0
    for r in range(n):
        for d in range(3):
            for i in range(LANES):
                work[3 + d, i] += tile.face_centre[r, d, i] * (1.0 / n)
    for r in range(n):
        a, c = tile.face[r], tile.face_centre[r]
        for i in range(LANES):
            dx, dy, dz = c[0, i] - work[3, i], c[1, i] - work[4, i], c[2, i] - work[5, i]
            w = abs(a[0, i] * dx + a[1, i] * dy + a[2, i] * dz)
            work[6, i] += w
            work[0, i] += w * dx
            work[1, i] += w * dy
            work[2, i] += w * dz
    for i in range(LANES):
        share = 0.75 / work[6, i] if work[6, i] > 0.0 else 0.0
        work[0, i] = work[3, i] + share * work[0, i]
        work[1, i] = work[4, i] + share * work[1, i]
        work[2, i] = work[5, i] + share * work[2, i]
        out[i] = np.inf
    for r in range(n):
        a, c = tile.face[r], tile.face_centre[r]
        for i in range(LANES):
            dx, dy, dz = c[0, i] - work[0, i], c[1, i] - work[1, i], c[2, i] - work[2, i]
            side = a[0, i] * dx + a[1, i] * dy + a[2, i] * dz
            # the face that a collapsed cell has lost looks nowhere
            out[i] = min(out[i], side if side != 0.0 or a[0, i] != 0.0 or a[1, i] != 0.0 or a[2, i] != 0.0 else np.inf)


@tile_kernel
def sides_of_flat_cell(tile: Tile, out: Lane) -> None:
    """The same in the x-y plane, where the faces are edges and the cell lies to their left."""
    table, x, work = tile.tables.edges, tile.x, tile.work
    n = len(table)
    for i in range(LANES):
        work[3, i] = work[4, i] = work[0, i] = work[1, i] = work[2, i] = work[6, i] = 0.0
        out[i] = np.inf
    for r in range(n):
        for i in range(LANES):
            work[3, i] += x[r, 0, i] / n
            work[4, i] += x[r, 1, i] / n
    for r in range(n):
        p, q = table[r, 0], table[r, 1]
        for i in range(LANES):
            ux, uy = x[p, 0, i] - work[3, i], x[p, 1, i] - work[4, i]
            vx, vy = x[q, 0, i] - work[3, i], x[q, 1, i] - work[4, i]
            w = abs(ux * vy - uy * vx)
            work[6, i] += w
            work[0, i] += w * (ux + vx)
            work[1, i] += w * (uy + vy)
    for i in range(LANES):
        w = 3.0 * (work[6, i] if work[6, i] > 0.0 else 1.0)
        work[0, i] = work[3, i] + work[0, i] / w
        work[1, i] = work[4, i] + work[1, i] / w
    for r in range(n):
        p, q = table[r, 0], table[r, 1]
        for i in range(LANES):
            ex, ey = x[q, 0, i] - x[p, 0, i], x[q, 1, i] - x[p, 1, i]
            mx, my = 0.5 * (x[p, 0, i] + x[q, 0, i]) - work[0, i], 0.5 * (x[p, 1, i] + x[q, 1, i]) - work[1, i]
            out[i] = min(out[i], ey * mx - ex * my if ex != 0.0 or ey != 0.0 else np.inf)


@tile_kernel
def centre_x(tile: Tile, out: Lane) -> None:
    """x of the centre found by the kernel before, relative to the first node."""
    for i in range(LANES):
        out[i] = tile.work[0, i] * tile.unit[i]


@tile_kernel
def centre_y(tile: Tile, out: Lane) -> None:
    """The y."""
    for i in range(LANES):
        out[i] = tile.work[1, i] * tile.unit[i]


@tile_kernel
def centre_z(tile: Tile, out: Lane) -> None:
    """The z."""
    for i in range(LANES):
        out[i] = tile.work[2, i] * tile.unit[i]
