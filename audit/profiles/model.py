"""What a system demands of a mesh, as data: `Profile` and its `Limit`s."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

__all__ = ["CELLS", "STATS", "Dialect", "LeftOut", "Limit", "Measure", "Profile", "Sense", "Unmeasurable"]

Stat = Literal["max", "min", "mean", "share", "count"]
STATS = ("max", "min", "mean", "share", "count")

Sense = Literal["above", "below"]
"""On which side of a limit the bad values lie."""

CELLS = "cells"
"""Stands in place of a metric: the cells themselves, for the share of a type among all of them."""


@dataclass(frozen=True)
class Limit:
    """One limit: what is measured, on what, and the values from which on it is a warning or a failure.

    id: a word, unique in its profile.  name: the system's own name for the quantity.  metric: id of a metric, `CELLS`,
    or "" where `finding` is the code of a check whose entities are counted.
    stat: "max" and "min" of all values; "mean" of them; "count" and "share" (0 to 1) of the values beyond `beyond`.
    types: cell types, () for all the metric is defined on; a first-order type stands for its second-order kin.
    order: 1 or 2 for cells of that order alone, 0 for both.  faces: "interior", "boundary" or "" for both.
    warn, fail: a value strictly beyond one is a warning or a failure, a value that equals it is not, unless
    `inclusive`.  sense: side of the bad values, "" for what the statistic and the metric's best end imply.
    source: where the limit stands.  verified: whether it was read there; false for limits that are handed down.
    ideal, good, worst, weight: further levels of criteria that know five of them; they judge nothing here.
    """

    id: str
    name: str
    stat: Stat
    source: str
    verified: bool
    metric: str = ""
    finding: str = ""
    types: tuple[str, ...] = ()
    order: int = 0
    faces: Literal["", "interior", "boundary"] = ""
    beyond: float | None = None
    warn: float | None = None
    fail: float | None = None
    inclusive: bool = False
    sense: Literal["", "above", "below"] = ""
    note: str = ""
    ideal: float | None = None
    good: float | None = None
    worst: float | None = None
    weight: float | None = None

    @property
    def subject(self) -> str:
        """What is measured: a metric id, `CELLS` or the code of a check."""
        return self.metric or self.finding

    def values_beyond(self, best: str) -> Sense:
        """On which side of `beyond`, or of a limit on the mean, the bad values lie; best: end of the metric's scale."""
        if self.sense:
            return self.sense
        return "above" if best == "low" else "below"

    def direction(self, best: str) -> Sense:
        """On which side of `warn` and `fail` the bad figures lie."""
        if self.stat == "mean":
            return self.values_beyond(best)
        return "below" if self.stat == "min" else "above"


@dataclass(frozen=True)
class Measure:
    """A quantity that the system reports without setting a limit to it.  metrics: ids of what it is here."""

    name: str
    metrics: tuple[str, ...]
    note: str = ""


@dataclass(frozen=True)
class LeftOut:
    """A limit of the system that is no rule here.  what: its name for the quantity."""

    what: str
    reason: str
    source: str = ""


@dataclass(frozen=True)
class Unmeasurable:
    """A demand of a file of limits that cannot be checked, so that no mesh passes it unseen."""

    id: str
    name: str
    reason: str


@dataclass(frozen=True)
class Dialect:
    """The system's words for what a mesh is divided into.  note: which of several words means what."""

    zone: str = "zone"
    zones: str = "zones"
    boundary: str = "boundary zone"
    boundaries: str = "boundary zones"
    note: str = ""


@dataclass(frozen=True)
class Profile:
    """All a system demands of a mesh, or all that a file of limits does.

    name: as on the command line; of a file its kind.  file: path of the file, "" for a profile that comes with the
    program.  discipline: "cfd" or "fea", "" for neither.  scales: how its numbers are to be read.
    default_metrics: metrics of its default quality measure, by cell type.  notes: what reading a file left aside.
    """

    name: str
    title: str
    description: str
    discipline: Literal["cfd", "fea", ""] = ""
    dialect: Dialect = field(default_factory=Dialect)
    scales: tuple[str, ...] = ()
    default_metrics: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    measures: tuple[Measure, ...] = ()
    limits: tuple[Limit, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    unmeasurable: tuple[Unmeasurable, ...] = ()
    file: str = ""
    notes: tuple[str, ...] = ()

    @property
    def metrics(self) -> tuple[str, ...]:
        """Ids of all metrics it needs measured, without repetition."""
        ids = [limit.metric for limit in self.limits if limit.metric not in ("", CELLS)]
        ids += [id_ for measure in self.measures for id_ in measure.metrics]
        ids += [id_ for ids_ in self.default_metrics.values() for id_ in ids_]
        return tuple(dict.fromkeys(ids))
