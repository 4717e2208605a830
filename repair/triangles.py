"""Passes on triangles: swaps for angles and for valence, smoothing; points put in and taken away where free."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.csr import invert, uniform_offsets
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.audit.node_classes import features
from meshwright.repair.carrying import with_cells, with_more_points, with_points, without_gone
from meshwright.repair.held import edge_walls, held_points
from meshwright.repair.outcome import FREE, Options, Outcome
from meshwright.repair.quality import worst_around_points
from meshwright.repair.tet_stars import colours
from meshwright.repair.tri_nodes import contract, insert
from meshwright.repair.tri_tables import (
    cost_sum,
    flip,
    held_by_borders,
    neighbours_of,
    relax,
    smallest_angles,
    worst_at_points,
)

__all__ = ["improve_triangles", "triangles"]

Mask = NDArray[np.bool_]

_TURN = float(np.cos(np.radians(5.0)))
"""Swaps and moves that turn a normal of a curved surface further than this change its shape: refused."""
_ROUNDS = 30
_VALENCE_ROUNDS = 22
"""Rounds that swap for valence; those after it settle the angles."""
_ROUNDING = 1e-12
_GOOD = 0.62
"""Fitness that a triangle is raised to where it can be: angles of about 37 and 106 degrees."""
_FREE_ROUNDS = 6
_WORST_PART = 0.03
"""Part of the triangles, the worst, around which points are put in and taken away."""
_ROOM = 0.1
_SETTLED = 1e-4
"""Relative gain of the cost under which a round without swaps is the last."""


def triangles(mesh: Mesh, options: Options) -> Outcome:
    """Swap and smooth the triangles of a flat or surface mesh; other cells beside them are not touched."""
    if mesh.faces is not None or mesh.cell_dimension != 2 or mesh.order > 1:
        return Outcome(mesh, 0)
    if not any(block.type == "tri" and len(block) for block in mesh.blocks):
        return Outcome(mesh, 0)
    block = mesh.block("tri")
    held = held_points(mesh, options)
    for other in mesh.blocks:
        if CELL_TYPES[other.type].corners != "tri":
            held[other.nodes if other.items is None else other.items] = True
    walls = edge_walls(mesh)
    flat = mesh.dimension == 2
    if not flat:
        found = features(mesh, 5.0)
        walls = np.concatenate([walls, np.asarray(found.edges[found.sharp], np.int64)])
    n = len(mesh.points)
    points, tris, parents, swaps = improve_triangles(
        mesh.points, block.nodes, held, walls, flat=flat, free=options.nodes == FREE
    )
    moved = int(np.count_nonzero((points[:n] != mesh.points).any(axis=1)))
    if not swaps and not moved:
        return Outcome(mesh, 0)
    fresh = with_more_points(with_points(mesh, points[:n]), points[n:])
    fresh, cells_from = with_cells(fresh, {"tri": (tris, block.rows[parents])})
    note, points_from = f"{swaps:,} swaps, {moved:,} points moved", None
    gone = np.setdiff1d(np.append(block.nodes, np.arange(n, len(points))), tris)
    if len(gone) or len(points) > n:
        fresh, points_from, told = without_gone(fresh, gone, n)
        note += told
    return Outcome(fresh, swaps + moved, note, points_from=points_from, cells_from=cells_from)


def improve_triangles(
    points: Floats, tris: Ints, held: Mask, walls: Ints, *, flat: bool, free: bool = False
) -> tuple[Floats, Ints, Ints, int]:
    """(points, tris, triangle that each stands for, number of swaps): settled, and, where points are free, again with
    some put in and taken away around the worst.

    points (n, 3), tris (m, 3); held (n,) points and walls (k, 2) edges stay. flat: all in the x-y plane.
    """
    least = worst_around_points(tris, worst_at_points(points, np.asarray(tris, np.int64), len(points))) - _ROUNDING
    points, found, swaps = _settled(points, tris, held, walls, least, flat)
    parents = np.arange(len(found))
    for _ in range(_FREE_ROUNDS if free else 0):
        points, changed, of, made, least, held = _with_nodes(points, found, held, walls, least, flat)
        if not made:
            break
        points, found, more = _settled(points, changed, held, walls, least, flat)
        parents, swaps = parents[of], swaps + made + more
    return points, found, parents, swaps


def _with_nodes(
    points: Floats, tris: Ints, held: Mask, walls: Ints, least: Floats, flat: bool
) -> tuple[Floats, Ints, Ints, int, Floats, Mask]:
    """(points, tris, triangle each stands for, changes, least, held) after a sweep of contractions and insertions."""
    turn = 0.0 if flat else _TURN
    below = max(_GOOD, float(np.quantile(smallest_angles(points, tris), _WORST_PART)))
    n, made = len(points), 0
    across = neighbours_of(tris, walls)
    stays = held | held_by_borders(tris, across, n)
    begin, items = invert(uniform_offsets(len(tris), 3), tris.ravel(), n)
    gone = np.zeros(len(tris), np.bool_)
    changed = np.array(tris)
    made += int(contract(points, changed, begin, items, stays, least, below, turn, gone))
    of = np.flatnonzero(~gone)
    changed = changed[of]
    spare = int(_ROOM * n) + 1
    wider = np.concatenate([points, np.zeros((spare + 1, 3))])
    count = np.array([n])
    wide_least = np.concatenate([least, np.full(spare + 1, -np.inf)])
    gone = np.zeros(len(changed), np.bool_)
    fresh, parent = np.empty((8 * spare, 3), np.int64), np.empty(8 * spare, np.int64)
    across = neighbours_of(changed, walls)
    new = int(insert(wider, count, changed, across, wide_least, below, turn, flat, gone, fresh, parent))
    made += int(count[0]) - n
    keep = np.flatnonzero(~gone)
    out = np.concatenate([changed[keep], fresh[:new]])
    stands = np.concatenate([of[keep], of[parent[:new]]])
    m = int(count[0])
    return wider[:m], out, stands, made, wide_least[:m], np.concatenate([held, np.zeros(m - n, np.bool_)])


def _settled(
    points: Floats, tris: Ints, held: Mask, walls: Ints, least: Floats, flat: bool
) -> tuple[Floats, Ints, int]:
    """(points, tris, number of swaps): angles first, then valence and smoothing in turn, then the worst.

    least (n,): fitness that no triangle at a point may fall under.
    """
    points = np.array(points, dtype=np.float64)
    tris = np.array(tris, dtype=np.int64)
    n = len(points)
    turn = 0.0 if flat else _TURN
    across = neighbours_of(tris, walls)
    held = held | held_by_borders(tris, across, n)
    degree, ideal = _degrees(tris, across, n), _ideal_degrees(points, tris, across, n)

    def swap(by_valence: bool) -> int:
        return int(flip(points, tris, across, least, degree, ideal, by_valence, turn))

    def move(aim: float, sweeps: int) -> int:
        return _move(points, tris, held, least, aim, turn, flat, sweeps)

    swaps = 0
    for _ in range(_ROUNDS):
        now = swap(by_valence=False)
        swaps += now
        if not now:
            break
    total = np.inf
    for i in range(_ROUNDS):
        now = swap(by_valence=i < _VALENCE_ROUNDS)
        move(0.0, sweeps=2)
        swaps += now
        before, total = total, float(cost_sum(points, tris))
        if not now and before - total < _SETTLED * total:
            break
    for _ in range(_ROUNDS):
        now, moved = swap(by_valence=False), move(_GOOD, sweeps=1)
        swaps += now
        if not now + moved:
            break
    return points, tris, swaps


def _move(
    points: Floats, tris: Ints, held: Mask, least: Floats, aim: float, turn: float, flat: bool, sweeps: int
) -> int:
    """Move all points for the cost, or, with an aim, those of triangles below it to raise the worst; moves made."""
    n = len(points)
    begin, items = invert(uniform_offsets(len(tris), 3), tris.ravel(), n)
    rows = np.flatnonzero(~held & (np.diff(begin) > 0))
    if aim > 0.0:
        bad = np.zeros(n, bool)
        bad[tris[smallest_angles(points, tris) < aim]] = True
        rows = rows[bad[rows]]
    order, stops = colours(tris, begin, items, rows)
    moved = 0
    for _ in range(sweeps):
        for c in range(len(stops) - 1):
            part = order[stops[c] : stops[c + 1]]
            moved += int(relax(points, tris, begin, items, least, part, aim, aim, turn, flat))
    return moved


def _degrees(tris: Ints, across: Ints, n: int) -> Ints:
    """(n,) edges at each point."""
    inner_half = np.bincount(tris.ravel(), minlength=n)
    border = np.zeros(n, np.int64)
    t, k = np.nonzero(across < 0)
    ends = np.concatenate([tris[t, (k + 1) % 3], tris[t, (k + 2) % 3]])
    border += np.bincount(ends, minlength=n)
    return (inner_half + border // 2).astype(np.int64)


def _ideal_degrees(points: Floats, tris: Ints, across: Ints, n: int) -> Ints:
    """(n,) 6 inside; on a border one more than the number of 60 degree angles that fit into the angle there."""
    corner = points[tris]
    angle = np.zeros(n)
    for k in range(3):
        u, v = corner[:, (k + 1) % 3] - corner[:, k], corner[:, (k + 2) % 3] - corner[:, k]
        a = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.einsum("ij,ij->i", u, v))
        angle += np.bincount(tris[:, k], a, minlength=n)
    ideal = np.full(n, 6, np.int64)
    on_border = held_by_borders(tris, across, n)
    ideal[on_border] = np.maximum(np.rint(angle[on_border] / (np.pi / 3.0)), 1).astype(np.int64) + 1
    return ideal
