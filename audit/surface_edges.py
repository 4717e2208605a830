"""Kernels on a surface given as a table of faces: unit normals, edges and the angle between the two faces of each."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.csr import sort_keys
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints

__all__ = ["face_normals", "fan_of_face", "surface_edges"]

Floats = NDArray[np.float64]


@inner
def fan_of_face(points: Floats, offsets: Ints, nodes: Ints, f: int) -> tuple[float, float, float, float]:
    """(twice the area vector of a face in units of its extent, seen from its first node; that extent)."""
    o = nodes[offsets[f]]
    s = 0.0
    for i in range(offsets[f] + 1, offsets[f + 1]):
        for d in range(3):
            s = max(s, abs(points[nodes[i], d] - points[o, d]))
    x = y = z = 0.0
    for i in range(offsets[f] + 1, offsets[f + 1] - 1):
        p, q = nodes[i], nodes[i + 1]
        ux, uy = (points[p, 0] - points[o, 0]) / s, (points[p, 1] - points[o, 1]) / s
        vx, vy = (points[q, 0] - points[o, 0]) / s, (points[q, 1] - points[o, 1]) / s
        uz, vz = (points[p, 2] - points[o, 2]) / s, (points[q, 2] - points[o, 2]) / s
        x += uy * vz - uz * vy
        y += uz * vx - ux * vz
        z += ux * vy - uy * vx
    return x, y, z, s


@kernel
def face_normals(points: Floats, offsets: Ints, nodes: Ints) -> Floats:
    """Unit normals of faces, by the cross products of their fans, each measured by its own extent; 0 without area."""
    out = np.zeros((offsets.size - 1, 3))
    for f in range(out.shape[0]):
        x, y, z, _ = fan_of_face(points, offsets, nodes, f)
        size = math.sqrt(x * x + y * y + z * z)
        if size > 0.0:
            out[f, 0], out[f, 1], out[f, 2] = x / size, y / size, z / size
    return out


@kernel
def surface_edges(offsets: Ints, nodes: Ints, normals: Floats, n_points: int) -> tuple[Ints, Ints, Floats]:
    """Edges (m, 2) of faces, the two faces of each (-1 where not two), degrees between their normals (nan likewise)."""
    begin = np.zeros(n_points + 1, np.int32)
    for f in range(offsets.size - 1):
        p = nodes[offsets[f + 1] - 1]
        for i in range(offsets[f], offsets[f + 1]):
            q = nodes[i]
            if p != q:
                begin[min(p, q)] += 1
            p = q
    m = 0
    most = 0
    for p in range(n_points + 1):
        n = begin[p]
        begin[p] = m
        m += n
        most = max(most, n)
    # larger end, face, and whether the face runs from the smaller to the larger, in one number that sorts
    keys = np.empty(m, np.int64)
    for f in range(offsets.size - 1):
        p = nodes[offsets[f + 1] - 1]
        for i in range(offsets[f], offsets[f + 1]):
            q = nodes[i]
            if p != q:
                low, high = min(p, q), max(p, q)
                keys[begin[low]] = np.int64(high) << 32 | np.int64(f) << 1 | np.int64(p < q)
                begin[low] += 1
            p = q
    edges = np.empty((m, 2), np.int32)
    sides = np.empty((m, 2), np.int32)
    degrees = np.empty(m)
    here = np.empty(most, np.int64)
    e = start = 0
    for p in range(n_points):
        n = begin[p] - start
        for i in range(n):
            here[i] = keys[start + i]
        sort_keys(here, n)
        i = 0
        while i < n:
            j = i + 1
            while j < n and here[j] >> 32 == here[i] >> 32:
                j += 1
            edges[e, 0], edges[e, 1] = p, here[i] >> 32
            sides[e, 0], sides[e, 1], degrees[e] = -1, -1, math.nan
            if j == i + 2:
                a, b = (here[i] & 0xFFFFFFFF) >> 1, (here[i + 1] & 0xFFFFFFFF) >> 1
                sides[e, 0], sides[e, 1] = a, b
                degrees[e] = _angle(normals[a], normals[b], here[i] & 1 == here[i + 1] & 1)
            e += 1
            i = j
        start = begin[p]
    return edges[:e], sides[:e], degrees[:e]


@kernel
def _angle(u: Floats, v: Floats, opposed: bool) -> float:
    """Degrees between two unit normals, of faces that run along their edge in the same direction if `opposed`."""
    dot = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    x, y, z = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0 and dot == 0.0:
        return math.nan  # a face without area looks nowhere
    return math.degrees(math.atan2(sine, -dot if opposed else dot))
