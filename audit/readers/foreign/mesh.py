"""From the arrays that the reading process wrote to a `Mesh`; every one of them is checked first."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES, ORDER_OF_TYPES
from meshwright.audit.errors import ReadError, UnsupportedError
from meshwright.audit.mesh import CellBlock, Faces, Mesh
from meshwright.audit.readers.foreign.faces import Polyhedra, faces_of_cells
from meshwright.audit.readers.foreign.zones import zones_of
from meshwright.audit.readers.source import Source

__all__ = ["mesh_of_arrays"]

Ints = NDArray[np.int64]

_BY_MESHIO = {row.meshio: row.name for row in CELL_TYPES.values()}
_REDUCED = {
    "wedge18": ("wedge15", "prisms of 18 nodes are read without their 3 face nodes"),
    "pyramid14": ("pyramid13", "pyramids of 14 nodes are read without the node of their base"),
    "tetra14": ("tet10", "tetrahedra of 14 nodes are read without their 4 face nodes"),
    "triangle7": ("tri6", "triangles of 7 nodes are read without the node in the middle"),
    "hexahedron24": ("hex20", "hexahedra of 24 nodes are read with 20"),
    "quad5": ("quad", "quadrilaterals of 5 nodes are measured by their corners"),
    "hexahedron9": ("hex", "hexahedra of 9 nodes are measured by their corners"),
    "tetra8": ("tet", "tetrahedra of 8 nodes are measured by their corners"),
    "tetra4": ("tet", ""),
}
_HIGH_ORDER = re.compile(r"(line|triangle|quad|tetra|wedge|hexahedron)(\d+)")
_RENUMBERED = (
    *("abaqus", "nastran", "avsucd", "mdpa", "permas", "flac3d", "exodus", "tetgen", "med"),
    *("medit", "meditb", "netgen", "ugrid", "obj", "tecplot"),  # no numbers written, but counted from 1
)


_VTK = ("vtk", "vtu")
_WEDGE = [0, 2, 1, 3, 5, 4]
"""meshio turns the wedges of VTK files by this, after old VTK text; VTK 9 itself computes with the order in which they
stand (`vtkCellSizeFilter`, `vtkMeshQuality`). Files that meshio wrote it turns back rightly; of others the turn is
undone."""


@dataclass(frozen=True)
class _Block:
    type: str
    nodes: Ints
    loss: str
    spare: Ints | None = None
    polyhedra: Polyhedra | None = None

    def __len__(self) -> int:
        return len(self.polyhedra.offsets) - 1 if self.polyhedra else len(self.nodes)


def mesh_of_arrays(source: Source, name: str, head: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Mesh:
    """The mesh. Raises ReadError for node numbers that are not, coordinates that are not, no cells."""
    points = _points(source, arrays["points"])
    turned = name in _VTK and not _by_meshio(source)
    blocks = [_block(source, kind, i, arrays, len(points), turned) for i, kind in enumerate(head["cells"])]
    dimensions = [CELL_TYPES[block.type].dimension for block in blocks for _ in range(min(1, len(block)))]
    cell_dimension = max(dimensions, default=-1)
    if cell_dimension < 2:
        found = "none" if cell_dimension < 0 else "lines or points only"
        raise ReadError(source.path, "", "surface or volume elements", found)
    if cell_dimension == 3 and arrays["points"].shape[1] == 2:
        raise ReadError(source.path, "", "three coordinates for solid cells", "two")
    # Row of each of meshio's elements: among the cells, or among the boundary elements.
    is_cell = np.concatenate([np.full(len(b), CELL_TYPES[b.type].dimension == cell_dimension) for b in blocks])
    rows = np.where(is_cell, np.cumsum(is_cell), np.cumsum(~is_cell)) - 1
    starts = np.concatenate(([0], np.cumsum([len(block) for block in blocks])))
    cells = [(b, rows[s : s + len(b)]) for b, s in zip(blocks, starts, strict=False) if len(b) and is_cell[s]]
    others = [(b, rows[s : s + len(b)]) for b, s in zip(blocks, starts, strict=False) if len(b) and not is_cell[s]]
    faces = None
    cell_blocks = _merged(cells)
    if any(block.type == "polyhedron" for block, _ in cells):
        faces, cell_blocks = _with_faces(source, cells, cell_blocks)
    losses = Counter[str]()
    for block in blocks:
        if block.loss:
            losses[block.loss] += len(block)
    notes = [f"{count} {loss}" for loss, count in losses.items() if count]
    if name in _RENUMBERED:
        notes.append("the file's own numbers of nodes and elements are not kept: both count from 0 in file order")
    if name == "stl":
        notes.append("corners of facets with exactly equal coordinates are one point")
    spare = [block.spare.ravel() for block in blocks if block.spare is not None and block.spare.size]
    boundary = _merged(others)
    zones, zone_notes = zones_of(source, name, head, arrays, is_cell, rows, len(points), keep_faces=faces is None)
    flat = cell_dimension == 2 and not np.any(points[:, 2])
    return Mesh(
        points=points,
        blocks=cell_blocks,
        boundary=boundary,
        faces=faces,
        zones=zones,
        dimension=2 if flat else 3,
        spare_points=np.unique(np.concatenate(spare)) if spare else None,
        path=source.path,
        format=name,
        notes=(*notes, *zone_notes),
    )


def _points(source: Source, values: np.ndarray) -> NDArray[np.float64]:
    if values.ndim != 2 or values.shape[1] not in (2, 3) or not len(values):
        raise ReadError(source.path, "", "points of two or three coordinates", f"an array of shape {values.shape}")
    points = np.zeros((len(values), 3))
    points[:, : values.shape[1]] = values
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        row = int(np.flatnonzero(~finite)[0])
        raise ReadError(source.path, f"point {row}", "finite coordinates", str(points[row].tolist()))
    return points


def _node_rows(source: Source, kind: str, values: np.ndarray, n_points: int) -> Ints:
    if values.size and values.dtype.kind not in "iu":
        raise ReadError(source.path, f"cells of type {kind}", "whole numbers of nodes", str(values.flat[0]))
    if values.size:
        low, high = int(values.min()), int(values.max())
        if low < 0 or high >= n_points:
            found = str(low if low < 0 else high)
            raise ReadError(source.path, f"cells of type {kind}", f"node rows from 0 to {n_points - 1}", found)
    return values.astype(np.int64)


def _by_meshio(source: Source) -> bool:
    """Whether meshio wrote the file: it says so near the beginning of each."""
    return b"by meshio" in source.data[:1024].tobytes()


def _block(source: Source, kind: str, i: int, arrays: Mapping[str, np.ndarray], n_points: int, turned: bool) -> _Block:
    values = arrays[f"cells{i}"]
    if kind.startswith("polyhedron"):
        nodes = _node_rows(source, kind, values, n_points)
        polyhedra = Polyhedra.checked(source, arrays[f"cells{i}_faces"], arrays[f"cells{i}_sizes"], nodes)
        return _Block("polyhedron", np.empty((0, 0), np.int64), "", polyhedra=polyhedra)
    if values.ndim != 2:
        raise ReadError(
            source.path, f"cells of type {kind}", "as many nodes in each", f"an array of shape {values.shape}"
        )
    nodes = _node_rows(source, kind, values, n_points)
    if turned and kind == "wedge":
        nodes = nodes[:, _WEDGE]
    width = nodes.shape[1]
    if kind.startswith("polygon"):
        if width < 3:
            raise ReadError(source.path, "polygons", "3 nodes or more", str(width))
        plain = {3: "tri", 4: "quad"}.get(width, "polygon")
        return _Block(plain, nodes, "")
    name, loss = _REDUCED.get(kind, (_BY_MESHIO.get(kind, ""), ""))
    high = _HIGH_ORDER.fullmatch(kind)
    if not name and high:
        name = _BY_MESHIO[high[1]]
        loss = (
            f"{CELL_TYPES[name].title} cells of {high[2]} nodes (third order or higher) are measured by their corners"
        )
    if not name or name in ("polygon", "polyhedron"):
        raise UnsupportedError(source.path, "", "cells of a known type", kind)
    n_nodes = CELL_TYPES[name].n_nodes
    if width < n_nodes or (not loss and width != n_nodes):
        raise ReadError(source.path, f"cells of type {kind}", f"{n_nodes} nodes in each", str(width))
    return _Block(name, nodes[:, :n_nodes], loss, nodes[:, n_nodes:])


def _merged(blocks: list[tuple[_Block, Ints]]) -> tuple[CellBlock, ...]:
    """One block a type, in the order of the tables; polyhedra are left out."""
    merged = []
    for name in ORDER_OF_TYPES:
        mine = [(block, rows) for block, rows in blocks if block.type == name and block.polyhedra is None]
        if not mine:
            continue
        rows = np.concatenate([r for _, r in mine])
        if name == "polygon":
            sizes = np.concatenate([np.full(len(b), b.nodes.shape[1]) for b, _ in mine])
            items = np.concatenate([b.nodes.ravel() for b, _ in mine])
            merged.append(CellBlock(name, rows, offsets=np.concatenate(([0], np.cumsum(sizes))), items=items))
        else:
            merged.append(CellBlock(name, rows, np.concatenate([b.nodes for b, _ in mine])))
    return tuple(merged)


def _with_faces(
    source: Source, cells: list[tuple[_Block, Ints]], plain: tuple[CellBlock, ...]
) -> tuple[Faces, tuple[CellBlock, ...]]:
    mine = [(block.polyhedra, rows) for block, rows in cells if block.polyhedra is not None]
    faces, offsets, items = faces_of_cells(source, plain, mine)
    rows = np.concatenate([r for _, r in mine])
    return faces, (*plain, CellBlock("polyhedron", rows, offsets=offsets, items=items))
