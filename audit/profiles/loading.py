"""Profiles from TOML, checked key by key and against the registry of metrics."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from typing import Any

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import UsageError, printable
from meshwright.audit.findings import CHECKS
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.model import CELLS, STATS, Dialect, LeftOut, Limit, Measure, Profile
from meshwright.audit.profiles.quantities import QUANTITIES, Quantity
from meshwright.audit.profiles.strict import Table, load_toml

__all__ = ["PROFILES", "check", "load", "profile_from_toml", "read_profile"]

PROFILES = (
    *("fluent", "icem", "gambit", "cfx", "openfoam"),
    *("hypermesh", "optistruct", "ansys", "femap", "patran", "nastran", "cubit", "verdict", "pointwise"),
    *("cfd", "fea"),
)
"""Names of the profiles that come with the program: flow, structures and geometry, then two of no system."""

_ID = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_TYPES = tuple(name for name, kind in CELL_TYPES.items() if kind.dimension >= 2)


def load(name: str) -> Profile:
    """The profile of that name, every metric and check in it known; UsageError for an unknown name."""
    profile = read_profile(name)
    check(profile)
    return profile


def read_profile(name: str) -> Profile:
    """As `load`, without the comparison with the registry of metrics."""
    if name not in PROFILES:
        raise UsageError(f"unknown profile {printable(name)!r}; profiles: {', '.join(PROFILES)}")
    file = f"{name}.toml"
    text = files("meshwright.audit.profiles").joinpath(file).read_text("utf-8")
    return replace(profile_from_toml(text, file, name), sha256=hashlib.sha256(text.encode()).hexdigest())


def profile_from_toml(text: str, file: str, name: str, path: str = "") -> Profile:
    """A profile from TOML text; UsageError with file and key for whatever it should not hold.

    path: of a user's file, "" for one that comes with the program.
    """
    root = load_toml(text, file)
    limits = tuple(_limit(table) for table in root.tables("limit"))
    seen: set[str] = set()
    for limit in limits:
        if limit.id in seen:
            raise root.wrong("limit", "ids that differ", f"{limit.id} twice")
        seen.add(limit.id)
    profile = Profile(
        name=name,
        title=root.word("title"),
        description=root.word("description", ""),
        version=root.word("version", ""),
        discipline=root.word("discipline", "", ("cfd", "fea", "")),  # type: ignore[arg-type]
        dialect=_dialect(root.table("dialect")),
        scales=root.words("scales"),
        default_metrics=_defaults(root.table("default_metrics")),
        measures=tuple(_made(t, lambda t: Measure(t.word("name"), t.words("metrics"), t.word("note", "")))
                       for t in root.tables("measure")),
        limits=limits,
        left_out=tuple(_made(t, lambda t: LeftOut(t.word("what"), t.word("reason"), t.word("source", "")))
                       for t in root.tables("left_out")),
        file=path,
    )  # fmt: skip
    root.done()
    return profile


def _made(table: Table, make: Callable[[Table], Any]) -> Any:
    found = make(table)
    table.done()
    return found


def _dialect(table: Table) -> Dialect:
    words = {key: table.word(key) for key in ("zone", "zones", "boundary", "boundaries", "note") if key in table}
    table.done()
    return Dialect(**words)


def _defaults(table: Table) -> dict[str, tuple[str, ...]]:
    found = {kind: table.words(kind) for kind in _TYPES if kind in table}
    table.done()
    return found


def _limit(table: Table) -> Limit:
    if ("metric" in table) == ("finding" in table):
        raise table.wrong("metric", "either a metric or a finding", "both" if "metric" in table else "neither")
    id_ = table.word("id")
    if not _ID.fullmatch(id_):
        raise table.wrong("id", "small letters, digits and single hyphens", id_)
    limit = Limit(
        id=id_,
        name=table.word("name"),
        metric=table.word("metric", ""),
        finding=table.word("finding", ""),
        stat=table.word("stat", None, STATS),
        types=table.words("types", _TYPES),
        order=_order(table),
        faces=table.word("faces", "", ("", "interior", "boundary")),  # type: ignore[arg-type]
        beyond=table.number("beyond"),
        warn=table.number("warn"),
        fail=table.number("fail"),
        inclusive="inclusive" in table and table.flag("inclusive"),
        sense=table.word("sense", "", ("", "above", "below")),  # type: ignore[arg-type]
        source=table.word("source"),
        verified=table.flag("verified"),
        note=table.word("note", ""),
        ideal=table.number("ideal"),
        good=table.number("good"),
        worst=table.number("worst"),
        weight=table.number("weight"),
    )
    table.done()
    if limit.warn is None and limit.fail is None:
        raise table.wrong("fail", "a limit for a warning or a failure", "neither")
    if not limit.source.strip():
        raise table.wrong("source", "where the limit stands", "nothing")
    tally = limit.stat in ("share", "count")
    if (limit.beyond is None) == (tally and limit.metric not in ("", CELLS)):
        raise table.wrong("beyond", "a value for shares and counts, none for others", limit.beyond)
    if limit.finding and limit.stat != "count":
        raise table.wrong("stat", "count, of what a check finds", limit.stat)
    if limit.metric == CELLS and (limit.stat != "share" or not limit.types):
        raise table.wrong("stat", "share, of the cells of some types", limit.stat)
    if limit.stat in ("max", "min") and limit.sense:
        raise table.wrong("sense", "nothing beside max and min, which imply it", limit.sense)
    return limit


def _order(table: Table) -> int:
    if "order" not in table:
        return 0
    order = table.number("order")
    if order not in (1.0, 2.0):
        raise table.wrong("order", "1 or 2", order)
    return int(order)


def check(profile: Profile) -> None:
    """UsageError where a limit names a metric, a type of cell or a check that this program does not know."""
    what = printable(profile.file, 200) or f"profile {profile.name}"
    for id_ in profile.metrics:
        if id_ not in METRICS and id_ not in QUANTITIES:
            raise UsageError(f"{what}: metric {printable(id_)!r} is not one of this build")
    for limit in profile.limits:
        where = f"{what}: limit {limit.id}"
        if limit.finding and limit.finding not in CHECKS:
            raise UsageError(f"{where}: {printable(limit.finding)!r} is not a check of this build")
        if limit.metric not in ("", CELLS):
            _check_limit(where, limit, METRICS.get(limit.metric) or QUANTITIES[limit.metric])


def _check_limit(where: str, limit: Limit, metric: Any | Quantity) -> None:
    """UsageError where the limit asks for what the metric cannot have, or looks at the good end of its scale."""
    if limit.types and metric.entity != "cell":
        raise UsageError(f"{where}: {metric.id} is a value of {metric.entity}s, not of cells")
    if limit.faces and metric.entity != "face":
        raise UsageError(f"{where}: {metric.id} is not a value of faces")
    for name in limit.types:
        if name not in metric.on and CELL_TYPES[name].corners not in metric.on:
            raise UsageError(f"{where}: {metric.id} is not defined on {name} cells")
    if limit.faces and limit.faces not in metric.on:
        raise UsageError(f"{where}: {metric.id} is not defined on {limit.faces} faces")
    best = metric.best
    if limit.stat == {"low": "min", "high": "max"}.get(best):
        raise UsageError(f"{where}: the {limit.stat} of {metric.id} is its good end")
    levels = [level for level in (limit.warn, limit.fail) if level is not None]
    if len(levels) == 2 and levels[0] != levels[1]:
        above = limit.direction(metric.best) == "above"
        if (levels[0] > levels[1]) == above:
            raise UsageError(f"{where}: a value fails at {levels[1]:g} before it warns at {levels[0]:g}")
    if limit.stat in ("max", "min", "mean"):
        for level in levels:
            if not metric.low <= level <= metric.high:
                raise UsageError(f"{where}: {level:g} is outside the range of {metric.id}")
