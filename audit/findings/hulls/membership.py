"""Which zones the facets of a hull belong to, and how the sides of a contact are told apart in a report."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.csr import uniform_offsets
from meshwright.audit.mesh import Ints, Mesh, Zone, index_array
from meshwright.audit.places import text
from meshwright.audit.sets import hash_rows

__all__ = ["Membership", "element_faces"]


def element_faces(mesh: Mesh) -> Ints:
    """(n_boundary,) row of `connectivity.faces` that each boundary element lies on, -1 for none.

    A face and an element are one when they have the same corners.
    """
    found = faces(mesh)
    at = np.full(mesh.n_boundary, -1, np.int64)
    width = 3 if mesh.cell_dimension == 3 else 2
    listed = [block for block in mesh.boundary if CELL_TYPES[block.type].dimension == width - 1 and len(block)]
    if not listed:
        return at
    keys = hash_rows(found.offsets, found.nodes)
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    for block in listed:
        if block.items is None or block.offsets is None:
            nodes = block.nodes[:, : CELL_TYPES[block.type].n_corners]
            own = hash_rows(uniform_offsets(*nodes.shape), index_array(nodes.ravel()))
        else:
            own = hash_rows(block.offsets, block.items)
        place = np.minimum(np.searchsorted(keys, own), len(keys) - 1)
        at[block.rows] = np.where(keys[place] == own, order[place], -1)
    return at


class Membership:
    """Zones of chosen faces of a mesh, rows of `connectivity.faces`."""

    def __init__(self, mesh: Mesh) -> None:
        self._mesh = mesh
        self._of_cell = mesh.cell_zone_index()
        self._zones: list[tuple[Zone, Ints]] = []
        face_zones = [zone for zone in mesh.zones if zone.entity == "face"]
        at = None if mesh.faces is not None or not face_zones else element_faces(mesh)
        for zone in face_zones:
            rows = zone.members if at is None else at[zone.members]
            self._zones.append((zone, rows[rows >= 0]))

    def rows(self, zone: Zone) -> Ints:
        """Faces of a face zone."""
        return next(rows for own, rows in self._zones if own is zone)

    def face_zones(self, rows: Ints) -> list[Zone]:
        """The face zones that hold any of these faces, most faces first; selections of OpenFOAM apart."""
        counts = [(-int(np.isin(rows, own).sum()), i) for i, (_, own) in enumerate(self._zones)]
        zones = [self._zones[i][0] for n, i in sorted(counts) if n]
        return [zone for zone in zones if zone.kind != "faceZone"]

    def cell_zones(self, rows: Ints) -> list[Zone]:
        """The cell zones that the cells behind these faces are in, most faces first."""
        found, counts = np.unique(self._of_cell[faces(self._mesh).owner[rows]], return_counts=True)
        order = np.argsort(-counts, kind="stable")
        return [self._mesh.cell_zones[i] for i in found[order].tolist() if i >= 0]

    def names(self, rows: Ints) -> dict[str, list[str]]:
        """Names of both, as a report lists them."""
        return {
            "face_zones": [text(zone.name) for zone in self.face_zones(rows)],
            "cell_zones": [text(zone.name) for zone in self.cell_zones(rows)],
        }

    def holding(self, roles: frozenset[str]) -> NDArray[np.bool_]:
        """(faces,) in a zone of one of these roles."""
        mask = np.zeros(len(faces(self._mesh)), dtype=bool)
        for zone, rows in self._zones:
            if zone.role in roles:
                mask[rows] = True
        return mask
