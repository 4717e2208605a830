"""A mesh with other points or cells, its zones, boundary elements and numbers carried along."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from meshwright.audit.errors import MeshError
from meshwright.audit.mesh import CellBlock, Floats, Ints, Mesh, Zone, index_array

__all__ = [
    "assignable", "padded", "with_boundary", "with_cells", "with_more_points", "with_points", "without_gone",
    "without_points",
]  # fmt: skip


def assignable(mesh: Mesh) -> None:
    """MeshError where the cells of this mesh cannot be rewired: polyhedra, polygons and faces of their own."""
    if mesh.faces is not None or any(block.items is not None for block in mesh.blocks):
        raise MeshError("cells given by their faces (polyhedra, polygons) cannot be rewired, only moved")


def with_points(mesh: Mesh, points: Floats) -> Mesh:
    """The same mesh with its points elsewhere; the very object where no coordinate has another value."""
    return mesh if np.array_equal(points, mesh.points, equal_nan=True) else replace(mesh, points=points)


def with_cells(mesh: Mesh, cells: Mapping[str, tuple[Ints, Ints]]) -> tuple[Mesh, Ints]:
    """(mesh, cells_from): its cells of each type replaced by (nodes (m, k), row of the cell each descends from).

    Types not named stay. Cells stand in the order of the rows they descend from; a new cell is in the zones of its
    parent. A cell that is the only one of its parent keeps its number, the others get new ones.
    """
    assignable(mesh)
    blocks, cells_from = _rewired(mesh.blocks, cells)
    zones = tuple(
        _of_children(zone, cells_from, mesh.n_cells) if zone.entity == "cell" else zone for zone in mesh.zones
    )
    ids = None
    if mesh.cell_ids is not None:
        ids = mesh.cell_ids[cells_from].astype(np.int64)
        again = np.flatnonzero(np.r_[False, cells_from[1:] == cells_from[:-1]])
        ids[again] = int(mesh.cell_ids.max()) + 1 + np.arange(len(again))
    return replace(mesh, blocks=blocks, zones=zones, cell_ids=ids), cells_from


def with_boundary(mesh: Mesh, elements: Mapping[str, tuple[Ints, Ints]]) -> Mesh:
    """The mesh with its boundary elements of each type replaced, as by `with_cells`; their own numbers are dropped."""
    blocks, origin = _rewired(mesh.boundary, elements)
    zones = tuple(_of_children(zone, origin, mesh.n_boundary) if zone.entity == "face" else zone for zone in mesh.zones)
    return replace(mesh, boundary=blocks, boundary_ids=None, zones=zones)


def _rewired(
    blocks: tuple[CellBlock, ...], cells: Mapping[str, tuple[Ints, Ints]]
) -> tuple[tuple[CellBlock, ...], Ints]:
    """(blocks, row that each of their cells descends from), in the order of these rows; see `with_cells`."""
    kept = {block.type: (block.nodes, block.rows) for block in blocks}
    kept.update(cells)
    kept = {name: pair for name, pair in kept.items() if len(pair[1])}
    if len(kept) == 1:
        ((name, (nodes, rows)),) = kept.items()
        if (rows[1:] >= rows[:-1]).all():
            return (CellBlock(name, np.arange(len(rows), dtype=np.int32), nodes),), index_array(rows)
    parents = np.concatenate([np.asarray(rows, dtype=np.int64) for _, rows in kept.values()] or [np.empty(0, np.int64)])
    order = np.argsort(parents, kind="stable")
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    out, at = [], 0
    for name, (nodes, rows) in kept.items():
        here = place[at : at + len(rows)]
        at += len(rows)
        inside = np.argsort(here, kind="stable")
        out.append(CellBlock(name, here[inside], np.asarray(nodes)[inside]))
    return tuple(out), index_array(parents[order])


def _of_children(zone: Zone, cells_from: Ints, n_before: int) -> Zone:
    inside = np.zeros(n_before, np.bool_)
    inside[zone.members] = True
    return replace(zone, members=np.flatnonzero(inside[cells_from]))


def without_points(mesh: Mesh, keep: Ints, into: Ints) -> tuple[Mesh, Ints]:
    """(mesh, points_from): only the points `keep` (rows, ascending); into (n,): the row each old point becomes, or -1.

    Every point that a cell or boundary element names must become one that is kept.
    """
    assignable(mesh)

    def renamed(block: CellBlock) -> CellBlock:
        return CellBlock(block.type, block.rows, into[block.nodes])

    zones = []
    for zone in mesh.zones:
        if zone.entity == "point":
            rows = into[zone.members]
            zones.append(replace(zone, members=np.unique(rows[rows >= 0])))
        else:
            zones.append(zone)
    spare = mesh.spare_points
    if spare is not None:
        spare = into[spare]
        spare = spare[spare >= 0]
    fresh = replace(
        mesh,
        points=mesh.points[keep],
        blocks=tuple(map(renamed, mesh.blocks)),
        boundary=tuple(map(renamed, mesh.boundary)),
        zones=tuple(zones),
        point_ids=None if mesh.point_ids is None else mesh.point_ids[keep],
        spare_points=spare,
    )
    return fresh, np.asarray(keep)


def with_more_points(mesh: Mesh, points: Floats) -> Mesh:
    """The mesh with points (m, 3) behind those it has; they get numbers after the largest, where points have some."""
    if not len(points):
        return mesh
    ids = mesh.point_ids
    if ids is not None:
        ids = np.concatenate([ids.astype(np.int64), int(ids.max()) + 1 + np.arange(len(points))])
    return replace(mesh, points=np.concatenate([mesh.points, points]), point_ids=ids)


def without_gone(mesh: Mesh, gone: Ints, n_before: int) -> tuple[Mesh, Ints, str]:
    """(mesh, points_from, words) without the points `gone`; those from row n_before on are new."""
    keep = np.setdiff1d(np.arange(len(mesh.points)), gone)
    into = np.full(len(mesh.points), -1, np.int64)
    into[keep] = np.arange(len(keep))
    fresh, rows = without_points(mesh, keep, into)
    new = len(mesh.points) - n_before - int(np.count_nonzero(gone >= n_before))
    words = f", {new:,} put in, {int(np.count_nonzero(gone < n_before)):,} taken away"
    return fresh, np.where(rows < n_before, rows, -1), words


def padded(mesh: Mesh) -> Ints:
    """(n_cells, k) nodes of every cell, -1 where it has fewer than the largest."""
    if (
        len(mesh.blocks) == 1
        and mesh.blocks[0].items is None
        and np.array_equal(mesh.blocks[0].rows, np.arange(mesh.n_cells))
    ):
        return mesh.blocks[0].nodes
    width = max((b.nodes.shape[1] for b in mesh.blocks if b.items is None), default=0)
    out = np.full((mesh.n_cells, max(width, 1)), -1, np.int64)
    for block in mesh.blocks:
        if block.items is None:
            out[block.rows, : block.nodes.shape[1]] = block.nodes
    return out
