"""Wanted edge lengths against those of the mesh.

Precedence as in ICEM CFD and its kin: global < point < line < surface. The regions of space (boxes, cylinders, spheres)
and of cells stand with the global size, a later one over an earlier one; a point, a line and a surface zone overrule
them all, in this order. An edge meets its size h when it is between h / sqrt(2) and h sqrt(2) long, the unit mesh of
Frey and George (Mesh Generation, 2000).
"""

from __future__ import annotations

import fnmatch
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import edges, faces, nodes_of_cells
from meshwright.audit.csr import ragged, take
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.options import SizeRegion
from meshwright.audit.mesh import CellBlock, Ints, Mesh, Zone
from meshwright.audit.places import plain

__all__ = ["ROWS", "Requested", "requested", "wanted_sizes"]

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Requested:
    """length (m,): of every row of `connectivity.edges`.  region (m,): place in `Options.sizes` of the request that
    rules the edge, -1 for none.  cells: how many cells have their middle in each region (their zone, for zones of
    cells).
    """

    length: Floats
    region: Ints
    cells: tuple[int, ...]


def requested(facts: Facts) -> Requested:
    """Which request rules which edge."""
    mesh, sizes = facts.mesh, facts.options.sizes
    table = edges(mesh)
    a, b = mesh.points[table[:, 0]], mesh.points[table[:, 1]]
    with np.errstate(all="ignore"):
        step = b - a
        length = np.hypot(np.hypot(step[:, 0], step[:, 1]), step[:, 2])
        middle = 0.5 * a + 0.5 * b
    rank = np.full(len(table), -1)
    region = np.full(len(table), -1)
    cells = []
    for k, size in enumerate(sizes):
        count = 0
        if size.shape == "zone":
            zones = [zone for zone in mesh.zones if fnmatch.fnmatchcase(zone.name, size.zone)]
            holds = [_edges_of_zone(mesh, zone, table) for zone in zones]
            count = sum(len(zone.members) for zone in zones if zone.entity == "cell")
        else:
            holds = [(0, inside(size, middle))]
            count = int(np.count_nonzero(inside(size, _middles(mesh))))
        cells.append(count)
        for of, mask in holds:
            ruled = mask & (rank <= of)
            rank[ruled], region[ruled] = of, k
    return Requested(length, region, tuple(cells))


def inside(region: SizeRegion, places: Floats) -> Mask:
    """Whether these places (n, 3) lie in a region of space, its surface included."""
    at = np.array(region.place, dtype=np.float64)
    with np.errstate(all="ignore"):
        if region.shape == "box":
            within = (places >= at[:3]) & (places <= at[3:6])
            return within[:, 0] & within[:, 1] & within[:, 2]
        if region.shape == "sphere":
            return ((places - at[:3]) ** 2).sum(axis=1) <= at[3] ** 2
        if region.shape == "cylinder":
            axis = at[3:6] - at[:3]
            along = (places - at[:3]) @ axis / (axis @ axis)
            off = places - at[:3] - along[:, None] * axis
            return (along >= 0.0) & (along <= 1.0) & ((off**2).sum(axis=1) <= at[6] ** 2)
    finite = np.isfinite(places)
    return finite[:, 0] & finite[:, 1] & finite[:, 2]


def _middles(mesh: Mesh) -> Floats:
    offsets, nodes = nodes_of_cells(mesh)
    with np.errstate(all="ignore"):
        return np.add.reduceat(mesh.points[nodes], offsets[:-1], axis=0) / np.diff(offsets)[:, None]


def _edges_of_zone(mesh: Mesh, zone: Zone, table: Ints) -> tuple[int, Mask]:
    """(rank, which edges) of a zone: 0 for cells, 1 for points, 2 for lines, 3 for surfaces."""
    if zone.entity == "point":
        chosen = np.zeros(len(mesh.points), dtype=bool)
        chosen[zone.members] = True
        return 1, _touching(table, chosen)
    wanted = np.zeros(mesh.n_cells if zone.entity == "cell" else _n_faces(mesh), dtype=bool)
    wanted[zone.members] = True
    if zone.entity == "cell":
        return 0, _among(table, _ends(mesh, mesh.blocks, wanted), len(mesh.points))
    if mesh.faces is not None:
        loops = take(mesh.faces.offsets, mesh.faces.nodes, np.flatnonzero(wanted))
        ends = _around(*loops) if mesh.cell_dimension == 3 else loops[1].reshape(-1, 2)
        return mesh.cell_dimension, _among(table, ends, len(mesh.points))
    rank = max((CELL_TYPES[b.type].dimension for b in mesh.boundary if wanted[b.rows].any()), default=0)
    if rank == 0:
        points = [b.nodes[wanted[b.rows]].ravel() for b in mesh.boundary]
        chosen = np.zeros(len(mesh.points), dtype=bool)
        chosen[np.concatenate([*points, np.empty(0, np.int32)])] = True
        return 1, _touching(table, chosen)
    return rank + 1, _among(table, _ends(mesh, mesh.boundary, wanted), len(mesh.points))


def _touching(table: Ints, chosen: Mask) -> Mask:
    """Rows of `table` with an end among the chosen points."""
    return chosen[table[:, 0]] | chosen[table[:, 1]]


def _n_faces(mesh: Mesh) -> int:
    return mesh.n_boundary if mesh.faces is None else len(mesh.faces)


def _ends(mesh: Mesh, blocks: tuple[CellBlock, ...], wanted: Mask) -> Ints:
    """(k, 2) edges of the chosen cells or elements, repeats and all."""
    found: list[Ints] = [np.empty((0, 2), np.int32)]
    for block in blocks:
        at = np.flatnonzero(wanted[block.rows])
        if not len(at):
            continue
        if block.items is None:
            found.append(block.nodes[at][:, CELL_TYPES[block.type].edge_table].reshape(-1, 2))
            continue
        loops = take(*ragged(block), at)
        if block.type == "polyhedron":
            loops = take(faces(mesh).offsets, faces(mesh).nodes, np.unique(loops[1]))
        found.append(_around(*loops))
    return np.concatenate(found)


def _around(offsets: Ints, nodes: Ints) -> Ints:
    after = np.roll(nodes, -1)
    after[offsets[1:] - 1] = nodes[offsets[:-1]]
    return np.stack([nodes, after], axis=1)


def _among(table: Ints, ends: Ints, n: int) -> Mask:
    """Which rows of `table` are among these edges."""
    scale = np.array([n, 1], dtype=np.int64)
    return np.isin(table @ scale, np.sort(ends, axis=1) @ scale)


def size_requests(facts: Facts) -> Found | None:
    """A table of wanted and found sizes."""
    if not facts.options.sizes:
        return None
    found = requested(facts)
    rows = _cells_with(facts.mesh, found.region >= 0)
    return Found(
        rows,
        f"{counted(len(facts.options.sizes), 'size request')} compared with the edges of the mesh: see the table for "
        "mean sizes and counts",
        detail={"regions": _table(facts, found)},
    )


def size_request_missed(facts: Facts) -> Found | None:
    """Cells with an edge more than sqrt(2) too long for the request that rules it."""
    sizes = facts.options.sizes
    if not sizes:
        return None
    found = requested(facts)
    rows = _cells_with(facts.mesh, _too_long(facts, found))
    if not len(rows):
        return None
    table = _table(facts, found)
    names = [entry["name"] for entry in table if entry["too_long"]]
    return Found(
        rows,
        f"{counted(len(rows), 'cell')} with edges more than a factor sqrt(2) longer than requested "
        f"({', '.join(names[:5])}): the flow or stress there is resolved less than planned; refine these regions",
        detail={"regions": table},
    )


def wanted_sizes(facts: Facts, found: Requested) -> Floats:
    """Size that rules each edge, nan where none does."""
    return np.append([region.size for region in facts.options.sizes], np.nan)[found.region]


def _too_long(facts: Facts, found: Requested) -> Mask:
    return found.length > math.sqrt(2.0) * (1.0 + 1e-12) * wanted_sizes(facts, found)


def _table(facts: Facts, found: Requested) -> list[dict[str, Any]]:
    wanted, long = wanted_sizes(facts, found), _too_long(facts, found)
    short = found.length < wanted / math.sqrt(2.0) * (1.0 - 1e-12)
    rows = []
    for k, region in enumerate(facts.options.sizes):
        here = (found.region == k) & np.isfinite(found.length)
        length = found.length[here]
        figures = [plain(float(f(length))) for f in (np.min, np.mean, np.max)] if len(length) else [None] * 3
        rows.append(
            {
                "name": region.name, "shape": region.shape, "wanted": region.size, "cells": found.cells[k],
                "edges": len(length), "min": figures[0], "mean": figures[1], "max": figures[2],
                "too_long": int(np.count_nonzero(long & here)), "too_short": int(np.count_nonzero(short & here)),
            }
        )  # fmt: skip
    return rows


def _cells_with(mesh: Mesh, chosen: Mask) -> Ints:
    """Rows of the cells that have one of the chosen rows of `connectivity.edges`."""
    picked = edges(mesh)[chosen]
    near = np.zeros(len(mesh.points), dtype=bool)
    near[picked] = True
    scale = np.array([len(mesh.points), 1], dtype=np.int64)
    keys = picked @ scale
    out = np.zeros(mesh.n_cells, dtype=bool)
    for block in mesh.blocks:
        if block.items is None:
            ends = block.nodes[:, CELL_TYPES[block.type].edge_table]
            out[block.rows] = np.isin(np.sort(ends, axis=2) @ scale, keys).any(axis=1)
            continue
        loops, owner = ragged(block), block.rows
        if block.type == "polyhedron":
            owner = np.repeat(owner, np.diff(loops[0]))
            loops = take(faces(mesh).offsets, faces(mesh).nodes, loops[1])
        hit = np.isin(np.sort(_around(*loops), axis=1) @ scale, keys)
        out[np.repeat(owner, np.diff(loops[0]))[hit]] = True
    return np.flatnonzero(out)


ROWS = (
    Check(
        "size-requests", "info", "Requested sizes", "cell",
        "figures to judge by, no fault", size_requests,
    ),
    Check(
        "size-request-missed", "warning", "Cells larger than requested", "cell",
        "the user asked for a resolution that is not there", size_request_missed,
    ),
)  # fmt: skip
