"""The check on hanging nodes: corners of some cells that lie inside an edge or a face of others."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from meshwright.audit.connectivity import faces, points_to_cells
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, Severity, counted
from meshwright.audit.findings.hulls.collect import collected
from meshwright.audit.findings.hulls.contacts import Contact, mesh_contacts
from meshwright.audit.findings.hulls.hull import Hull
from meshwright.audit.findings.hulls.straight import straight_corners, straight_corners_of_polygons
from meshwright.audit.mesh import Ints

__all__ = ["ROWS"]

_MOST_LISTED = 100


def hanging_nodes(facts: Facts) -> Found | None:
    """Points inside an edge or face of a cell that does not have them, or has them without a corner there."""
    mesh = facts.mesh
    contacts = mesh_contacts(mesh)
    places = contacts.of("hanging")
    hull = contacts.hull
    points = hull.points[contacts.hanging_points]
    straight, cells = _straight(facts)
    rows = np.union1d(points, straight)
    if not len(rows):
        return None
    families, levels = _families(hull, places)
    severity: Severity = "warning" if len(points) else "info"
    if len(points):
        message = (
            f"{counted(len(rows), 'hanging node')}: corners of small cells inside an edge or face of larger ones "
            f"({_level_words(levels)}), which do not know them; finite elements tear there and finite volumes see a "
            "wall, unless the solver handles refinement: constrain the nodes, or split the larger cells"
        )
    else:
        message = (
            f"{counted(len(rows), 'hanging node')} of polygonal or polyhedral cells: corners without an angle, as "
            "where smaller cells meet a larger one; polyhedral solvers take this, others need such cells split"
        )
    return Found(
        rows,
        message,
        severity=severity,
        detail={
            "between_cells": len(points),
            "on_polyhedra": len(straight),
            "level_difference": {str(level): int(n) for level, n in levels},
            "families": families,
            "cells_with_straight_corners": [
                {"cell": int(mesh.ids_of_cells(cell)), "nodes": int(n)}
                for cell, n in zip(*(c[:_MOST_LISTED] for c in np.unique(cells, return_counts=True)), strict=True)
            ],
        },
    )


def _straight(facts: Facts) -> tuple[Ints, Ints]:
    """(points, cells): each corner without an angle of a polygon or polyhedron, and the cell that has it."""
    mesh = facts.mesh
    points, cells = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    found = faces(mesh)
    for block in mesh.blocks:
        if block.items is None or block.offsets is None or not len(block):
            continue
        if block.type == "polygon":
            run = partial(straight_corners_of_polygons, mesh.points, block.offsets, block.items)
        else:
            run = partial(straight_corners, mesh.points, block.offsets, block.items, found.offsets, found.nodes)
        at, of = collected(run, np.int64, np.int64)
        points.append(at)
        cells.append(block.rows[of])
    point, cell = np.concatenate(points), np.concatenate(cells)
    if len(point):  # a corner that has no angle in any cell around it bends nothing: it only splits an edge
        corner = np.diff(points_to_cells(mesh)[0])
        sharp = np.bincount(point, minlength=len(mesh.points))[point] < corner[point]
        point, cell = point[sharp], cell[sharp]
    return np.unique(point), cell


def _families(hull: Hull, places: list[Contact]) -> tuple[list[dict[str, Any]], list[tuple[int, int]]]:
    """(table of the large cells with the small ones on them, [(level difference, how many small cells)])."""
    if not places:
        return [], []
    mesh = hull.mesh
    first = np.concatenate([place.first[~place.matched] for place in places])
    second = np.concatenate([place.second[~place.matched] for place in places])
    swap = hull.area[second] > hull.area[first]
    parent, child = np.where(swap, second, first), np.where(swap, first, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        halvings = np.log2(hull.area[parent] / hull.area[child]) / (2 if hull.kind == "face" else 1)
    level = np.maximum(np.rint(halvings), 0).astype(int)
    pairs = np.unique(np.stack([hull.owner[parent], hull.owner[child], level], axis=1), axis=0)
    table = []
    for cell in np.unique(pairs[:, 0])[:_MOST_LISTED].tolist():
        of = pairs[pairs[:, 0] == cell]
        table.append(
            {
                "parent": int(mesh.ids_of_cells(cell)),
                "children": [int(mesh.ids_of_cells(row)) for row in of[:, 1].tolist()],
                "level_difference": int(of[:, 2].max()),
            }
        )
    found, counts = np.unique(pairs[:, 2], return_counts=True)
    return table, list(zip(found.tolist(), counts.tolist(), strict=True))


def _level_words(levels: list[tuple[int, int]]) -> str:
    most = max((level for level, _ in levels), default=0)
    return f"up to {counted(most, 'level')} apart" if most else "of about their size"


ROWS = (
    Check(
        "hanging-nodes", "warning", "Hanging nodes", "point",
        "cells that do not share a node are not connected there; no more than told of polyhedra, which are made to "
        "hold such nodes",
        hanging_nodes,
    ),
)  # fmt: skip
