"""`Shells`: the connected pieces of a surface mesh, and whether each of them encloses a volume."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, nodes_of_cells, overused_faces
from meshwright.audit.csr import take
from meshwright.audit.findings.hulls.nesting import nesting
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, Ints, Mesh, index_array
from meshwright.audit.orientation import traversed_alike
from meshwright.audit.places import plain
from meshwright.audit.sets import find_parts, hash_rows

__all__ = ["Shells", "mesh_shells"]

Floats = NDArray[np.float64]

_MOST_LISTED = 100


@dataclass(frozen=True, eq=False)
class Shells:
    """s pieces of a surface, connected through edges, those of more than two cells too; by their first cell.

    shell (n_cells,): number of the piece of each cell.  cells, free, crowded, turned (s,): its cells, edges of one
    cell, edges of more than two, edges that both cells traverse the same way.  area (s,).  volume (s,): enclosed,
    positive where normals look outward; nan unless closed, manifold and consistent.  sense (s,): its sign, which
    is there where the volume itself is too small for a float; 0 where nan.  low, high (s, 3).
    inside (s,): the smallest other watertight piece that a watertight one lies in, -1 for none.  depth (s,): in how
    many.
    """

    shell: Ints
    cells: Ints
    free: Ints
    crowded: Ints
    turned: Ints
    area: Floats
    volume: Floats
    sense: Floats
    low: Floats
    high: Floats
    inside: Ints
    depth: Ints

    @property
    def watertight(self) -> NDArray[np.bool_]:
        """(s,) every edge has two cells."""
        return (self.free == 0) & (self.crowded == 0)

    def table(self, mesh: Mesh) -> dict[str, Any]:
        """Figures of the pieces, those that are not watertight first, larger ones first."""
        order = np.lexsort((-self.cells, self.watertight))
        first = np.unique(self.shell, return_index=True)[1]
        rows = [self._row(mesh, k, int(first[k])) for k in order[:_MOST_LISTED].tolist()]
        return {"shells": len(self.cells), "watertight": int(np.count_nonzero(self.watertight)), "table": rows}

    def _row(self, mesh: Mesh, k: int, first: int) -> dict[str, Any]:
        return {
            "shell": k,
            "first_cell": int(mesh.ids_of_cells(first)),
            "cells": int(self.cells[k]),
            "watertight": bool(self.watertight[k]),
            "closed": bool(self.free[k] == 0),
            "manifold": bool(self.crowded[k] == 0),
            "oriented": bool(self.turned[k] == 0),
            "open_edges": int(self.free[k]),
            "nonmanifold_edges": int(self.crowded[k]),
            "inconsistent_edges": int(self.turned[k]),
            "area": plain(self.area[k]),
            "volume": None if math.isnan(self.volume[k]) else plain(self.volume[k]),
            "low": [plain(x) for x in self.low[k]],
            "high": [plain(x) for x in self.high[k]],
            "inside": None if self.inside[k] < 0 else int(self.inside[k]),
            "depth": int(self.depth[k]),
        }


_one_at_a_time = threading.Lock()


def mesh_shells(mesh: Mesh) -> Shells:
    """The shells of a surface mesh: checks that run side by side wait for the first of them to find out."""
    with _one_at_a_time:
        return _shells(mesh)


@once_per_mesh
def _shells(mesh: Mesh) -> Shells:
    found = faces(mesh)
    crowd = overused_faces(mesh)
    owner, neighbour = found.owner, found.neighbour
    joints = index_array([])
    if len(crowd):  # cells around one edge: its faces in a row
        keys = hash_rows(*take(found.offsets, found.nodes, crowd))
        order = np.argsort(keys, kind="stable")
        crowd, keys = crowd[order], keys[order]
        again = np.flatnonzero(keys[1:] == keys[:-1])
        owner = np.concatenate([owner, owner[crowd[again]]])
        neighbour = np.concatenate([neighbour, owner[crowd[again + 1]]])
        joints = crowd[np.append(True, keys[1:] != keys[:-1])]
    shell = find_parts(owner, neighbour, mesh.n_cells)
    n = int(shell.max()) + 1
    alone = found.neighbour == NO_CELL
    alone[crowd] = False

    def tally(rows: Ints) -> Ints:
        return np.bincount(shell[found.owner[rows]], minlength=n)

    free, crowded = tally(np.flatnonzero(alone)), tally(joints)
    turns = np.flatnonzero(traversed_alike(mesh))
    turned = tally(turns[~np.isin(turns, crowd)])
    offsets, nodes = nodes_of_cells(mesh)
    corners = np.diff(offsets)
    for block in mesh.blocks:
        if block.items is None:
            corners[block.rows] = CELL_TYPES[block.type].n_corners
    scale = _scale(mesh)
    area, volume = np.zeros(n), np.zeros(n)
    low, high = np.full((n, 3), np.inf), np.full((n, 3), -np.inf)
    _measure(mesh.points, offsets, nodes, corners, shell, scale, area, volume, low, high)
    whole = (free == 0) & (crowded == 0)
    turn = np.sign(volume)
    with np.errstate(over="ignore"):
        area, volume = area / scale / scale, volume / scale / scale / scale
    volume[~whole | (turned > 0)] = np.nan
    turn[~whole | (turned > 0)] = 0
    inside, depth = nesting(mesh.points, offsets, nodes, corners, shell, whole, low, high)
    return Shells(
        shell, np.bincount(shell, minlength=n), free, crowded, turned, area, volume, turn, low, high, inside, depth
    )


def _scale(mesh: Mesh) -> float:
    """A power of two that keeps products of three lengths in range; 1 for ordinary sizes."""
    size = float(np.max(np.abs(mesh.points), where=np.isfinite(mesh.points), initial=0.0))
    if 1e-60 < size < 1e60 or size == 0.0:
        return 1.0
    return math.ldexp(1.0, -max(min(math.frexp(size)[1], 1020), -1020))


@kernel
def _measure(
    points: Floats,
    offsets: Ints,
    nodes: Ints,
    corners: Ints,
    shell: Ints,
    scale: float,
    area: Floats,
    volume: Floats,
    low: Floats,
    high: Floats,
) -> None:
    """Add up areas and volumes, over the scale; cells are fans of triangles about their first corner."""
    origin = np.full(area.size, -1)
    for c in range(corners.size):
        s, first = shell[c], offsets[c]
        o = nodes[first]
        if origin[s] < 0:
            origin[s] = o
        k = origin[s]
        ox, oy, oz = (
            scale * (points[o, 0] - points[k, 0]),
            scale * (points[o, 1] - points[k, 1]),
            scale * (points[o, 2] - points[k, 2]),
        )
        ax = ay = az = 0.0
        for i in range(first, first + corners[c]):
            p = nodes[i]
            for d in range(3):
                low[s, d] = min(low[s, d], points[p, d])
                high[s, d] = max(high[s, d], points[p, d])
        for i in range(first + 1, first + corners[c] - 1):
            p, q = nodes[i], nodes[i + 1]
            ux, uy, uz = (
                scale * (points[p, 0] - points[o, 0]),
                scale * (points[p, 1] - points[o, 1]),
                scale * (points[p, 2] - points[o, 2]),
            )
            vx, vy, vz = (
                scale * (points[q, 0] - points[o, 0]),
                scale * (points[q, 1] - points[o, 1]),
                scale * (points[q, 2] - points[o, 2]),
            )
            ax += uy * vz - uz * vy
            ay += uz * vx - ux * vz
            az += ux * vy - uy * vx
        area[s] += 0.5 * np.sqrt(ax * ax + ay * ay + az * az)
        volume[s] += (ox * ax + oy * ay + oz * az) / 6.0
