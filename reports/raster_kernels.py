"""Kernels of the software renderer: polygons, lines and dots into a picture of samples, and samples into pixels.

Places are (x, y, z) in samples: x to the right, y down, z towards the eye.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["NOTHING", "draw_dots", "draw_lines", "draw_polygons", "moved", "pixels", "plot_cells"]

Floats = NDArray[np.float64]
Depth = NDArray[np.float32]
Ids = NDArray[np.int32]

NOTHING = -1

_BIAS = 1.0
"""Samples by which a cell may lie behind the shell and still count as in it: its own sides are part of the shell."""

_LIFT = 4.0
"""The same of lines, which run over steep faces too."""


@inner
def _edge(ax: float, ay: float, bx: float, by: float, px: float, py: float) -> float:
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@inner
def _triangle(at: Floats, p: int, q: int, r: int, mark: int, depth: Depth, ids: Ids) -> None:
    """Every sample whose middle lies in the triangle and that nothing nearer has."""
    height, width = depth.shape
    ax, ay, az = at[p, 0], at[p, 1], at[p, 2]
    bx, by, bz = at[q, 0], at[q, 1], at[q, 2]
    cx, cy, cz = at[r, 0], at[r, 1], at[r, 2]
    area = _edge(ax, ay, bx, by, cx, cy)
    if not abs(area) > 1e-9:
        return
    left, right = max(0, int(min(ax, bx, cx) - 0.5)), min(width - 1, int(max(ax, bx, cx) + 0.5))
    top, bottom = max(0, int(min(ay, by, cy) - 0.5)), min(height - 1, int(max(ay, by, cy) + 0.5))
    one = 1.0 / area
    # barycentric coordinates are linear: a step to the right changes them by constants
    u_step, v_step = -(cy - by) * one, -(ay - cy) * one
    z_step = u_step * az + v_step * bz - (u_step + v_step) * cz
    for y in range(top, bottom + 1):
        u = _edge(bx, by, cx, cy, left + 0.5, y + 0.5) * one
        v = _edge(cx, cy, ax, ay, left + 0.5, y + 0.5) * one
        z = u * az + v * bz + (1.0 - u - v) * cz
        for x in range(left, right + 1):
            if u >= -1e-9 and v >= -1e-9 and u + v <= 1.0 + 1e-9 and z > depth[y, x]:
                depth[y, x] = z
                ids[y, x] = mark
            u += u_step
            v += v_step
            z += z_step


@kernel
def moved(points: Floats, matrix: Floats, shift: Floats) -> Floats:
    """(n, 3) matrix times every point, and a shift: a library's product of so narrow a matrix wakes all its threads."""
    out = np.empty(points.shape)
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for d in range(3):
            out[i, d] = matrix[d, 0] * x + matrix[d, 1] * y + matrix[d, 2] * z + shift[d]
    return out


@kernel
def draw_polygons(at: Floats, offsets: Ints, nodes: Ints, depth: Depth, ids: Ids) -> None:
    """Polygons as fans; ids gets the number of the nearest one in each sample."""
    for f in range(offsets.size - 1):
        start = offsets[f]
        for i in range(start + 1, offsets[f + 1] - 1):
            _triangle(at, nodes[start], nodes[i], nodes[i + 1], f, depth, ids)


@kernel
def draw_lines(at: Floats, lines: Ints, thick: int, depth: Depth, ink: NDArray[np.uint8], value: int) -> None:
    """Lines (m, 2) that nothing hides, `thick` samples wide; ink gets the value where it was less."""
    height, width = depth.shape
    for m in range(lines.shape[0]):
        ax, ay, az = at[lines[m, 0], 0], at[lines[m, 0], 1], at[lines[m, 0], 2]
        bx, by, bz = at[lines[m, 1], 0], at[lines[m, 1], 1], at[lines[m, 1], 2]
        steps = int(max(abs(bx - ax), abs(by - ay))) + 1
        for k in range(steps + 1):
            t = k / steps
            x, y = int(ax + t * (bx - ax)), int(ay + t * (by - ay))
            z = az + t * (bz - az)
            for j in range(y - thick // 2, y - thick // 2 + thick):
                for i in range(x - thick // 2, x - thick // 2 + thick):
                    if 0 <= i < width and 0 <= j < height and z + _LIFT >= depth[j, i] and ink[j, i] < value:
                        ink[j, i] = value


@kernel
def plot_cells(
    at: Floats, offsets: Ints, nodes: Ints, owner: Ints, depth: Depth, own: Depth, ids: Ids, hidden: NDArray[np.uint8]
) -> None:
    """Polygons of chosen cells over the shell: ids gets the cell, `hidden` whether the shell lies before it.

    own: their depth, apart from that of the shell, so that cells inside are seen through it.
    """
    faces = np.full(depth.shape, NOTHING, np.int32)
    for f in range(offsets.size - 1):
        start = offsets[f]
        for i in range(start + 1, offsets[f + 1] - 1):
            _triangle(at, nodes[start], nodes[i], nodes[i + 1], f, own, faces)
    for y in range(depth.shape[0]):
        for x in range(depth.shape[1]):
            if faces[y, x] >= 0:
                ids[y, x] = faces[y, x]
                hidden[y, x] = own[y, x] + _BIAS < depth[y, x]


@kernel
def draw_dots(
    at: Floats, radius: float, ring: float, depth: Depth, dots: Ids, hidden: NDArray[np.uint8], rings: Ids
) -> None:
    """A dot at every place, the last on top, and a ring around it where `ring` is more than 0."""
    height, width = depth.shape
    reach = int(max(radius, ring + 1.0)) + 1
    for i in range(at.shape[0]):
        if not (math.isfinite(at[i, 0]) and math.isfinite(at[i, 1])):
            continue
        mx, my = int(min(max(at[i, 0], 0.0), width - 1.0)), int(min(max(at[i, 1], 0.0), height - 1.0))
        behind = at[i, 2] + _BIAS < depth[my, mx]
        for y in range(max(0, my - reach), min(height, my + reach + 1)):
            for x in range(max(0, mx - reach), min(width, mx + reach + 1)):
                far = math.sqrt((x + 0.5 - at[i, 0]) ** 2 + (y + 0.5 - at[i, 1]) ** 2)
                if far <= radius or (x == mx and y == my):
                    dots[y, x] = i
                    hidden[y, x] = behind
                elif ring > 0.0 and abs(far - ring) <= 1.0:
                    rings[y, x] = i


@kernel
def pixels(
    shell: Ids, shade: Floats, ink: NDArray[np.uint8], cells: Ids, cell_shade: Floats, owner: Ints,
    hidden: NDArray[np.uint8], dots: Ids, dot_hidden: NDArray[np.uint8], rings: Ids, colours: Floats, theme: Floats,
    through: float, out: NDArray[np.uint8],
) -> None:  # fmt: skip
    """(h, w, 3) pixels of 2 x 2 samples each.

    shell, cells: polygon in each sample; shade, cell_shade: of each polygon, 0 to 1; owner: cell of each polygon of
    cells.  colours: of each cell.  theme: rows background, shell in the dark, shell in the light, ink.  through: how
    much of the colour of a hidden cell comes through the shell.
    """
    height, width = out.shape[0], out.shape[1]
    sums = np.empty(3)
    here = np.empty(3)
    for row in range(height):
        for column in range(width):
            sums[:] = 0.0
            for y in range(2 * row, 2 * row + 2):
                for x in range(2 * column, 2 * column + 2):
                    for d in range(3):
                        here[d] = theme[0, d]
                    if shell[y, x] >= 0:
                        s = shade[shell[y, x]]
                        for d in range(3):
                            here[d] = theme[1, d] + (theme[2, d] - theme[1, d]) * s
                    if ink[y, x] > 0:
                        a = ink[y, x] / 255.0
                        for d in range(3):
                            here[d] += (theme[3, d] - here[d]) * a
                    if cells[y, x] >= 0:
                        f = cells[y, x]
                        a = through if hidden[y, x] else 1.0
                        for d in range(3):
                            here[d] += (colours[owner[f], d] * (0.62 + 0.38 * cell_shade[f]) - here[d]) * a
                    if rings[y, x] >= 0:
                        for d in range(3):
                            here[d] += (colours[rings[y, x], d] - here[d]) * 0.8
                    if dots[y, x] >= 0:
                        a = 0.7 if dot_hidden[y, x] else 1.0
                        for d in range(3):
                            here[d] += (colours[dots[y, x], d] - here[d]) * a
                    for d in range(3):
                        sums[d] += here[d]
            for d in range(3):
                out[row, column, d] = int(min(max(sums[d] * 0.25, 0.0), 255.0) + 0.5)
