"""Two parts that lie against each other with points of their own become one: a weld of free sides alone."""

from __future__ import annotations

import numpy as np

from meshwright.audit.connectivity import cell_components, faces
from meshwright.audit.errors import MeshError
from meshwright.audit.mesh import NO_CELL, Ints, Mesh
from meshwright.repair.carrying import assignable, without_points
from meshwright.repair.clean import clusters_within
from meshwright.repair.outcome import Options, Outcome

__all__ = ["stitch"]

_DEFAULT = 1e-3
"""Part of the shortest free side within which points are joined when no tolerance is given."""
_MOST = 0.1


def stitch(mesh: Mesh, options: Options) -> Outcome:
    """Join the points of free sides of one part with those of another that lie within the tolerance of them.

    Points of one part are never joined with each other, so that no cell is pulled flat. Sides that do not fit the other
    part point by point stay free; those of triangles `split-junctions` can cut.
    """
    assignable(mesh)
    part = cell_components(mesh)
    if int(part.max(initial=0)) == 0:
        return Outcome(mesh, 0)
    rim, of, shortest = _rim(mesh, part)
    if not len(rim):
        return Outcome(mesh, 0)
    tolerance = _DEFAULT * shortest if options.tolerance is None else options.tolerance
    if tolerance > _MOST * shortest:
        raise MeshError(
            f"a tolerance of {tolerance:.3g} is too large: it must stay under {_MOST:g} of the shortest free side, "
            f"{shortest:.3g}"
        )
    cluster = clusters_within(mesh.points[rim], tolerance)
    # a cluster with two points of one part is left alone: which of them belongs to the other part, nobody can tell
    keys = np.stack([cluster, of], axis=1)
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    unclear = np.zeros(int(cluster.max()) + 1, np.bool_)
    unclear[cluster[first[count > 1]]] = True
    joins = ~unclear[cluster]
    target = np.arange(len(mesh.points))
    lowest = np.full(int(cluster.max()) + 1, len(mesh.points), np.int64)
    np.minimum.at(lowest, cluster[joins], rim[joins])
    target[rim[joins]] = lowest[cluster[joins]]
    gone = int(np.count_nonzero(target != np.arange(len(target))))
    if not gone:
        return Outcome(mesh, 0)
    keep = np.unique(target)
    fresh, points_from = without_points(mesh, keep, np.searchsorted(keep, target))
    left = int(np.count_nonzero(_free(fresh)))
    note = f"points of free sides joined within {tolerance:.3g}; {left:,} free sides are left"
    return Outcome(fresh, gone, note, points_from=points_from)


def _free(mesh: Mesh) -> np.ndarray:
    return np.asarray(faces(mesh).neighbour == NO_CELL)


def _rim(mesh: Mesh, part: Ints) -> tuple[Ints, Ints, float]:
    """(points of free sides, part of each, length of the shortest edge of free sides)."""
    sides = faces(mesh)
    free = _free(mesh)
    width = np.diff(sides.offsets)
    nodes = sides.nodes[np.repeat(free, width)].astype(np.int64)
    of = np.repeat(part[sides.owner[free]], width[free])
    nearest = np.inf
    for w in np.unique(width[free]):
        rows = np.flatnonzero(free & (width == w))
        x = mesh.points[sides.nodes[sides.offsets[rows].astype(np.int64)[:, None] + np.arange(w)]]
        along = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
        nearest = min(nearest, float(along.min()))
    pairs = np.unique(np.stack([nodes, of], axis=1), axis=0)
    return pairs[:, 0], pairs[:, 1], nearest
