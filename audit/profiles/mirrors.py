"""Limits on another scale than the stored one, which are compared on the stored one: 1 - 0.8 is less than 0.2."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from typing import Any

from meshwright.audit.metrics import METRICS
from meshwright.audit.metrics.row import Metric
from meshwright.audit.profiles.model import Limit
from meshwright.audit.profiles.rule import NotApplicable, Rule

__all__ = ["MIRRORS", "SCALES", "Turn", "turn_for", "turned", "turned_back"]

MIRRORS = {"icem.equiangle_skewness": "gambit.equiangle_skew"}
"""Metrics that are 1 minus another: limits on them are compared on the scale of the other."""

SCALES = ("fluent", "icem")


@dataclass(frozen=True)
class Turn:
    """How a limit gets onto the scale that is stored: the metric to compare, and what makes one number of the other."""

    metric: str
    convert: Callable[[float], float]


def _one_minus(value: float) -> float:
    """1 - value as decimals have it, so that the mirror of 0.8 is 0.2 and no less."""
    return float(1 - Decimal(repr(value))) if math.isfinite(value) else 1.0 - value


def _one_over(value: float) -> float:
    """1 / value of the decimal that stands there, rounded once."""
    if value == 0 or not math.isfinite(value):
        return math.inf if value == 0 else 0.0 if math.isinf(value) else value
    return float(1 / Fraction(Decimal(repr(value))))


def scale_of(metric: Metric) -> str:
    """The scale a metric is stored on: "fluent", "icem", or "" where it is on neither."""
    if metric.best == "low" and (metric.low, metric.high) in ((0.0, 1.0), (1.0, math.inf)):
        return "fluent"
    return "icem" if metric.best == "high" and metric.high == 1.0 and metric.low in (0.0, -1.0) else ""


def turn_for(limit: Limit, measured: object = ()) -> Turn | None:
    """What turns the limit onto the stored scale, None where it stands on it.

    measured: ids of the metrics there are values of.  KeyError for a scale that the metric does not have.
    """
    metric, convert = limit.metric, None
    if limit.scale:
        row = METRICS[metric]
        stored = scale_of(row)
        if not stored:
            raise KeyError(f"{metric} is on neither scale")
        if stored != limit.scale:
            convert = _one_over if row.high == math.inf else _one_minus
    other = MIRRORS.get(metric)
    if other is not None and other in measured:  # type: ignore[operator]
        metric, convert = other, _one_minus if convert is None else None
    if convert is None:
        return None if metric == limit.metric else Turn(metric, float)
    return Turn(metric, convert)


def turned(limit: Limit, turn: Turn) -> Limit:
    """The same limit on the stored scale."""
    if turn.convert is float:
        return replace(limit, metric=turn.metric, scale="")

    def other(value: float | None) -> float | None:
        return None if value is None else turn.convert(value)

    sense: dict[str, Any] = {"above": "below", "below": "above", "": ""}
    here = replace(limit, metric=turn.metric, scale="", sense=sense[limit.sense])
    if limit.tally:
        return replace(here, beyond=other(limit.beyond))
    stat = {"max": "min", "min": "max"}.get(limit.stat, limit.stat)
    if limit.percentile is not None:
        stat = f"p{100 - Decimal(limit.stat[1:])}"
    return replace(here, warn=other(limit.warn), fail=other(limit.fail), stat=stat, side=sense[limit.side])


def turned_back(rule: Rule | NotApplicable, limit: Limit, turn: Turn) -> Rule | NotApplicable:
    """A rule on the stored scale, told on that of the limit."""
    if isinstance(rule, NotApplicable):
        return rule
    metric = METRICS[limit.metric]
    measured, worst = rule.measured, rule.worst
    if measured is not None and not limit.tally:
        measured = turn.convert(measured)

    def told(entry: dict | None) -> dict | None:
        return None if entry is None else {**entry, "value": turn.convert(float(entry["value"]))}

    best = metric.best
    if limit.scale:
        best = "low" if limit.scale == "fluent" else "high"
    zones = tuple({**entry, "worst": told(entry["worst"])} for entry in rule.zones)
    return replace(rule, limit=limit, best=best, unit=metric.unit, measured=measured, worst=told(worst), zones=zones)
