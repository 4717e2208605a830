"""Which cells, faces and points the conditions of a limit leave."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces, nodes_of_cells
from meshwright.audit.errors import printable
from meshwright.audit.findings.face_sets import faces_of_zone, wall_zones
from meshwright.audit.mesh import NO_CELL, Ints, Mesh, Zone
from meshwright.audit.places import Places
from meshwright.audit.profiles.model import Layers, Near, Where

__all__ = ["NoMatchError", "Part", "cells_of", "matching", "parts"]

Mask = NDArray[np.bool_]
Floats = NDArray[np.float64]

_MOST_NAMES = 20


class NoMatchError(Exception):
    """The conditions leave nothing.  misnamed: because a name of theirs is not in the mesh."""

    def __init__(self, reason: str, *, misnamed: bool) -> None:
        super().__init__(reason)
        self.misnamed = misnamed


@dataclass(frozen=True, eq=False)
class Part:
    """What one rule looks at.  zone: the one it is judged on by itself, "" for all that match."""

    zone: str
    places: Places


def matching(names: tuple[str, ...], zones: tuple[Zone, ...]) -> list[Zone]:
    """The zones with one of these names, or that match a pattern; a name that is there stands for itself alone."""
    there = {zone.name for zone in zones}
    return [
        zone
        for zone in zones
        if any(zone.name == name or (name not in there and fnmatch.fnmatchcase(zone.name, name)) for name in names)
    ]


def cells_of(mesh: Mesh, zones: list[Zone]) -> Mask:
    """(n_cells,) cells in one of these zones of cells."""
    mask = np.zeros(mesh.n_cells, dtype=bool)
    for zone in zones:
        mask[zone.members] = True
    return mask


def parts(mesh: Mesh, where: Where, entity: str, chosen: Mask | None, *, each: bool = False) -> Iterator[Part]:
    """The parts of a mesh that a limit on cells, faces or points is judged on.

    chosen: (n_cells,) cells to look at, None for all.  each: every zone of cells by itself.  NoMatchError where the
    conditions leave no cell. Faces and points are those around the cells; a condition on zones of faces means these.
    """
    if not where and not each:
        yield Part("", Places(mesh, chosen))
        return
    mask = np.ones(mesh.n_cells, dtype=bool) if chosen is None else chosen.copy()
    cell_zones, face_zones = _zones(mesh, where, entity)
    sides = None
    if face_zones:
        sides = np.zeros(len(faces(mesh)), dtype=bool)
        for zone in face_zones:
            sides[faces_of_zone(mesh, zone)] = True
        if cell_zones:
            sides |= _around(mesh, cells_of(mesh, cell_zones))
    elif where.zones or where.roles:
        mask &= cells_of(mesh, cell_zones)
    if where.layers is not None:
        mask &= _in_layers(mesh, where.layers)
    if where.near is not None:
        mask &= _near(mesh, where.near)
    if not mask.any() or (sides is not None and not sides.any()):
        raise NoMatchError(f"no cell matches: {where.words}", misnamed=False)
    if not each:
        yield Part("", Places(mesh, mask, sides))
        return
    homeless = mask.copy()
    found = False
    for zone in cell_zones:
        here = np.zeros(mesh.n_cells, dtype=bool)
        here[zone.members] = mask[zone.members]
        homeless[zone.members] = False
        if here.any():
            found = True
            yield Part(zone.name, Places(mesh, here))
    if not where.zones and not where.roles and homeless.any():
        found = True
        yield Part("(no zone)", Places(mesh, homeless))
    if not found:
        raise NoMatchError("no zone of cells matches", misnamed=False)


def _zones(mesh: Mesh, where: Where, entity: str) -> tuple[list[Zone], list[Zone]]:
    """The zones of cells, and for a limit on faces those of faces, that names and roles leave."""
    there = tuple(zone for zone in mesh.zones if zone.entity == "cell" or (zone.entity == "face" and entity == "face"))
    found = list(there)
    if where.zones:
        found = matching(where.zones, there)
        if not found:
            raise NoMatchError(f"no zone is called {_quoted(where.zones)}; {_names(there)}", misnamed=True)
    if where.roles:
        roles = sorted({zone.role for zone in there if zone.role})
        if not set(roles) & set(where.roles):
            said = ", ".join(map(printable, roles)) or "none"
            raise NoMatchError(f"no zone has the role {_quoted(where.roles)}; roles here: {said}", misnamed=True)
        found = [zone for zone in found if zone.role in where.roles]
        if not found:
            raise NoMatchError(f"no zone matches: {where.words}", misnamed=False)
    if not where.zones and not where.roles:
        return [zone for zone in found if zone.entity == "cell"], []
    return [zone for zone in found if zone.entity == "cell"], [zone for zone in found if zone.entity == "face"]


def _quoted(names: tuple[str, ...]) -> str:
    return " or ".join(repr(printable(name)) for name in names)


def _names(zones: tuple[Zone, ...]) -> str:
    shown = ", ".join(printable(zone.name, 40) for zone in zones[:_MOST_NAMES])
    more = f" and {len(zones) - _MOST_NAMES} more" if len(zones) > _MOST_NAMES else ""
    return f"zones of this mesh: {shown}{more}" if zones else "this mesh has no such zones"


def _around(mesh: Mesh, cells: Mask) -> Mask:
    found = faces(mesh)
    mask: Mask = cells[found.owner] | ((found.neighbour != NO_CELL) & cells[found.neighbour])
    return mask


def _in_layers(mesh: Mesh, layers: Layers) -> Mask:
    """Cells of the first layers on some walls: those that lie on them, their neighbours over faces, and so on."""
    walls = wall_zones(mesh)
    zones = list(walls) if layers.of == "*" else matching((layers.of,), _faces_zones(mesh))
    if not zones:
        there = walls if layers.of == "*" else _faces_zones(mesh)
        what = "no zone is a wall" if layers.of == "*" else f"no zone of faces is called {_quoted((layers.of,))}"
        raise NoMatchError(f"{what}; {_names(there)}", misnamed=True)
    found = faces(mesh)
    inside = found.neighbour != NO_CELL
    owner, neighbour = found.owner[inside], found.neighbour[inside]
    mask = np.zeros(mesh.n_cells, dtype=bool)
    for zone in zones:
        rows = faces_of_zone(mesh, zone)
        mask[found.owner[rows]] = True
        across = found.neighbour[rows]
        mask[across[across != NO_CELL]] = True
    for _ in range(layers.at_most - 1):
        grown = mask.copy()
        grown[neighbour[mask[owner]]] = True
        grown[owner[mask[neighbour]]] = True
        if np.array_equal(grown, mask):
            break
        mask = grown
    return mask


def _faces_zones(mesh: Mesh) -> tuple[Zone, ...]:
    return tuple(zone for zone in mesh.zones if zone.entity == "face")


def _near(mesh: Mesh, near: Near) -> Mask:
    """Cells by the distance of their nearest corner to the nearest corner of some zones."""
    from scipy.spatial import cKDTree  # noqa: PLC0415 - slow to import, wanted by few limits

    zones = matching((near.to,), mesh.zones)
    if not zones:
        raise NoMatchError(f"no zone is called {_quoted((near.to,))}; {_names(mesh.zones)}", misnamed=True)
    targets = np.unique(np.concatenate([_points_of(mesh, zone) for zone in zones]))
    targets = targets[np.isfinite(mesh.points[targets]).all(axis=1)]
    offsets, nodes = nodes_of_cells(mesh)
    distance = np.full(len(mesh.points), np.inf)
    sound = np.isfinite(mesh.points).all(axis=1)
    if len(targets):
        distance[sound] = cKDTree(mesh.points[targets]).query(mesh.points[sound], workers=1)[0]
    of_cell: Floats = np.minimum.reduceat(distance[nodes], offsets[:-1])
    mask = np.ones(mesh.n_cells, dtype=bool)
    if near.at_most is not None:
        mask &= of_cell <= near.at_most
    if near.at_least is not None:
        mask &= of_cell >= near.at_least
    return mask


def _points_of(mesh: Mesh, zone: Zone) -> Ints:
    """Rows of the points of a zone of points, cells or faces."""
    if zone.entity == "point":
        return zone.members
    if zone.entity == "cell":
        table, rows = nodes_of_cells(mesh), zone.members
    else:
        found = faces(mesh)
        table, rows = (found.offsets, found.nodes), faces_of_zone(mesh, zone)
    offsets, nodes = table
    mask = np.zeros(len(offsets) - 1, dtype=bool)
    mask[rows] = True
    return nodes[np.repeat(mask, np.diff(offsets))]
