"""Kernels on pairs of facets of a hull that lie over each other: by how much, how far apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.hulls.boxes import boxes_near
from meshwright.audit.findings.hulls.touching import facing
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["find_overlaps"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@inner
def _overlap_of_edges(x: Floats, offsets: Ints, nodes: Ints, f: int, g: int) -> tuple[float, float]:
    """(length of edge f over edge g, distance between them in the middle of it)."""
    a, b = nodes[offsets[g]], nodes[offsets[g] + 1]
    p, q = nodes[offsets[f]], nodes[offsets[f] + 1]
    gg = s = t = 0.0
    for d in range(3):
        e = x[b, d] - x[a, d]
        gg += e * e
        s += (x[p, d] - x[a, d]) * e
        t += (x[q, d] - x[a, d]) * e
    if not gg > 0.0 or s == t:
        return 0.0, 0.0
    s, t = s / gg, t / gg
    low, high = max(min(s, t), 0.0), min(max(s, t), 1.0)
    if not high > low:
        return 0.0, 0.0
    middle = 0.5 * (low + high)
    w = (middle - s) / (t - s)
    square = 0.0
    for d in range(3):
        on_f = x[p, d] + w * (x[q, d] - x[p, d])
        on_g = x[a, d] + middle * (x[b, d] - x[a, d])
        square += (on_f - on_g) ** 2
    return (high - low) * np.sqrt(gg), np.sqrt(square)


@inner
def _clip(ring: Floats, n: int, ax: float, ay: float, bx: float, by: float, out: Floats) -> int:
    """The part of a ring (n, 2) to the left of the line a b, written to `out` (Sutherland and Hodgman 1974)."""
    m = 0
    for i in range(n):
        j = i - 1 if i > 0 else n - 1
        px, py, qx, qy = ring[j, 0], ring[j, 1], ring[i, 0], ring[i, 1]
        s = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
        t = (bx - ax) * (qy - ay) - (by - ay) * (qx - ax)
        if (s > 0.0 and t < 0.0) or (s < 0.0 and t > 0.0):
            w = s / (s - t)
            out[m, 0], out[m, 1] = px + w * (qx - px), py + w * (qy - py)
            m += 1
        if t >= 0.0:
            out[m, 0], out[m, 1] = qx, qy
            m += 1
    return m


@inner
def _overlap_of_faces(
    x: Floats, offsets: Ints, nodes: Ints, centre: Floats, normal: Floats, f: int, g: int, work: Floats
) -> tuple[float, float]:
    """(area of face f over face g, seen along g's normal, distance between their planes in the middle of it)."""
    nx, ny, nz = normal[g, 0], normal[g, 1], normal[g, 2]
    # a direction in the plane of g: the axis it is least along, crossed with the normal
    if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
        ux, uy, uz = 0.0, nz, -ny
    elif abs(ny) <= abs(nz):
        ux, uy, uz = -nz, 0.0, nx
    else:
        ux, uy, uz = ny, -nx, 0.0
    length = np.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    vx, vy, vz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
    n_f, n_g = offsets[f + 1] - offsets[f], offsets[g + 1] - offsets[g]
    rings = work[:, :, :2]
    for i in range(n_f):
        p = nodes[offsets[f] + i]
        dx, dy, dz = x[p, 0] - centre[g, 0], x[p, 1] - centre[g, 1], x[p, 2] - centre[g, 2]
        rings[0, i, 0], rings[0, i, 1] = ux * dx + uy * dy + uz * dz, vx * dx + vy * dy + vz * dz
    for i in range(n_g):
        p = nodes[offsets[g] + i]
        dx, dy, dz = x[p, 0] - centre[g, 0], x[p, 1] - centre[g, 1], x[p, 2] - centre[g, 2]
        rings[1, i, 0], rings[1, i, 1] = ux * dx + uy * dy + uz * dz, vx * dx + vy * dy + vz * dz
    area = cx = cy = 0.0
    for i in range(n_g):
        j = i - 1 if i > 0 else n_g - 1
        ax, ay, bx, by = rings[1, j, 0], rings[1, j, 1], rings[1, i, 0], rings[1, i, 1]
        turn = ax * by - ay * bx
        if turn == 0.0:
            continue
        if turn < 0.0:
            ax, ay, bx, by = bx, by, ax, ay
        m = _clip(rings[0], n_f, 0.0, 0.0, ax, ay, rings[2])
        m = _clip(rings[2], m, ax, ay, bx, by, rings[3])
        m = _clip(rings[3], m, bx, by, 0.0, 0.0, rings[2])
        sign = -0.5 if turn < 0.0 else 0.5  # a fan about the centre may fold over in a face that is not convex
        for k in range(m):
            h = k - 1 if k > 0 else m - 1
            px, py, qx, qy = rings[2, h, 0], rings[2, h, 1], rings[2, k, 0], rings[2, k, 1]
            cross = sign * (px * qy - py * qx)
            area += cross
            cx += cross * (px + qx) / 3.0
            cy += cross * (py + qy) / 3.0
    # f is seen from behind, so its ring turns clockwise
    area = -area
    if not area > 0.0:
        return 0.0, 0.0
    cx, cy = -cx / area, -cy / area
    fx, fy, fz = normal[f, 0], normal[f, 1], normal[f, 2]
    rise = (
        (centre[g, 0] + cx * ux + cy * vx - centre[f, 0]) * fx
        + (centre[g, 1] + cx * uy + cy * vy - centre[f, 1]) * fy
        + (centre[g, 2] + cx * uz + cy * vz - centre[f, 2]) * fz
    )
    return area, abs(rise / (nx * fx + ny * fy + nz * fz))


@kernel
def find_overlaps(
    chosen: Bools,
    x: Floats,
    offsets: Ints,
    nodes: Ints,
    centre: Floats,
    normal: Floats,
    area: Floats,
    size: Floats,
    order: Ints,
    boxes: Floats,
    heap: Floats,
    rim: bool,
    most: float,
    least: float,
    first: Ints,
    second: Ints,
    overlaps: Floats,
    gaps: Floats,
) -> int:
    """(f, g, overlap, gap): pairs of facets of which one at least is chosen, no further apart than `most` times their
    size, that share more than `least` of the smaller one's area: how many, for `collected`."""
    n = 0
    near = np.empty(256, np.int32)
    box = np.empty(6)
    longest = 2
    for f in range(size.size):
        longest = max(longest, offsets[f + 1] - offsets[f])
    work = np.empty((4, 4 * longest + 16, 2))
    for i in range(order.size):
        f = order[i]
        if not chosen[f] or not area[f] > 0.0:
            continue
        for d in range(3):
            box[d], box[3 + d] = boxes[i, d] - most * size[f], boxes[i, 3 + d] + most * size[f]
        count = boxes_near(boxes, heap, box, near)
        if count > near.size:
            near = np.empty(2 * count, np.int32)
            count = boxes_near(boxes, heap, box, near)
        for k in range(count):
            g = order[near[k]]
            if g == f or (chosen[g] and g < f) or not area[g] > 0.0:
                continue
            if not facing(x, offsets, nodes, normal, rim, f, g):
                continue
            if offsets[f + 1] - offsets[f] == 2:
                overlap, gap = _overlap_of_edges(x, offsets, nodes, f, g)
            else:
                overlap, gap = _overlap_of_faces(x, offsets, nodes, centre, normal, f, g, work)
            if not (overlap > least * min(area[f], area[g]) and gap <= most * min(size[f], size[g])):
                continue
            if n < first.size:
                first[n], second[n], overlaps[n], gaps[n] = min(f, g), max(f, g), overlap, gap
            n += 1
    return n
