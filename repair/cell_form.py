"""A mesh that is given by its faces (Fluent, OpenFOAM) as one given by its cells, which passes can rewire."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from meshwright.audit.errors import printable
from meshwright.audit.mesh import NO_CELL, Mesh, Zone
from meshwright.audit.surface import blocks_of_faces
from meshwright.repair.face_order import order_faces

__all__ = ["in_cell_form"]


def in_cell_form(mesh: Mesh) -> tuple[Mesh, tuple[str, ...]]:
    """(mesh, notes): its boundary faces, and those of every zone that is not interior, become boundary elements.

    The very mesh where it has no faces of its own, or has polyhedra or polygons, which are nothing but their faces.
    notes: a sentence for each zone that is left out.
    """
    faces = mesh.faces
    if faces is None or any(block.items is not None for block in mesh.blocks):
        return mesh, ()
    chosen = faces.neighbour == NO_CELL
    listed = [zone for zone in mesh.zones if zone.entity == "face"]
    for zone in listed:
        if zone.role != "interior":
            chosen[zone.members] = True
    rows = np.flatnonzero(chosen)
    zones: list[Zone] = []
    notes = []
    for zone in mesh.zones:
        if zone.entity != "face":
            zones.append(zone)
        elif zone.role == "interior":
            notes.append(f"zone {printable(zone.name, 100)!r} is left out: its inner faces follow from the cells")
        else:
            zones.append(replace(zone, members=np.searchsorted(rows, zone.members)))
    turned = order_faces(mesh).changed
    if turned:
        notes.append(f"{turned} faces looked into the cell that owns them: what is written follows from the cells")
    fresh = replace(mesh, faces=None, boundary=blocks_of_faces(faces, rows), boundary_ids=None, zones=tuple(zones))
    return fresh, tuple(notes)
