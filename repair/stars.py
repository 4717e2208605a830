"""Raising the worst cell around a point, for cells of any linear type: the active-set method on their own quality.

The quality of a cell is the smaller of its scaled Jacobian, over its corners, and 1 minus its equiangle skew, over its
faces: what the driver judges by (`quality`), but for the middles of hexes and the apexes of pyramids. Points of one
colour share no cell, so that the result is the same on any number of threads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import nodes_of_cells
from meshwright.audit.csr import invert, uniform_offsets
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.audit.parallel import in_parallel
from meshwright.repair.carrying import padded, with_points
from meshwright.repair.foldover import ideal_corners
from meshwright.repair.held import held_points
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.quality import standing, worst_around_points, worst_at_points
from meshwright.repair.tet_smooth import colours, shortest_in_hull

__all__ = ["raise_worst_cells"]

Rows = tuple[tuple[int, ...], ...]

_TYPES = ("tri", "quad", "tet", "pyramid", "wedge", "hex")
_SWEEPS = 10
_BATCH = 256
_LARGEST_STAR = 128
_ACTIVE = 0.04
_MOST_ASCENTS = 8
_LEAST = 1e-5
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class _Tables:
    """What the quality of a cell is made of, by type.

    corners (t, 8, 4): corners and their edge neighbours, -1 for the third in the plane; ideal (t,): their determinant
    in the best cell of unit edges. angles (t, 24, 4): a corner of a face, the ones after and before it, and how many
    the face has. n_corners, n_angles (t,): rows in use.
    """

    corners: Ints
    n_corners: Ints
    ideal: Floats
    angles: Ints
    n_angles: Ints

    @classmethod
    def of(cls) -> _Tables:
        t = len(_TYPES)
        out = cls(
            np.zeros((t, 8, 4), np.int64), np.zeros(t, np.int64), np.ones(t), np.zeros((t, 24, 4), np.int64),
            np.zeros(t, np.int64),
        )  # fmt: skip
        for i, name in enumerate(_TYPES):
            kind, n = CELL_TYPES[name], CELL_TYPES[name].n_nodes
            corners = (
                list(kind.triads) if kind.dimension == 3 else [(k, (k + 1) % n, (k - 1) % n, -1) for k in range(n)]
            )
            if name == "tet":
                corners = [(0, 1, 2, 3), (1, 2, 0, 3), (2, 0, 1, 3), (3, 0, 2, 1)]
            angles = [(f[k], f[(k + 1) % len(f)], f[k - 1], len(f)) for f in kind.faces for k in range(len(f))]
            out.corners[i, : len(corners)], out.n_corners[i] = corners, len(corners)
            out.angles[i, : len(angles)], out.n_angles[i] = angles, len(angles)
            out.ideal[i] = np.linalg.det(ideal_corners(name))
        return out


@inner
def _unit_volume(x: Floats, a: int, b: int, c: int, d: int) -> float:
    """Determinant of the unit vectors from corner a to b, c, d of a cell x (8, 3); of two in the plane for d < 0."""
    ux, uy, uz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    vx, vy, vz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    size = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz)
    if d < 0:
        det = ux * vy - uy * vx
    else:
        wx, wy, wz = x[d, 0] - x[a, 0], x[d, 1] - x[a, 1], x[d, 2] - x[a, 2]
        det = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
        size *= wx * wx + wy * wy + wz * wz
    return det / math.sqrt(size) if size > 0.0 else -1.0


@inner
def _cosine(x: Floats, a: int, b: int, c: int) -> float:
    """Of the angle at corner a of a face, between its neighbours b and c."""
    ux, uy, uz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    vx, vy, vz = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
    size = math.sqrt((ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz))
    return (ux * vx + uy * vy + uz * vz) / size if size > 0.0 else 1.0


@inner
def _quality(
    x: Floats, kind: int, corners: Ints, n_corners: Ints, ideal: Floats, angles: Ints, n_angles: Ints
) -> float:
    """The smaller of the scaled Jacobian and 1 minus the equiangle skew of a cell with corners x (8, 3)."""
    low = np.inf
    for i in range(n_corners[kind]):
        det = _unit_volume(x, corners[kind, i, 0], corners[kind, i, 1], corners[kind, i, 2], corners[kind, i, 3])
        low = min(low, det / ideal[kind])
    if low <= 0.0:
        return low
    for width in (3, 4):
        high_cos, low_cos = -2.0, 2.0
        for i in range(n_angles[kind]):
            if angles[kind, i, 3] == width:
                c = _cosine(x, angles[kind, i, 0], angles[kind, i, 1], angles[kind, i, 2])
                high_cos, low_cos = max(high_cos, c), min(low_cos, c)
        if high_cos >= -1.0:
            best = math.pi / 3.0 if width == 3 else math.pi / 2.0
            small, large = math.acos(min(1.0, high_cos)), math.acos(max(-1.0, low_cos))
            low = min(low, small / best, (math.pi - large) / (math.pi - best))
    return low


@inner
def _load(points: Floats, cells: Ints, c: int, p: int, x: Floats) -> int:
    """Write the corners of cell c into x (8, 3); which of them is the point p."""
    at = -1
    for k in range(cells.shape[1]):
        q = cells[c, k]
        if q < 0:
            break
        if q == p:
            at = k
        for i in range(3):
            x[k, i] = points[q, i]
    return at


@inner
def _gather(
    points: Floats, cells: Ints, kinds: Ints, begin: Ints, items: Ints, least: Floats, p: int, n: int,
    star: Floats, place: Ints, kind: Ints, floor: Floats, value: Floats,
    corners: Ints, n_corners: Ints, ideal: Floats, angles: Ints, n_angles: Ints,
) -> tuple[float, float]:  # fmt: skip
    """(shortest edge at p, smallest quality) of the n cells at p, which are written into the other arguments.

    star (n, 8, 3): their corners; place (n,): which of them is p; kind, floor, value (n,): type, quality that they may
    not fall under, quality.
    """
    reach, low = np.inf, np.inf
    for i in range(n):
        c = items[begin[p] + i]
        place[i], kind[i] = _load(points, cells, c, p, star[i]), kinds[c]
        floor[i] = -np.inf
        for k in range(cells.shape[1]):
            if cells[c, k] >= 0:
                floor[i] = max(floor[i], least[cells[c, k]])
        value[i] = _quality(star[i], kind[i], corners, n_corners, ideal, angles, n_angles)
        low = min(low, value[i])
        for k in range(cells.shape[1]):
            if cells[c, k] >= 0 and k != place[i]:
                gap = 0.0
                for m in range(3):
                    gap += (star[i, k, m] - points[p, m]) ** 2
                reach = min(reach, gap)
    return math.sqrt(reach), low


@kernel
def _raise(
    points: Floats, cells: Ints, kinds: Ints, begin: Ints, items: Ints, least: Floats, d: int, rows: Ints,
    corners: Ints, n_corners: Ints, ideal: Floats, angles: Ints, n_angles: Ints,
) -> int:  # fmt: skip
    """Raise the smallest quality around each point of `rows` by steps of the active-set method; points that moved.

    least (n,): quality that no cell at a point may fall under.
    """
    star = np.empty((_LARGEST_STAR, 8, 3))
    place = np.empty(_LARGEST_STAR, np.int64)
    kind = np.empty(_LARGEST_STAR, np.int64)
    floor = np.empty(_LARGEST_STAR)
    value = np.empty(_LARGEST_STAR)
    trial = np.empty(_LARGEST_STAR)
    slopes = np.zeros((_LARGEST_STAR, 3))
    g = np.empty(3)
    here, there = np.empty(3), np.empty(3)
    moved = 0
    for r in range(rows.size):
        p = rows[r]
        n = begin[p + 1] - begin[p]
        if n > _LARGEST_STAR:
            continue
        reach, low = _gather(
            points, cells, kinds, begin, items, least, p, n, star, place, kind, floor, value,
            corners, n_corners, ideal, angles, n_angles,
        )  # fmt: skip
        if not (low > 0.0 and reach > 0.0):
            continue
        for m in range(3):
            here[m] = points[p, m]
        started, step, h = low, 0.1 * reach, 1e-6 * reach
        for _ in range(_MOST_ASCENTS):
            active = 0
            for i in range(n):
                if value[i] <= low + _ACTIVE * low:
                    for m in range(d):
                        star[i, place[i], m] = here[m] + h
                        ahead = _quality(star[i], kind[i], corners, n_corners, ideal, angles, n_angles)
                        star[i, place[i], m] = here[m] - h
                        behind = _quality(star[i], kind[i], corners, n_corners, ideal, angles, n_angles)
                        star[i, place[i], m] = here[m]
                        slopes[active, m] = (ahead - behind) / (2.0 * h)
                    active += 1
            size = shortest_in_hull(slopes, active, g)
            if not size * reach > 1e-4:
                break
            better = False
            fresh = low
            for _ in range(6):
                fresh, worse = np.inf, False
                for m in range(3):
                    there[m] = here[m] + (step / size * g[m] if m < d else 0.0)
                for i in range(n):
                    for m in range(3):
                        star[i, place[i], m] = there[m]
                    trial[i] = _quality(star[i], kind[i], corners, n_corners, ideal, angles, n_angles)
                    fresh = min(fresh, trial[i])
                    worse = worse or trial[i] < floor[i]
                if fresh > low and not worse:
                    better = True
                    break
                step *= 0.45
            if not better:
                for i in range(n):
                    for m in range(3):
                        star[i, place[i], m] = here[m]
                break
            gain = fresh - low
            low = fresh
            here[:] = there
            for i in range(n):
                value[i] = trial[i]
            if gain < 1e-4 * low:
                break
            step *= 1.6
        if low > started * (1.0 + _LEAST):
            for m in range(3):
                points[p, m] = here[m]
            moved += 1
    return moved


def raise_worst_cells(mesh: Mesh, options: Options) -> Outcome:
    """Move inner points of linear cells of any type so that the worst cell around each gets better.

    Points of curved surfaces stay, and those at cells that are inverted: `untangle` comes first.
    """
    known = {name: i for i, name in enumerate(_TYPES)}
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
    tables = _Tables.of()
    rest = (tables.corners, tables.n_corners, tables.ideal, tables.angles, tables.n_angles)

    def one(part: Ints) -> int:
        return int(_raise(points, cells, kinds, begin, items, least, mesh.cell_dimension, part, *rest))

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
