"""What a pass gives back, and what a pass may not touch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from meshwright.audit.mesh import Ints, Mesh
from meshwright.repair.sliding import FIXED, Sheet

__all__ = ["FREE", "KEEP", "Options", "Outcome", "Pass", "Tell"]

KEEP, FREE = "keep", "free"

Tell = Callable[[str, int, int], None]


def _silent(stage: str, done: int, of: int) -> None:
    """Tell nobody."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """A pass's proposal.

    mesh: the mesh it proposes, the very object it was given where nothing is to be done.
    changed: entities changed, in the unit that `note` names.
    points_from, cells_from: (n,) for each point and cell of `mesh` the row in the mesh before: that it is, or, for
    cells, that it descends from; -1 for a new point. None where the rows are the same.
    refused: sentences on what could not be mended and what stands in the way.
    """

    mesh: Mesh
    changed: int
    note: str = ""
    points_from: Ints | None = None
    cells_from: Ints | None = None
    refused: tuple[str, ...] = ()


@dataclass(frozen=True)
class Options:
    """What the user may choose.

    hold: globs of zones whose points stay. tolerance: distance within which `weld` joins points, None for its default.
    refine: globs of zones of cells that `refine` and its kin work on, none for all. max_edge: length that no edge of
    theirs keeps, None for none. max_hole: edges of the largest hole that `fill-holes` closes, where that is more than
    its own limit.
    boundary: "fixed", "slide" or "project", see `sliding`; sheet: the boundary as given, along which points slide.
    nodes: "keep", or "free" where passes on tets may put points in and take inner ones away.
    tell: is told (stage, done, of) and may raise to cancel.
    """

    hold: tuple[str, ...] = ()
    tolerance: float | None = None
    boundary: str = FIXED
    sheet: Sheet = field(default_factory=Sheet.empty, compare=False)
    nodes: str = KEEP
    refine: tuple[str, ...] = ()
    max_edge: float | None = None
    max_hole: int = 0
    tell: Tell = field(default=_silent, compare=False)


@dataclass(frozen=True)
class Pass:
    """A row of the table of passes.

    name: as on the command line. title: what it does, for people. run: (mesh, options) -> Outcome; the mesh is never
    changed in place. repeats: worth running again on its own outcome until it gains nothing more; its outcome counts
    only where the quality has risen, so that a second run finds nothing to do. nothing_worse: where the driver demands
    that the worst cell is no worse, and the volume kept: "around points" (see `quality.worst_around_points`), "in
    regions" of changed cells that hang together, for passes that move everything at once; "nowhere", where the volume
    must be kept and no more, for passes that cut cells; "" for passes that put the list of cells in order. explicit:
    runs only where it is asked for by name. once: runs once in a repair, since its own outcome is work for it again.
    cautious: a second, smaller proposal for where the first is rolled back.
    """

    name: str
    title: str
    run: Callable[[Mesh, Options], Outcome]
    repeats: bool = False
    nothing_worse: str = "around points"
    explicit: bool = False
    once: bool = False
    cautious: Callable[[Mesh, Options], Outcome] | None = None
