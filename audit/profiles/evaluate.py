"""The rules of a profile against measured values: pass, warn, fail or incomplete, and how many entities lie beyond.

A value is beyond a limit when it is strictly on its bad side; the comparison is made on the unrounded double, so 0.95
passes "at most 0.95" and the next double after it does not. `Limit.inclusive` counts equality as beyond.

    any value beyond `fail`                          fail, whatever else is unknown
    else values undefined, or nothing measured       incomplete: what is not known does not pass
    else any value beyond `warn`                     warn
    else                                             pass

Of a count or a share the undefined values leave a range: it fails when its lower end does, is incomplete when only its
upper end is beyond a limit. A mean with undefined values is incomplete. A limit on entities that the mesh does not have
is no rule but is listed as not applicable.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.measurement import Measured, clamp
from meshwright.audit.mesh import NO_CELL, Floats, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.parallel import in_parallel
from meshwright.audit.places import Places, plain
from meshwright.audit.profiles.model import CELLS, Limit, Profile, Sense
from meshwright.audit.profiles.quantities import QUANTITIES
from meshwright.audit.statistics import worst_first

__all__ = ["Judgement", "NotApplicable", "Rule", "Sample", "State", "evaluate", "is_beyond", "judge", "samples"]

State = Literal["pass", "warn", "fail", "incomplete"]
Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Sample:
    """Values of one key of `Measured.values`: (n,) clamped to the range of the metric, and the rows they stand in."""

    key: str
    values: Floats
    rows: Rows | None

    def row(self, at: int) -> int:
        """Row of the value at that position."""
        return at if self.rows is None else int(self.rows[at])


@dataclass(frozen=True)
class Rule:
    """What became of a limit.

    profile: name of its profile.  best: end of the metric's scale.  measured: the figure, None where there is none.
    state: see the head of this file.  count: entities looked at; undefined: of those without a value; warned, failed:
    values beyond `warn` and `fail` (of means, where the mean is; of shares and counts: values beyond `beyond`, where
    that limit is exceeded).
    worst: the worst entity, as in the lists of worst values, or None.  reason: why it is incomplete, else "".
    """

    profile: str
    limit: Limit
    best: str
    unit: str
    measured: float | None
    state: State
    count: int = 0
    undefined: int = 0
    warned: int = 0
    failed: int = 0
    worst: dict[str, Any] | None = None
    reason: str = ""

    @property
    def id(self) -> str:
        """`profile.limit`, stable."""
        return f"{self.profile}.{self.limit.id}"

    @property
    def deciding(self) -> float | None:
        """The limit that the state speaks of: of a failure `fail`, else `warn` where there is one."""
        limit = self.limit
        if self.state == "fail" or limit.warn is None:
            return limit.fail
        return limit.warn

    def as_json(self) -> dict[str, Any]:
        """The rule as the document holds it."""
        limit = self.limit
        return {
            "id": self.id,
            "name": limit.name,
            "metric": limit.subject,
            "stat": limit.stat,
            "limit": self.deciding,
            "measured": None if self.measured is None else plain(self.measured),
            "state": self.state,
            "sense": limit.direction(self.best),
            "inclusive": limit.inclusive,
            "warn": limit.warn,
            "fail": limit.fail,
            "value_beyond": limit.beyond,
            "value_sense": limit.values_beyond(self.best),
            "unit": "1" if limit.stat in ("share", "count") else self.unit,
            "on": _on(limit),
            "count": self.count,
            "undefined": self.undefined,
            "beyond": self.failed if self.state == "fail" else self.warned,
            "beyond_warn": self.warned,
            "beyond_fail": self.failed,
            "worst": self.worst,
            "reason": self.reason,
            "source": limit.source,
            "verified": limit.verified,
            "note": limit.note,
        }


@dataclass(frozen=True)
class NotApplicable:
    """A limit that no entity of this mesh is subject to."""

    id: str
    reason: str


@dataclass(frozen=True)
class Judgement:
    """All rules of a profile, in its order, and the limits that do not apply to this mesh."""

    profile: Profile
    rules: tuple[Rule, ...]
    not_applicable: tuple[NotApplicable, ...] = field(default=())

    @property
    def state(self) -> State:
        """fail over incomplete over warn over pass; incomplete where no rule applies, for then nothing was judged."""
        states = {rule.state for rule in self.rules}
        return next((s for s in ("fail", "incomplete", "warn", "pass") if s in states), "incomplete")


def is_beyond(value: float, limit: float | None, sense: Sense, *, inclusive: bool = False) -> bool:
    """Whether a number is on the bad side of a limit; False for nan and where there is no limit."""
    if limit is None:
        return False
    if inclusive and value == limit:
        return True
    return value > limit if sense == "above" else value < limit


def judge(low: float, high: float, limit: Limit, sense: Sense) -> State:
    """The state of a figure known to lie between `low` and `high`, both its value where it is known.

    For limits on one side: `high` is the worse end for sense "above", `low` for "below".
    """
    states = [
        next((name for name, x in (("fail", limit.fail), ("warn", limit.warn))
              if is_beyond(figure, x, sense, inclusive=limit.inclusive)), "pass")
        for figure in ((low, high) if sense == "above" else (high, low))
    ]  # fmt: skip
    at_best, at_worst = states
    return cast(State, at_best if at_best in ("fail", at_worst) else "incomplete")


def evaluate(
    measured: Measured,
    profile: Profile,
    findings: Mapping[str, int] | None = None,
    chosen: NDArray[np.bool_] | None = None,
) -> Judgement:
    """Every limit of the profile against the raw values of an audit.

    findings: how many entities each check reported, by code.  chosen: (n_cells,) cells to count, with the faces and
    points around them; None for all. A metric that was not measured makes its rule incomplete, never a pass.
    """
    places = Places(measured.mesh, chosen)
    for id_ in {limit.metric for limit in profile.limits} & QUANTITIES.keys():
        QUANTITIES[id_].values(measured.mesh)  # kept with the mesh, and not computed by several rules at once
    found = in_parallel(lambda limit: _rule(measured, places, profile, limit, findings or {}), list(profile.limits))
    results = list(found)
    rules = [r for r in results if isinstance(r, Rule)]
    rules += [
        Rule(profile.name, Limit(u.id, u.name, "max", "", True), "low", "1", None, "incomplete", reason=u.reason)
        for u in profile.unmeasurable
    ]
    return Judgement(profile, tuple(rules), tuple(r for r in results if isinstance(r, NotApplicable)))


def _rule(
    measured: Measured, places: Places, profile: Profile, limit: Limit, findings: Mapping[str, int]
) -> Rule | NotApplicable:
    if limit.finding:
        return _of_finding(profile, limit, findings.get(limit.finding, 0))
    if limit.metric == CELLS:
        return _of_types(measured.mesh, places, profile, limit)
    if _MIRRORS.get(limit.metric) in measured.values:
        return _mirrored_back(_rule(measured, places, profile, _mirrored(limit), findings), limit)
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    name = f"{profile.name}.{limit.id}"
    if metric is None or (limit.metric in METRICS and limit.metric not in measured.values):
        if limit.types and not any(_matches(block.type, limit) and len(block) for block in measured.mesh.blocks):
            return NotApplicable(name, f"the mesh has no {' or '.join(limit.types)} cells")
        best, unit = ("low", "1") if metric is None else (metric.best, metric.unit)
        return Rule(profile.name, limit, best, unit, None, "incomplete", reason=f"{limit.metric} was not measured")
    found = [s for s in samples(measured, places, limit) if len(s.values)]
    if not found:
        return NotApplicable(name, _absence(limit, metric.entity))
    return _of_values(places, profile, limit, metric.best, metric.unit, found)


_MIRRORS = {"icem.equiangle_skewness": "gambit.equiangle_skew"}
"""Metrics that are 1 minus another: limits on them are compared on the scale of the other, for 1 - 0.8 < 0.2."""


def _mirrored(limit: Limit) -> Limit:
    """The same limit on the other scale."""

    def other(value: float | None) -> float | None:
        return None if value is None else _one_minus(value)

    turned = replace(limit, metric=_MIRRORS[limit.metric], warn=other(limit.warn), fail=other(limit.fail))
    if limit.stat in ("share", "count"):
        turned = replace(limit, metric=turned.metric, beyond=other(limit.beyond))
    stat = {"max": "min", "min": "max"}.get(limit.stat, limit.stat)
    sense = {"above": "below", "below": "above"}.get(limit.sense, "")
    return replace(turned, stat=stat, sense=sense)  # type: ignore[arg-type]


def _mirrored_back(rule: Rule | NotApplicable, limit: Limit) -> Rule | NotApplicable:
    """A rule on the other scale, told on that of the limit."""
    if isinstance(rule, NotApplicable):
        return rule
    metric = METRICS[limit.metric]
    measured, worst = rule.measured, rule.worst
    if measured is not None and limit.stat not in ("share", "count"):
        measured = _one_minus(measured)
    if worst is not None:
        worst = {**worst, "value": _one_minus(float(worst["value"]))}
    return replace(rule, limit=limit, best=metric.best, unit=metric.unit, measured=measured, worst=worst)


def _one_minus(value: float) -> float:
    """1 - value as decimals have it, so that the mirror of 0.8 is 0.2 and no less."""
    return float(1 - Decimal(repr(value))) if math.isfinite(value) else 1.0 - value


def _absence(limit: Limit, entity: str) -> str:
    if entity != "cell":
        return f"the mesh has no such {entity}s"
    kinds = " or ".join(limit.types) or "its type of"
    order = {1: "first-order ", 2: "second-order "}.get(limit.order, "")
    return f"the mesh has no {order}{kinds} cells"


def _on(limit: Limit) -> str:
    """What a limit is on, in words."""
    if limit.faces:
        return f"{limit.faces} faces"
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    if metric is not None and metric.entity != "cell":
        return f"{metric.entity}s"
    order = {1: " (first order)", 2: " (second order)"}.get(limit.order, "")
    return (" ".join(limit.types) or ("mesh" if limit.finding else "all")) + order


def _matches(kind: str, limit: Limit) -> bool:
    cell = CELL_TYPES[kind]
    if limit.order and cell.order != limit.order:
        return False
    return not limit.types or kind in limit.types or cell.corners in limit.types


def samples(measured: Measured, places: Places, limit: Limit) -> Iterator[Sample]:
    """The values a limit is on, one set per cell type."""
    mesh = measured.mesh
    if limit.metric in QUANTITIES:
        values = QUANTITIES[limit.metric].values(mesh)
        rows = places.chosen("face", np.flatnonzero(~np.isnan(values)))
        yield _of_faces(mesh, limit, values, rows)
        return
    metric = METRICS[limit.metric]
    for key, raw in measured.values[limit.metric].items():
        if key in CELL_TYPES and not _matches(key, limit):
            continue
        rows = places.chosen(key, measured.domain(limit.metric, key))
        if key == "face":
            sample = _of_faces(mesh, limit, raw, rows)
        else:
            sample = Sample(key, raw if rows is None else raw[rows], rows)
        yield Sample(key, clamp(metric, sample.values), sample.rows)


def _of_faces(mesh: Mesh, limit: Limit, values: Floats, rows: Rows | None) -> Sample:
    if limit.faces:
        outside = faces(mesh).neighbour == NO_CELL
        wanted = outside if limit.faces == "boundary" else ~outside
        rows = np.flatnonzero(wanted) if rows is None else rows[wanted[rows]]
    return Sample("face", values if rows is None else values[rows], rows)


def _of_finding(profile: Profile, limit: Limit, n: int) -> Rule:
    state = judge(n, n, limit, "above")
    warned, failed = (n if is_beyond(n, x, "above", inclusive=limit.inclusive) else 0 for x in (limit.warn, limit.fail))
    return Rule(profile.name, limit, "low", "1", float(n), state, n, 0, warned, failed)


def _of_types(mesh: Mesh, places: Places, profile: Profile, limit: Limit) -> Rule | NotApplicable:
    """The share of cells of some types among the cells of the same dimension."""
    counts: dict[str, int] = {}
    for block in mesh.blocks:
        rows = places.chosen(block.type, None)
        counts[block.type] = len(block) if rows is None else len(rows)
    dimensions = {CELL_TYPES[kind].dimension for kind in limit.types}
    total = sum(n for kind, n in counts.items() if CELL_TYPES[kind].dimension in dimensions)
    if not total:
        return NotApplicable(f"{profile.name}.{limit.id}", "the mesh has no cells of this dimension")
    n = sum(n for kind, n in counts.items() if _matches(kind, limit))
    share = n / total
    warned, failed = (
        n if is_beyond(share, x, "above", inclusive=limit.inclusive) else 0 for x in (limit.warn, limit.fail)
    )
    return Rule(profile.name, limit, "low", "1", share, judge(share, share, limit, "above"), total, 0, warned, failed)


def _count(found: list[Sample], limit: float | None, sense: Sense, *, inclusive: bool) -> int:
    if limit is None:
        return 0
    n = 0
    for sample in found:
        values = sample.values
        with np.errstate(invalid="ignore"):
            if sense == "above":
                n += int(np.count_nonzero(values >= limit if inclusive else values > limit))
            else:
                n += int(np.count_nonzero(values <= limit if inclusive else values < limit))
    return n


def _of_values(places: Places, profile: Profile, limit: Limit, best: str, unit: str, found: list[Sample]) -> Rule:
    total = sum(len(s.values) for s in found)
    undefined = sum(int(np.count_nonzero(np.isnan(s.values))) for s in found)
    known = total - undefined
    reason = f"no value on {undefined:,} of {total:,}" if undefined else ""
    sense = limit.direction(best)
    bad = limit.values_beyond(best) if limit.stat not in ("max", "min") else sense
    worst = _worst(places, found, bad)
    if limit.stat in ("count", "share"):
        n = _count(found, limit.beyond, bad, inclusive=False)
        low, high = float(n), float(n + undefined)
        if limit.stat == "share":
            low, high = low / total, high / total
        state = judge(low, high, limit, "above")
        passed = [is_beyond(low, x, "above", inclusive=limit.inclusive) for x in (limit.warn, limit.fail)]
        warned, failed = (n if over else 0 for over in passed)
        return Rule(profile.name, limit, best, unit, low, state, total, undefined, warned, failed, worst,
                    reason if state == "incomplete" else "")  # fmt: skip
    warned, failed = (_count(found, x, bad, inclusive=limit.inclusive) for x in (limit.warn, limit.fail))
    if not known:
        return Rule(profile.name, limit, best, unit, None, "incomplete", total, undefined, reason=reason)
    figure = _figure(found, limit.stat, known)
    if limit.stat == "mean":  # cells beyond it count where the mean itself is
        passed = [is_beyond(figure, x, sense, inclusive=limit.inclusive) for x in (limit.warn, limit.fail)]
        warned, failed = (n if over else 0 for n, over in zip((warned, failed), passed, strict=True))
    state = judge(figure, figure, limit, sense)
    if math.isnan(figure):  # the mean of inf and -inf
        state, reason = "incomplete", reason or "the mean is not a number"
    if undefined and not (state == "fail" and limit.stat != "mean"):
        state = "incomplete"
    return Rule(profile.name, limit, best, unit, figure, state, total, undefined, warned, failed, worst,
                reason if state == "incomplete" else "")  # fmt: skip


def _figure(found: list[Sample], stat: str, known: int) -> float:
    """The largest, smallest or mean of the values that are defined."""
    values = [s.values[~np.isnan(s.values)] for s in found]
    values = [v for v in values if len(v)]
    if stat == "mean":
        with np.errstate(invalid="ignore", over="ignore"):
            return float(sum(float(v.sum()) for v in values) / known)
    return max(float(v.max()) for v in values) if stat == "max" else min(float(v.min()) for v in values)


def _worst(places: Places, found: list[Sample], sense: Sense) -> dict[str, Any] | None:
    """The worst entity over all types; of equal ones that of the first type."""
    high = sense == "above"
    first: tuple[float, Sample, int] | None = None
    for sample in found:
        for at in worst_first(sample.values, 1, high_is_worse=high).tolist():
            value = float(sample.values[at])
            if first is None or (value > first[0] if high else value < first[0]):
                first = value, sample, at
    if first is None:
        return None
    value, sample, at = first
    return {"type": sample.key, **places.describe(sample.key, sample.row(at), plain(value))}
