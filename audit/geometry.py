"""Areas, volumes and centres of faces and cells by OpenFOAM's rules, for every kind of mesh.

A face is fanned about the mean of its nodes: area vector = sum of the triangles', centre = their centroids
weighted by their (unsigned) areas. A cell is cut into pyramids over its faces with the apex at the mean of
the face centres: volume = sum of the pyramids', centre weighted by their volumes (primitiveMeshFaceCentresAndAreas.C
and primitiveMeshCellCentresAndVols.C). For a hex the volume is that of the trilinear map. Every product is taken
after a node of the cell has been subtracted, so an offset of 1e9 cell sizes costs what storing the points cost.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshwright.audit import solids
from meshwright.audit.cache import once_per_mesh
from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.csr import ragged, uniform_offsets
from meshwright.audit.mesh import CellBlock, Floats, Ints, Mesh, index_array

__all__ = [
    "CellGeometry",
    "FaceGeometry",
    "bounds",
    "cell_geometry",
    "cell_normals",
    "face_geometry",
    "in_safe_units",
    "total_volume",
]

_CHUNK = 1 << 15
_INT32 = 2**31 - 1
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class FaceGeometry:
    """area: (f, 3) normal times area, from owner to neighbour (L2; L for the edges of 2-D cells).

    centre: (f, 3). The normal of an edge lies in the plane of its owner: in a flat mesh the x-y plane.
    """

    area: Floats
    centre: Floats


@dataclass(frozen=True, eq=False)
class CellGeometry:
    """volume: (n_cells,) signed, positive when right-handed (L3).

    2-D cells (L2): signed, positive when counter-clockwise, in a flat mesh; unsigned in a shell, which has
    no outside.  first: (n_cells,) row of a point of the cell; arm: (n_cells, 3) from there to the centre, which is the
    mean of the face centres where the volume is zero.  Differences of positions that are taken so stay exact far from
    the origin, where the centres themselves are rounded.
    """

    points: Floats
    volume: Floats
    first: Ints
    arm: Floats

    @cached_property
    def centre(self) -> Floats:
        """(n_cells, 3) centres."""
        return _sealed(self.points[self.first] + self.arm)


def face_geometry(mesh: Mesh, threads: int | None = None) -> FaceGeometry:
    """Area vectors and centres of `connectivity.faces(mesh)`, in its order.

    threads: None for all processors, and the result is kept; same bits for any number.
    """
    return _kept_faces(mesh) if threads is None else _face_geometry(mesh, threads)


def cell_geometry(mesh: Mesh, threads: int | None = None) -> CellGeometry:
    """Volumes and centres of the cells, in the order of their rows; `threads` as in `face_geometry`.

    Cells of fixed types are measured by their own nodes and need no face table; polyhedra by their faces.
    """
    return _kept_cells(mesh) if threads is None else _cell_geometry(mesh, threads)


def total_volume(mesh: Mesh) -> float:
    """Sum of the signed cell volumes (areas for 2-D cells)."""
    return float(np.sum(cell_geometry(mesh).volume))


def bounds(mesh: Mesh) -> Floats:
    """(2, 3) smallest and largest coordinates of the points that are finite; nan where there are none."""
    points = mesh.points if not mesh.n_nonfinite else mesh.points[np.isfinite(mesh.points).all(axis=1)]
    return np.stack([points.min(axis=0), points.max(axis=0)]) if len(points) else np.full((2, 3), np.nan)


@once_per_mesh
def in_safe_units(mesh: Mesh) -> tuple[Mesh, float]:
    """(the mesh, length of its unit) in a unit in which no product of twelve lengths can under- or overflow.

    The mesh itself and 1 unless it is huge or tiny; else a copy, scaled by a power of two, which rounds nothing.
    """
    low, high = 0.25 * bounds(mesh)
    size = float(np.max(high - low))
    if not size > 0.0 or 1e-20 < size < 1e20:
        return mesh, 1.0
    exponent = math.frexp(size)[1]
    with np.errstate(invalid="ignore"):
        points = np.ldexp(np.ldexp(mesh.points, -(exponent // 2)), exponent // 2 - exponent)
    return replace(mesh, points=points), math.ldexp(1.0, exponent)


@once_per_mesh
def cell_normals(mesh: Mesh) -> Floats:
    """(n_cells, 3) normals of the cells of a 2-D or surface mesh, of any length."""
    if mesh.dimension == 2:
        return np.ascontiguousarray(np.broadcast_to(_UP, (mesh.n_cells, 3)))
    return _shell_areas(mesh, os.cpu_count() or 1)


@once_per_mesh
def _kept_faces(mesh: Mesh) -> FaceGeometry:
    return _face_geometry(mesh, os.cpu_count() or 1)


@once_per_mesh
def _kept_cells(mesh: Mesh) -> CellGeometry:
    return _cell_geometry(mesh, os.cpu_count() or 1)


def _face_geometry(mesh: Mesh, threads: int) -> FaceGeometry:
    table = faces(mesh)
    n = len(table)
    area, centre = np.empty((n, 3)), np.empty((n, 3))
    points = mesh.points
    if mesh.cell_dimension == 3:
        _in_chunks(
            n, threads, lambda a, b: solids.face_rows(points, table.offsets, table.nodes, a, b, area, centre, False)
        )
    else:
        normals = cell_normals(mesh)
        _in_chunks(
            n, threads, lambda a, b: solids.edge_rows(points, table.nodes, table.owner, normals, a, b, area, centre)
        )
    return FaceGeometry(_sealed(area), _sealed(centre))


def _cell_geometry(mesh: Mesh, threads: int) -> CellGeometry:
    points, n = mesh.points, mesh.n_cells
    volume, arm = np.empty(n), np.empty((n, 3))
    first: Ints = np.empty(n, np.int32 if len(points) <= _INT32 else np.int64)
    if mesh.cell_dimension == 2:
        areas = np.empty((n, 3))
        for block in mesh.blocks:
            _surface_block(points, block, threads, areas, first, arm)
        volume[:] = areas[:, 2] if mesh.dimension == 2 else np.sqrt(np.sum(areas * areas, axis=1))
    for block in mesh.blocks if mesh.cell_dimension == 3 else ():
        if block.type == "polyhedron":
            _polyhedra(mesh, block, threads, volume, first, arm)
        else:
            _solid_block(points, block, threads, volume, first, arm)
    return CellGeometry(points, _sealed(volume), index_array(first), _sealed(arm))


def _solid_block(points: Floats, block: CellBlock, threads: int, volume: Floats, first: Ints, arm: Floats) -> None:
    sides = CELL_TYPES[block.type].faces
    sizes = index_array([len(side) for side in sides])
    corners = index_array([[*side, *[side[0]] * (4 - len(side))] for side in sides])
    rows, nodes = block.rows, block.nodes
    _in_chunks(
        len(block),
        threads,
        lambda a, b: solids.cells_by_table(points, rows, nodes, sizes, corners, a, b, volume, first, arm),
    )


def _polyhedra(mesh: Mesh, block: CellBlock, threads: int, volume: Floats, first: Ints, arm: Floats) -> None:
    table, rows = faces(mesh), block.rows
    starts, items = ragged(block)
    most = int(np.diff(starts).max(initial=0))
    _in_chunks(
        len(block),
        threads,
        lambda a, b: solids.cells_by_faces(
            mesh.points, rows, starts, items, table.offsets, table.nodes, table.owner, most, a, b, volume, first, arm
        ),
    )


def _surface_block(points: Floats, block: CellBlock, threads: int, areas: Floats, first: Ints, arm: Floats) -> None:
    rows = block.rows
    if block.items is None:
        nodes = block.nodes[:, : CELL_TYPES[block.type].n_corners]
        offsets, items = uniform_offsets(*nodes.shape), index_array(nodes.ravel())
    else:
        offsets, items = ragged(block)
    own_areas, own_arms = np.empty((len(block), 3)), np.empty((len(block), 3))
    _in_chunks(
        len(block), threads, lambda a, b: solids.face_rows(points, offsets, items, a, b, own_areas, own_arms, True)
    )
    areas[rows], first[rows], arm[rows] = own_areas, items[offsets[:-1]], own_arms


def _shell_areas(mesh: Mesh, threads: int) -> Floats:
    n = mesh.n_cells
    areas, first, arm = np.empty((n, 3)), np.empty(n, np.int64), np.empty((n, 3))
    for block in mesh.blocks:
        _surface_block(mesh.points, block, threads, areas, first, arm)
    return areas


def _in_chunks(n: int, threads: int, work: Callable[[int, int], None]) -> None:
    """Call work(begin, end) for chunks of fixed size; each writes its own rows, so the order cannot matter."""
    chunks = [(a, min(a + _CHUNK, n)) for a in range(0, n, _CHUNK)]
    if threads <= 1 or len(chunks) <= 1:
        for a, b in chunks:
            work(a, b)
        return
    with ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(work, a, b) for a, b in chunks]:
            done.result()


def _sealed(array: NDArray[np.float64]) -> NDArray[np.float64]:
    array.flags.writeable = False
    return array
