"""What became of the limits of a profile: `Rule` and `Judgement`, and which state a figure has.

A value is beyond a limit when it is strictly on its bad side; the comparison is made on the unrounded double, so 0.95
passes "at most 0.95" and the next double after it does not. `Limit.inclusive` counts equality as beyond.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, cast

from meshwright.audit.metrics import METRICS
from meshwright.audit.places import plain
from meshwright.audit.profiles.model import Limit, Profile, Sense
from meshwright.audit.profiles.quantities import QUANTITIES

__all__ = ["Judgement", "NotApplicable", "Rule", "State", "is_beyond", "judge"]

State = Literal["pass", "warn", "fail", "incomplete"]


@dataclass(frozen=True)
class Rule:
    """What became of a limit.

    profile: name of its profile.  best: end of the metric's scale.  measured: the figure, None where there is none.
    state: see the head of `evaluate`.  count: entities looked at; undefined: of those without a value; warned, failed:
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


def _on(limit: Limit) -> str:
    """What a limit is on, in words."""
    if limit.faces:
        return f"{limit.faces} faces"
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    if metric is not None and metric.entity != "cell":
        return f"{metric.entity}s"
    order = {1: " (first order)", 2: " (second order)"}.get(limit.order, "")
    return (" ".join(limit.types) or ("mesh" if limit.finding else "all")) + order
