"""What became of the limits of a profile: `Rule` and `Judgement`, and which state a figure has.

A value is beyond a limit when it is strictly on its bad side; the comparison is made on the unrounded double, so 0.95
passes "at most 0.95" and the next double after it does not. `Limit.inclusive` counts equality as beyond.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal, cast

from meshwright.audit.metrics import METRICS
from meshwright.audit.places import plain, text
from meshwright.audit.profiles.model import Limit, NoWorse, Profile, Sense
from meshwright.audit.profiles.quantities import QUANTITIES

__all__ = ["Judgement", "NotApplicable", "Rule", "State", "is_beyond", "judge", "worse_than"]

State = Literal["pass", "info", "waived", "warn", "fail", "incomplete"]
"""Of a rule. info: it fails or warns but never counts; waived: it fails, which a waiver accepts."""


@dataclass(frozen=True)
class Rule:
    """What became of a limit.

    profile: name of its profile.  best: end of the metric's scale.  measured: the figure, None where there is none.
    state: see the head of `evaluate`.  count: entities looked at; undefined: of those without a value; warned, failed:
    values beyond `warn` and `fail` (of means, where the mean is; of shares and counts: values beyond `beyond`, where
    that limit is exceeded).
    worst: the worst entity, as in the lists of worst values, or None.  reason: why it is incomplete or waived, what is
    worse than the baseline, else "".
    zone: the zone it was judged on by itself, "" for all there are.  baseline: the figure of the baseline, None for
    none.  waiver: what accepts its failure, or did until it expired.  zones: of a broken rule, the zones with values
    beyond the limit: {"zone", "beyond", "worst"}.
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
    zone: str = ""
    baseline: float | None = None
    waiver: dict[str, Any] | None = None
    zones: tuple[dict[str, Any], ...] = ()

    @property
    def id(self) -> str:
        """`profile.limit`, stable; with the zone in brackets where each is judged by itself."""
        return f"{self.profile}.{self.limit.id}{f'[{self.zone}]' if self.zone else ''}"

    @property
    def deciding(self) -> float | None:
        """The limit that the state speaks of: of a failure `fail`, else `warn` where there is one."""
        limit = self.limit
        if self.state in ("fail", "waived") or limit.warn is None:
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
            "unit": "1" if limit.tally else self.unit,
            "on": _on(limit),
            "where": text(limit.where.words),
            "zone": text(self.zone) or None,
            "scale": limit.scale,
            "severity": limit.severity,
            "count": self.count,
            "undefined": self.undefined,
            "beyond": self.failed if self.state in ("fail", "waived") else self.warned,
            "beyond_warn": self.warned,
            "beyond_fail": self.failed,
            "worst": self.worst,
            "reason": text(self.reason),
            "baseline": None if self.baseline is None else plain(self.baseline),
            "no_worse": None if limit.no_worse is None else {"abs": limit.no_worse.abs, "rel": limit.no_worse.rel},
            "waiver": self.waiver,
            "zones": list(self.zones),
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
        states = {"pass" if rule.state in ("info", "waived") else rule.state for rule in self.rules}
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


def worse_than(figure: float, baseline: float, sense: Sense, allowed: NoWorse) -> bool:
    """Whether a figure is worse than the baseline's by more than is allowed; the bad ones lie on side `sense`.

    A figure that is no number is worse than any; so is any than an infinitely good one.
    """
    if math.isnan(figure):
        return True
    slack = max(allowed.abs, allowed.rel * abs(baseline)) if math.isfinite(baseline) else 0.0
    return figure > baseline + slack if sense == "above" else figure < baseline - slack


def _on(limit: Limit) -> str:
    """What a limit is on, in words."""
    if limit.faces:
        return f"{limit.faces} faces"
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    if metric is not None and metric.entity != "cell":
        return f"{metric.entity}s"
    order = {1: " (first order)", 2: " (second order)"}.get(limit.order, "")
    return (" ".join(limit.types) or ("mesh" if limit.finding else "all")) + order
