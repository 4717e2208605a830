"""Where a number of a summary was measured: the file's own number of the cell, face or point, its zone, its place."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, nodes_of_cells
from meshwright.audit.mesh import NO_CELL, CellBlock, Ints, Mesh

__all__ = ["Places", "place", "plain", "short", "text"]

_LONGEST = 1000

Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]


def plain(value: float) -> float | str:
    """A number as JSON holds it: what JSON lacks is spelled."""
    if math.isnan(value):
        return "nan"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return float(value)


def text(name: str) -> str:
    """A name that can be written as UTF-8, whatever bytes it came from."""
    return name.encode("utf-8", "replace").decode("utf-8")


def short(name: str) -> str:
    """A name for lists, where it stands many times: one of more than 1,000 characters is cut, with an ellipsis."""
    known = text(name[:_LONGEST])
    return known if len(name) <= _LONGEST else f"{known[:-1]}…"


def place(mesh: Mesh, entity: str, row: int, of_boundary: bool = False) -> list[float]:
    """Mean of the corners of a cell, face, edge (the face of a 2-D cell) or boundary element, or the point itself."""
    if entity == "point":
        nodes: Ints = np.array([row])
    elif entity == "cell" or of_boundary:
        for block in mesh.boundary if of_boundary else mesh.blocks:
            at = int(np.searchsorted(block.rows, row))
            if at < len(block) and block.rows[at] == row:
                nodes = _corners(mesh, block, at)
                break
    else:
        found = faces(mesh)
        nodes = found.nodes[found.offsets[row] : found.offsets[row + 1]]
    with np.errstate(invalid="ignore", over="ignore"):
        return mesh.points[nodes].mean(axis=0).tolist()


class Places:
    """The entities that a summary counts, by the keys of `Measured.values`: cell types, "face", "point".

    chosen: (n_cells,) the cells to count, with the faces and points around them; None for all.
    sides: (f,) the faces to count in place of all those around the cells.
    """

    def __init__(self, mesh: Mesh, chosen: Mask | None, sides: Mask | None = None) -> None:
        self._mesh = mesh
        self._cells = chosen
        self._sides = sides

    def without(self, cells: Mask) -> Places:
        """The same, but for these (n_cells,) cells."""
        keep = ~cells if self._cells is None else self._cells & ~cells
        return Places(self._mesh, keep, self._sides)

    def chosen(self, key: str, domain: Rows | None) -> Rows | None:
        """Rows of the values to count: those of the domain around chosen cells; None for all."""
        mask = self._mask(key)
        if mask is None:
            return domain
        return np.flatnonzero(mask) if domain is None else domain[mask[domain]]

    def describe(self, key: str, row: int, value: float | str) -> dict[str, Any]:
        """An entry of a list of worst values: {"cell" or "face" or "point": number, value, zone, centroid}."""
        label, number, zone, nodes = self._entity(key, row)
        with np.errstate(invalid="ignore", over="ignore"):
            centroid = self._mesh.points[nodes].mean(axis=0).tolist()
        return {label: number, "value": value, "zone": zone, "centroid": [plain(x) for x in centroid]}

    def _entity(self, key: str, row: int) -> tuple[str, int, str | None, Ints]:
        mesh = self._mesh
        if key == "face":
            found = faces(mesh)
            number = row if found.ids is None else int(found.ids[row])
            return "face", number, self._zone("face", row), found.nodes[found.offsets[row] : found.offsets[row + 1]]
        if key == "point":
            number = row if mesh.point_ids is None else int(mesh.point_ids[row])
            return "point", number, self._zone("point", row), np.array([row])
        block = mesh.block(key)
        cell = int(block.rows[row])
        zone = int(self._zone_of_cell[cell])
        name = None if zone < 0 else short(mesh.cell_zones[zone].name)
        return "cell", int(mesh.ids_of_cells(cell)), name, _corners(mesh, block, row)

    def _mask(self, key: str) -> Mask | None:
        if self._cells is None:
            return None
        if key == "face":
            return self._face_mask
        if key == "point":
            return self._point_mask
        return self._cells[self._mesh.block(key).rows]

    @cached_property
    def _face_mask(self) -> Mask:
        found, chosen = faces(self._mesh), self._cells
        assert chosen is not None  # noqa: S101 - `_mask` has seen to it
        mask: Mask = chosen[found.owner] | ((found.neighbour != NO_CELL) & chosen[found.neighbour])
        return mask if self._sides is None else mask & self._sides

    @cached_property
    def _point_mask(self) -> Mask:
        offsets, nodes = nodes_of_cells(self._mesh)
        assert self._cells is not None  # noqa: S101 - `_mask` has seen to it
        mask = np.zeros(len(self._mesh.points), dtype=bool)
        mask[nodes[np.repeat(self._cells, np.diff(offsets))]] = True
        return mask

    @cached_property
    def _zone_of_cell(self) -> Ints:
        return self._mesh.cell_zone_index()

    def _zone(self, entity: str, row: int) -> str | None:
        """The first zone of faces or points that holds the row. Zones of a cell-based mesh number its elements."""
        if entity == "face" and self._mesh.faces is None:
            return None
        for zone in self._mesh.zones:
            if zone.entity == entity and bool(np.any(zone.members == row)):
                return short(zone.name)
        return None


def _corners(mesh: Mesh, block: CellBlock, place: int) -> Ints:
    """Rows of the corners of a cell of any shape, whose mean exists for collapsed ones too."""
    if block.offsets is None or block.items is None:
        return block.nodes[place][: CELL_TYPES[block.type].n_corners]
    items = block.items[block.offsets[place] : block.offsets[place + 1]]
    if block.type == "polygon" or mesh.faces is None:
        return items
    own = mesh.faces
    return np.unique(np.concatenate([own.nodes[own.offsets[face] : own.offsets[face + 1]] for face in items]))
