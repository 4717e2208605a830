"""What must hold across every pass, whatever it is. One broken invariant rolls it back."""

from __future__ import annotations

import numpy as np

from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.carrying import padded
from meshwright.repair.held import held_points, sliding
from meshwright.repair.outcome import Options, Outcome, Pass
from meshwright.repair.quality import Standing, worst_around_points, worst_at_points
from meshwright.repair.sizes import signed_sizes, warp
from meshwright.repair.sliding import FIXED, PROJECT, SLIDE

__all__ = ["broken"]

_VOLUMES = {FIXED: 1e-12, SLIDE: 1e-9, PROJECT: 1e-2}
"""Part of the volume that may change: rounding, what rounding leaves of flatness, the sag of a coarse boundary."""
_OFF = 1e-9
"""Part of the extent by which rounding may take a point off the boundary that it slides on."""
_ROUNDING = 1e-9


def broken(row: Pass, mesh: Mesh, outcome: Outcome, before: Standing, after: Standing, options: Options) -> str:
    """The invariant that the outcome of a pass breaks, in words; "" where it keeps them all."""
    new = outcome.mesh
    if new.n_nonfinite:
        return f"{new.n_nonfinite} points would have no finite coordinates"
    if after.bad > before.bad:
        return f"{after.bad - before.bad} more cells would be inverted or degenerate"
    if [zone.name for zone in new.zones] != [zone.name for zone in mesh.zones]:
        return "zones would be lost"
    emptied = [z.name for z, old in zip(new.zones, mesh.zones, strict=True) if len(old.members) and not len(z.members)]
    if emptied and row.nothing_worse:
        return f"zone {emptied[0]!r} would lose its last member"
    origin = np.arange(len(new.points)) if outcome.points_from is None else outcome.points_from
    slides = sliding(mesh, options)
    stays = held_points(mesh, options) & ~slides
    old = origin >= 0
    still = old & stays[np.where(old, origin, 0)]
    if not np.array_equal(new.points[still].view(np.int64), mesh.points[origin[still]].view(np.int64)):
        return "a point that is held would move"
    along = new.points[old & slides[np.where(old, origin, 0)]]
    if len(along) and float(options.sheet.seats(along)[1].max()) > _OFF * float(np.ptp(mesh.points, axis=0).max()):
        return "a point of the boundary would leave it"
    if not row.nothing_worse:
        return ""
    bent = warp(mesh) if row.nothing_worse == "nowhere" else 0.0
    fault = _volume_change(mesh, new, _VOLUMES[options.boundary], bent)
    if fault or row.nothing_worse == "nowhere":
        return fault
    fault = _folded(mesh, new)
    if fault:
        return fault
    if row.nothing_worse == "in regions":
        return _worse_in_regions(mesh, outcome, before, after)
    return _worse_around_points(mesh, outcome, before, after)


def _volume_change(mesh: Mesh, new: Mesh, part: float, bent: float) -> str:
    """In words, "" where the signed volume (area in the plane) is the same: inner points cannot change it.

    part, bent: of it, and in all, that may change; the latter where quads of the boundary that are not flat are cut.

    A curved surface has neither; what swaps do to it is limited by the angle by which they may turn a normal.
    """
    if mesh.cell_dimension == 2 and mesh.dimension == 3:
        return ""
    one, two = (float(np.sum(signed_sizes(m))) for m in (mesh, new))
    scale = max(float(np.sum(np.abs(signed_sizes(new)))), abs(one))
    if abs(two - one) > part * scale + bent:
        return f"the volume would change from {one:.17g} to {two:.17g}"
    return ""


def _folded(mesh: Mesh, new: Mesh) -> str:
    """In words, "" where the cells of a flat mesh lie over one another no more than before.

    Quality does not tell a triangle or quad that is turned over whole; the areas without their signs do.
    """
    if mesh.cell_dimension == 3 or mesh.dimension == 3:
        return ""
    one, two = (float(np.sum(np.abs(signed_sizes(m)))) for m in (mesh, new))
    if two - one > _VOLUMES[FIXED] * one:
        return f"cells would be turned over: they would cover {two:.17g}, not {one:.17g}"
    return ""


def _worse_around_points(mesh: Mesh, outcome: Outcome, before: Standing, after: Standing) -> str:
    """No cell may be worse than the worst one was around any of its points."""
    old = worst_around_points(padded(mesh), worst_at_points(mesh, before.quality))
    new = worst_at_points(outcome.mesh, after.quality)
    origin = np.arange(len(new)) if outcome.points_from is None else outcome.points_from
    kept = np.flatnonzero(origin >= 0)
    return _fallen(old[origin[kept]], new[kept])


def _fallen(low_old: Floats, low_new: Floats) -> str:
    worse = low_new < low_old - _ROUNDING
    if not worse.any():
        return ""
    at = int(np.argmax(np.where(worse, low_old - low_new, -np.inf)))
    return f"the worst cell of a neighbourhood would fall from {low_old[at]:.4g} to {low_new[at]:.4g}"


def _worse_in_regions(mesh: Mesh, outcome: Outcome, before: Standing, after: Standing) -> str:
    """The worst cell of each connected region that changes may not get worse."""
    old_touched, new_touched = _touched(mesh, outcome)
    if not len(old_touched) or not len(new_touched):
        return ""
    region_old, region_new, n = _regions(mesh, outcome, old_touched, new_touched)
    low_old, low_new = np.full(n, np.inf), np.full(n, np.inf)
    np.minimum.at(low_old, region_old, before.quality[old_touched])
    np.minimum.at(low_new, region_new, after.quality[new_touched])
    return _fallen(low_old, low_new)


def _touched(mesh: Mesh, outcome: Outcome) -> tuple[Ints, Ints]:
    """(rows before, rows after) of the cells whose nodes or places of nodes are not the same."""
    new = outcome.mesh
    cells_from = np.arange(new.n_cells) if outcome.cells_from is None else outcome.cells_from
    old_nodes, new_nodes = padded(mesh), padded(new)
    origin = np.arange(len(new.points)) if outcome.points_from is None else outcome.points_from
    name = np.append(origin, -1)[new_nodes]
    width = max(name.shape[1], old_nodes.shape[1])
    name = np.pad(name, ((0, 0), (0, width - name.shape[1])), constant_values=-1)
    was = np.pad(old_nodes, ((0, 0), (0, width - old_nodes.shape[1])), constant_values=-1)
    same = (name == was[cells_from]).all(axis=1)
    moved = np.zeros(len(new.points) + 1, bool)
    old = origin >= 0
    moved[:-1][old] = (new.points[old] != mesh.points[origin[old]]).any(axis=1)
    moved[:-1][~old] = True
    new_touched = ~same | moved[new_nodes].any(axis=1)
    untouched = np.zeros(mesh.n_cells, bool)
    untouched[cells_from[~new_touched]] = True
    return np.flatnonzero(~untouched), np.flatnonzero(new_touched)


def _regions(mesh: Mesh, outcome: Outcome, old_rows: Ints, new_rows: Ints) -> tuple[Ints, Ints, int]:
    """Region of each touched cell: cells are in one region where they share a point, before or after."""
    from scipy.sparse import coo_array  # noqa: PLC0415 - slow to import
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    new = outcome.mesh
    origin = np.arange(len(new.points)) if outcome.points_from is None else outcome.points_from
    name = np.where(origin >= 0, origin, len(mesh.points) + np.arange(len(origin)))
    n_old, n_new = len(old_rows), len(new_rows)
    a = padded(mesh)[old_rows]
    b = np.append(name, -1)[padded(new)[new_rows]]
    cells = np.concatenate([np.repeat(np.arange(n_old), a.shape[1]), n_old + np.repeat(np.arange(n_new), b.shape[1])])
    nodes = np.concatenate([a.ravel(), b.ravel()])
    inside = nodes >= 0
    n = n_old + n_new
    links = coo_array(
        (np.ones(int(inside.sum()), np.int8), (cells[inside], n + nodes[inside])),
        shape=(n + len(mesh.points) + len(origin),) * 2,
    )
    label = connected_components(links, directed=False)[1][:n]
    _, label = np.unique(label, return_inverse=True)
    return label[:n_old], label[n_old:], int(label.max()) + 1
