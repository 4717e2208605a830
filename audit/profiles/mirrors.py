"""Limits on the mirror image of a metric, which are compared on the scale that is stored."""

from __future__ import annotations

import math
from dataclasses import replace
from decimal import Decimal

from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.model import Limit
from meshwright.audit.profiles.rule import NotApplicable, Rule

__all__ = ["MIRRORS", "mirrored", "mirrored_back"]

MIRRORS = {"icem.equiangle_skewness": "gambit.equiangle_skew"}
"""Metrics that are 1 minus another: limits on them are compared on the scale of the other, for 1 - 0.8 < 0.2."""


def mirrored(limit: Limit) -> Limit:
    """The same limit on the other scale."""

    def other(value: float | None) -> float | None:
        return None if value is None else _one_minus(value)

    turned = replace(limit, metric=MIRRORS[limit.metric], warn=other(limit.warn), fail=other(limit.fail))
    if limit.stat in ("share", "count"):
        turned = replace(limit, metric=turned.metric, beyond=other(limit.beyond))
    stat = {"max": "min", "min": "max"}.get(limit.stat, limit.stat)
    sense = {"above": "below", "below": "above"}.get(limit.sense, "")
    return replace(turned, stat=stat, sense=sense)  # type: ignore[arg-type]


def mirrored_back(rule: Rule | NotApplicable, limit: Limit) -> Rule | NotApplicable:
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
