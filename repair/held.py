"""What must stay: the points and faces that no pass may move or swap through."""

from __future__ import annotations

from enum import IntFlag
from fnmatch import fnmatchcase
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, half_faces, nodes_of_cells
from meshwright.audit.errors import UsageError
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, Ints, Mesh
from meshwright.repair.outcome import Options
from meshwright.repair.sliding import sliding_points
from meshwright.repair.zoning import zone_numbers

__all__ = ["Hold", "border_faces", "edge_walls", "held_points", "holds", "sliding", "zone_walls"]

Mask = NDArray[np.bool_]

_found: WeakKeyDictionary[Mesh, dict[tuple[str, ...], NDArray[np.uint8]]] = WeakKeyDictionary()
"""What holds the points of a mesh, kept by the globs asked for: small beside the faces that it follows from."""


class Hold(IntFlag):
    """What can hold a point. A boundary or a border of zones that the file lists as elements has both bits."""

    BOUNDARY = 1
    """The boundary of the mesh."""
    BORDER = 2
    """A face between cells of different zones."""
    ELEMENT = 4
    """An element of lower dimension that the file lists."""
    POINTS = 8
    """A zone of points."""
    ASKED = 16
    """A zone that the user holds."""
    CURVED = 32
    """A cell of second order: its mid-side nodes would have to follow."""
    LAYER = 64
    """A wedge: layers move as columns or not at all."""


def border_faces(mesh: Mesh) -> Mask:
    """(faces,) the faces on the boundary and those between cells of different zones."""
    sides = faces(mesh)
    out: Mask = sides.neighbour == NO_CELL
    memberships = _memberships(mesh)
    if memberships is not None:
        inner = np.flatnonzero(~out)
        out[inner] = memberships[sides.owner[inner]] != memberships[sides.neighbour[inner]]
    return out


def _memberships(mesh: Mesh) -> Ints | None:
    """(n_cells,) a number for the zones that a cell is in, the same where they are the same; None where all are."""
    if not mesh.cell_zones:
        return None
    out = zone_numbers(mesh.cell_zones, mesh.n_cells)
    return out if out.any() else None


@kernel
def _apart(starts: Ints, other: Ints, memberships: Ints) -> Mask:
    """(half-faces,) those with a cell of other zones beyond."""
    out = np.zeros(other.size, np.bool_)
    for c in range(starts.size - 1):
        for h in range(starts[c], starts[c + 1]):
            out[h] = other[h] >= 0 and memberships[c] != memberships[other[h]]
    return out


def _borders(mesh: Mesh) -> Ints:
    """(k, 4) nodes of the sides between cells of different zones; -1 where one has fewer."""
    memberships = _memberships(mesh)
    if memberships is None:
        return np.empty((0, 4), np.int32)
    sides = half_faces(mesh)
    return sides.loops(_apart(sides.starts, sides.other, memberships))


def zone_walls(mesh: Mesh) -> Ints:
    """(k, 3) triangles that a swap may not remove: borders of zones, and surface elements that the file lists."""
    loops = _borders(mesh)
    walls = [loops[loops[:, 3] < 0, :3]]
    walls += [block.nodes[:, :3] for block in mesh.boundary if CELL_TYPES[block.type].corners == "tri"]
    return np.concatenate(walls)


def edge_walls(mesh: Mesh) -> Ints:
    """(k, 2) edges of a mesh of 2-D cells that a swap may not remove: borders of zones, and listed line elements."""
    walls = [_borders(mesh)[:, :2]]
    walls += [block.nodes[:, :2] for block in mesh.boundary if CELL_TYPES[block.type].corners == "line"]
    return np.concatenate(walls)


def sliding(mesh: Mesh, options: Options) -> Mask:
    """(n,) points of the boundary of tets that may move along it; none where the boundary is fixed.

    Nothing but the boundary holds them, and all their cells are linear tets.
    """
    out = sliding_points(mesh, options.boundary)
    if out.any():
        out &= (holds(mesh, options) | (Hold.BOUNDARY | Hold.ELEMENT).value) == (Hold.BOUNDARY | Hold.ELEMENT).value
        for block in mesh.blocks:
            if block.type != "tet":
                out[block.nodes.ravel()] = False
    return out


def held_points(mesh: Mesh, options: Options) -> Mask:
    """(n,) points that stay, whatever holds them; see `Hold`."""
    return holds(mesh, options) > 0


def holds(mesh: Mesh, options: Options) -> NDArray[np.uint8]:
    """(n,) what holds each point, bits of `Hold`; 0 where it may move.

    UsageError for a glob of `options.hold` that matches no zone.
    """
    found = _found.setdefault(mesh, {})
    if options.hold not in found:
        found[options.hold] = _holds(mesh, options)
    return found[options.hold]


def _outer_points(mesh: Mesh) -> tuple[Ints, Ints]:
    """Point rows on the boundary and on sides between cells of different zones, each maybe more than once."""
    if mesh.faces is None:
        sides = half_faces(mesh)
        loops, borders = sides.loops(sides.other == NO_CELL), _borders(mesh)
        return loops[loops >= 0], borders[borders >= 0]
    sizes, outside = np.diff(mesh.faces.offsets), mesh.faces.neighbour == NO_CELL
    between = border_faces(mesh) & ~outside
    return mesh.faces.nodes[np.repeat(outside, sizes)], mesh.faces.nodes[np.repeat(between, sizes)]


def _holds(mesh: Mesh, options: Options) -> NDArray[np.uint8]:
    held = np.zeros(len(mesh.points), np.uint8)
    outside, between = _outer_points(mesh)
    held[outside] |= Hold.BOUNDARY.value
    held[between] |= Hold.BORDER.value
    for block in mesh.boundary:
        named = block.nodes if block.items is None else block.items
        held[named.ravel()] |= Hold.ELEMENT.value
    for zone in mesh.zones:
        if zone.entity == "point":
            held[zone.members] |= Hold.POINTS.value
    for pattern in options.hold:
        matching = [zone for zone in mesh.zones if fnmatchcase(zone.name, pattern)]
        if not matching:
            names = ", ".join(sorted({zone.name for zone in mesh.zones})[:10]) or "none"
            raise UsageError(f"no zone matches {pattern!r}; the mesh has: {names}")
        for zone in matching:
            if zone.entity == "cell":
                chosen = np.zeros(mesh.n_cells, np.bool_)
                chosen[zone.members] = True
                offsets, nodes = nodes_of_cells(mesh)
                held[nodes[np.repeat(chosen, np.diff(offsets))]] |= Hold.ASKED.value
    for block in mesh.blocks:
        if CELL_TYPES[block.type].order > 1:
            held[block.nodes.ravel()] |= Hold.CURVED.value
        elif CELL_TYPES[block.type].corners == "wedge":
            held[block.nodes.ravel()] |= Hold.LAYER.value
    held.flags.writeable = False
    return held
