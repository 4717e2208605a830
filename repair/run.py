"""The driver: passes propose, it disposes. Every pass is a transaction: its outcome is kept whole or not at all."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from meshwright.audit.cache import forget
from meshwright.audit.errors import MeshError, UsageError
from meshwright.audit.mesh import Ints, Mesh
from meshwright.audit.parallel import limited_to
from meshwright.audit.profiles.model import Profile
from meshwright.repair.cell_form import in_cell_form
from meshwright.repair.guards import broken
from meshwright.repair.hausdorff import Apart, surface_of, surfaces_apart
from meshwright.repair.limits import limits
from meshwright.repair.outcome import FREE, KEEP, Options, Outcome, Pass
from meshwright.repair.passes import PASSES, select_passes
from meshwright.repair.quality import SMALL, WORTH, Rating, Standing, standing, worst_first
from meshwright.repair.sizes import signed_sizes
from meshwright.repair.sliding import FIXED, MODES, Sheet
from meshwright.repair.target import Aim, judge_by

__all__ = ["Repair", "Step", "repair"]

_NO_GAIN = "it gained nothing worth a change"
_MOST_REPEATS = 50
_MOST_ROUNDS = 8
"""Turns of a pass and rounds of all passes after which a repair that does not settle is stopped, and says so."""


@dataclass(frozen=True, eq=False)
class Step:
    """One transaction that was kept, or one that was not and why.

    name: of the pass. state: "kept", "rolled back" or "refused". changed, note: as of `Outcome`. reason: why it was
    rolled back or refused. before, after: the meshes, the same where nothing was kept. points_from, cells_from: as of
    `Outcome`.
    """

    name: str
    state: str
    changed: int
    note: str
    reason: str
    before: Mesh
    after: Mesh
    points_from: Ints | None
    cells_from: Ints | None
    worst_before: float
    worst_after: float
    bad_before: int
    bad_after: int
    seconds: float

    @property
    def raised(self) -> bool:
        """Whether the worst cell was, or would have been, raised by what counts."""
        return self.worst_after > self.worst_before + WORTH * max(abs(self.worst_before), SMALL)


@dataclass(frozen=True)
class Along:
    """What became of a boundary whose points could slide.

    mode: "slide" or "project". moved: points of it that moved. volume: relative change of the volume.
    """

    mode: str
    moved: int
    volume: float


@dataclass(frozen=True, eq=False)
class Repair:
    """What a repair did. before and after are meshes; steps tells how the one became the other.

    before: the mesh that was given, in the form of cells where it was given by its faces; `notes` tells what that form
    does not hold. limits: what the boundary alone decides. aim: the profile it was for, None where there was none.
    along: what became of the boundary, None where it was fixed. apart: how far the surface is from what it was, None
    for solid meshes with a fixed boundary and where nothing changed.
    """

    before: Mesh
    after: Mesh
    steps: tuple[Step, ...]
    refused: tuple[str, ...]
    notes: tuple[str, ...]
    limits: tuple[str, ...]
    first: Rating
    last: Standing
    aim: Aim | None = None
    along: Along | None = None
    apart: Apart | None = None

    @property
    def changed(self) -> bool:
        """Whether the mesh is another one now."""
        return self.after is not self.before

    @property
    def moved_points(self) -> int:
        """Points that are still there and elsewhere."""
        return int(np.count_nonzero(self._moves() > 0.0))

    @property
    def max_deviation(self) -> float:
        """Longest way of a point."""
        moves = self._moves()
        return float(moves.max()) if len(moves) else 0.0

    def _moves(self) -> Any:
        origin = np.arange(len(self.after.points))
        for step in reversed([s for s in self.steps if s.state == "kept" and s.points_from is not None]):
            origin = np.where(origin >= 0, np.asarray(step.points_from)[origin], -1)
        old = origin >= 0
        gap = self.after.points[old] - self.before.points[origin[old]]
        return np.sqrt((gap * gap).sum(axis=1))


def repair(
    mesh: Mesh,
    passes: str | None = None,
    *,
    target: Profile | None = None,
    hold: tuple[str, ...] = (),
    tolerance: float | None = None,
    boundary: str = FIXED,
    nodes: str = KEEP,
    refine: tuple[str, ...] = (),
    max_edge: float | None = None,
    max_hole: int = 0,
    threads: int | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Repair:
    """Repair a mesh; it is not changed, the result holds a new one.

    passes: names with commas, None for those that are safe on every mesh; they run in the order of `PASSES`.
    target: in place of `passes`: run what this profile calls for, until it is kept, and tell what is left and why.
    hold: globs of zones whose points stay; borders of zones always stay. boundary: "fixed"; "slide", where points of
    tets inside flat parts of it may move there; "project", where those of smooth parts may move along the surface as it
    was given; edges of the geometry always stay. nodes: "keep", or "free", where points of tets may be put in and inner
    ones taken away. tolerance: of `weld`. refine, max_edge: globs of zones, and the longest edge that is left there, of
    the passes that refine. max_hole: edges of the largest hole that `fill-holes` closes; 16 at least.
    threads: the result is the same for any number. progress: told (stage, done, of); raise in it to cancel.
    Raises UsageError for unknown names, MeshError where the mesh cannot be repaired at all.
    """
    if target is not None and passes is not None:
        raise UsageError("passes and a target exclude each other: a target chooses the passes")
    chosen = select_passes(passes)
    if boundary not in MODES:
        raise UsageError(f"unknown boundary {boundary[:60]!r}; known are {', '.join(MODES)}")
    if nodes not in (KEEP, FREE):
        raise UsageError(f"unknown choice of nodes {nodes[:60]!r}; known are {KEEP}, {FREE}")
    options = Options(hold, tolerance, boundary, nodes=nodes, refine=refine, max_edge=max_edge, max_hole=max_hole)
    if progress is not None:
        options = replace(options, tell=progress)
    if mesh.n_nonfinite:
        raise MeshError(
            f"{mesh.n_nonfinite} points have coordinates that are nan or infinite; no pass can tell where they belong"
        )
    mesh, notes = in_cell_form(mesh)
    if boundary != FIXED and mesh.cell_dimension == 3:
        options = replace(options, sheet=Sheet.of(mesh, boundary))
    with limited_to(threads):
        if target is None:
            return _Driver(mesh, options).run(chosen, notes, None)
        options.tell("judge", 0, 0)
        aim = Aim(target, judge_by(mesh, target))
        return _Driver(mesh, options).run(tuple(PASSES[p.name] for p in aim.plan), notes, aim)


class _Driver:
    """The mesh while it is repaired, and what became of every proposal."""

    def __init__(self, mesh: Mesh, options: Options) -> None:
        self.options = options
        self.now = standing(mesh)
        self.first = self.now.rating
        self.before = self.current = mesh
        self.steps: list[Step] = []
        self.refused: list[str] = []
        stiff = sum(len(block) for block in mesh.blocks if block.items is not None)
        if stiff:
            self.refused.append(f"{stiff} polyhedra or polygons keep their shape: no pass moves them or cuts them anew")
        self.spent: dict[str, Mesh] = {}
        self.blocked = False
        self.judged: tuple[Mesh | None, bool] = None, False

    def run(self, chosen: tuple[Pass, ...], notes: tuple[str, ...], aim: Aim | None) -> Repair:
        """Rounds of all passes until a whole one keeps nothing, or the aim is reached.

        A second run then begins where this one ended, proposes what was rolled back here, and rolls it back again:
        nothing is left for it to change.
        """
        done = not chosen
        for _ in range(_MOST_ROUNDS):
            if done or self.blocked:
                break
            kept = 0
            for row in chosen:
                kept += self._turns(row, aim)
                done = self._reached(aim)
                if done or self.blocked:
                    break
            done |= not kept
        else:
            self.refused.append(f"the repair was stopped after {_MOST_ROUNDS} rounds; another run may change more")
        if aim is not None:
            self.options.tell("judge", 0, 0)
            aim = aim.ended(self.current, self.options)
        return Repair(
            self.before, self.current, tuple(self.steps), tuple(dict.fromkeys(self.refused)), notes,
            limits(self.current), self.first, self.now, aim, self._along(), self._apart(),
        )  # fmt: skip

    def _along(self) -> Along | None:
        sheet, mode = self.options.sheet, self.options.boundary
        if not len(sheet.corners):
            return None
        before, now = (np.unique(x.corners.reshape(-1, 3), axis=0) for x in (sheet, Sheet.of(self.current, mode)))
        moved = len(np.unique(np.concatenate([before, now]), axis=0)) - len(before)
        one, two = (float(np.sum(signed_sizes(mesh))) for mesh in (self.before, self.current))
        return Along(mode, moved, (two - one) / one if one else 0.0)

    def _apart(self) -> Apart | None:
        """Of the surfaces before and after, where the mesh is one or its boundary could move, and it changed."""
        if self.current is self.before or (self.before.cell_dimension == 3 and not len(self.options.sheet.corners)):
            return None
        one, two = surface_of(self.before), surface_of(self.current)
        if one is None or two is None:
            return None
        self.options.tell("compare surfaces", 0, 0)
        return surfaces_apart(one, two)

    def _turns(self, row: Pass, aim: Aim | None) -> int:
        """Run a pass until it keeps nothing more; how often it was kept."""
        if self.spent.get(row.name) is self.current or (row.once and row.name in self.spent):
            return 0  # it had its turn on this very mesh
        for turn in range(_MOST_REPEATS if row.repeats else 1):
            if turn and self._reached(aim):
                return turn
            self.spent[row.name] = self.current
            step, after = self._propose(row)
            if step is None:
                return turn
            if step.state != "kept":
                self.blocked = row.explicit and not row.repeats
                if self.blocked:
                    # the passes after it were asked for on the strength of it
                    self.refused.append(f"the passes after {row.name} were not run")
                return turn
            self.current, self.now = step.after, after
        if row.repeats:
            self.refused.append(f"{row.name} was stopped after {_MOST_REPEATS} turns and might gain more")
        return _MOST_REPEATS if row.repeats else 1

    def _propose(self, row: Pass) -> tuple[Step | None, Standing]:
        """The first proposal of a pass that is kept, or its last one; see `Pass.cautious`."""
        runs = [(row.run, self.options)]
        if self.options.boundary != FIXED:
            runs.append((row.run, replace(self.options, boundary=FIXED, sheet=Sheet.empty())))
        if row.cautious is not None:
            runs.append((row.cautious, runs[-1][1]))
        step: Step | None = None
        after = self.now
        for i, (run, options) in enumerate(runs):
            if step is not None and step.reason == _NO_GAIN and (run is row.run or not step.raised):
                continue  # with less freedom it would gain no more
            new, after = _transaction(row, run, self.current, self.now, options, self.refused)
            if new is None:
                return (None if i == 0 else step), self.now
            step = new
            self.steps.append(step)
            if step.state == "kept":
                break
        return step, after

    def _reached(self, aim: Aim | None) -> bool:
        """Whether the aim is; asked once of each mesh."""
        if aim is None:
            return False
        if self.judged[0] is not self.current:
            self.judged = self.current, aim.reached(self.current)
        return self.judged[1]


def _transaction(
    row: Pass,
    run: Callable[[Mesh, Options], Outcome],
    mesh: Mesh,
    now: Standing,
    options: Options,
    refused: list[str],
) -> tuple[Step | None, Standing]:
    """One pass on one mesh; None where it found nothing to do."""
    start = time.perf_counter()

    def step(state: str, reason: str, outcome: Outcome | None, after: Standing) -> Step:
        kept = state == "kept"
        return Step(
            name=row.name, state=state, changed=outcome.changed if outcome and kept else 0,
            note=outcome.note if outcome else "", reason=reason, before=mesh,
            after=outcome.mesh if outcome and kept else mesh,
            points_from=outcome.points_from if outcome and kept else None,
            cells_from=outcome.cells_from if outcome and kept else None,
            worst_before=now.worst, worst_after=after.worst, bad_before=now.bad, bad_after=after.bad,
            seconds=time.perf_counter() - start,
        )  # fmt: skip

    try:
        outcome = run(mesh, options)
    except MeshError as error:
        refused.append(f"{row.name}: {error}")
        return step("refused", str(error), None, now), now
    refused += [f"{row.name}: {text}" for text in outcome.refused]
    if outcome.mesh is mesh:
        return None, now
    after = standing(outcome.mesh)
    forget(mesh)
    if row.repeats and not worst_first(now, after):
        return step("rolled back", _NO_GAIN, outcome, after), now
    fault = broken(row, mesh, outcome, now, after, options)
    forget(mesh)
    forget(outcome.mesh)
    if fault:
        refused.append(f"{row.name} was rolled back: {fault}")
        return step("rolled back", fault, outcome, after), now
    return step("kept", "", outcome, after), after
