"""The boundary of a mesh as a mesh of its own: a shell of the surface elements, sharing the points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.mesh import NO_CELL, CellBlock, Faces, Mesh, Zone

__all__ = ["blocks_of_faces", "boundary_mesh"]

_BY_WIDTH = {2: "line", 3: "tri", 4: "quad"}


def boundary_mesh(mesh: Mesh) -> Mesh | None:
    """A shell of the surface elements of a 3-D mesh, or None where there is nothing to measure.

    The surface elements that the file lists are taken; a face-based file without any gives its boundary faces and
    those of walls with cells on both sides (a heated body, a baffle); any other file the faces that only one cell has.
    Points are shared with `mesh`, row by row; cell ids are the file's numbers of the elements or faces, or count the
    faces where the file has none; face zones become cell zones, of the members that lie in the surface.
    """
    if mesh.cell_dimension != 3:
        return None
    listed = tuple(block for block in mesh.boundary if CELL_TYPES[block.type].dimension == 2)
    if listed:
        old_rows = np.sort(np.concatenate([block.rows for block in listed]))
        blocks = tuple(_renumbered(block, old_rows) for block in listed)
        ids = old_rows if mesh.boundary_ids is None else mesh.boundary_ids[old_rows]
        zones_follow = mesh.faces is None
    else:
        sides = faces(mesh)
        zones_follow = mesh.faces is not None
        outside = _on_surface(mesh, sides) if zones_follow else sides.neighbour == NO_CELL
        old_rows = np.flatnonzero(outside)
        blocks = blocks_of_faces(sides, old_rows)
        ids = old_rows if sides.ids is None else sides.ids[old_rows]
    if not blocks:
        return None
    zones = tuple(_restricted(zone, old_rows) for zone in mesh.zones if zone.entity == "face") if zones_follow else ()
    return Mesh(
        points=mesh.points,
        blocks=blocks,
        zones=tuple(zone for zone in zones if len(zone.members)),
        cell_ids=ids,
        point_ids=mesh.point_ids,
        path=mesh.path,
        format=mesh.format,
    )


def _on_surface(mesh: Mesh, sides: Faces) -> NDArray[np.bool_]:
    outside: NDArray[np.bool_] = sides.neighbour == NO_CELL
    for zone in mesh.zones:
        if zone.entity == "face" and zone.role == "wall":
            outside[zone.members] = True
    return outside


def _renumbered(block: CellBlock, old_rows: NDArray) -> CellBlock:
    return CellBlock(block.type, np.searchsorted(old_rows, block.rows), block.nodes, block.offsets, block.items)


def blocks_of_faces(sides: Faces, rows: NDArray) -> tuple[CellBlock, ...]:
    """Lines (the faces of 2-D cells), triangles, quadrilaterals and polygons of these faces, in their order."""
    widths = np.diff(sides.offsets)[rows]
    blocks = []
    for width, name in _BY_WIDTH.items():
        at = np.flatnonzero(widths == width)
        if len(at):
            start = sides.offsets[rows[at]].astype(np.int64)
            blocks.append(CellBlock(name, at, sides.nodes[start[:, None] + np.arange(width)]))
    at = np.flatnonzero(widths > 4)
    if len(at):
        offsets = np.concatenate([[0], np.cumsum(widths[at], dtype=np.int64)])
        start = sides.offsets[rows[at]].astype(np.int64)
        items = sides.nodes[np.repeat(start - offsets[:-1], widths[at]) + np.arange(offsets[-1])]
        blocks.append(CellBlock("polygon", at, offsets=offsets, items=items))
    return tuple(blocks)


def _restricted(zone: Zone, old_rows: NDArray) -> Zone:
    inside = zone.members[np.isin(zone.members, old_rows)]
    return Zone(zone.name, zone.kind, zone.role, "cell", np.searchsorted(old_rows, inside), zone.id)
