"""Checks on the kinds of elements: their order, 1-D elements, pyramids out of place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, faces_of_cells, used_points
from meshwright.audit.csr import take
from meshwright.audit.findings.face_sets import faces_of_elements
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.mesh import NO_CELL, Floats, Ints, Mesh, index_array
from meshwright.audit.places import plain

__all__ = ["ROWS"]

_LISTED = 100


def element_order(facts: Facts) -> Found | None:
    """Second-order cells where finite volumes are meant, tetrahedra of first order where finite elements are."""
    blocks = facts.mesh.blocks
    if facts.options.discipline == "cfd":
        curved = [block for block in blocks if CELL_TYPES[block.type].order == 2 and len(block)]
        if not curved:
            return None
        rows = np.concatenate([block.rows for block in curved])
        return Found(
            rows,
            f"{counted(len(rows), 'cell')} of second order ({_named(facts.mesh, 2)}): finite-volume solvers read "
            "corners only or refuse them; write the mesh in first order",
        )
    if facts.options.discipline == "fea":
        stiff = [block for block in blocks if block.type == "tet" and len(block)]
        if not stiff:
            return None
        rows = np.concatenate([block.rows for block in stiff])
        return Found(
            rows,
            f"{counted(len(rows), 'tetrahedron', 'tetrahedra')} of first order: their strain is constant and they "
            "are far too stiff in bending; use second order (tet10)",
        )
    return None


def _named(mesh: Mesh, order: int) -> str:
    return ", ".join(f"{len(b):,} {b.type}" for b in mesh.blocks if len(b) and CELL_TYPES[b.type].order == order)


def simplex_elements(facts: Facts) -> Found | None:
    """Triangles and tetrahedra of first order, where finite elements are meant."""
    if facts.options.discipline != "fea":
        return None
    plainest = [block for block in facts.mesh.blocks if block.type in ("tri", "tet") and len(block)]
    if not plainest:
        return None
    rows = np.concatenate([block.rows for block in plainest])
    return Found(
        rows,
        f"{counted(len(rows), 'simplex element')} of first order "
        f"({', '.join(f'{len(b):,} {b.type}' for b in plainest)}): strain and stress are constant in each of them; "
        "expect steps between neighbours and refine where stress matters",
        detail={"simplices": {block.type: len(block) for block in plainest}, "cells": facts.mesh.n_cells},
    )


def line_elements(facts: Facts) -> Found | None:
    """Elements of one dimension, in a report on finite elements with their lengths and free ends.

    Line elements on the edges of a flat mesh are its boundary and not counted.
    """
    mesh, discipline = facts.mesh, facts.options.discipline
    if discipline not in ("cfd", "fea") or not mesh.boundary:
        return None
    ends, rows = _lines(mesh)
    if not len(rows):
        return None
    if discipline == "cfd":
        return Found(
            rows,
            f"{counted(len(rows), 'line element')}: nothing in a flow simulation uses them; leave them out of "
            "the export",
            entity="edge",
            of_boundary=True,
            severity="warning",
        )
    with np.errstate(all="ignore"):
        step = mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]]
        length = np.hypot(np.hypot(step[:, 0], step[:, 1]), step[:, 2])
    uses = np.bincount(ends.ravel(), minlength=len(mesh.points))
    free = np.flatnonzero((uses == 1) & ~used_points(mesh) & ~_on_faces(mesh))
    zero = int(np.count_nonzero(length == 0.0))
    detail: dict[str, Any] = {
        "elements": len(rows),
        "length": {name: _figure(f, length) for name, f in (("min", np.min), ("mean", np.mean), ("max", np.max))},
        "total_length": _figure(np.sum, length),
        "without_length": zero,
        "free_ends": len(free),
        "free_end_points": (free if mesh.point_ids is None else mesh.point_ids[free])[:_LISTED].tolist(),
    }
    return Found(
        rows,
        f"{counted(len(rows), 'line element')} (beams, bars, links, springs) of {_range(length)} length, {zero} of "
        f"them without any, with {counted(len(free), 'free end')}: check that each free end is meant",
        entity="edge",
        of_boundary=True,
        detail=detail,
    )


def _figure(function: Any, length: Floats) -> Any:
    sure = length[np.isfinite(length)]
    with np.errstate(over="ignore"):
        return plain(float(function(sure))) if len(sure) else "nan"


def _range(length: Floats) -> str:
    sure = length[np.isfinite(length)]
    return f"{sure.min():.4g} to {sure.max():.4g}" if len(sure) else "unknown"


def _lines(mesh: Mesh) -> tuple[Ints, Ints]:
    """(ends (m, 2), rows (m,)) of the line elements that are no edges of a flat mesh."""
    blocks = [block for block in mesh.boundary if CELL_TYPES[block.type].dimension == 1 and len(block)]
    if not blocks:
        return np.empty((0, 2), np.int32), index_array([])
    ends, rows = np.concatenate([b.nodes[:, :2] for b in blocks]), np.concatenate([b.rows for b in blocks])
    if mesh.dimension == 2:
        beams = faces_of_elements(mesh)[rows] < 0
        ends, rows = ends[beams], rows[beams]
    return ends, rows


def _on_faces(mesh: Mesh) -> NDArray[np.bool_]:
    """Points of the surface elements that a file lists: a bar that ends at one of them is held."""
    held = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.boundary:
        if CELL_TYPES[block.type].dimension == 2:
            held[block.nodes] = True
            if block.items is not None:
                held[block.items] = True
    return held


def misplaced_pyramids(facts: Facts) -> Found | None:
    """Pyramids that are no transition: nothing with quadrilateral sides below the base, or no tetrahedron beside."""
    mesh = facts.mesh
    rows = np.concatenate([b.rows for b in mesh.blocks if CELL_TYPES[b.type].corners == "pyramid"] or [index_array([])])
    if not len(rows):
        return None
    kind = np.zeros(mesh.n_cells + 1, dtype=np.int8)  # the last one stands for no cell
    for block in mesh.blocks:
        kind[block.rows] = _KINDS.get(CELL_TYPES[block.type].corners, 0)
    kind[-1] = _OUTSIDE
    found = faces(mesh)
    offsets, items = take(*faces_of_cells(mesh), rows)
    of = np.repeat(np.arange(len(rows)), np.diff(offsets))
    cell = np.where(found.owner[items] == rows[of], found.neighbour[items], found.owner[items])
    beyond = kind[np.where(cell == NO_CELL, mesh.n_cells, cell)]
    is_base = np.diff(found.offsets)[items] == 4

    def count(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
        return np.bincount(of[mask], minlength=len(rows))

    stands = count(is_base & (beyond == _SIDED)) > 0
    beside = count(~is_base & (beyond == _TET)) > 0
    wrong = ~(stands & beside)
    if not wrong.any():
        return None
    detail = {
        "base_on_pyramid": int(np.count_nonzero(count(is_base & (beyond == _PYRAMID))[wrong])),
        "base_on_boundary": int(np.count_nonzero(count(is_base & (beyond == _OUTSIDE))[wrong])),
        "no_tetrahedron_beside": int(np.count_nonzero(~beside)),
        "pyramids": len(rows),
    }
    return Found(
        rows[wrong],
        f"{counted(int(wrong.sum()), 'pyramid')} of {len(rows):,} that do not lead from the quadrilateral of a "
        f"hexahedron or prism to tetrahedra ({detail['base_on_boundary']} with the base on the boundary, "
        f"{detail['base_on_pyramid']} on another pyramid, {detail['no_tetrahedron_beside']} with no tetrahedron "
        "beside): pyramids are the least exact cells and belong into transitions only",
        detail=detail,
    )


_SIDED, _TET, _PYRAMID, _OUTSIDE = 1, 2, 3, 4
_KINDS = {"hex": _SIDED, "wedge": _SIDED, "polyhedron": _SIDED, "tet": _TET, "pyramid": _PYRAMID}


ROWS = (
    Check(
        "element-order", "warning", "Order of the elements", "cell",
        "the solver ignores the extra nodes, or the model is too stiff", element_order,
    ),
    Check(
        "simplex-elements", "info", "Simplex elements", "cell",
        "a property of the element to know of, no fault", simplex_elements,
    ),
    Check(
        "line-elements", "info", "Elements of one dimension", "edge",
        "part of many structural models; of no use to a flow solver", line_elements,
    ),
    Check(
        "misplaced-pyramids", "info", "Pyramids out of place", "cell",
        "legal, but less exact than the cells they could be", misplaced_pyramids,
    ),
)  # fmt: skip
