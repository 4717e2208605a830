"""Cross-sections of solids through the middles of edges, measured as MAPDL measures faces."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner
from meshwright.audit.metrics.aspect import FLAT
from meshwright.audit.metrics.face_shapes import (
    ASPECT,
    BROKEN,
    COLLAPSED,
    PARALLEL,
    flattened,
    opposite,
    triangle_aspect2,
)
from meshwright.audit.metrics.stages import Lane, degrees
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = [
    "hex_section_aspect",
    "hex_section_parallel",
    "pyramid_section_aspect",
    "tet_section_aspect",
    "wedge_section_aspect",
    "wedge_section_parallel",
]

# An edge, then the opposite edge whose middle completes the triangle.
_TET = np.array([[0, 1, 2, 3], [1, 2, 0, 3], [2, 0, 1, 3], [0, 3, 1, 2], [1, 3, 0, 2], [2, 3, 0, 1]])
_PYRAMID = np.array([[0, 1, 2, 4], [0, 1, 3, 4], [1, 2, 3, 4], [1, 2, 0, 4],
                     [2, 3, 0, 4], [2, 3, 1, 4], [3, 0, 1, 4], [3, 0, 2, 4]])  # fmt: skip
# Two edges of a wedge's triangle, as three corners: their middles and those of the edges above make a section.
_WEDGE = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])
# Pairs of directions of a hex, and the mode that mixes them.
_PAIRS = np.array([[0, 1, 0], [0, 2, 1], [1, 2, 2]])


@inner
def _triangles(tile, sections, out):  # type: ignore[no-untyped-def]
    """Worst of the faces and of the triangles of an edge and the middle of another."""
    x = tile.x
    for i in range(LANES):
        out[i] = tile.face_shape[ASPECT, i]
    for r in range(len(sections)):
        a, b, c, d = sections[r, 0], sections[r, 1], sections[r, 2], sections[r, 3]
        for i in range(LANES):
            ux, uy, uz = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
            vx = 0.5 * (x[c, 0, i] + x[d, 0, i]) - x[a, 0, i]
            vy = 0.5 * (x[c, 1, i] + x[d, 1, i]) - x[a, 1, i]
            vz = 0.5 * (x[c, 2, i] + x[d, 2, i]) - x[a, 2, i]
            wx, wy, wz = vx - ux, vy - uy, vz - uz
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            p, q, r2 = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
            aspect = triangle_aspect2(p, q, r2, 0.25 * (nx * nx + ny * ny + nz * nz))
            out[i] = aspect if aspect > out[i] else out[i]
    _root(tile, out)


@inner
def _root(tile, out):  # type: ignore[no-untyped-def]
    """From the squared ratio to the ratio; inf when flat or when all quadrilaterals are lines."""
    n = len(tile.tables.quads)
    for i in range(LANES):
        ratio = math.sqrt(out[i])
        out[i] = ratio if ratio * FLAT < 1.0 and (n == 0 or tile.face_shape[COLLAPSED, i] < n) else np.inf


@tile_kernel
def tet_section_aspect(tile: Tile, out: Lane) -> None:
    """Faces, and six triangles of an edge and the middle of the opposite one."""
    _triangles(tile, _TET, out)


@tile_kernel
def pyramid_section_aspect(tile: Tile, out: Lane) -> None:
    """Faces, and eight triangles of a base edge and the middle of an opposite edge to the apex."""
    _triangles(tile, _PYRAMID, out)


@tile_kernel
def hex_section_aspect(tile: Tile, out: Lane) -> None:
    """Faces, and three sections, whose mid-lines are the axes."""
    a = tile.axis
    for i in range(LANES):
        out[i] = tile.face_shape[ASPECT, i]
    for r in range(3):
        k, m = _PAIRS[r, 0], _PAIRS[r, 1]
        for i in range(LANES):
            ux, uy, uz, vx, vy, vz = a[k, 0, i], a[k, 1, i], a[k, 2, i], a[m, 0, i], a[m, 1, i], a[m, 2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            high = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
            area2 = nx * nx + ny * ny + nz * nz
            aspect = high * high / area2 if area2 > 0.0 else np.inf
            out[i] = aspect if aspect > out[i] else out[i]
    _root(tile, out)


@tile_kernel
def hex_section_parallel(tile: Tile, out: Lane) -> None:
    """Faces, and three sections, whose opposite edges are an axis less and plus a mode."""
    a, t, broken = tile.axis, tile.mode, tile.work[0]
    for i in range(LANES):
        out[i] = tile.face_shape[PARALLEL, i]
        broken[i] = tile.face_shape[BROKEN, i] + (1.0 if flattened(tile, i) else 0.0)
    for r in range(6):
        k, m = _PAIRS[r // 2, r % 2], _PAIRS[r // 2, 2]
        for i in range(LANES):
            ux, uy, uz = a[k, 0, i] - t[m, 0, i], a[k, 1, i] - t[m, 1, i], a[k, 2, i] - t[m, 2, i]
            vx, vy, vz = a[k, 0, i] + t[m, 0, i], a[k, 1, i] + t[m, 1, i], a[k, 2, i] + t[m, 2, i]
            s = opposite(ux, uy, uz, vx, vy, vz)
            out[i] = s if s < out[i] else out[i]
            broken[i] += 1.0 if s != s else 0.0
    for i in range(LANES):
        out[i] = degrees(out[i]) if broken[i] == 0.0 else np.nan


@tile_kernel
def wedge_section_aspect(tile: Tile, out: Lane) -> None:
    """Faces, the triangle through the middles of the edges between the ends, and three quads through the other middles."""
    x = tile.x
    for i in range(LANES):
        ux, uy, uz = _between(x, 0, 1, 3, 4, 0, i), _between(x, 0, 1, 3, 4, 1, i), _between(x, 0, 1, 3, 4, 2, i)
        vx, vy, vz = _between(x, 0, 2, 3, 5, 0, i), _between(x, 0, 2, 3, 5, 1, i), _between(x, 0, 2, 3, 5, 2, i)
        wx, wy, wz = vx - ux, vy - uy, vz - uz
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        p, q, r2 = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
        aspect = triangle_aspect2(p, q, r2, 0.25 * (nx * nx + ny * ny + nz * nz))
        out[i] = aspect if aspect > tile.face_shape[ASPECT, i] else tile.face_shape[ASPECT, i]
    for r in range(3):
        j, k, m = _WEDGE[r, 0], _WEDGE[r, 1], _WEDGE[r, 2]
        for i in range(LANES):
            # mid-lines: along the triangles, half the mean of two edges; across them, the mean of four weights 1 2 1
            ux, uy, uz = (
                0.5 * _between(x, j, m, j + 3, m + 3, 0, i),
                0.5 * _between(x, j, m, j + 3, m + 3, 1, i),
                0.5 * _between(x, j, m, j + 3, m + 3, 2, i),
            )
            vx, vy, vz = _across(x, j, k, m, 0, i), _across(x, j, k, m, 1, i), _across(x, j, k, m, 2, i)
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            high = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
            area2 = nx * nx + ny * ny + nz * nz
            aspect = high * high / area2 if area2 > 0.0 else np.inf
            out[i] = aspect if aspect > out[i] else out[i]
    _root(tile, out)


@inner
def _between(x, a, b, c, d, k, i):  # type: ignore[no-untyped-def]
    """Mean of the vectors a to b and c to d."""
    return 0.5 * ((x[b, k, i] - x[a, k, i]) + (x[d, k, i] - x[c, k, i]))


@inner
def _across(x, a, b, c, k, i):  # type: ignore[no-untyped-def]
    """Mean of the vectors between the middles of edges ab, bc and of those above them."""
    p, q, r = x[a + 3, k, i] - x[a, k, i], x[b + 3, k, i] - x[b, k, i], x[c + 3, k, i] - x[c, k, i]
    return 0.25 * (p + 2.0 * q + r)


@tile_kernel
def wedge_section_parallel(tile: Tile, out: Lane) -> None:
    """Faces, and three sections: their edges across the triangles; those along them lie as the edges of the faces do."""
    x, broken = tile.x, tile.work[0]
    for i in range(LANES):
        out[i] = tile.face_shape[PARALLEL, i]
        broken[i] = tile.face_shape[BROKEN, i]
    for r in range(3):
        j, k, m = _WEDGE[r, 0], _WEDGE[r, 1], _WEDGE[r, 2]
        for i in range(LANES):
            ux, uy, uz = (
                _between(x, j, j + 3, k, k + 3, 0, i),
                _between(x, j, j + 3, k, k + 3, 1, i),
                _between(x, j, j + 3, k, k + 3, 2, i),
            )
            vx, vy, vz = (
                _between(x, k, k + 3, m, m + 3, 0, i),
                _between(x, k, k + 3, m, m + 3, 1, i),
                _between(x, k, k + 3, m, m + 3, 2, i),
            )
            s = opposite(ux, uy, uz, vx, vy, vz)
            nothing = abs(ux) + abs(uy) + abs(uz) + abs(vx) + abs(vy) + abs(vz) == 0.0
            out[i] = s if s < out[i] else out[i]
            broken[i] += 1.0 if s != s and not nothing else 0.0
    for i in range(LANES):
        out[i] = degrees(out[i]) if broken[i] == 0.0 else np.nan
