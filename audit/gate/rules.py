"""One rule of a gate file as a `Limit`, checked against the registries of metrics and checks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.findings import CHECKS
from meshwright.audit.gate.model import GateFile, RuleTable, WhereTable
from meshwright.audit.gate.problems import nearest
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.mirrors import scale_of
from meshwright.audit.profiles.model import CELLS, Layers, Limit, Near, NoWorse, Where
from meshwright.audit.profiles.quantities import QUANTITIES

__all__ = ["RuleError", "UnknownError", "limit_of_rule"]

_TYPES = tuple(name for name, kind in CELL_TYPES.items() if kind.dimension >= 2)
_SIDES = {"le": ("above", False), "lt": ("above", True), "ge": ("below", False), "gt": ("below", True)}
_LEVELS = (*_SIDES, *(f"warn_{key}" for key in _SIDES))


class RuleError(Exception):
    """A rule that contradicts itself.  key: where, as a path within the rule; the texts: expected and found."""

    def __init__(self, key: str, expected: str, found: str) -> None:
        super().__init__(expected, found)
        self.key, self.expected, self.found = tuple(key.split(".")) if key else (), expected, found


class UnknownError(RuleError):
    """A rule about a metric or a check that this version does not have: no mesh passes it, for nothing was checked."""


def limit_of_rule(rule: RuleTable, file: GateFile, inherited: Limit | None, place: str) -> Limit:
    """The limit that a rule comes to; RuleError for what contradicts itself, UnknownError for unknown metrics.

    inherited: the limit of the same id in what the file extends, which a rule without metric and finding changes.
    place: where it stands, for reports.
    """
    if rule.metric is None and rule.finding is None:
        if inherited is None:
            raise RuleError(
                "", "metric = ... or finding = ..., or the id of an inherited rule", f"neither, id {rule.id!r}"
            )
        return _amended(rule, file, inherited)
    if rule.metric is not None and rule.finding is not None:
        raise RuleError("finding", "either a metric or a finding", "both")
    limit = _subject(rule, place)
    limit = _conditions(limit, rule, file)
    limit = _levels(limit, rule)
    _check_levels(limit, rule)
    return limit


def _subject(rule: RuleTable, place: str) -> Limit:
    """What is measured: metric or check, statistic, scale, values that count."""
    title, stat = "", rule.stat
    if rule.finding is not None:
        if rule.finding not in CHECKS:
            raise UnknownError("finding", "the code of a check (`meshwright explain --checks`)",
                               f"{rule.finding!r}{nearest(rule.finding, CHECKS)}")  # fmt: skip
        title, stat = rule.finding.replace("-", " "), stat or "count"
        _only("stat", stat, ("count",), "of what a check finds")
        for key in ("where", "each", "scale", "faces", "beyond", "side"):
            if getattr(rule, key) is not None:
                raise RuleError(key, "no such key in a rule about a finding", repr(key))
    elif rule.metric == CELLS:
        title, stat = f"share of {' '.join((rule.where and rule.where.type) or ())} cells", stat or "share"
        _only("stat", stat, ("share",), "of the cells of some types")
        if not (rule.where and rule.where.type):
            raise RuleError("where.type", "the cell types whose share is meant", "nothing")
        for key in ("scale", "faces", "beyond", "side"):
            if getattr(rule, key) is not None:
                raise RuleError(key, "no such key in a rule about types of cells", repr(key))
    else:
        return _of_metric(rule, place)
    return Limit(rule.id, rule.name or title, stat, rule.source or place, rule.source is None,
                 rule.metric or "", rule.finding or "", note=rule.note or "", own=True)  # fmt: skip


def _only(key: str, value: str, among: tuple[str, ...], why: str) -> None:
    if value not in among:
        raise RuleError(key, f"{' or '.join(among)}, {why}", repr(value))


def _of_metric(rule: RuleTable, place: str) -> Limit:
    assert rule.metric is not None  # noqa: S101 - the caller has seen to it
    metric: Any = METRICS.get(rule.metric) or QUANTITIES.get(rule.metric)
    if metric is None:
        known = (*METRICS, *QUANTITIES, CELLS)
        raise UnknownError("metric", "the id of a metric (`meshwright explain` lists them)",
                           f"{rule.metric!r}{nearest(rule.metric, known)}")  # fmt: skip
    if rule.stat is None:
        raise RuleError(
            "stat", "one of max, min, mean, count, share, undefined, or a percentile such as p99.9", "nothing"
        )
    if rule.scale is not None and (rule.metric not in METRICS or not scale_of(metric)):
        raise RuleError("scale", f"no scale, for {rule.metric} is on neither of them", repr(rule.scale))
    tally = rule.stat in ("count", "share")
    if tally and rule.beyond is None:
        raise RuleError("beyond", f"a value for the {rule.stat} of values beyond it", "nothing")
    if not tally and rule.beyond is not None:
        raise RuleError("beyond", "no such key but for count and share", f"{rule.beyond:g}")
    if rule.side is not None and not tally:
        raise RuleError("side", "no such key but for count and share", repr(rule.side))
    best = _best(metric, rule.scale)
    if tally and rule.side is None and best == "none":
        raise RuleError("side", f"above or below, for {rule.metric} has no good end", "nothing")
    if rule.stat == {"low": "min", "high": "max"}.get(best):
        other = {"min": "max", "max": "min"}[rule.stat]
        raise RuleError("stat", f"{other}, the bad end of {rule.metric}{_on(rule.scale)}", repr(rule.stat))
    if rule.faces is not None and (metric.entity != "face" or rule.faces not in metric.on):
        raise RuleError(
            "faces", f"no such key, for {rule.metric} has no values on {rule.faces} faces alone", repr(rule.faces)
        )
    return Limit(rule.id, rule.name or metric.title, rule.stat, rule.source or place, rule.source is None, rule.metric,
                 beyond=rule.beyond, sense=rule.side or "", scale=rule.scale or "", faces=rule.faces or "",
                 note=rule.note or "", own=True)  # fmt: skip


def _best(metric: Any, scale: str | None) -> str:
    if scale is None:
        return str(metric.best)
    return "low" if scale == "fluent" else "high"


def _on(scale: str | None) -> str:
    return f" on the {scale} scale" if scale else ""


def _conditions(limit: Limit, rule: RuleTable, file: GateFile) -> Limit:
    """The limit with what it is on, and what becomes of it where nothing is."""
    where = rule.where
    no_worse = limit.no_worse
    if rule.no_worse is not None:
        no_worse = NoWorse() if rule.no_worse is True else NoWorse(rule.no_worse.abs, rule.no_worse.rel)
    if where is not None:
        if where.type is not None:
            limit = replace(limit, types=_types(limit, where.type))
        limit = replace(limit, where=_where(where))
    return replace(
        limit,
        each=rule.each is not None or limit.each,
        severity=rule.severity or limit.severity,  # type: ignore[arg-type]
        no_worse=no_worse,
        on_missing=rule.on_missing or file.on_missing,
        on_no_match=rule.on_no_match or file.on_no_match or "",
    )


def _types(limit: Limit, types: list[str]) -> tuple[str, ...]:
    metric: Any = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    for name in types:
        if name not in _TYPES:
            raise RuleError("where.type", f"one of {', '.join(_TYPES)}", f"{name!r}{nearest(name, _TYPES)}")
        if metric is None:
            continue
        if metric.entity != "cell":
            raise RuleError("where.type", f"no such key, for {limit.metric} is a value of {metric.entity}s", repr(name))
        if name not in metric.on and CELL_TYPES[name].corners not in metric.on:
            raise RuleError(
                "where.type", f"types that {limit.metric} is defined on: {', '.join(metric.on)}", repr(name)
            )
    return tuple(types)


def _where(where: WhereTable) -> Where:
    layer, near = where.wall_layer, where.distance
    return Where(
        zones=tuple(where.zone or ()),
        roles=tuple(where.role or ()),
        layers=None if layer is None else Layers(layer.of, layer.at_most),
        near=None if near is None else Near(near.to, near.at_most, near.at_least),
    )


def _given(rule: RuleTable) -> Iterator[tuple[str, float]]:
    for key in _LEVELS:
        value = getattr(rule, key)
        if value is not None:
            yield key, value


def _levels(limit: Limit, rule: RuleTable) -> Limit:
    """The limit with its levels, all of them comparisons of one kind."""
    given = list(_given(rule))
    if not given:
        if limit.no_worse is None and limit.warn is None and limit.fail is None:
            raise RuleError("le", f"one of {', '.join(_LEVELS)} or no_worse", "none of them")
        return limit
    first = given[0][0]
    kind = first.removeprefix("warn_")
    for key, _ in given[1:]:
        if key.removeprefix("warn_") != kind or key.startswith("warn_") == first.startswith("warn_"):
            raise RuleError(key, f"{kind} and warn_{kind} alone beside {first}", repr(key))
    side, strict = _SIDES[kind]
    _check_side(limit, first, side)
    fail, warn = dict(given).get(kind), dict(given).get(f"warn_{kind}")
    return replace(limit, fail=fail, warn=warn, inclusive=strict, side=side)  # type: ignore[arg-type]


def _check_side(limit: Limit, key: str, side: str) -> None:
    """RuleError where the limit would refuse good values."""
    good = {"above": "le or lt", "below": "ge or gt"}
    wanted = ""
    if limit.stat in ("max", "min"):
        wanted = "above" if limit.stat == "max" else "below"
    elif not limit.tally and limit.metric:
        metric: Any = METRICS.get(limit.metric) or QUANTITIES[limit.metric]
        wanted = {"low": "above", "high": "below"}.get(_best(metric, limit.scale or None), "")
    if wanted and side != wanted:
        raise RuleError(key, f"{good[wanted]} for the {limit.stat} of {limit.metric}{_on(limit.scale)}", repr(key))


def _check_levels(limit: Limit, rule: RuleTable) -> None:
    """RuleError for levels that no figure can reach, or that fail before they warn."""
    given = dict(_given(rule))
    low, high = 0.0, math.inf
    if limit.stat == "share":
        high = 1.0
    elif not limit.tally:
        low, high = _range(limit)
    for key, value in given.items():
        if not low <= value <= high:
            what = limit.stat if limit.tally else f"{limit.metric}{_on(limit.scale)}"
            raise RuleError(key, f"a {what} from {low:g} to {high:g}", f"{value:g}")
    if limit.beyond is not None:
        low, high = _range(limit)
        if not low <= limit.beyond <= high:
            raise RuleError(
                "beyond", f"a {limit.metric}{_on(limit.scale)} from {low:g} to {high:g}", f"{limit.beyond:g}"
            )
    if limit.warn is None or limit.fail is None or limit.warn == limit.fail:
        return
    if (limit.warn > limit.fail) == (limit.side == "above"):
        key = next((key for key in given if key.startswith("warn_")), "le")
        raise RuleError(key, f"a warning before the failure at {limit.fail:g}", f"{limit.warn:g}")


def _range(limit: Limit) -> tuple[float, float]:
    metric: Any = METRICS.get(limit.metric) or QUANTITIES[limit.metric]
    low, high = metric.low, metric.high
    if limit.scale and limit.scale != scale_of(metric):
        return (0.0, 1.0) if high == math.inf else (1.0 - high, 1.0 - low)
    return low, high


def _amended(rule: RuleTable, file: GateFile, inherited: Limit) -> Limit:
    """An inherited limit with what the rule says anew; its levels are those of the rule where it gives any."""
    for key in ("stat", "scale", "beyond", "side", "faces"):
        if getattr(rule, key) is not None:
            raise RuleError(
                key, "metric or finding beside it: without them a rule changes levels and conditions alone", repr(key)
            )
    if inherited.finding and (rule.where is not None or rule.each is not None):
        raise RuleError("where", "no such key in a rule about a finding", "where")
    limit = replace(inherited, own=True)
    if rule.name:
        limit = replace(limit, name=rule.name)
    if rule.note:
        limit = replace(limit, note=rule.note)
    limit = _conditions(limit, rule, file)
    if any(True for _ in _given(rule)):
        limit = _levels(limit, rule)
        source = rule.source or f"{inherited.source}; changed by the gate file"
        limit = replace(limit, source=source, verified=False)
    _check_levels(limit, rule)
    return limit
