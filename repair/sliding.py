"""Boundary points that may move on the boundary: which they are, and the surface that they keep to.

A point may slide where all boundary faces around it belong to one smooth piece of one zone: flat to rounding, or, where
points are projected, turning by less than `_SMOOTH` from face to face. Points on edges of the geometry, on borders of
zones and on listed lines stay. The surface is that of the mesh as it was given: triangles, and which one lies beyond
each edge, so that a point that leaves its triangle walks to the next one and never over an edge of the geometry.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import NO_CELL, Floats, Ints, Mesh
from meshwright.repair.zoning import zone_numbers

__all__ = ["FIXED", "MODES", "PROJECT", "SLIDE", "Sheet", "closest_on", "normal_of", "settle", "sliding_points"]

FIXED, SLIDE, PROJECT = "fixed", "slide", "project"
MODES = (FIXED, SLIDE, PROJECT)
_FLAT = 1e-7
"""Radians between normals up to which faces are in one plane: what rounding leaves of it."""
_SMOOTH = math.radians(15.0)
_MOST_WALKS = 64

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Sheet:
    """The boundary triangles that points may slide on. corners (k, 9); across (k, 3): the triangle beyond the edge
    opposite each corner, -1 where no point may pass."""

    corners: Floats
    across: Ints

    @classmethod
    def of(cls, mesh: Mesh, mode: str) -> Sheet:
        """The boundary of a mesh of solid cells, its triangles joined where they are smooth."""
        nodes, across, _ = _joined(mesh, mode)
        return cls(np.ascontiguousarray(mesh.points[nodes].reshape(-1, 9)), across)

    @classmethod
    def empty(cls) -> Sheet:
        """A sheet for meshes of which no point slides."""
        return cls(np.empty((0, 9)), np.empty((0, 3), np.int64))

    def seats(self, points: Floats) -> tuple[Ints, Floats]:
        """(seat, distance) of points (m, 3): the triangle each lies on, or nearest to, and how far from it."""
        centres = self.corners.reshape(-1, 3, 3).mean(axis=1)
        seat = np.full(len(points), -1, np.int64)
        if not len(points) or not len(centres):
            return seat, np.full(len(points), np.inf)
        near = cKDTree(centres).query(points, k=min(8, len(centres)))[1].reshape(len(points), -1)
        away = np.empty(len(points))
        _nearest(self.corners, self.across, np.ascontiguousarray(points), near.astype(np.int64), seat, away)
        return seat, away


def sliding_points(mesh: Mesh, mode: str) -> Mask:
    """(n,) boundary points of a solid mesh that lie inside one smooth piece of its boundary."""
    out: Mask = np.zeros(len(mesh.points), np.bool_)
    if mode == FIXED or mesh.cell_dimension != 3:
        return out
    nodes, across, others = _joined(mesh, mode)
    out[nodes.ravel()] = True
    out[others] = False
    for k in range(3):
        alone = across[:, k] < 0
        out[nodes[alone][:, [(k + 1) % 3, (k + 2) % 3]].ravel()] = False
    outside = np.sort(nodes, axis=1)
    for block in mesh.boundary:
        inside = np.ones(len(block), np.bool_)
        if CELL_TYPES[block.type].corners == "tri":
            every = np.concatenate([outside, np.sort(block.nodes[:, :3].astype(np.int64), axis=1)])
            _, first = np.unique(every, axis=0, return_inverse=True)
            inside = ~np.isin(first.ravel()[len(outside) :], first.ravel()[: len(outside)])
        named = block.nodes[inside] if block.items is None else block.items
        out[named.ravel()] = False  # lines, and elements between cells
    return out


def _joined(mesh: Mesh, mode: str) -> tuple[Ints, Ints, Ints]:
    """(nodes (k, 3), across (k, 3), points of other boundary faces) of the boundary triangles."""
    sides = faces(mesh)
    outside = sides.neighbour == NO_CELL
    width = np.diff(sides.offsets)
    rows = np.flatnonzero(outside & (width == 3))
    nodes = sides.nodes[sides.offsets[rows].astype(np.int64)[:, None] + np.arange(3)].astype(np.int64)
    others = sides.nodes[np.repeat(outside & (width != 3), width)].astype(np.int64)
    part = _zones_of(mesh, nodes)
    x = mesh.points[nodes]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    k = len(nodes)
    ends = np.stack([nodes[:, [1, 2, 0]], nodes[:, [2, 0, 1]]], axis=2).reshape(-1, 2)
    key = np.sort(ends, axis=1)
    order = np.lexsort((key[:, 1], key[:, 0]))
    same = np.r_[(key[order][1:] == key[order][:-1]).all(axis=1), False]
    before, after = np.r_[False, same[:-1]], np.r_[same[1:], False]
    at = np.flatnonzero(same & ~before & ~after)
    a, b = order[at], order[at + 1]
    # half edge 3 * t + j runs opposite corner j of triangle t
    t, u = a // 3, b // 3
    turn = np.arctan2(
        np.linalg.norm(np.cross(normal[t], normal[u]), axis=1), np.einsum("ij,ij->i", normal[t], normal[u])
    )
    smooth = (turn <= (_FLAT if mode == SLIDE else _SMOOTH)) & (part[t] == part[u])
    across = np.full((k, 3), -1, np.int64)
    a, b = a[smooth], b[smooth]
    across[a // 3, a % 3] = b // 3
    across[b // 3, b % 3] = a // 3
    return nodes, across, others


def _zones_of(mesh: Mesh, nodes: Ints) -> Ints:
    """(k,) a number for the zones of the element that lists each boundary triangle, 0 where none does."""
    part = np.zeros(len(nodes), np.int64)
    listed = [b for b in mesh.boundary if CELL_TYPES[b.type].corners == "tri"]
    if not listed:
        return part
    elements = np.sort(np.concatenate([b.nodes[:, :3] for b in listed]).astype(np.int64), axis=1)
    element_rows = np.concatenate([b.rows for b in listed])
    label = 1 + zone_numbers((zone for zone in mesh.zones if zone.entity == "face"), mesh.n_boundary)
    every = np.concatenate([elements, np.sort(nodes, axis=1)])
    _, name = np.unique(every, axis=0, return_inverse=True)
    name = name.ravel()
    of_name = np.zeros(int(name.max()) + 1, np.int64)
    of_name[name[: len(elements)]] = label[element_rows]
    part[:] = of_name[name[len(elements) :]]
    return part


@inner
def closest_on(c: Floats, t: int, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """(x, y, z, squared distance) of the point of triangle t nearest to a point.

    By the region of the plane that the point lies over (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
    """
    ax, ay, az = c[t, 0], c[t, 1], c[t, 2]
    ux, uy, uz = c[t, 3] - ax, c[t, 4] - ay, c[t, 5] - az
    vx, vy, vz = c[t, 6] - ax, c[t, 7] - ay, c[t, 8] - az
    px, py, pz = x - ax, y - ay, z - az
    d1, d2 = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    d3, d4, d5, d6 = d1 - uu, d2 - uv, d1 - uv, d2 - vv
    if d1 <= 0.0 and d2 <= 0.0:
        s, r = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, r = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, r = 0.0, 1.0
    else:
        w3 = d1 * d4 - d3 * d2
        w2 = d5 * d2 - d1 * d6
        w1 = d3 * d6 - d5 * d4
        if w3 <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
            s, r = d1 / (d1 - d3), 0.0
        elif w2 <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            s, r = 0.0, d2 / (d2 - d6)
        elif w1 <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
            r = (d4 - d3) / ((d4 - d3) + (d5 - d6))
            s = 1.0 - r
        else:
            # inside: taking off what sticks out along the normal keeps a coordinate that the plane fixes to the bit
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            h = (px * nx + py * ny + pz * nz) / (nx * nx + ny * ny + nz * nz)
            return x - h * nx, y - h * ny, z - h * nz, h * h * (nx * nx + ny * ny + nz * nz)
    qx, qy, qz = ax + s * ux + r * vx, ay + s * uy + r * vy, az + s * uz + r * vz
    return qx, qy, qz, (qx - x) * (qx - x) + (qy - y) * (qy - y) + (qz - z) * (qz - z)


@inner
def normal_of(corners: Floats, t: int) -> tuple[float, float, float]:
    """Unit normal of a triangle of the sheet; 0 where it has no area."""
    ux, uy, uz = corners[t, 3] - corners[t, 0], corners[t, 4] - corners[t, 1], corners[t, 5] - corners[t, 2]
    vx, vy, vz = corners[t, 6] - corners[t, 0], corners[t, 7] - corners[t, 1], corners[t, 8] - corners[t, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = math.sqrt(x * x + y * y + z * z)
    if size > 0.0:
        return x / size, y / size, z / size
    return 0.0, 0.0, 0.0


@inner
def settle(
    corners: Floats, across: Ints, seat: int, x: float, y: float, z: float
) -> tuple[float, float, float, int, float]:
    """(x, y, z, seat, squared distance): the nearest point of the sheet, walking from the triangle `seat`."""
    bx, by, bz, best = closest_on(corners, seat, x, y, z)
    for _ in range(_MOST_WALKS):
        into = -1
        for k in range(3):
            o = across[seat, k]
            if o >= 0:
                cx, cy, cz, d = closest_on(corners, o, x, y, z)
                if d < best:
                    bx, by, bz, best, into = cx, cy, cz, d, o
        if into < 0:
            break
        seat = into
    return bx, by, bz, seat, best


@kernel
def _nearest(corners: Floats, across: Ints, points: Floats, near: Ints, seat: Ints, away: Floats) -> None:
    for i in range(points.shape[0]):
        best = np.inf
        for j in range(near.shape[1]):
            found = settle(corners, across, near[i, j], points[i, 0], points[i, 1], points[i, 2])
            if found[4] < best:
                best, seat[i] = found[4], found[3]
        away[i] = math.sqrt(best)
