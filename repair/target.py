"""A repair with an aim: which passes the findings and limits of a profile call for, and what is left and why.

The plan is made of what the audit found, so that a mesh that keeps the profile is left as it is. After the repair every
cell that still breaks a limit is looked at again, and what holds its points is named.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces, nodes_of_cells
from meshwright.audit.errors import printable
from meshwright.audit.mesh import NO_CELL, Floats, Ints, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.places import plain, short
from meshwright.audit.profiles.evaluate import evaluate
from meshwright.audit.profiles.figures import is_beyond_each
from meshwright.audit.profiles.mirrors import turn_for, turned
from meshwright.audit.profiles.model import CELLS, Limit, Profile
from meshwright.audit.profiles.quantities import QUANTITIES
from meshwright.audit.profiles.rule import Judgement, Rule
from meshwright.audit.profiles.sampling import matches, samples
from meshwright.audit.profiles.where import parts
from meshwright.audit.run import Audit, audit
from meshwright.repair.held import Hold, holds
from meshwright.repair.outcome import Options
from meshwright.repair.passes import PASSES

__all__ = ["Aim", "Left", "Planned", "Verdict", "judge_by", "left_over", "plan"]

_FOR_FINDINGS = {
    "duplicate-points": ("weld",),
    "degenerate-cells": ("drop-degenerate",),
    "duplicate-cells": ("drop-duplicates",),
    "left-handed-faces": ("orient", "untangle"),
    "inverted-cells": ("orient", "untangle"),
    "negative-jacobian-cells": ("orient", "untangle"),
    "node-order-convention": ("orient",),
    "inconsistent-orientation": ("orient",),
    "inside-out-shell": ("orient",),
}
"""Passes that mend what a check reports. Nothing is planned that a user may have meant: open edges, say."""
_FOR_SHAPES = {
    "tet": ("improve",), "tri": ("triangles",), "quad": ("untangle", "raise-worst"),
    "hex": ("untangle", "raise-worst"), "pyramid": ("untangle", "raise-worst"),
}  # fmt: skip
"""Passes that better the shape of cells, by the type of the cells that a limit is on."""
_LISTED = 100
"""Cells that are named one by one for each rule."""
_WORDS = {
    Hold.BOUNDARY: "the boundary", Hold.BORDER: "a border between zones", Hold.POINTS: "a zone of points",
    Hold.ELEMENT: "an element that the file lists", Hold.ASKED: "a zone held by --hold",
    Hold.CURVED: "cells of second order", Hold.LAYER: "layers of wedges",
}  # fmt: skip


@dataclass(frozen=True)
class Planned:
    """A pass that is to run, and the sentences that call for it."""

    name: str
    because: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a profile says of a mesh."""

    found: Audit
    judgement: Judgement

    @property
    def broken(self) -> tuple[Rule, ...]:
        """The rules that fail or warn."""
        return tuple(rule for rule in self.judgement.rules if rule.state in ("fail", "warn"))


@dataclass(frozen=True)
class Left:
    """Cells that break a rule after the repair.

    rule: its id. count: how many. stuck: of these, how many have no point that may move; held: how many have some;
    by: (what holds points of them, of how many cells), most frequent first. cells: the worst of them, as data.
    """

    rule: str
    name: str
    limit: float | None
    count: int
    stuck: int
    held: int
    by: tuple[tuple[str, int], ...]
    cells: tuple[dict[str, Any], ...]

    @property
    def words(self) -> str:
        """One sentence for people."""
        cells = "1 cell is" if self.count == 1 else f"{self.count:,} cells are"
        beyond = "" if self.limit is None else f" beyond {self.limit:g}"
        out = f"{printable(self.name, 80)}: {cells} left{beyond}"
        free = self.count - self.stuck - self.held
        parts = []
        if self.stuck:
            parts.append(f"{self.stuck:,} with no point that may move")
        if self.held:
            parts.append(f"{self.held:,} with some points held")
        if free:
            parts.append(f"{free:,} that nothing holds, for which no pass found better")
        out += ": " + ", ".join(parts)
        if self.by:
            out += "; held by " + ", ".join(f"{what} ({n:,})" for what, n in self.by[:4])
        if self.cells:
            worst = self.cells[0]
            x, y, z = worst["centroid"]
            out += f"; the worst is cell {worst['cell']} ({worst['type']}) at ({x:.5g}, {y:.5g}, {z:.5g})"
        return out


@dataclass(frozen=True, eq=False)
class Aim:
    """The profile that a repair is for. first, last: what it says of the mesh before and after; left: see `Left`."""

    profile: Profile
    first: Verdict
    last: Verdict | None = None
    left: tuple[Left, ...] = ()

    @cached_property
    def plan(self) -> tuple[Planned, ...]:
        """The passes that it calls for, in the order in which they run."""
        return plan(self.first)

    def reached(self, mesh: Mesh) -> bool:
        """Whether the mesh keeps the profile, so that nothing more is to be done."""
        return mesh is not self.first.found.mesh and not plan(judge_by(mesh, self.profile))

    def as_json(self) -> dict[str, Any]:
        """The aim as the receipt holds it."""
        last = self.first if self.last is None else self.last
        return {
            "profile": self.profile.name, "verdict": [self.first.judgement.state, last.judgement.state],
            "plan": [{"pass": step.name, "because": list(step.because)} for step in self.plan],
            "left": [
                {
                    "rule": left.rule, "name": left.name, "limit": left.limit, "cells": left.count,
                    "no_point_may_move": left.stuck, "some_points_held": left.held,
                    "held_by": [{"what": what, "cells": n} for what, n in left.by],
                    "words": left.words, "worst": list(left.cells),
                }
                for left in self.left
            ],
        }  # fmt: skip

    def ended(self, mesh: Mesh, options: Options) -> Aim:
        """The aim with what is said of the mesh that the repair ended with."""
        last = self.first if mesh is self.first.found.mesh else judge_by(mesh, self.profile)
        return replace(self, last=last, left=left_over(last, options))


def judge_by(mesh: Mesh, profile: Profile) -> Verdict:
    """Audit the mesh and judge it by the profile."""
    wanted = [id_ for id_ in profile.metrics if id_ in METRICS]
    found = audit(mesh, ",".join(wanted) or "default")
    counts = {finding.code: finding.count for finding in found.findings}
    return Verdict(found, evaluate(found.measured, profile, counts))


def plan(verdict: Verdict) -> tuple[Planned, ...]:
    """The passes that the findings and broken rules call for, each with its reasons; none where all is kept."""
    because: dict[str, list[str]] = {}

    def add(names: tuple[str, ...], reason: str) -> None:
        for name in names:
            because.setdefault(name, []).append(reason)

    mesh = verdict.found.mesh
    for finding in verdict.found.findings:
        demanded = any(rule.limit.finding == finding.code for rule in verdict.broken)
        if finding.severity == "error" or demanded:
            add(_FOR_FINDINGS.get(finding.code, ()), f"{finding.count:,} {finding.code}")
    for rule in verdict.broken:
        if not rule.limit.metric or rule.limit.metric == CELLS:
            continue
        figure = "" if rule.measured is None else f" is {rule.measured:.4g}, limit {rule.deciding:g}"
        for kind in mesh.counts:
            if kind in _FOR_SHAPES and (_entity(rule.limit) != "cell" or matches(kind, rule.limit)):
                add(_FOR_SHAPES[kind], f"{rule.id}: {rule.limit.stat} of {rule.limit.metric}{figure}")
    return tuple(Planned(name, tuple(dict.fromkeys(because[name]))) for name in PASSES if name in because)


def left_over(verdict: Verdict, options: Options) -> tuple[Left, ...]:
    """For each rule that is still broken the cells that break it, and what holds them."""
    rules = [rule for rule in verdict.broken if rule.limit.metric and rule.limit.metric != CELLS]
    if not rules:
        return ()
    mesh = verdict.found.mesh
    held = holds(mesh, options)
    names = _Names(mesh)
    out = []
    for rule in rules:
        rows, values = _beyond(verdict, rule)
        if len(rows):
            out.append(_left(mesh, rule, rows, values, held, names))
    return tuple(out)


def _beyond(verdict: Verdict, rule: Rule) -> tuple[Ints, Floats]:
    """(rows, values): the cells that break a rule, worst first; of faces and points the cells at them."""
    measured, mesh, limit = verdict.found.measured, verdict.found.mesh, rule.limit
    level, sense = _level(rule), limit.values_beyond(rule.best) if limit.tally else limit.direction(rule.best)
    if level is None:
        return np.empty(0, np.int64), np.empty(0)
    turn = turn_for(limit, measured.values)
    asked = limit if turn is None else turned(limit, turn)
    rows: list[Ints] = [np.empty(0, np.int64)]
    values: list[Floats] = [np.empty(0)]
    for part in parts(mesh, limit.where, _entity(limit), None, each=limit.each):
        if part.zone != rule.zone:
            continue
        for sample in samples(measured, part.places, asked):
            figures = sample.values if turn is None else np.array([turn.convert(x) for x in sample.values.tolist()])
            bad = np.flatnonzero(is_beyond_each(figures, level, sense, inclusive=limit.inclusive and not limit.tally))
            at = bad if sample.rows is None else np.asarray(sample.rows)[bad]
            for cells, of in _cells_at(mesh, sample.key, at):
                rows.append(cells)
                values.append(figures[bad][of])
    row, value = np.concatenate(rows), np.concatenate(values)
    order = np.argsort(-value if sense == "above" else value, kind="stable")
    row, value = row[order], value[order]
    _, first = np.unique(row, return_index=True)
    first.sort()
    return row[first], value[first]


def _level(rule: Rule) -> float | None:
    return rule.limit.beyond if rule.limit.tally else rule.deciding


def _entity(limit: Limit) -> str:
    return METRICS[limit.metric].entity if limit.metric in METRICS else QUANTITIES[limit.metric].entity


def _cells_at(mesh: Mesh, key: str, rows: Ints) -> Iterator[tuple[Ints, Ints]]:
    """(cells, index into `rows` of each): the cells that the entities are or belong to."""
    if key == "face":
        sides = faces(mesh)
        every = np.arange(len(rows))
        yield sides.owner[rows].astype(np.int64), every
        inner = sides.neighbour[rows] != NO_CELL
        yield sides.neighbour[rows][inner].astype(np.int64), every[inner]
    elif key == "point":
        offsets, nodes = nodes_of_cells(mesh)
        place = np.full(len(mesh.points), -1, np.int64)
        place[rows] = np.arange(len(rows))
        of = place[nodes]
        cells = np.repeat(np.arange(mesh.n_cells), np.diff(offsets))
        yield cells[of >= 0], of[of >= 0]
    else:
        yield mesh.block(key).rows[rows].astype(np.int64), np.arange(len(rows))


def _left(mesh: Mesh, rule: Rule, rows: Ints, values: Floats, held: NDArray[np.uint8], names: _Names) -> Left:
    offsets, nodes = nodes_of_cells(mesh)
    begin, size = offsets[rows].astype(np.int64), np.diff(offsets)[rows].astype(np.int64)
    cell = np.repeat(np.arange(len(rows)), size)
    points = nodes[np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size) + np.repeat(begin, size)]
    fixed = np.bincount(cell[held[points] > 0], minlength=len(rows))
    by = []
    for bit, words in _WORDS.items():
        n = len(np.unique(cell[(held[points] & bit.value) > 0]))
        if n and not (bit == Hold.ELEMENT and (held[points] & (Hold.BOUNDARY | Hold.BORDER).value).any()):
            by.append((words, n))
    by.sort(key=lambda pair: -pair[1])
    stuck = fixed == size
    worst = zip(rows[:_LISTED].tolist(), values[:_LISTED].tolist(), strict=True)
    return Left(
        rule.id, rule.limit.name, _level(rule), len(rows), int(stuck.sum()), int(((fixed > 0) & ~stuck).sum()),
        tuple(by), tuple(names.cell(row, value, held) for row, value in worst),
    )  # fmt: skip


class _Names:
    """Tells cells and what holds them by their names in the file."""

    def __init__(self, mesh: Mesh) -> None:
        self._mesh = mesh
        self._offsets, self._nodes = nodes_of_cells(mesh)
        self._type = np.empty(mesh.n_cells, np.int64)
        for k, block in enumerate(mesh.blocks):
            self._type[block.rows] = k
        self._zone = mesh.cell_zone_index() if mesh.cell_zones else None
        self._at: list[tuple[str, NDArray[np.bool_]]] = []
        for zone in mesh.zones:
            if zone.entity == "cell":
                continue
            inside = np.zeros(len(mesh.points), np.bool_)
            inside[self._points(zone.entity, zone.members)] = True
            self._at.append((zone.name, inside))

    def _points(self, entity: str, members: Ints) -> Ints:
        if entity == "point":
            return members
        if self._mesh.faces is not None:
            sides = self._mesh.faces
            chosen = np.zeros(len(sides.offsets) - 1, np.bool_)
            chosen[members] = True
            return sides.nodes[np.repeat(chosen, np.diff(sides.offsets))]
        parts = [block.nodes[np.isin(block.rows, members)].ravel() for block in self._mesh.boundary
                 if block.items is None]  # fmt: skip
        return np.concatenate(parts) if parts else np.empty(0, np.int64)

    def cell(self, row: int, value: float, held: NDArray[np.uint8]) -> dict[str, Any]:
        """What a list of cells says of this one."""
        mesh = self._mesh
        points = self._nodes[self._offsets[row] : self._offsets[row + 1]]
        fixed = points[held[points] > 0]
        words = [text for bit, text in _WORDS.items() if (held[points] & bit.value).any() and bit != Hold.ELEMENT]
        zones = [short(name) for name, inside in self._at if inside[fixed].any()]
        zone = None if self._zone is None or self._zone[row] < 0 else short(mesh.cell_zones[int(self._zone[row])].name)
        return {
            "cell": int(mesh.ids_of_cells(row)), "type": mesh.blocks[int(self._type[row])].type, "zone": zone,
            "value": plain(value), "centroid": [plain(x) for x in mesh.points[points].mean(axis=0).tolist()],
            "points": len(points), "points_held": len(fixed), "held_by": words, "held_in_zones": zones[:10],
        }  # fmt: skip
