"""Cleaning up: weld points that lie on one another; drop cells without an inside, second copies, points of no cell."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import duplicate_cells, edges, unused_points
from meshwright.audit.errors import MeshError
from meshwright.audit.geometry import cell_geometry
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.carrying import assignable, with_cells, without_points
from meshwright.repair.outcome import Options, Outcome

__all__ = ["clusters_within", "drop_degenerate", "drop_duplicates", "drop_unused", "weld"]

_DEFAULT = 1e-6
"""Part of the shortest edge within which points are welded when no tolerance is given."""
_NOTHING = 1e-12
"""Volume over the cube of the extent below which a cell has no inside."""
_MOST = 0.1
"""A tolerance above this part of the shortest edge that is longer than it would pull cells flat: refused."""


def weld(mesh: Mesh, options: Options) -> Outcome:
    """Join points that lie within the tolerance of each other into the one of the lowest row.

    Cells that are left without an inside by it are dropped.
    """
    assignable(mesh)
    if mesh.n_nonfinite:
        raise MeshError(f"{mesh.n_nonfinite} points have no finite coordinates: nothing can be welded to them")
    lengths = _edge_lengths(mesh)
    lengths = lengths[lengths > 0.0]
    shortest = float(lengths.min()) if len(lengths) else 0.0
    tolerance = _DEFAULT * shortest if options.tolerance is None else options.tolerance
    longer = lengths[lengths > tolerance]
    if len(longer) and tolerance > _MOST * float(longer.min()):
        raise MeshError(
            f"a tolerance of {tolerance:.3g} is too large: it must stay under {_MOST:g} of the shortest edge left, "
            f"{float(longer.min()):.3g}"
        )
    cluster = clusters_within(mesh.points, tolerance)
    n = len(mesh.points)
    first = np.full(int(cluster.max()) + 1, n, np.int64)
    np.minimum.at(first, cluster, np.arange(n))
    target = first[cluster]
    gone = n - len(first)
    if not gone:
        return Outcome(mesh, 0)
    keep = np.unique(target)
    into = np.searchsorted(keep, target)
    fresh, points_from = without_points(mesh, keep, into)
    note = f"points welded within {tolerance:.3g}"
    flat = drop_degenerate(fresh, options)
    if flat.changed:
        note += f", {flat.changed} cells without an inside dropped"
    return Outcome(flat.mesh, gone, note, points_from=points_from, cells_from=flat.cells_from, refused=flat.refused)


def _edge_lengths(mesh: Mesh) -> Floats:
    ends = mesh.points[edges(mesh)]
    return np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)


def clusters_within(points: Floats, tolerance: float) -> Ints:
    """(n,) cluster of each point: chains of neighbours, but a chain wider than two tolerances is not joined."""
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    n = len(points)
    links = coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    count, label = connected_components(links, directed=False)
    if count == n:
        return label
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label, points)
    np.maximum.at(high, label, points)
    wide = np.linalg.norm(high - low, axis=1) > 2.0 * tolerance
    if not wide.any():
        return label
    apart = wide[label]
    label = np.where(apart, count + np.arange(n), label)
    return np.unique(label, return_inverse=True)[1]


def _without_cells(mesh: Mesh, gone: Ints, note: str) -> Outcome:
    if not len(gone):
        return Outcome(mesh, 0)
    if len(gone) == mesh.n_cells:
        return Outcome(mesh, 0, refused=("no cell would be left",))
    keep = np.ones(mesh.n_cells, bool)
    keep[gone] = False
    cells = {block.type: (block.nodes[keep[block.rows]], block.rows[keep[block.rows]]) for block in mesh.blocks}
    fresh, cells_from = with_cells(mesh, cells)
    return Outcome(fresh, len(gone), note, cells_from=cells_from)


def drop_degenerate(mesh: Mesh, options: Options) -> Outcome:
    """Drop the cells that name a point twice among their corners and have no volume.

    A hex with corners in common can be a good wedge, as FEA codes write it: that one stays.
    """
    assignable(mesh)
    size = np.abs(cell_geometry(mesh).volume)
    gone = []
    for block in mesh.blocks:
        nodes = block.nodes[:, : CELL_TYPES[block.type].n_corners]
        corners = np.sort(nodes, axis=1)
        twice = (corners[:, 1:] == corners[:, :-1]).any(axis=1)
        reach = np.ptp(mesh.points[nodes], axis=1).max(axis=1) ** mesh.cell_dimension
        gone.append(block.rows[twice & ~(size[block.rows] > _NOTHING * reach)])
    return _without_cells(mesh, np.sort(np.concatenate(gone)), "cells without an inside dropped")


def drop_duplicates(mesh: Mesh, options: Options) -> Outcome:
    """Drop each cell that has the nodes of an earlier one."""
    assignable(mesh)
    return _without_cells(mesh, np.unique(duplicate_cells(mesh)[:, 0]), "second copies of cells dropped")


def drop_unused(mesh: Mesh, options: Options) -> Outcome:
    """Drop the points that no cell, boundary element or zone of points names, and no reader left out of a cell."""
    assignable(mesh)
    keep = np.ones(len(mesh.points), bool)
    keep[unused_points(mesh)] = False
    for named in (*(b.nodes for b in mesh.boundary), *(z.members for z in mesh.zones if z.entity == "point")):
        keep[named] = True
    if mesh.spare_points is not None:
        keep[mesh.spare_points] = True
    if keep.all():
        return Outcome(mesh, 0)
    rows = np.flatnonzero(keep)
    into = np.full(len(keep), -1, np.int64)
    into[rows] = np.arange(len(rows))
    fresh, points_from = without_points(mesh, rows, into)
    return Outcome(fresh, int(np.count_nonzero(~keep)), "unused points dropped", points_from=points_from)
