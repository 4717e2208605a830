"""`Mesh`: what every reader makes and everything else reads. Frozen, read-only arrays, checked once here.

Rows and ids. A cell's *row* is its position in the file, 0 to n_cells-1, whatever its type; its *id* is the
file's own number. Everything inside the program uses rows; only outputs turn them into ids. The same holds
for points, faces and boundary elements.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import MeshError

__all__ = ["NO_CELL", "CellBlock", "Faces", "Mesh", "Zone", "index_array"]

NO_CELL = -1
"""Neighbour of a boundary face."""

_INT32_END = 2**31 - 1

Ints = NDArray[np.integer]
Floats = NDArray[np.float64]


def index_array(values: ArrayLike) -> Ints:
    """Contiguous, read-only int32 array of indices; int64 only where a value needs it."""
    array = np.asarray(values)
    if array.dtype.kind not in "iu":
        if array.size:
            raise MeshError(f"indices must be integers, got dtype {array.dtype}")
        array = array.astype(np.int32)
    if array.dtype != np.int32:
        wide = array.size and (int(array.max()) > _INT32_END or int(array.min()) < -_INT32_END)
        array = array.astype(np.int64 if wide else np.int32)
    return _frozen(np.ascontiguousarray(array))


def _frozen(array: NDArray) -> NDArray:
    """A read-only view; the caller's own array keeps its flags."""
    view = array.view()
    view.flags.writeable = False
    return view


@dataclass(frozen=True, eq=False)
class CellBlock:
    """All cells of one type.

    type: a name of `CELL_TYPES`.  rows: (n,) row of each cell, ascending.
    nodes: (n, k) point rows in VTK node order; for polygon and polyhedron empty (0, 0).
    polygon: `offsets` (n+1,) into `items`, the point rows around each polygon.
    polyhedron: `offsets` (n+1,) into `items`, the rows of its faces in `Mesh.faces`.
    """

    type: str
    rows: Ints
    nodes: Ints = field(default_factory=lambda: np.empty((0, 0), np.int32))
    offsets: Ints | None = None
    items: Ints | None = None

    def __post_init__(self) -> None:
        if self.type not in CELL_TYPES:
            raise MeshError(f"unknown cell type {self.type!r}")
        for name in ("rows", "nodes", "offsets", "items"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, index_array(value))
        n = len(self.rows)
        width = CELL_TYPES[self.type].n_nodes
        if width:
            if self.nodes.shape != (n, width):
                raise MeshError(
                    f"{self.type} block of {n} cells needs nodes of shape {(n, width)}, got {self.nodes.shape}"
                )
        else:
            if self.offsets is None or self.items is None:
                raise MeshError(f"{self.type} block needs offsets and items")
            _check_offsets(self.type, self.offsets, n, len(self.items), least=3 if self.type == "polygon" else 4)

    def __len__(self) -> int:
        return len(self.rows)


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces of the top-dimensional cells (edges of two nodes in a 2-D mesh), with who owns them.

    nodes: point rows of all faces, concatenated; offsets: (f+1,).  owner, neighbour: (f,) cell rows,
    neighbour NO_CELL on the boundary.  In a sound mesh the right-hand normal points from owner to
    neighbour (in 2-D: the owner lies to the left of the edge 0 -> 1).  ids: (f,) the file's numbers, or
    None for 0, 1, 2, ...  Face-based files keep their own numbering and order.
    """

    offsets: Ints
    nodes: Ints
    owner: Ints
    neighbour: Ints
    ids: Ints | None = None

    def __post_init__(self) -> None:
        for name in ("offsets", "nodes", "owner", "neighbour", "ids"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, index_array(value))
        n = len(self.owner)
        if len(self.neighbour) != n or (self.ids is not None and len(self.ids) != n):
            raise MeshError(f"{n} owners but {len(self.neighbour)} neighbours")
        _check_offsets("face", self.offsets, n, len(self.nodes), least=2)

    def __len__(self) -> int:
        return len(self.owner)


@dataclass(frozen=True, eq=False)
class Zone:
    """A named group of entities.

    kind: the native word: "zone" (Fluent), "patch", "cellZone", "physical group", "part", "component", ...
    role: what it is for: "fluid", "solid", "interior", "wall", "inlet", "outlet", "symmetry", "periodic",
    "interface", ... or "" when the file does not say.
    entity: "cell", "face" or "point"; members: rows of them. Rows of faces refer to `Mesh.faces` in a
    face-based mesh and to the elements of `Mesh.boundary` otherwise.  id: the file's number of the zone.
    """

    name: str
    kind: str
    role: str
    entity: str
    members: Ints
    id: int | None = None

    def __post_init__(self) -> None:
        if self.entity not in ("cell", "face", "point"):
            raise MeshError(f"zone entity must be cell, face or point, got {self.entity!r}")
        object.__setattr__(self, "members", index_array(self.members))


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh.

    points: (n, 3) float64, z = 0 throughout when `dimension` is 2.
    blocks: cells of the highest topological dimension, at most one block per type.
    boundary: elements of lower dimension that the file lists beside them (surface and line elements).
    faces: of face-based formats and wherever there are polyhedra; otherwise None, `connectivity.faces` derives them.
    dimension: 2 for a flat mesh in the x-y plane with +z as reference normal, otherwise 3 (shells too).
    cell_ids, point_ids, boundary_ids: the file's own numbers, or None for 0, 1, 2, ...
    spare_points: rows of the nodes of higher order that a reader leaves out of its cells; they are not unused.
    notes: the loss ledger: one sentence for each thing in the file that the mesh does not hold.
    """

    points: Floats
    blocks: tuple[CellBlock, ...]
    boundary: tuple[CellBlock, ...] = ()
    faces: Faces | None = None
    zones: tuple[Zone, ...] = ()
    dimension: int = 3
    cell_ids: Ints | None = None
    point_ids: Ints | None = None
    boundary_ids: Ints | None = None
    spare_points: Ints | None = None
    path: str = ""
    format: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        points = np.ascontiguousarray(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise MeshError(f"points must have shape (n, 3), got {points.shape}")
        object.__setattr__(self, "points", _frozen(points))
        for name in ("cell_ids", "point_ids", "boundary_ids", "spare_points"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, index_array(getattr(self, name)))
        if self.dimension not in (2, 3):
            raise MeshError(f"dimension must be 2 or 3, got {self.dimension}")
        if self.dimension == 2 and np.any(points[:, 2] != 0.0):
            raise MeshError("a mesh of dimension 2 needs z = 0 everywhere")
        if not any(len(block) for block in self.blocks):
            raise MeshError("a mesh needs at least one cell")
        if len({CELL_TYPES[b.type].dimension for b in self.blocks}) != 1 or self.cell_dimension < 2:
            raise MeshError("the blocks of a mesh must all hold 2-D cells or all hold 3-D cells")
        _check_rows("cell", self.blocks, self.n_cells, self.cell_ids)
        _check_rows("boundary element", self.boundary, self.n_boundary, self.boundary_ids)
        if self.point_ids is not None and len(self.point_ids) != len(points):
            raise MeshError(f"{len(self.point_ids)} point ids for {len(points)} points")
        self._check_indices()

    def _check_indices(self) -> None:
        n = len(self.points)
        _check_range("spare point", self.spare_points, n)
        for block in (*self.blocks, *self.boundary):
            _check_range(f"node of a {block.type}", block.nodes, n)
            if block.type == "polygon":
                _check_range("node of a polygon", block.items, n)
            elif block.type == "polyhedron":
                if self.faces is None:
                    raise MeshError("polyhedra need the mesh's faces")
                _check_range("face of a polyhedron", block.items, len(self.faces))
        if self.faces is not None:
            _check_range("node of a face", self.faces.nodes, n)
            _check_range("owner of a face", self.faces.owner, self.n_cells)
            _check_range("neighbour of a face", self.faces.neighbour, self.n_cells, least=NO_CELL)
        counts = {"cell": self.n_cells, "point": n, "face": self.n_boundary if self.faces is None else len(self.faces)}
        for zone in self.zones:
            _check_range(f"member of zone {zone.name!r}", zone.members, counts[zone.entity])

    @property
    def cell_dimension(self) -> int:
        """Topological dimension of the cells: 2 or 3."""
        return CELL_TYPES[self.blocks[0].type].dimension

    @property
    def order(self) -> int:
        """Highest order of any cell: 1 or 2."""
        return max(CELL_TYPES[block.type].order for block in self.blocks)

    @cached_property
    def n_cells(self) -> int:
        """Number of cells, boundary elements not counted."""
        return sum(len(block) for block in self.blocks)

    @cached_property
    def n_boundary(self) -> int:
        """Number of boundary elements."""
        return sum(len(block) for block in self.boundary)

    @cached_property
    def n_nonfinite(self) -> int:
        """Points with a NaN or infinite coordinate."""
        return int(np.count_nonzero(~np.isfinite(self.points).all(axis=1)))

    @property
    def counts(self) -> dict[str, int]:
        """Cells by type, in the order of the blocks."""
        return {block.type: len(block) for block in self.blocks}

    @cached_property
    def cell_zones(self) -> tuple[Zone, ...]:
        """The zones that group cells."""
        return tuple(zone for zone in self.zones if zone.entity == "cell")

    def cell_zone_index(self) -> Ints:
        """(n_cells,) index into `cell_zones` of the first zone that holds the cell, -1 for none."""
        index = np.full(self.n_cells, -1, dtype=np.int32)
        zones = self.cell_zones
        for i in range(len(zones) - 1, -1, -1):
            index[zones[i].members] = i
        return index

    def ids_of_cells(self, rows: ArrayLike) -> Ints:
        """The file's own numbers of these cell rows."""
        rows = np.asarray(rows)
        return rows if self.cell_ids is None else self.cell_ids[rows]

    def block(self, type_name: str) -> CellBlock:
        """The block of that cell type; KeyError where the mesh has none."""
        for block in self.blocks:
            if block.type == type_name:
                return block
        raise KeyError(type_name)


def _check_offsets(what: str, offsets: Ints, n: int, n_items: int, least: int) -> None:
    if len(offsets) != n + 1 or offsets[0] != 0 or offsets[-1] != n_items:
        raise MeshError(f"{what} offsets must run from 0 to {n_items} in {n + 1} entries")
    if n and int(np.diff(offsets).min()) < least:
        raise MeshError(f"every {what} needs at least {least} items")


def _check_range(what: str, values: Ints | None, end: int, least: int = 0) -> None:
    if values is None or not values.size:
        return
    low, high = int(values.min()), int(values.max())
    if low < least or high >= end:
        raise MeshError(f"{what}: index {low if low < least else high} is outside {least} to {end - 1}")


def _check_rows(what: str, blocks: tuple[CellBlock, ...], n: int, ids: Ints | None) -> None:
    if len({block.type for block in blocks}) != len(blocks):
        raise MeshError(f"two {what} blocks of the same type")
    if ids is not None and len(ids) != n:
        raise MeshError(f"{len(ids)} {what} ids for {n} {what}s")
    if len(blocks) == 1:
        rows = blocks[0].rows
        if n and (rows[0] != 0 or rows[-1] != n - 1 or np.any(np.diff(rows) != 1)):
            raise MeshError(f"{what} rows must be 0 to {n - 1} in order")
        return
    seen = np.zeros(n, dtype=bool)
    for block in blocks:
        _check_range(f"{what} row", block.rows, n)
        seen[block.rows] = True
        if len(block) > 1 and np.any(np.diff(block.rows) <= 0):
            raise MeshError(f"{what} rows must ascend within a block")
    if not seen.all():
        raise MeshError(f"{what} rows must cover 0 to {n - 1} exactly once")
