"""`Hull`: the facets on the outside of a mesh, measured, and a tree of boxes around them.

Facets are the faces of solid cells, or the edges of flat and surface cells, that have a cell on one side only. A
surface mesh that is closed has none. Facets with a coordinate that is not finite are left out, and so are those of
more than two cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.connectivity import cell_components, faces, overused_faces
from meshwright.audit.csr import invert, take
from meshwright.audit.findings.hulls.boxes import Tree, box_tree
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, Ints, Mesh, index_array

__all__ = ["Hull", "mesh_hull"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hull:
    """m facets with k different nodes.

    kind: "face" of solid cells, "side" of a flat mesh, "rim" of a surface mesh (edges, both).
    rows (m,): of `connectivity.faces`.  offsets (m + 1,), nodes: of the facets, as numbers of hull points.
    points (k,): point rows, ascending.  x (k, 3): coordinates from the low corner of the hull, over `unit`, which is a
    power of two that brings them to the size of 1.  origin (3,): that corner.
    centre (m, 3): mean of the corners.  normal (m, 3): unit, outward as the cell turns it; 0 where there is no area,
    and on a rim.  area (m,): or length.  size (m,): shortest edge with a length.  reach (k,): shortest facet edge with
    a length at each point.
    """

    mesh: Mesh
    kind: str
    rows: Ints
    offsets: Ints
    nodes: Ints
    points: Ints
    x: Floats
    unit: float
    origin: Floats
    centre: Floats
    normal: Floats
    area: Floats
    size: Floats
    reach: Floats

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def words(self) -> tuple[str, str]:
        """What a facet is called, one and many."""
        return ("face", "faces") if self.kind == "face" else ("edge", "edges")

    @cached_property
    def owner(self) -> Ints:
        """(m,) cell row behind each facet."""
        return faces(self.mesh).owner[self.rows]

    @cached_property
    def part(self) -> Ints:
        """(m,) connected part of the mesh behind each facet."""
        return cell_components(self.mesh)[self.owner]

    @cached_property
    def outward(self) -> Floats:
        """(m, 3) `normal`, turned where the cells of a whole file are mirrored, by the sign of the volume inside."""
        inside = float(np.einsum("ij,ij,i->", self.centre, self.normal, self.area))
        return self.normal if inside >= 0.0 else -self.normal

    @cached_property
    def around(self) -> tuple[Ints, Ints]:
        """(offsets (k + 1,), items): the facets around each hull point."""
        return invert(self.offsets, self.nodes, len(self.points))

    @cached_property
    def tree(self) -> Tree:
        """Boxes of the facets."""
        return box_tree(*_boxes(self.x, self.offsets, self.nodes))

    @cached_property
    def point_tree(self) -> Tree:
        """The points themselves."""
        return box_tree(self.x, self.x)


@once_per_mesh
def mesh_hull(mesh: Mesh) -> Hull:
    """The hull of a mesh."""
    found = faces(mesh)
    outside = found.neighbour == NO_CELL
    outside[overused_faces(mesh)] = False
    rows = np.flatnonzero(outside)
    offsets, nodes = take(found.offsets, found.nodes, index_array(rows))
    if mesh.n_nonfinite and len(rows):
        lost = np.asarray(~np.isfinite(mesh.points).all(axis=1))
        rows = rows[~np.logical_or.reduceat(lost[nodes], offsets[:-1])]
        offsets, nodes = take(found.offsets, found.nodes, index_array(rows))
    used = np.zeros(len(mesh.points), dtype=bool)
    used[nodes] = True
    points = np.flatnonzero(used)
    place = np.cumsum(used, dtype=np.int32) - 1
    local = index_array(place[nodes])
    x, unit = _scaled(mesh.points[points])
    origin = mesh.points[points].min(axis=0) if len(points) else np.zeros(3)
    kind = "face" if mesh.cell_dimension == 3 else "side" if mesh.dimension == 2 else "rim"
    m = len(rows)
    measured = np.zeros((m, 3)), np.zeros((m, 3)), np.zeros(m), np.zeros(m), np.full(len(points), np.inf)
    _measure(x, offsets, local, kind == "side", *measured)
    return Hull(mesh, kind, index_array(rows), offsets, local, index_array(points), x, unit, origin, *measured)


def _scaled(points: Floats) -> tuple[Floats, float]:
    """Coordinates from their low corner over a power of two, and that power; no overflow on the way."""
    if not len(points):
        return np.empty((0, 3)), 1.0
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float(np.max(0.5 * high - 0.5 * low))
    if extent == 0.0:
        return points - low, 1.0
    exponent = min(max(math.frexp(extent)[1] + 1, -1020), 1020)
    half = exponent // 2  # 2**-exponent may overflow by itself
    scaled = np.ldexp(np.ldexp(0.5 * points - 0.5 * low, -half), half - exponent + 1)
    return np.ascontiguousarray(scaled), math.ldexp(1.0, exponent)


@kernel
def _measure(
    x: Floats,
    offsets: Ints,
    nodes: Ints,
    flat: bool,
    centre: Floats,
    normal: Floats,
    area: Floats,
    size: Floats,
    reach: Floats,
) -> None:
    for f in range(area.size):
        first, last = offsets[f], offsets[f + 1]
        n = last - first
        o = nodes[first]
        ax = ay = az = 0.0
        shortest = np.inf
        p = nodes[last - 1]
        for i in range(first, last):
            q = nodes[i]
            ux, uy, uz = x[p, 0] - x[o, 0], x[p, 1] - x[o, 1], x[p, 2] - x[o, 2]
            vx, vy, vz = x[q, 0] - x[o, 0], x[q, 1] - x[o, 1], x[q, 2] - x[o, 2]
            ax += uy * vz - uz * vy
            ay += uz * vx - ux * vz
            az += ux * vy - uy * vx
            length = np.sqrt((vx - ux) ** 2 + (vy - uy) ** 2 + (vz - uz) ** 2)
            if length > 0.0:
                shortest = min(shortest, length)
                reach[p] = min(reach[p], length)
                reach[q] = min(reach[q], length)
            for d in range(3):
                centre[f, d] += (x[q, d] - x[o, d]) / n
            p = q
        for d in range(3):
            centre[f, d] += x[o, d]
        if n == 2:
            q = nodes[last - 1]
            ax, ay, az = (x[q, 1] - x[o, 1], x[o, 0] - x[q, 0], 0.0) if flat else (0.0, 0.0, 0.0)
            area[f] = shortest if shortest < np.inf else 0.0
            ax, ay, az = 2.0 * ax, 2.0 * ay, 2.0 * az
        length = np.sqrt(ax * ax + ay * ay + az * az)
        if n > 2:
            area[f] = 0.5 * length
        if length > 0.0:
            normal[f, 0], normal[f, 1], normal[f, 2] = ax / length, ay / length, az / length
        size[f] = shortest if shortest < np.inf else 0.0


@kernel
def _boxes(x: Floats, offsets: Ints, nodes: Ints) -> tuple[Floats, Floats]:
    m = offsets.size - 1
    low, high = np.full((m, 3), np.inf), np.full((m, 3), -np.inf)
    for f in range(m):
        for i in range(offsets[f], offsets[f + 1]):
            for d in range(3):
                low[f, d] = min(low[f, d], x[nodes[i], d])
                high[f, d] = max(high[f, d], x[nodes[i], d])
    return low, high
