"""What a system demands of a mesh, as data: `Profile` and its `Limit`s."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

__all__ = [
    "CELLS",
    "STATS",
    "Dialect",
    "Layers",
    "LeftOut",
    "Limit",
    "Measure",
    "Near",
    "NoWorse",
    "Preset",
    "Profile",
    "Sense",
    "Unmeasurable",
    "Waiver",
    "Where",
]

STATS = ("max", "min", "mean", "share", "count")
"""Statistics of a profile; a gate file knows "undefined" and percentiles ("p99.9") as well."""

Sense = Literal["above", "below"]
"""On which side of a limit the bad values lie."""

CELLS = "cells"
"""Stands in place of a metric: the cells themselves, for the share of a type among all of them."""


@dataclass(frozen=True)
class Layers:
    """The first `at_most` layers of cells on the wall zones that match `of`; the first lies on the wall."""

    of: str
    at_most: int


@dataclass(frozen=True)
class Near:
    """Cells so near to the zones that match `to`, or so far away: by the smallest distance between corners."""

    to: str
    at_most: float | None = None
    at_least: float | None = None


@dataclass(frozen=True)
class Where:
    """Which part of a mesh a limit is on: all of it, or what every given condition holds for.

    zones: names or patterns.  roles: of zones.
    """

    zones: tuple[str, ...] = ()
    roles: tuple[str, ...] = ()
    layers: Layers | None = None
    near: Near | None = None

    def __bool__(self) -> bool:
        return bool(self.zones or self.roles or self.layers or self.near)

    @property
    def words(self) -> str:
        """'zone fluid*, within 0.1 of inlet', "" for everywhere."""
        parts = []
        if self.zones:
            parts.append(f"zone {' or '.join(self.zones)}")
        if self.roles:
            parts.append(f"role {' or '.join(self.roles)}")
        if self.layers:
            n, of = self.layers.at_most, "any wall" if self.layers.of == "*" else self.layers.of
            parts.append(f"first {f'{n} layers' if n > 1 else 'layer'} on {of}")
        if self.near:
            if self.near.at_most is not None:
                parts.append(f"within {self.near.at_most:g} of {self.near.to}")
            if self.near.at_least is not None:
                parts.append(f"{self.near.at_least:g} or more from {self.near.to}")
        return ", ".join(parts)


@dataclass(frozen=True)
class NoWorse:
    """How much worse than the baseline is still no worse: the larger of `abs` and `rel` times its figure."""

    abs: float = 0.0
    rel: float = 0.0


@dataclass(frozen=True)
class Waiver:
    """A failure that is accepted until the end of a day.  rule: id or pattern.  zone: name or pattern, "" for all."""

    rule: str
    zone: str
    reason: str
    until: dt.date


@dataclass(frozen=True)
class Preset:
    """A profile that a gate file extends, by what tells one edition of it from another."""

    name: str
    version: str
    sha256: str


@dataclass(frozen=True)
class Limit:
    """One limit: what is measured, on what, and the values from which on it is a warning or a failure.

    id: a word, unique in its profile.  name: the system's own name for the quantity.  metric: id of a metric, `CELLS`,
    or "" where `finding` is the code of a check whose entities are counted.
    stat: "max" and "min" of all values; "mean" of them; percentiles ("p99.9"); "count" and "share" (0 to 1) of the
    values beyond `beyond`; "undefined": how many entities have none.
    types: cell types, () for all the metric is defined on; a first-order type stands for its second-order kin.
    order: 1 or 2 for cells of that order alone, 0 for both.  faces: "interior", "boundary" or "" for both.
    warn, fail: a value strictly beyond one is a warning or a failure, a value that equals it is not, unless
    `inclusive`.  sense: side of the bad values, "" for what the statistic and the metric's best end imply.
    side: side of `warn` and `fail` on which the bad figures lie, likewise.
    scale: "fluent" (0 is best) or "icem" (1 is best) where its numbers are on one of these, "" for the metric's own.
    where: the part of the mesh it is on.  each: whether every zone of cells there is judged by itself.
    severity: "warn" where a failure only warns, "info" where it never counts.  no_worse: against a baseline.
    on_missing: what it becomes without a figure.  on_no_match: what it becomes where it matches nothing, "" for an
    error where a name is not in the mesh, else a warning; it counts for limits of the user's `own` gate file alone.
    source: where the limit stands.  verified: whether it was read there; false for limits that are handed down.
    ideal, good, worst, weight: further levels of criteria that know five of them; they judge nothing here.
    """

    id: str
    name: str
    stat: str
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
    side: Literal["", "above", "below"] = ""
    scale: Literal["", "fluent", "icem"] = ""
    where: Where = Where()
    each: bool = False
    severity: Literal["error", "warn", "info"] = "error"
    no_worse: NoWorse | None = None
    on_missing: Literal["error", "warn", "ignore"] = "error"
    on_no_match: Literal["", "error", "warn", "ignore"] = ""
    own: bool = False

    @property
    def percentile(self) -> float | None:
        """99.9 for "p99.9", None for other statistics."""
        return float(self.stat[1:]) if self.stat[:1] == "p" else None

    @property
    def tally(self) -> bool:
        """Whether the figure is a number of entities or a share of them, and not a value of the metric."""
        return self.stat in ("share", "count", "undefined")

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
        if self.side:
            return self.side
        if self.stat == "mean" or self.percentile is not None:
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
    program.  version, sha256: of the text of a profile that comes with the program.  presets: those a gate file
    extends.  baseline: what a gate file names as its baseline, "" for nothing.  discipline: "cfd" or "fea", "" for
    neither.  scales: how its numbers are to be read.
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
    waivers: tuple[Waiver, ...] = ()
    presets: tuple[Preset, ...] = ()
    baseline: str = ""
    version: str = ""
    sha256: str = ""

    @property
    def metrics(self) -> tuple[str, ...]:
        """Ids of all metrics it needs measured, without repetition."""
        ids = [limit.metric for limit in self.limits if limit.metric not in ("", CELLS)]
        ids += [id_ for measure in self.measures for id_ in measure.metrics]
        ids += [id_ for ids_ in self.default_metrics.values() for id_ in ids_]
        return tuple(dict.fromkeys(ids))
