"""Raising the worst cell around a point, for cells of any linear type: the active-set method on the driver's quality.

Points of one colour share no cell, so that the result is the same on any number of threads. See `tet_smooth` for tets.
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.connectivity import nodes_of_cells
from meshwright.audit.csr import invert, uniform_offsets
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.audit.parallel import in_parallel
from meshwright.repair.carrying import padded, with_points
from meshwright.repair.cell_quality import KINDS, quality_at
from meshwright.repair.held import held_points
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.quality import standing, worst_around_points, worst_at_points
from meshwright.repair.tet_climb import shortest_in_hull
from meshwright.repair.tet_stars import colours

__all__ = ["raise_worst_cells"]

_SWEEPS = 10
_BATCH = 256
_LARGEST_STAR = 128
_ACTIVE = 0.04
"""Cells whose quality is within this part of the smallest one count as worst."""
_MOST_ASCENTS = 8
_LEAST = 1e-5
_ROUNDING = 1e-9
_UP = (0.0, 0.0, 1.0)
"""Normal of a flat mesh."""


@inner
def _shortest(points: Floats, cells: Ints, begin: Ints, items: Ints, p: int) -> float:
    """Distance of p to the nearest point of its cells."""
    reach = np.inf
    for i in range(begin[p], begin[p + 1]):
        for k in range(cells.shape[1]):
            q = cells[items[i], k]
            if q >= 0 and q != p:
                x, y, z = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1], points[q, 2] - points[p, 2]
                reach = min(reach, x * x + y * y + z * z)
    return math.sqrt(reach)


@kernel
def _raise(
    points: Floats, cells: Ints, kinds: Ints, begin: Ints, items: Ints, least: Floats, d: int, rows: Ints
) -> int:
    """Raise the smallest quality around each point of `rows` by steps of the active-set method; points that moved.

    least (n,): quality that no cell at a point may fall under. d: directions in which points move.
    """
    floor = np.empty(_LARGEST_STAR)
    value = np.empty(_LARGEST_STAR)
    trial = np.empty(_LARGEST_STAR)
    slopes = np.zeros((_LARGEST_STAR, 3))
    g = np.empty(3)
    here = np.empty(3)
    moved = 0
    for r in range(rows.size):
        p = rows[r]
        first, n = begin[p], begin[p + 1] - begin[p]
        if n > _LARGEST_STAR:
            continue
        low = np.inf
        for i in range(n):
            c = items[first + i]
            floor[i] = -np.inf
            for k in range(cells.shape[1]):
                if cells[c, k] >= 0:
                    floor[i] = max(floor[i], least[cells[c, k]])
            value[i] = quality_at(points, cells, c, kinds[c], _UP)
            low = min(low, value[i])
        reach = _shortest(points, cells, begin, items, p)
        if not (low > 0.0 and reach > 0.0):
            continue
        here[:] = points[p]
        started, step, h = low, 0.1 * reach, 1e-6 * reach
        for _ in range(_MOST_ASCENTS):
            active = 0
            for i in range(n):
                if value[i] <= low + _ACTIVE * low:
                    c = items[first + i]
                    for m in range(d):
                        points[p, m] = here[m] + h
                        ahead = quality_at(points, cells, c, kinds[c], _UP)
                        points[p, m] = here[m] - h
                        behind = quality_at(points, cells, c, kinds[c], _UP)
                        points[p, m] = here[m]
                        slopes[active, m] = (ahead - behind) / (2.0 * h)
                    active += 1
            size = shortest_in_hull(slopes, active, g)
            if not size * reach > 1e-4:
                break
            better, fresh = False, low
            for _ in range(6):
                for m in range(d):
                    points[p, m] = here[m] + step / size * g[m]
                fresh, worse = np.inf, False
                for i in range(n):
                    c = items[first + i]
                    trial[i] = quality_at(points, cells, c, kinds[c], _UP)
                    fresh = min(fresh, trial[i])
                    if fresh <= low or trial[i] < floor[i]:
                        worse = True
                        break
                if not worse:
                    better = True
                    break
                step *= 0.45
            if not better:
                break
            gain = fresh - low
            low = fresh
            here[:] = points[p]
            for i in range(n):
                value[i] = trial[i]
            if gain < 1e-4 * low:
                break
            step *= 1.6
        points[p] = here
        if low > started * (1.0 + _LEAST):
            moved += 1
    return moved


def raise_worst_cells(mesh: Mesh, options: Options) -> Outcome:
    """Move inner points of linear cells of any type so that the worst cell around each gets better.

    Points of curved surfaces stay, and those at cells that are inverted: `untangle` comes first.
    """
    known = {name: i for i, name in enumerate(KINDS)}
    if mesh.cell_dimension == 2 and mesh.dimension == 3:
        return Outcome(mesh, 0)
    held = held_points(mesh, options)
    cells = padded(mesh)
    kinds = np.zeros(mesh.n_cells, np.int64)
    for block in mesh.blocks:
        if block.type in known:
            kinds[block.rows] = known[block.type]
        else:
            named = block.nodes if block.items is None else nodes_of_cells(mesh)[1]
            held[named.ravel()] = True
    points = np.array(mesh.points)
    width = cells.shape[1]
    # padding stands at a point of its own behind all others
    begin, items = invert(
        uniform_offsets(len(cells), width), np.where(cells < 0, len(points), cells).ravel(), len(points) + 1
    )
    least = worst_around_points(cells, worst_at_points(mesh, standing(mesh).quality)) - _ROUNDING
    rows = np.flatnonzero(~held & (np.diff(begin)[:-1] > 0))
    if not len(rows):
        return Outcome(mesh, 0)
    order, stops = colours(cells, begin, items, rows)

    def one(part: Ints) -> int:
        return int(_raise(points, cells, kinds, begin, items, least, mesh.cell_dimension, part))

    for sweep in range(_SWEEPS):
        options.tell("raise the worst", sweep, _SWEEPS)
        moved = 0
        for c in range(len(stops) - 1):
            same = order[stops[c] : stops[c + 1]]
            moved += sum(in_parallel(one, [same[i : i + _BATCH] for i in range(0, len(same), _BATCH)]))
        if not moved:
            break
    count = int(np.count_nonzero((points != mesh.points).any(axis=1)))
    return Outcome(with_points(mesh, points), count, "points moved to raise the worst cells around them")
