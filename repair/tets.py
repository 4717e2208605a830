"""The schedule that improves a tet mesh with its points kept: swap and smooth for the mean, then for the worst."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.mesh import Floats, Ints
from meshwright.audit.parallel import in_parallel
from meshwright.repair.curve import along_curve
from meshwright.repair.quality import worst_around_points
from meshwright.repair.sliding import Sheet
from meshwright.repair.tet_nodes import contract, insert
from meshwright.repair.tet_smooth import colours, raise_worst, rate, smooth, stars, worst_at_points
from meshwright.repair.tet_swaps import swap
from meshwright.repair.tet_topology import WALL, neighbours, wall_points

__all__ = ["TetTables", "free_tets", "improve_tets", "raise_worst_tets", "smooth_tets", "swap_tets"]

Mask = NDArray[np.bool_]
Tell = Callable[[str, int, int], None]

_ROUNDS = 8
_SHAKING = ((0.3, 1), (0.3, 1), (0.3, 1), (0.3, 1), (0.2, 1), (0.2, 1))
_SETTLING = ((0.1, 2), (-1e-6, 2))
"""(part by which a swap may raise the cost, sweeps of smoothing) of each round: shaken first, settled at the end. Where
only gains are allowed, the swaps come to rest in a poor local optimum: mean skewness 0.33 against 0.28 on random
tets."""
_SETTLED = ((0.1, 1), (-1e-6, 1))
_FEW = 0.02
"""Where a first sweep swaps less than this part of the tets, the mesh has been shaken before."""
_STILL = 0.005
"""And where it lowers the summed cost by less than this part of it, further rounds gain nothing worth a change."""
_WORST_ROUNDS = 12
_SHAKES = 4
_AROUND = 3
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
_ROOM = 0.25
_ROUNDING = 1e-12
"""A tet that is not touched may differ by so much from what the same formula gave before."""
_BATCH = 512
"""Points of one colour that a thread takes at a time."""
_PIECE = 1 << 14
"""Tets that a thread rates at a time."""
_LAYERS = 12
"""Layers of tets in a part that is swept beside others: the longest swap reaches over a few."""
_MOST_PARTS = 64


@dataclass
class TetTables:
    """A tet mesh while it is changed; see `tet_topology`. `held` (n,): points that stay.

    seat (n,): triangle of `sheet` that a point keeps to, -1 for one that is free or held.
    least (n,): quality of the worst tet around each point at the start, see `quality.worst_around_points`; no tet at
    the point may fall under that. count (1,): points in use. place (n,): row of each point that was given: what lies
    near each other stands near each other here, which halves the time that kernels wait for memory. part_of (cap,):
    the part of the mesh that a row belongs to while parts are swept at the same time. The arrays are its own.
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
    place: Ints
    part_of: NDArray[np.uint8]

    @classmethod
    def of(
        cls, points: Floats, tets: Ints, walls: Ints, held: Mask, slides: Mask | None = None,
        sheet: Sheet | None = None, room: float = 0.0,
    ) -> TetTables:  # fmt: skip
        """Tables of the tets (m, 4); walls (k, 3): faces to leave alone; held (n,): points to leave alone.

        slides (n,): of those, the ones that may move along `sheet`. room: new points that there is room for, as a part
        of the points.
        """
        m, n = len(tets), len(points)
        capacity = m + int(_ROOM * m) + 64
        # the kernels wait for memory: narrow tables are worth a fifth of the time, and half the room
        narrow: type[np.integer] = np.int32 if 4 * capacity < 2**31 else np.int64
        order = along_curve(points)
        place = np.empty(n, narrow)
        place[order] = np.arange(n)
        table = np.full((capacity, 4), -1, narrow)
        table[:m] = place[tets]
        rows = np.argsort(table[:m].min(axis=1), kind="stable")
        table[:m] = table[:m][rows]
        across = np.full((capacity, 4), WALL, narrow)
        across[:m] = neighbours(table[:m], place[np.asarray(walls, dtype=np.int64)])
        origin: Ints = np.full(capacity, -1, narrow)
        origin[:m] = rows
        spare = int(room * n)
        own = np.concatenate([np.asarray(points, dtype=np.float64)[order], np.zeros((spare, 3))])
        tables = cls(
            own,
            table,
            across,
            origin,
            _stack(np.arange(m, capacity), capacity, narrow),
            np.zeros(capacity),
            np.zeros(capacity),
            np.concatenate([held[order], np.zeros(spare, np.bool_)]),
            worst_around_points(table[:m], worst_at_points(own, table, n + spare)) - _ROUNDING,
            np.full(n + spare, -1, np.int64),
            Sheet.empty() if sheet is None else sheet,
            np.array([n]),
            place,
            np.zeros(capacity, np.uint8),
        )
        tables.held |= wall_points(table, across, n + spare)
        if slides is not None and slides.any():
            free = place[np.flatnonzero(slides)]
            tables.seat[free], _ = tables.sheet.seats(own[free])
            tables.held[free] = False
        tables._rate()
        return tables

    @property
    def living(self) -> Ints:
        """Rows in use."""
        return np.flatnonzero(self.tets[:, 0] >= 0)

    def result(self) -> tuple[Floats, Ints, Ints]:
        """(points, tets, origin of each), by the rows that were given; new points stand behind the old ones."""
        rows = self.living
        rows = rows[np.argsort(self.origin[rows], kind="stable")]
        rest = np.arange(len(self.place), self.count[0])
        given = np.append(np.argsort(self.place), rest)
        return self.points[np.append(self.place, rest)], given[self.tets[rows]], self.origin[rows]

    @property
    def total(self) -> float:
        """Summed cost of all tets."""
        return float(self.cost[self.living].sum())

    @property
    def floor(self) -> float:
        """Fitness that no change for the mean may take a neighbourhood under: that of the worst tet there is."""
        return float(self.fit[self.living].min())

    def swap(self, below: float, by_fitness: bool, give: float = -1e-6, near: Mask | None = None) -> int:
        """One sweep of swaps; see `tet_swaps.swap`. near (points,): only tets of which all points are there."""
        floor = np.inf if by_fitness else self.floor
        late: Mask = np.zeros(len(self.tets), np.bool_)
        width = self.tets.dtype

        def one(part: int, rows: Ints, free: Ints) -> int:
            return int(
                swap(
                    self.points, self.tets, self.across, self.origin, self.fit, self.cost, free,
                    self.least, below, by_fitness, floor, give, rows, self.part_of, part, late,
                )
            )  # fmt: skip

        def swept(layer: Ints, parts: int, only_late: bool = False) -> int:
            self.part_of[:] = layer
            jobs = []
            for part in range(parts):
                rows = np.flatnonzero(layer == part)
                free = _stack(rows[self.tets[rows, 0] < 0], len(rows), width)
                jobs.append((part, rows[late[rows]] if only_late else rows, free))
            return sum(in_parallel(lambda job: one(*job), jobs))

        tried = int(np.count_nonzero((self.tets[:, 0] >= 0) & (self.fit < below)))
        parts = max(1, min(_MOST_PARTS, int(tried ** (1.0 / 3.0) / _LAYERS)))
        if near is not None:
            made = swept(~(near[self.tets].all(axis=1) | (self.tets[:, 0] < 0)), 1)
        elif parts == 1:
            made = swept(np.zeros(len(self.tets), np.uint8), 1)
        else:
            # each half layer is in one part with one neighbour first, then with the other one: what lies across the
            # borders of the first parts is well inside the second
            half = self._layers(2 * parts)
            made = swept(half // 2, parts)
            made += swept((half + 1) // 2, parts + 1, only_late=True)
        self.part_of[:] = 0
        self.free = _stack(np.flatnonzero(self.tets[:, 0] < 0), len(self.tets), width)
        return made

    def _layers(self, count: int) -> Ints:
        """(cap,) layer across the longest axis that each tet is in, all of about as many; free rows are dealt out."""
        living, empty = self.living, np.flatnonzero(self.tets[:, 0] < 0)
        axis = int(np.ptp(self.points[: self.count[0]], axis=0).argmax())
        along = np.ascontiguousarray(self.points[:, axis])[self.tets[living]].sum(axis=1)
        at = [k * len(living) // count for k in range(1, count)]
        out = np.empty(len(self.tets), np.uint8)
        out[living] = np.searchsorted(np.partition(along, at)[at], along, side="right")
        out[empty] = np.arange(len(empty)) * count // max(len(empty), 1)
        return out

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

    def around(self, below: float, layers: int) -> Mask:
        """(points,) those of tets of fitness under `below`, and so many layers of points around these."""
        out: Mask = np.zeros(len(self.points), np.bool_)
        living = self.tets[self.living]
        out[living[self.fit[self.living] < below]] = True
        for _ in range(layers):
            out[living[out[living].any(axis=1)]] = True
        return out

    def move(self, sweeps: int, below: float | None = None, near: Mask | None = None) -> int:
        """Smooth all points that may move, or raise the worst of those at tets of fitness under `below`.

        near (points,): only these.
        """
        begin, items = stars(self.tets, len(self.points))
        if below is None:
            free = ~self.held & (np.diff(begin) > 0)
            rows = np.flatnonzero(free if near is None else free & near)
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
        self._rate()
        return moved

    def _rate(self) -> None:
        def one(start: int) -> None:
            piece = slice(start, start + _PIECE)
            rate(self.points, self.tets[piece], self.fit[piece], self.cost[piece])

        for _ in in_parallel(one, range(0, len(self.tets), _PIECE)):
            pass


def _stack(rows: Ints, of: int, dtype: np.dtype[np.integer] | type[np.integer]) -> Ints:
    """Stack of free rows, the first on top, its height at [0], with room for all of the `of` rows that may get free."""
    out = np.zeros(of + 1, dtype)
    out[0] = len(rows)
    out[1 : len(rows) + 1] = rows[::-1]
    return out


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
    rounds = _SHAKING + _SETTLING
    if swaps < _FEW * len(tables.living):
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
        fits = tables.fit[tables.living]
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
