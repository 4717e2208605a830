"""The tables of a tet mesh while it is changed, and the sweeps over them in threads."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.audit.parallel import in_parallel
from meshwright.repair.curve import along_curve
from meshwright.repair.held import Mask
from meshwright.repair.quality import worst_around_points
from meshwright.repair.sliding import Sheet
from meshwright.repair.tet_climb import raise_worst
from meshwright.repair.tet_flips import flip
from meshwright.repair.tet_nodes import contract, insert
from meshwright.repair.tet_shape import cost_of
from meshwright.repair.tet_smooth import smooth
from meshwright.repair.tet_stars import colours, rate, stars, worst_at_points
from meshwright.repair.tet_swaps import swap
from meshwright.repair.tet_topology import WALL, neighbours, wall_points

__all__ = ["TetTables"]

_ROOM = 0.08
"""Tets that swaps may add, as a part of those there are; as a rule they leave fewer. With half of it swaps do without
some that they want, and take half as long again."""
_MORE_PER_POINT = 7
"""Tets that a new point brings."""
_ROUNDING = 1e-12
"""A tet that is not touched may differ by so much from what the same formula gave before."""
_BATCH = 512
"""Points of one colour that a thread takes at a time."""
_PIECE = 1 << 14
"""Tets that a thread rates at a time."""
_LAYERS = 12
"""Layers of tets in a part that is swept beside others: the longest swap reaches over a few."""
_MOST_PARTS = 64
_SAMPLE = 20_000
"""Tets by which the borders of parts are chosen."""


@dataclass
class TetTables:
    """A tet mesh while it is changed; see `tet_topology`. `held` (n,): points that stay.

    fit (cap,): fitness of each tet, inf in rows that are free. seat (n,): triangle of `sheet` that a point keeps to, -1
    for one that is free or held.
    least (n,): quality of the worst tet around each point at the start, see `quality.worst_around_points`; no tet at
    the point may fall under that. count (1,): points in use. place (n,): row of each point that was given: what lies
    near each other stands near each other here, which halves the time that kernels wait for memory. part_of (cap,):
    the part of the mesh that a row belongs to while parts are swept at the same time. flips: edges of the boundary that
    were removed. The arrays are its own.
    """

    points: Floats
    tets: Ints
    across: Ints
    origin: Ints
    fit: Floats
    held: Mask
    least: Floats
    seat: Ints
    sheet: Sheet
    count: Ints
    place: Ints
    part_of: NDArray[np.uint8]
    flips: int = 0

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
        spare = int(room * n)
        capacity = m + int(_ROOM * m) + _MORE_PER_POINT * spare + 64
        # the kernels wait for memory: narrow tables are worth a fifth of the time, and half the room
        narrow: type[np.integer] = np.int32 if 4 * capacity < 2**31 else np.int64
        order = along_curve(points)
        place = np.empty(n, narrow)
        place[order] = np.arange(n)
        origin: Ints = np.full(capacity, -1, narrow)
        origin[:m] = np.argsort(_first(tets, place), kind="stable")
        table = np.full((capacity, 4), -1, narrow)
        _renumbered(tets, place, origin, table)
        met = neighbours(table[:m], place[np.asarray(walls, dtype=np.int64)])
        across = np.full((capacity, 4), WALL, narrow)
        across[:m] = met
        del met
        own = np.zeros((n + spare, 3))
        own[:n] = points[order]
        least = worst_around_points(table[:m], worst_at_points(own, table, n + spare))
        least -= _ROUNDING
        tables = cls(
            points=own,
            tets=table,
            across=across,
            origin=origin,
            fit=np.full(capacity, np.inf),
            held=np.concatenate([held[order], np.zeros(spare, np.bool_)]),
            least=least,
            seat=np.full(n + spare, -1, narrow),
            sheet=Sheet.empty() if sheet is None else sheet,
            count=np.array([n]),
            place=place,
            part_of=np.zeros(capacity, np.uint8),
        )
        tables.held |= wall_points(table, across, n + spare)
        if slides is not None and slides.any():
            free = place[np.flatnonzero(slides)]
            tables.seat[free], _ = tables.sheet.seats(own[free])
            tables.held[free] = False
        tables._rate()
        return tables

    def result(self) -> tuple[Floats, Ints, Ints]:
        """(points, tets, origin of each), by the rows that were given; new points stand behind the old ones.

        The tables are spent by it.
        """
        nothing = np.empty(0)
        self.across, self.fit, self.least = np.empty((0, 4), np.int32), nothing, nothing
        n = len(self.place)
        given = np.arange(self.count[0], dtype=self.place.dtype)
        given[self.place] = np.arange(n)
        points = np.empty((self.count[0], 3))
        points[given] = self.points[: self.count[0]]
        return points, *_in_order(self.tets, self.origin, given)

    @property
    def size(self) -> int:
        """Number of tets."""
        return int(np.count_nonzero(self.tets[:, 0] >= 0))

    @property
    def fits(self) -> Floats:
        """Fitness of all tets."""
        return self.fit[self.tets[:, 0] >= 0]

    @property
    def total(self) -> float:
        """Summed cost of all tets."""
        return float(_summed(self.points, self.tets))

    @property
    def floor(self) -> float:
        """Fitness that no change for the mean may take a neighbourhood under: that of the worst tet there is."""
        return float(self.fit.min())

    @property
    def free(self) -> Ints:
        """A stack of the rows that are free, as `tet_topology` has it."""
        return self._free(0)

    def _free(self, part: int) -> Ints:
        mine = self.part_of == part
        out = np.zeros(np.count_nonzero(mine) + 1, self.tets.dtype)
        rows = np.flatnonzero(mine & (self.tets[:, 0] < 0))
        out[0] = len(rows)
        out[1 : len(rows) + 1] = rows[::-1]
        return out

    def swap(self, below: float, by_fitness: bool, give: float = -1e-6, near: Mask | None = None) -> int:
        """One sweep of swaps; see `tet_swaps.swap`. near (points,): only tets of which all points are there."""
        floor = np.inf if by_fitness else self.floor
        late: Mask = np.zeros(len(self.tets), np.bool_)

        def sweep(parts: Iterable[int], only_late: bool = False) -> int:
            def one(part: int) -> int:
                return int(
                    swap(
                        self.points, self.tets, self.across, self.origin, self.fit, self._free(part),
                        self.least, below, by_fitness, floor, give, self.part_of, part, late, only_late,
                    )
                )  # fmt: skip

            return sum(in_parallel(one, parts))

        tried = int(np.count_nonzero(self.fit < below))
        count = max(1, min(_MOST_PARTS, int(tried ** (1.0 / 3.0) / _LAYERS)))
        if near is not None:
            _set_apart(self.tets, near, self.part_of)
            made = sweep([0])
        elif count == 1:
            made = sweep([0])
        else:
            # each half layer is in one part with one neighbour first, then with the other one: what lies across the
            # borders of the first parts is well inside the second
            half = self._layers(2 * count)
            self.part_of[:] = half // 2
            made = sweep(range(count))
            half += 1
            self.part_of[:] = half // 2
            made += sweep(range(count + 1), only_late=True)
        self.part_of[:] = 0
        if near is None and (self.seat >= 0).any():
            flips = flip(
                self.points, self.tets, self.across, self.origin, self.fit, self._free(0),
                self.least, self.seat, below, by_fitness, floor, give,
            )  # fmt: skip
            self.flips += int(flips)
            made += int(flips)
        return made

    def _layers(self, count: int) -> NDArray[np.uint8]:
        """(cap,) layer across the longest axis that each tet is in, all of about as many; free rows are dealt out."""
        out = np.empty(len(self.tets), np.uint8)
        axis = int(np.ptp(self.points[: self.count[0]], axis=0).argmax())
        rows = np.flatnonzero(self.tets[:: max(1, len(self.tets) // _SAMPLE), 0] >= 0)
        rows *= max(1, len(self.tets) // _SAMPLE)
        sample = np.sort(self.points[self.tets[rows], axis].sum(axis=1))
        _deal(self.points, self.tets, axis, sample[np.arange(1, count) * len(rows) // count], out)
        return out

    def contract(self, below: float) -> int:
        """Take inner points away at tets of fitness under `below`; see `tet_nodes.contract`."""
        return int(
            contract(
                self.points, self.tets, self.across, self.origin, self.fit, self.free, self.least, self.held, below
            )
        )

    def insert(self, below: float) -> int:
        """Put points in at tets of fitness under `below`; see `tet_nodes.insert`."""
        return int(
            insert(self.points, self.count, self.tets, self.across, self.origin, self.fit, self.free, self.least, below)
        )

    def around(self, below: float, layers: int) -> Mask:
        """(points,) those of tets of fitness under `below`, and so many layers of points around these."""
        out: Mask = np.zeros(len(self.points), np.bool_)
        out[self.tets[self.fit < below]] = True
        for _ in range(layers):
            out = _grown(self.tets, out)
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
            rows = np.unique(self.tets[self.fit < below])
            rows = rows[~self.held[rows]]
        order, stops = colours(self.tets, begin, items, rows.astype(self.tets.dtype))

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
            rate(self.points, self.tets[piece], self.fit[piece])

        for _ in in_parallel(one, range(0, len(self.tets), _PIECE)):
            pass


@kernel
def _first(tets: Ints, place: Ints) -> Ints:
    """(m,) the first place of a point of each tet."""
    out = np.empty(tets.shape[0], place.dtype)
    for t in range(tets.shape[0]):
        out[t] = min(place[tets[t, 0]], place[tets[t, 1]], place[tets[t, 2]], place[tets[t, 3]])
    return out


@kernel
def _renumbered(tets: Ints, place: Ints, rows: Ints, out: Ints) -> None:
    """The tets in the order of `rows`, with the places of their points."""
    for i in range(tets.shape[0]):
        for k in range(4):
            out[i, k] = place[tets[rows[i], k]]


@kernel
def _in_order(tets: Ints, origin: Ints, given: Ints) -> tuple[Ints, Ints]:
    """(tets, origin) of the rows in use by their origin, and where that is the same by their row; points as given."""
    begin = np.zeros(origin.max() + 2, origin.dtype)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            begin[origin[t] + 1] += 1
    for i in range(begin.size - 1):
        begin[i + 1] += begin[i]
    out, of = np.empty((begin[-1], 4), tets.dtype), np.empty(begin[-1], origin.dtype)
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            at = begin[origin[t]]
            begin[origin[t]] += 1
            of[at] = origin[t]
            for k in range(4):
                out[at, k] = given[tets[t, k]]
    return out, of


@kernel
def _summed(points: Floats, tets: Ints) -> float:
    total = 0.0
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0:
            total += cost_of(points, tets[t, 0], tets[t, 1], tets[t, 2], tets[t, 3])
    return total


@kernel
def _deal(points: Floats, tets: Ints, axis: int, borders: Floats, out: NDArray[np.uint8]) -> None:
    """Layer of each tet by the sum of its corners along the axis; free rows go to all layers in turn."""
    turn = 0
    for t in range(tets.shape[0]):
        if tets[t, 0] < 0:
            out[t] = turn
            turn = turn + 1 if turn < borders.size else 0
            continue
        at = 0.0
        for k in range(4):
            at += points[tets[t, k], axis]
        layer = 0
        while layer < borders.size and borders[layer] <= at:
            layer += 1
        out[t] = layer


@kernel
def _set_apart(tets: Ints, near: Mask, part_of: NDArray[np.uint8]) -> None:
    """Part 0 for free rows and tets with all points in `near`, 1 for the others."""
    for t in range(tets.shape[0]):
        part_of[t] = 0
        if tets[t, 0] >= 0:
            for k in range(4):
                if not near[tets[t, k]]:
                    part_of[t] = 1


@kernel
def _grown(tets: Ints, inside: Mask) -> Mask:
    """The points of the tets that have a point inside."""
    out = inside.copy()
    for t in range(tets.shape[0]):
        if tets[t, 0] >= 0 and (inside[tets[t, 0]] or inside[tets[t, 1]] or inside[tets[t, 2]] or inside[tets[t, 3]]):
            for k in range(4):
                out[tets[t, k]] = True
    return out
