"""Quads of a flat mesh: edges turned and points taken away until four quads meet at most points, then smoothed.

Three moves (after Kinney, "CleanUp: improving quadrilateral finite element meshes", 6th International Meshing
Roundtable, 1997): a point between two quads alone goes, a quad whose opposite corners both have three quads is closed
into one of them, and the edge between two quads turns around their six corners. Each has to bring the numbers of quads
at its points nearer to their ideal, and leaves no quad under the quality that the worst one around had.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.csr import invert, uniform_offsets
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.carrying import with_cells, without_gone
from meshwright.repair.cell_quality import KINDS, quality_at
from meshwright.repair.held import edge_walls, held_points
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.pairing import pair_sides
from meshwright.repair.quality import standing, worst_around_points, worst_at_points
from meshwright.repair.stars import raise_worst_cells

__all__ = ["clean_quads"]

Mask = NDArray[np.bool_]

_QUAD = KINDS.index("quad")
_SIDES = np.array([[0, 1], [1, 2], [2, 3], [3, 0]], dtype=np.int64)
_UP = (0.0, 0.0, 1.0)
_SOUND = 0.25
"""Quality that a move may leave where it was no worse before: smoothing makes such quads good."""
_ROUNDS = 100
_ROUNDING = 1e-9
_DOUBLET, _CLOSE, _TURN = range(3)


@inner
def _good(points: Floats, trial: Ints, n: int, least: Floats, before: float) -> bool:
    """Whether the n quads of trial may stand: none under what its points had, nor unsound where none was before."""
    for i in range(n):
        q = quality_at(points, trial, i, _QUAD, _UP)
        floor = min(before, _SOUND)
        for k in range(4):
            floor = max(floor, least[trial[i, k]])
            for j in range(k):
                if trial[i, k] == trial[i, j]:
                    return False
        if not q >= floor:
            return False
    return True


@inner
def _error(count: Ints, ideal: Ints, p: int, change: int) -> int:
    off = count[p] + change - ideal[p]
    return off * off


@inner
def _joined(quads: Ints, begin: Ints, items: Ints, p: int, q: int) -> bool:
    """Whether an edge p-q is there already."""
    for i in range(begin[p], begin[p + 1]):
        for k in range(4):
            a, b = quads[items[i], k], quads[items[i], (k + 1) % 4]
            if (a == p and b == q) or (a == q and b == p):
                return True
    return False


@inner
def _touch(quads: Ints, begin: Ints, items: Ints, touched: Mask, t: int) -> None:
    """Nothing at the points of quad t is looked at again before the tables are new."""
    for k in range(4):
        p = quads[t, k]
        for i in range(begin[p], begin[p + 1]):
            touched[items[i]] = True


@kernel
def _sweep(
    points: Floats, quads: Ints, begin: Ints, items: Ints, across: Ints, held: Mask, count: Ints, ideal: Ints,
    least: Floats, gone: Mask, move: int,
) -> int:  # fmt: skip
    """One sweep of a move, by its number, over quads that do not touch; how many were made. quads, gone (m,) change.

    across (m, 4): 4 * neighbour + its side, for the side from each corner; -1 at borders.
    """
    m = quads.shape[0]
    touched = np.zeros(m, np.bool_)
    trial = np.full((8, 8), -1, np.int64)
    made = 0
    for t in range(m):
        if touched[t]:
            continue
        done = False
        for k in range(4):
            p = quads[t, k]
            if move != _DOUBLET or held[p] or count[p] != 2 or done:
                continue
            u = items[begin[p]] + items[begin[p] + 1] - t
            j = 0
            while quads[u, j] != p:
                j += 1
            a, b, c = quads[t, (k + 1) % 4], quads[t, (k + 2) % 4], quads[t, (k + 3) % 4]
            if touched[u] or quads[u, (j + 1) % 4] != c or quads[u, (j + 3) % 4] != a:
                continue
            trial[0, 0], trial[0, 1], trial[0, 2], trial[0, 3] = a, b, c, quads[u, (j + 2) % 4]
            before = min(quality_at(points, quads, t, _QUAD, _UP), quality_at(points, quads, u, _QUAD, _UP))
            if _good(points, trial, 1, least, before):
                _touch(quads, begin, items, touched, t)
                _touch(quads, begin, items, touched, u)
                quads[t, :4] = trial[0, :4]
                gone[u] = True
                made += 1
                done = True
        for k in range(2):
            p, q, r, s = quads[t, k], quads[t, k + 1], quads[t, k + 2], quads[t, (k + 3) % 4]
            if move != _CLOSE or done or held[p] or count[p] != 3 or count[r] != 3 or ideal[p] != 4 or ideal[r] != 4:
                continue
            gain = _error(count, ideal, p, 0) + _error(count, ideal, r, 0) - _error(count, ideal, r, 1)
            gain += _error(count, ideal, q, 0) - _error(count, ideal, q, -1)
            gain += _error(count, ideal, s, 0) - _error(count, ideal, s, -1)
            if gain <= 0:
                continue
            n, before, clear = 0, quality_at(points, quads, t, _QUAD, _UP), True
            for i in range(begin[p], begin[p + 1]):
                u = items[i]
                clear = clear and not touched[u]
                if u != t:
                    for j in range(4):
                        v = quads[u, j]
                        trial[n, j] = r if v == p else v
                    before = min(before, quality_at(points, quads, u, _QUAD, _UP))
                    n += 1
            if clear and _good(points, trial, n, least, before):
                n = 0
                for i in range(begin[p], begin[p + 1]):
                    _touch(quads, begin, items, touched, items[i])
                for i in range(begin[p], begin[p + 1]):
                    u = items[i]
                    if u != t:
                        quads[u, :4] = trial[n, :4]
                        n += 1
                gone[t] = True
                made += 1
                done = True
        for k in range(4):
            o = across[t, k]
            if move != _TURN or done or o < 0 or touched[o // 4] or o // 4 < t:
                continue
            u, j = o // 4, o % 4
            # corners around both: a and b are the ends of the edge between
            a, b, c, d = quads[t, k], quads[t, (k + 1) % 4], quads[t, (k + 2) % 4], quads[t, (k + 3) % 4]
            e, f = quads[u, (j + 2) % 4], quads[u, (j + 3) % 4]
            before = min(quality_at(points, quads, t, _QUAD, _UP), quality_at(points, quads, u, _QUAD, _UP))
            best, way = 0, -1
            for w in range(2):
                x, y = (e, c) if w == 0 else (f, d)
                gain = _error(count, ideal, a, 0) - _error(count, ideal, a, -1)
                gain += _error(count, ideal, b, 0) - _error(count, ideal, b, -1)
                gain += _error(count, ideal, x, 0) - _error(count, ideal, x, 1)
                gain += _error(count, ideal, y, 0) - _error(count, ideal, y, 1)
                if gain <= best or _joined(quads, begin, items, x, y):
                    continue
                _turned(trial, a, b, c, d, e, f, w)
                if _good(points, trial, 2, least, before):
                    best, way = gain, w
            if way >= 0:
                _turned(trial, a, b, c, d, e, f, way)
                _touch(quads, begin, items, touched, t)
                _touch(quads, begin, items, touched, u)
                quads[t, :4], quads[u, :4] = trial[0, :4], trial[1, :4]
                made += 1
                done = True
    return made


@inner
def _turned(trial: Ints, a: int, b: int, c: int, d: int, e: int, f: int, way: int) -> None:
    """Write the two quads of the six corners a, e, f, b, c, d that are cut from e to c, or from f to d."""
    if way == 0:
        trial[0, 0], trial[0, 1], trial[0, 2], trial[0, 3] = e, f, b, c
        trial[1, 0], trial[1, 1], trial[1, 2], trial[1, 3] = c, d, a, e
    else:
        trial[0, 0], trial[0, 1], trial[0, 2], trial[0, 3] = f, b, c, d
        trial[1, 0], trial[1, 1], trial[1, 2], trial[1, 3] = d, a, e, f


def clean_quads(mesh: Mesh, options: Options) -> Outcome:
    """Clean up the quads of a flat mesh of nothing else, then raise the worst; other meshes are left alone."""
    if [block.type for block in mesh.blocks] != ["quad"] or mesh.dimension != 2:
        return Outcome(mesh, 0)
    n = len(mesh.points)
    block = mesh.blocks[0]
    quads = np.full((len(block), 8), -1, np.int64)
    quads[:, :4] = block.nodes
    held = held_points(mesh, options)
    walls = edge_walls(mesh)
    least = worst_around_points(quads[:, :4], worst_at_points(mesh, standing(mesh).quality)) - _ROUNDING
    ideal = _ideal(mesh.points, quads[:, :4], held)
    of = np.arange(len(quads))
    points = np.ascontiguousarray(mesh.points)
    made, move = 0, _DOUBLET
    for turn in range(_ROUNDS):
        options.tell("clean up", turn, _ROUNDS)
        begin, items = invert(uniform_offsets(len(quads), 4), quads[:, :4].ravel(), n)
        across = pair_sides(quads[:, :4], _SIDES, walls)
        gone = np.zeros(len(quads), np.bool_)
        now = int(_sweep(points, quads, begin, items, across, held, np.diff(begin), ideal, least, gone, move))
        if not now and move == _TURN:
            break
        # what takes the least apart comes first, again after every move that was made
        move = _DOUBLET if now else move + 1
        made += now
        quads, of = quads[~gone], of[~gone]
    if not made:
        return Outcome(mesh, 0)
    fresh, cells_from = with_cells(mesh, {"quad": (quads[:, :4], block.rows[of])})
    lost = np.setdiff1d(block.nodes, quads[:, :4])
    points_from, told = None, ""
    if len(lost):
        fresh, points_from, told = without_gone(fresh, lost, n)
    better = raise_worst_cells(fresh, options).mesh
    note = f"{made:,} moves{told}, points moved to raise the worst"
    return Outcome(better, made, note, points_from=points_from, cells_from=cells_from)


def _ideal(points: Floats, quads: Ints, held: Mask) -> Ints:
    """(n,) quads that should meet at each point: 4, and where the point is held as many right angles as fit there."""
    angle = np.zeros(len(points))
    for k in range(4):
        at = points[quads[:, k]]
        u, v = points[quads[:, (k + 1) % 4]] - at, points[quads[:, k - 1]] - at
        turn = np.arctan2(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], np.einsum("ij,ij->i", u, v))
        angle += np.bincount(quads[:, k], np.where(turn < 0.0, turn + 2.0 * np.pi, turn), minlength=len(points))
    fits = np.maximum(np.rint(angle / (0.5 * np.pi)), 1).astype(np.int64)
    return np.where(held, fits, 4)
