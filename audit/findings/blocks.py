"""The check that finds structured blocks: i x j x k grids in a mesh that does not say it has any."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, faces_of_cells
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.grids.cuts import block_sizes, cut_faces
from meshwright.audit.findings.grids.singular import singular_edges, singular_points
from meshwright.audit.mesh import NO_CELL, CellBlock, Ints, Mesh, index_array
from meshwright.audit.sets import find_parts

__all__ = ["ROWS", "Blocks", "structured_blocks"]

_LISTED = 100
_IRREGULAR = 0.25
"""Singular edges (points) over cells above which a mesh is taken for unstructured."""
_CUT = 0.5
"""The same for cut faces over inner faces: blocks of two cells across."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """block (n,): number of the block of each cell of `cells` (rows of the mesh), largest first, -1 for no grid.

    sizes: (i, j, k) or (i, j) of each block, descending.  closed: which of these directions return to their start.
    singular (m, 2) or (m,): singular edges or points.  valence (m,): cells around them.  border (m,): on the boundary.
    """

    cells: Ints
    block: Ints
    sizes: list[tuple[int, ...]]
    closed: list[tuple[bool, ...]]
    singular: Ints
    valence: Ints
    border: NDArray[np.bool_]


def structured_blocks(mesh: Mesh) -> Blocks | None:
    """The blocks of the hexahedra (quadrilaterals) of a mesh; None without any, or where they form no grid.

    Cells of other types count as the end of the mesh. A grid needs half of the cells in blocks of two cells or more
    in two directions, and no more blocks than the square root of the number of cells, since any mesh of quadrilaterals
    falls apart into small ones.
    """
    kind = "hex" if mesh.cell_dimension == 3 else "quad"
    chosen = [block for block in mesh.blocks if CELL_TYPES[block.type].corners == kind and len(block)]
    if not chosen:
        return None
    width = CELL_TYPES[kind].n_nodes
    if len(chosen) == 1 and len(chosen[0]) == mesh.n_cells:
        part, cells, nodes = mesh, chosen[0].rows, chosen[0].nodes[:, :width]
    else:
        cells = np.concatenate([block.rows for block in chosen])
        nodes = np.concatenate([block.nodes[:, :width] for block in chosen])
        part = Mesh(mesh.points, (CellBlock(kind, np.arange(len(cells)), nodes),), dimension=mesh.dimension)
    singular, valence, border = (singular_edges if kind == "hex" else singular_points)(part, nodes)
    if len(singular) > _IRREGULAR * len(cells):
        return None
    found = faces(part)
    neighbour = found.neighbour
    if len(singular):
        inner = int(np.count_nonzero(neighbour != NO_CELL))
        cut = cut_faces(part, singular, int(_CUT * inner))
        if cut is None:
            return None
        neighbour = index_array(np.where(cut, NO_CELL, neighbour))
    directions = 3 if kind == "hex" else 2
    table = (found.offsets, found.nodes, found.owner, neighbour, *faces_of_cells(part))
    along = block_sizes(*table, index_array([0]), directions)
    if not len(singular) and abs(along.prod()) == len(cells):
        return _ranked(cells, np.zeros(len(cells), np.int32), along, (singular, valence, border))
    component = find_parts(found.owner, neighbour, len(cells))
    first = np.unique(component, return_index=True)[1]
    along = block_sizes(*table, index_array(first), directions)
    return _ranked(cells, component, along, (singular, valence, border))


def _ranked(cells: Ints, component: Ints, along: Ints, singular: tuple[Ints, Ints, NDArray[np.bool_]]) -> Blocks | None:
    count = np.bincount(component)
    order = np.argsort(-np.abs(along), axis=1, kind="stable")
    along = np.take_along_axis(along, order, axis=1)
    grid = np.abs(along).prod(axis=1) == count
    if len(count) ** 2 > len(cells) or 2 * count[grid & (np.abs(along[:, 1]) >= 2)].sum() < len(cells):
        return None
    largest = np.lexsort((np.arange(len(count)), -count, ~grid))
    number = np.full(len(count), -1, dtype=np.int64)
    number[largest[: grid.sum()]] = np.arange(grid.sum())
    along = along[largest[: grid.sum()]]
    sizes = [tuple(row) for row in np.abs(along).tolist()]
    closed = [tuple(row) for row in (along < 0).tolist()]
    return Blocks(cells, index_array(number[component]), sizes, closed, *singular)


def blocks(facts: Facts) -> Found | None:
    """Cells that lie in structured blocks, with the size of each block and the singular edges between them."""
    mesh = facts.mesh
    found = structured_blocks(mesh)
    if found is None:
        return None
    count = np.bincount(found.block[found.block >= 0], minlength=len(found.sizes))
    detail: dict[str, Any] = {
        "blocks": len(found.sizes),
        "sizes": [
            {"size": list(size), "cells": int(n), "closed": [k for k, turn in enumerate(closed) if turn]}
            for size, n, closed in zip(found.sizes[:_LISTED], count, found.closed, strict=False)
        ],
        "cells": int(count.sum()),
        "cells_in_none": int(np.count_nonzero(found.block < 0)),
        "singular_edges" if mesh.cell_dimension == 3 else "singular_points": _listed(mesh, found),
    }
    text = ", ".join(" x ".join(str(n) for n in size) for size in found.sizes[:5])
    more = f" and {len(found.sizes) - 5} more" if len(found.sizes) > 5 else ""
    what = "edge" if mesh.cell_dimension == 3 else "point"
    return Found(
        found.cells[found.block >= 0],
        f"{counted(len(found.sizes), 'structured block')} ({text}{more}) between "
        f"{counted(len(found.singular), f'singular {what}')}: structured solvers and mapped smoothing can use them",
        detail=detail,
    )


def _listed(mesh: Mesh, found: Blocks) -> dict[str, Any]:
    """How many singular edges (points) with how many cells around, and the first of them by the file's numbers."""
    inside = ~found.border
    first = found.singular[:_LISTED]
    return {
        "count": len(found.singular),
        "inside": {str(v): int(n) for v, n in zip(*np.unique(found.valence[inside], return_counts=True), strict=True)},
        "border": {str(v): int(n) for v, n in zip(*np.unique(found.valence[~inside], return_counts=True), strict=True)},
        "first": (first if mesh.point_ids is None else mesh.point_ids[first]).tolist(),
    }


ROWS = (
    Check(
        "blocks", "info", "Structured blocks", "cell",
        "a property of the mesh to know of, no fault", blocks,
    ),
)  # fmt: skip
