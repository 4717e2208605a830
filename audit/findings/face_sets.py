"""Which faces of the cells a zone or a boundary element stands for, and which zones are walls."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.csr import ragged, take
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, CellBlock, Ints, Mesh, Zone, index_array
from meshwright.audit.sets import hash_rows

__all__ = ["bordering", "faces_of_elements", "faces_of_zone", "named_faces", "wall_zones"]

_WALL = re.compile(r"(?<![a-z])walls?(?![a-z])", re.IGNORECASE)


def wall_zones(mesh: Mesh) -> tuple[Zone, ...]:
    """Face zones that are walls: by role, or by the word "wall" in the name where the format knows no roles."""
    return tuple(
        zone
        for zone in mesh.zones
        if zone.entity == "face" and (zone.role == "wall" or (not zone.role and _WALL.search(zone.name)))
    )


def faces_of_zone(mesh: Mesh, zone: Zone) -> Ints:
    """Rows of `connectivity.faces` in a face zone, ascending, each once; elements that are no face are left out."""
    if mesh.faces is not None:
        return index_array(np.unique(zone.members))
    rows = faces_of_elements(mesh)[zone.members]
    return index_array(np.unique(rows[rows >= 0]))


@once_per_mesh
def faces_of_elements(mesh: Mesh) -> Ints:
    """(n_boundary,) row of the face with the nodes of each boundary element, -1 where no cell has such a face.

    The first one where there are two, as on both sides of a baffle.
    """
    out = np.full(mesh.n_boundary, -1, dtype=np.int32)
    found = faces(mesh)
    marked = np.zeros(len(mesh.points), dtype=bool)
    tables = []
    for block in mesh.boundary:
        if CELL_TYPES[block.type].dimension == mesh.cell_dimension - 1 and len(block):
            offsets, nodes = _corners(block)
            marked[nodes] = True
            tables.append((block.rows, hash_rows(offsets, nodes)))
    if not tables:
        return index_array(out)
    near = index_array(np.flatnonzero(_all_marked(found.offsets, found.nodes, marked)))
    keys = hash_rows(*take(found.offsets, found.nodes, near))
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]
    for rows, wanted in tables:
        at = np.searchsorted(ranked, wanted)
        there = at < len(ranked)
        there[there] = ranked[at[there]] == wanted[there]
        out[rows[there]] = near[order[at[there]]]
    return index_array(out)


def _corners(block: CellBlock) -> tuple[Ints, Ints]:
    if block.items is not None:
        return ragged(block)
    nodes = block.nodes[:, : CELL_TYPES[block.type].n_corners]
    return index_array(np.arange(0, nodes.size + 1, nodes.shape[1])), index_array(nodes.ravel())


@kernel
def _all_marked(offsets: Ints, nodes: Ints, marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    out = np.empty(offsets.size - 1, np.bool_)
    for f in range(out.size):
        i = offsets[f]
        while i < offsets[f + 1] and marked[nodes[i]]:
            i += 1
        out[f] = i == offsets[f + 1]
    return out


@once_per_mesh
def named_faces(mesh: Mesh) -> NDArray[np.bool_]:
    """(f,) faces that a zone or a boundary element stands for.

    Not by Fluent's zones of interior faces, nor by OpenFOAM's faceZones, which only select.
    """
    named = np.zeros(len(faces(mesh)), dtype=bool)
    for zone in mesh.zones:
        if zone.entity == "face" and zone.role != "interior" and zone.kind != "faceZone" and mesh.faces is not None:
            named[zone.members] = True
    if mesh.boundary and mesh.faces is None:
        rows = faces_of_elements(mesh)
        named[rows[rows >= 0]] = True
    return named


def bordering(mesh: Mesh, rows: Ints) -> NDArray[np.bool_]:
    """Whether each of these inner faces lies between two cell zones, or in a zone or element of its own."""
    found = faces(mesh)
    out: NDArray[np.bool_] = named_faces(mesh)[rows].copy()
    if len(mesh.cell_zones) > 1:
        zone = mesh.cell_zone_index()
        inside = found.neighbour[rows] != NO_CELL
        out |= inside & (zone[found.owner[rows]] != zone[found.neighbour[rows]])
    return out
