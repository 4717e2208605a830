"""The schedule that improves a tet mesh with its points kept: swap and smooth for the mean, then for the worst."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from meshwright.repair.tet_tables import TetTables

__all__ = ["free_tets", "improve_tets", "raise_worst_tets", "smooth_tets", "swap_tets"]

Tell = Callable[[str, int, int], None]

_ROUNDS = 8
_SHAKING = ((0.3, 1), (0.3, 1), (0.3, 1), (0.3, 1), (0.2, 1), (0.2, 1))
_SETTLING = ((0.1, 2), (-1e-6, 2))
"""(part by which a swap may raise the cost, sweeps of smoothing) of each round: shaken first, settled at the end. Where
only gains are allowed, the swaps come to rest in a poor local optimum: mean skewness 0.33 against 0.28 on random
tets."""
_SETTLED = ((0.1, 1), (-1e-6, 1))
"""The rounds of a mesh that has been shaken before."""
_FEW = 0.02
"""Where a first sweep swaps less than this part of the tets, the mesh has been shaken before."""
_STILL = 0.005
"""And where it lowers the summed cost by less than this part of it, further rounds gain nothing worth a change."""
_WORST_ROUNDS = 12
_SHAKES = 4
"""Times that the surroundings of the worst tets are shaken, as long as these rise by _RISE."""
_AROUND = 3
"""Layers of points that count as surroundings: a swap reaches over two."""
_GOOD = 0.16
"""Fitness that a tet is raised to where it can be: dihedral angles of about 27 to 142 degrees."""
_FREE_ROUNDS = 12
_WORTH = 0.2
"""Part of the changes of the first round under which a round is the last, unless the worst tet has risen by _RISE."""
_RISE = 1.001
_WORST_PART = 0.03
"""Part of the tets, the worst, around which points are put in and taken away: Klingner's and Shewchuk's choice."""
_NEAR = 1.08
"""Tets whose fitness is within this factor of the smallest are raised with it."""


def _silent(stage: str, done: int, of: int) -> None:
    """Tell nobody."""


def swap_tets(tables: TetTables) -> int:
    """Swap until no swap is left that lowers the cost; the number made."""
    made = 0
    for _ in range(_ROUNDS):
        now = tables.swap(np.inf, by_fitness=False)
        made += now
        if not now:
            break
    return made


def smooth_tets(tables: TetTables) -> int:
    """Smooth until the points come to rest; the number of moves."""
    moved = 0
    for _ in range(_ROUNDS):
        now = tables.move(2)
        moved += now
        if not now:
            break
    return moved


def improve_tets(tables: TetTables, tell: Tell = _silent) -> tuple[int, int]:
    """(swaps, moves): the mean first, then the worst until nothing gives."""
    before = tables.total
    swaps = tables.swap(np.inf, by_fitness=False)
    moves = tables.move(1)
    rounds: tuple[tuple[float, int], ...] = _SHAKING + _SETTLING
    if swaps < _FEW * tables.size:
        rounds = _SETTLED if tables.total < before * (1.0 - _STILL) else ()
    for i, (give, sweeps) in enumerate(rounds):
        tell("swap and smooth", i, len(rounds) + _SHAKES + 1)
        swaps += tables.swap(np.inf, by_fitness=False, give=give)
        moves += tables.move(sweeps)
    made, moved = raise_worst_tets(tables, tell, len(rounds))
    return swaps + made, moves + moved


def raise_worst_tets(tables: TetTables, tell: Tell = _silent, told: int = 0) -> tuple[int, int]:
    """(swaps, moves): raise the smallest fitness; where that gets stuck, shake what lies around the worst tets.

    told: rounds that came before.
    """
    swaps = moves = 0
    before = -np.inf
    for shake in range(_SHAKES + 1):
        tell("raise the worst", told + shake, told + _SHAKES + 1)
        for _ in range(_WORST_ROUNDS):
            made, moved = tables.swap(_GOOD, by_fitness=True), tables.move(1, below=_GOOD)
            swaps, moves = swaps + made, moves + moved
            if not made + moved:
                break
        worst = tables.floor
        if worst >= _GOOD or shake == _SHAKES or worst <= _RISE * before:
            break
        before = worst
        near = tables.around(_NEAR * worst, _AROUND)
        for give, sweeps in _SHAKING[-2:] + _SETTLING:
            swaps += tables.swap(np.inf, by_fitness=False, give=give, near=near)
            moves += tables.move(sweeps, near=near)
    return swaps, moves


def free_tets(tables: TetTables, tell: Tell = _silent) -> tuple[int, int]:
    """(swaps, moves): put points in and take them away around the worst tets, then swap and smooth what is new."""
    swaps = moves = first = 0
    reached = -np.inf
    for i in range(_FREE_ROUNDS):
        tell("points in and out", i, _FREE_ROUNDS)
        fits = tables.fits
        below = max(_GOOD, float(np.quantile(fits, _WORST_PART)))
        made = tables.contract(below) + tables.insert(below)
        first = first or made
        if made <= _WORTH * first and not fits.min() > reached:
            break
        reached = max(reached, float(fits.min()) * _RISE)
        worst = max(_GOOD, _NEAR * float(fits.min()))
        swaps += made + tables.swap(worst, by_fitness=True)
        moves += tables.move(1, below=worst)
        swaps += tables.swap(np.inf, by_fitness=False)
        moves += tables.move(2)
    return swaps, moves
