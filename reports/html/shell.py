"""The boundary of a mesh as polygons with zones: what the bad cells are shown in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import boundary_faces, faces
from meshwright.audit.csr import take
from meshwright.audit.findings.face_sets import faces_of_zone
from meshwright.audit.mesh import Ints, Mesh
from meshwright.audit.places import text

__all__ = ["Shell", "shell_of"]


@dataclass(frozen=True, eq=False)
class Shell:
    """Polygons: offsets (m + 1,) into nodes, point rows; zone (m,) index into `names`, the last of which is no zone.

    of: how many polygons the boundary has; `thinned` where some were left out.
    """

    points: NDArray[np.float64]
    offsets: Ints
    nodes: Ints
    zone: Ints
    names: tuple[str | None, ...]
    of: int
    thinned: bool


def shell_of(mesh: Mesh, most: int) -> Shell:
    """The faces that have a cell on one side only, or the cells themselves where they are two-dimensional.

    Faces with a point that is not finite are left out. More than `most` are thinned by merging points on a grid.
    """
    if mesh.cell_dimension == 2:
        offsets, nodes, zone, names = _of_cells(mesh)
    else:
        offsets, nodes, zone, names = _of_faces(mesh)
    sound = np.asarray(np.isfinite(mesh.points).all(axis=1))
    if not sound.all() and len(nodes):
        keep = np.logical_and.reduceat(sound[nodes], offsets[:-1])
        rows = np.flatnonzero(keep)
        (offsets, nodes), zone = take(offsets, nodes, rows), zone[rows]
    of = len(offsets) - 1
    points = mesh.points
    if of > most:
        points, offsets, nodes, zone = _thinned(points, offsets, nodes, zone, most)
    return Shell(points, offsets, nodes, zone, names, of, of > most)


def _of_faces(mesh: Mesh) -> tuple[Ints, Ints, Ints, tuple[str | None, ...]]:
    found = faces(mesh)
    rows = boundary_faces(mesh)
    zones = [zone for zone in mesh.zones if zone.entity == "face" and zone.kind != "faceZone"]
    names = tuple(text(zone.name) for zone in zones)
    of_face = np.full(len(found), len(names), np.int64)
    for k in range(len(zones) - 1, -1, -1):
        of_face[faces_of_zone(mesh, zones[k])] = k
    offsets, nodes = take(found.offsets, found.nodes, rows)
    return offsets, nodes, of_face[rows], (*names, None)


def _of_cells(mesh: Mesh) -> tuple[Ints, Ints, Ints, tuple[str | None, ...]]:
    parts, rows = [], []
    for block in mesh.blocks:
        if block.items is not None and block.offsets is not None:
            parts.append((np.diff(block.offsets), block.items))
        else:
            corners = CELL_TYPES[block.type].n_corners
            parts.append((np.full(len(block), corners), block.nodes[:, :corners].ravel()))
        rows.append(block.rows)
    sizes = np.concatenate([size for size, _ in parts])
    nodes = np.concatenate([node for _, node in parts])
    zone = mesh.cell_zone_index()[np.concatenate(rows)].astype(np.int64)
    names = (*(text(z.name) for z in mesh.cell_zones), None)
    zone = np.where(zone < 0, len(names) - 1, zone)
    return np.concatenate([[0], np.cumsum(sizes)]), nodes, zone, names


def _thinned(
    points: NDArray[np.float64], offsets: Ints, nodes: Ints, zone: Ints, most: int
) -> tuple[NDArray[np.float64], Ints, Ints, Ints]:
    """The polygons after all points in one cell of a grid have become one; those without area are gone.

    The grid gets coarser until few enough are left.
    """
    used, inverse = np.unique(nodes, return_inverse=True)
    here = points[used]
    low, size = here.min(axis=0), float(np.ptp(here, axis=0).max()) or 1.0
    sizes = np.diff(offsets)
    divisions = int(np.sqrt(most / 2))
    while True:
        grid = np.floor((here - low) / size * divisions).astype(np.int64)
        key = (grid[:, 0] * (divisions + 2) + grid[:, 1]) * (divisions + 2) + grid[:, 2]
        _, first, merged = np.unique(key, return_index=True, return_inverse=True)
        corners = merged[inverse]
        # a polygon keeps those corners that differ from the one before
        face = np.repeat(np.arange(len(sizes)), sizes)
        previous = np.roll(corners, 1)
        previous[offsets[:-1]] = corners[offsets[1:] - 1]
        keep = corners != previous
        left = np.bincount(face[keep], minlength=len(sizes))
        sound = left >= 3
        if int(sound.sum()) <= most:
            break
        divisions = int(divisions * 0.8)
    keep &= sound[face]
    new_offsets = np.concatenate([[0], np.cumsum(left[sound])])
    return here[first], new_offsets, corners[keep], zone[sound]
