"""The schedule that improves a tet mesh with its points kept: swap and smooth for the mean, then for the worst."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.mesh import Floats, Ints
from meshwright.audit.parallel import in_parallel
from meshwright.repair.quality import worst_around_points
from meshwright.repair.sliding import Sheet
from meshwright.repair.tet_nodes import contract, insert
from meshwright.repair.tet_smooth import colours, raise_worst, rate, smooth, stars, worst_at_points
from meshwright.repair.tet_swaps import swap
from meshwright.repair.tet_topology import neighbours, wall_points

__all__ = ["TetTables", "free_tets", "improve_tets", "raise_worst_tets", "smooth_tets", "swap_tets"]

Mask = NDArray[np.bool_]
Tell = Callable[[str, int, int], None]

_ROUNDS = 8
_GIVES = (0.3, 0.3, 0.3, 0.3, 0.3, 0.2, 0.2, 0.1, 0.1, -1e-6)
"""Part by which a swap may raise the cost, round by round: shaken first, settled at the end. Where only gains are
allowed, the swaps come to rest in a poor local optimum: mean skewness 0.33 against 0.28 on random tets."""
_SETTLED = 0.02
_FEW_ROUNDS = 4
"""Where a first sweep swaps less than this part of the tets, the mesh has been through all rounds, and few will do."""
_WORST_ROUNDS = 12
_GOOD = 0.16
"""Fitness that a tet is raised to where it can be: dihedral angles of about 27 to 142 degrees."""
_FREE_ROUNDS = 12
_WORST_PART = 0.03
"""Part of the tets, the worst, around which points are put in and taken away: Klingner's and Shewchuk's choice."""
_NEAR = 1.08
"""Tets whose fitness is within this factor of the smallest are raised with it."""
_ROOM = 0.25
_ROUNDING = 1e-12
"""A tet that is not touched may differ by so much from what the same formula gave before."""
_BATCH = 1024
"""Points of one colour that a thread takes at a time."""


@dataclass
class TetTables:
    """A tet mesh while it is changed; see `tet_topology`. `held` (n,): points that stay.

    seat (n,): triangle of `sheet` that a point keeps to, -1 for one that is free or held.
    least (n,): quality of the worst tet around each point at the start, see `quality.worst_around_points`; no tet at
    the point may fall under that. count (1,): points in use. The arrays are its own.
    """

    points: Floats
    tets: Ints
    across: Ints
    origin: Ints
    free: Ints
    fit: Floats
    cost: Floats
    held: Mask
    least: Floats
    seat: Ints
    sheet: Sheet
    count: Ints

    @classmethod
    def of(
        cls, points: Floats, tets: Ints, walls: Ints, held: Mask, slides: Mask | None = None,
        sheet: Sheet | None = None, room: float = 0.0,
    ) -> TetTables:  # fmt: skip
        """Tables of the tets (m, 4); walls (k, 3): faces to leave alone; held (n,): points to leave alone.

        slides (n,): of those, the ones that may move along `sheet`. room: new points that there is room for, as a part
        of the points.
        """
        m = len(tets)
        capacity = m + int(_ROOM * m) + 64
        # the kernels wait for memory: narrow tables are worth a fifth of the time, and half the room
        narrow: type[np.integer] = np.int32 if 4 * capacity < 2**31 else np.int64
        table = np.full((capacity, 4), -1, narrow)
        table[:m] = tets
        across = np.full((capacity, 4), -1, narrow)
        across[:m] = neighbours(table[:m], walls)
        free: Ints = np.zeros(capacity + 1, narrow)
        free[0] = capacity - m
        free[1 : capacity - m + 1] = np.arange(capacity - 1, m - 1, -1)
        origin: Ints = np.full(capacity, -1, narrow)
        origin[:m] = np.arange(m)
        n = len(points)
        spare = int(room * n)
        own = np.concatenate([np.array(points, dtype=np.float64), np.zeros((spare, 3))])
        tables = cls(
            own,
            table,
            across,
            origin,
            free,
            np.zeros(capacity),
            np.zeros(capacity),
            np.concatenate([held, np.zeros(spare, np.bool_)]),
            worst_around_points(table[:m], worst_at_points(own, table, n + spare)) - _ROUNDING,
            np.full(n + spare, -1, np.int64),
            Sheet.empty() if sheet is None else sheet,
            np.array([n]),
        )
        tables.held |= wall_points(table, across, n + spare)
        if slides is not None and slides.any():
            rows = np.flatnonzero(slides)
            tables.seat[rows], _ = tables.sheet.seats(own[rows])
            tables.held[rows] = False
        rate(own, table, tables.fit, tables.cost)
        return tables

    @property
    def living(self) -> Ints:
        """Rows in use."""
        return np.flatnonzero(self.tets[:, 0] >= 0)

    def result(self) -> tuple[Floats, Ints, Ints]:
        """(points, tets, origin of each), in the order of the origins; new points stand behind the old ones."""
        rows = self.living
        rows = rows[np.argsort(self.origin[rows], kind="stable")]
        return self.points[: self.count[0]], self.tets[rows], self.origin[rows]

    @property
    def floor(self) -> float:
        """Fitness that no change for the mean may take a neighbourhood under: that of the worst tet there is."""
        return float(self.fit[self.living].min())

    def swap(self, below: float, by_fitness: bool, give: float = -1e-6) -> int:
        """One sweep of swaps; see `tet_swaps.swap`."""
        floor = np.inf if by_fitness else self.floor
        return int(
            swap(
                self.points, self.tets, self.across, self.origin, self.fit, self.cost, self.free,
                self.least, below, by_fitness, floor, give,
            )
        )  # fmt: skip

    def contract(self, below: float) -> int:
        """Take inner points away at tets of fitness under `below`; see `tet_nodes.contract`."""
        return int(
            contract(
                self.points, self.tets, self.across, self.origin, self.fit, self.cost, self.free,
                self.least, self.held, below,
            )
        )  # fmt: skip

    def insert(self, below: float) -> int:
        """Put points in at tets of fitness under `below`; see `tet_nodes.insert`."""
        return int(
            insert(
                self.points, self.count, self.tets, self.across, self.origin, self.fit, self.cost, self.free,
                self.least, below,
            )
        )  # fmt: skip

    def move(self, sweeps: int, below: float | None = None) -> int:
        """Smooth all points that may move, or raise the worst of those at tets of fitness under `below`."""
        begin, items = stars(self.tets, len(self.points))
        if below is None:
            rows = np.flatnonzero(~self.held & (np.diff(begin) > 0))
        else:
            bad = self.tets[(self.tets[:, 0] >= 0) & (self.fit < below)]
            rows = np.unique(bad)
            rows = rows[~self.held[rows]]
        order, stops = colours(self.tets, begin, items, rows)

        floor = self.floor
        seats = (self.seat, self.sheet.corners, self.sheet.across)

        def one(part: Ints) -> int:
            if below is None:
                return int(smooth(self.points, self.tets, begin, items, self.least, part, floor, *seats))
            return int(raise_worst(self.points, self.tets, begin, items, self.least, part, below, *seats))

        moved = 0
        for _ in range(sweeps):
            for c in range(len(stops) - 1):
                same = order[stops[c] : stops[c + 1]]
                parts = [same[i : i + _BATCH] for i in range(0, len(same), _BATCH)]
                moved += sum(in_parallel(one, parts)) if len(parts) > 1 else sum(map(one, parts))
        rate(self.points, self.tets, self.fit, self.cost)
        return moved


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
    swaps = tables.swap(np.inf, by_fitness=False)
    moves = 0
    settled = swaps < _SETTLED * len(tables.living)
    for i, give in enumerate(_GIVES[-_FEW_ROUNDS:] if settled else _GIVES):
        tell("swap and smooth", i, len(_GIVES) + _WORST_ROUNDS)
        made, moved = tables.swap(np.inf, by_fitness=False, give=give), tables.move(2)
        swaps, moves = swaps + made, moves + moved
    made, moved = raise_worst_tets(tables, tell)
    return swaps + made, moves + moved


def raise_worst_tets(tables: TetTables, tell: Tell = _silent) -> tuple[int, int]:
    """(swaps, moves): each raises the smallest fitness of the tets that it touches."""
    swaps = moves = 0
    for i in range(_WORST_ROUNDS):
        tell("raise the worst", len(_GIVES) + i, len(_GIVES) + _WORST_ROUNDS)
        made, moved = tables.swap(_GOOD, by_fitness=True), tables.move(1, below=_GOOD)
        swaps, moves = swaps + made, moves + moved
        if not made + moved:
            break
    return swaps, moves


def free_tets(tables: TetTables, tell: Tell = _silent) -> tuple[int, int]:
    """(swaps, moves): put points in and take them away around the worst tets, then swap and smooth what is new."""
    swaps = moves = 0
    for i in range(_FREE_ROUNDS):
        tell("points in and out", i, _FREE_ROUNDS)
        fits = tables.fit[tables.living]
        below = max(_GOOD, float(np.quantile(fits, _WORST_PART)))
        made = tables.contract(below) + tables.insert(below)
        if not made:
            break
        worst = max(_GOOD, _NEAR * float(fits.min()))
        swaps += made + tables.swap(worst, by_fitness=True)
        moves += tables.move(1, below=worst)
        swaps += tables.swap(np.inf, by_fitness=False)
        moves += tables.move(2)
    return swaps, moves
