"""What must stay: the points and faces that no pass may move or swap through."""

from __future__ import annotations

from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, nodes_of_cells
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import NO_CELL, Ints, Mesh
from meshwright.repair.outcome import Options

__all__ = ["border_faces", "edge_walls", "held_points", "zone_walls"]

Mask = NDArray[np.bool_]


def border_faces(mesh: Mesh) -> Mask:
    """(faces,) the faces on the boundary and those between cells of different zones."""
    sides = faces(mesh)
    out: Mask = sides.neighbour == NO_CELL
    memberships = np.zeros(mesh.n_cells, np.int64)
    for zone in mesh.cell_zones:
        inside = np.zeros(mesh.n_cells, np.int64)
        inside[zone.members] = 1
        _, memberships = np.unique(2 * memberships + inside, return_inverse=True)
    if mesh.cell_zones:
        inner = np.flatnonzero(~out)
        out[inner] = memberships[sides.owner[inner]] != memberships[sides.neighbour[inner]]
    return out


def zone_walls(mesh: Mesh) -> Ints:
    """(k, 3) triangles that a swap may not remove: borders of zones, and surface elements that the file lists."""
    sides = faces(mesh)
    rows = np.flatnonzero(border_faces(mesh) & (sides.neighbour != NO_CELL) & (np.diff(sides.offsets) == 3))
    walls = [sides.nodes[sides.offsets[rows].astype(np.int64)[:, None] + np.arange(3)]]
    walls += [block.nodes[:, :3] for block in mesh.boundary if CELL_TYPES[block.type].corners == "tri"]
    return np.concatenate(walls).astype(np.int64)


def edge_walls(mesh: Mesh) -> Ints:
    """(k, 2) edges of a mesh of 2-D cells that a swap may not remove: borders of zones, and listed line elements."""
    sides = faces(mesh)
    rows = np.flatnonzero(border_faces(mesh) & (sides.neighbour != NO_CELL))
    walls = [sides.nodes[sides.offsets[rows].astype(np.int64)[:, None] + np.arange(2)]]
    walls += [block.nodes[:, :2] for block in mesh.boundary if CELL_TYPES[block.type].corners == "line"]
    return np.concatenate(walls).astype(np.int64)


def held_points(mesh: Mesh, options: Options) -> Mask:
    """(n,) points that stay: boundary, borders of zones, listed elements, point zones, and the zones of `hold`."""
    held: Mask = np.zeros(len(mesh.points), np.bool_)
    sides = faces(mesh)
    inside = np.repeat(border_faces(mesh), np.diff(sides.offsets))
    held[sides.nodes[inside]] = True
    for block in mesh.boundary:
        held[block.nodes if block.items is None else block.items] = True
    offsets, nodes = nodes_of_cells(mesh)
    for zone in mesh.zones:
        if zone.entity == "point":
            held[zone.members] = True
    for pattern in options.hold:
        matching = [zone for zone in mesh.zones if fnmatchcase(zone.name, pattern)]
        if not matching:
            names = ", ".join(sorted({zone.name for zone in mesh.zones})[:10]) or "none"
            raise UsageError(f"no zone matches {pattern!r}; the mesh has: {names}")
        for zone in matching:
            if zone.entity == "cell":
                chosen = np.zeros(mesh.n_cells, np.bool_)
                chosen[zone.members] = True
                held[nodes[np.repeat(chosen, np.diff(offsets))]] = True
    for block in mesh.blocks:
        if CELL_TYPES[block.type].order > 1:
            held[block.nodes] = True  # mid-side nodes would have to follow their corners
        elif CELL_TYPES[block.type].corners == "wedge":
            held[block.nodes] = True  # layers move as columns or not at all
    return held
