"""One mesh under every convention at once: who would accept it, and each quantity as every system spells it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.measurement import Measured
from meshwright.audit.mesh import Floats
from meshwright.audit.metrics import METRICS
from meshwright.audit.places import Places, plain
from meshwright.audit.profiles.model import Limit
from meshwright.audit.profiles.rule import Judgement, Rule
from meshwright.audit.profiles.sampling import samples
from meshwright.audit.profiles.strict import Table, load_toml
from meshwright.audit.statistics import worst_first

__all__ = ["FAMILIES_FILE", "Family", "Member", "families", "rosetta"]

FAMILIES_FILE = "rosetta.toml"

_REFUSALS = 3
"""Rules named for each system that refuses a mesh; the number of all of them stands beside."""


@dataclass(frozen=True)
class Member:
    """One system's form of a quantity.

    metric, types: what it is made of; types () for all.  transform: of the stored value, "1-x" or "1/x" where the
    system's scale runs the other way.  scale: in words.  profile: whose limits on it are shown, "" for none.
    worst: "largest" for a size, which has no bad end of its own, whose largest value is to be shown.
    """

    system: str
    name: str
    metric: str
    scale: str
    transform: Literal["", "1-x", "1/x"] = ""
    types: tuple[str, ...] = ()
    profile: str = ""
    note: str = ""
    worst: Literal["", "largest"] = ""


@dataclass(frozen=True)
class Family:
    """Forms of one quantity."""

    id: str
    title: str
    members: tuple[Member, ...]


@cache
def families() -> tuple[Family, ...]:
    """All families, from the data file; UsageError for a key it should not hold."""
    root = load_toml(files("meshwright.audit.profiles").joinpath(FAMILIES_FILE).read_text("utf-8"), FAMILIES_FILE)
    found = []
    for table in root.tables("family"):
        members = tuple(_member(entry) for entry in table.tables("member"))
        found.append(Family(table.word("id"), table.word("title"), members))
        table.done()
    root.done()
    return tuple(found)


def _member(table: Table) -> Member:
    member = Member(
        system=table.word("system"),
        name=table.word("name"),
        metric=table.word("metric"),
        scale=table.word("scale"),
        transform=table.word("transform", "", ("", "1-x", "1/x")),  # type: ignore[arg-type]
        types=table.words("types"),
        profile=table.word("profile", ""),
        note=table.word("note", ""),
        worst=table.word("worst", "", ("", "largest")),  # type: ignore[arg-type]
    )
    table.done()
    return member


def rosetta(
    measured: Measured,
    judgements: Sequence[Judgement],
    errors: Sequence[str] = (),
    chosen: NDArray[np.bool_] | None = None,
) -> dict[str, Any]:
    """The document's key "rosetta": {"systems": [...], "families": [...]}.

    errors: codes of the findings that are errors, for no system takes such a mesh.  chosen: as in `evaluate`.
    """
    places = Places(measured.mesh, chosen)
    rules = {judgement.profile.name: judgement.rules for judgement in judgements}
    return {
        "systems": [_system(judgement, errors) for judgement in judgements],
        "families": [
            {
                "id": family.id,
                "title": family.title,
                "members": [_figures(measured, places, m, rules.get(m.profile, ())) for m in family.members],
            }
            for family in families()
        ],
    }


def _system(judgement: Judgement, errors: Sequence[str]) -> dict[str, Any]:
    state = "fail" if errors else judgement.state
    against = [rule for rule in judgement.rules if rule.state == judgement.state and rule.state != "pass"]
    return {
        "profile": judgement.profile.name,
        "title": judgement.profile.title,
        "verdict": state,
        "rules": len(judgement.rules),
        "not_applicable": len(judgement.not_applicable),
        "against": len(against),
        "errors": list(errors),
        "because": [_reason(rule) for rule in against[:_REFUSALS]],
    }


def _reason(rule: Rule) -> dict[str, Any]:
    whole = rule.as_json()
    keys = ("id", "name", "metric", "stat", "limit", "measured", "state", "sense", "inclusive", "value_beyond")
    return {key: whole[key] for key in (*keys, "value_sense", "unit", "on", "beyond", "reason", "verified")}


def _transformed(values: Floats, transform: str) -> Floats:
    if not transform:
        return values
    with np.errstate(divide="ignore"):
        found: Floats = 1.0 - values if transform == "1-x" else 1.0 / values
    return found


def _figures(measured: Measured, places: Places, member: Member, rules: Sequence[Rule]) -> dict[str, Any]:
    """Worst value and mean of a member on its own scale, with the limit of its system."""
    row: dict[str, Any] = {
        "system": member.system,
        "name": member.name,
        "metric": member.metric,
        "transform": member.transform,
        "scale": member.scale,
        "types": list(member.types),
        "unit": METRICS[member.metric].unit if member.metric in METRICS else "1",
        "count": 0,
        "undefined": 0,
        "worst": None,
        "mean": None,
        "worst_at": None,
        "limit": None,
        "state": None,
        "note": member.note,
    }
    if member.metric not in METRICS or member.metric not in measured.values:
        return row
    metric = METRICS[member.metric]
    found = [s for s in samples(measured, places, Limit("", "", "max", "", True, types=member.types,
                                                        metric=member.metric)) if len(s.values)]  # fmt: skip
    known = [s.values[~np.isnan(s.values)] for s in found]
    row["count"] = sum(map(len, known))
    row["undefined"] = sum(len(s.values) for s in found) - row["count"]
    if row["count"]:
        high = metric.worst_is_high or member.worst == "largest"
        listed = [(s, at) for s in found for at in worst_first(s.values, 1, high_is_worse=high).tolist()]
        sample, at = (max if high else min)(listed, key=lambda pair: float(pair[0].values[pair[1]]))
        with np.errstate(invalid="ignore", over="ignore"):
            mean = sum(float(_transformed(v, member.transform).sum()) for v in known) / row["count"]
        worst = plain(float(_transformed(sample.values[at : at + 1], member.transform)[0]))
        row["worst"], row["mean"] = worst, plain(mean)
        row["worst_at"] = {"type": sample.key, **places.describe(sample.key, sample.row(at), worst)}
    _add_limit(row, member, rules)
    return row


def _add_limit(row: dict[str, Any], member: Member, rules: Sequence[Rule]) -> None:
    """The limit of the worst of the system's rules on this metric, on the member's scale."""
    order = ("fail", "incomplete", "warn", "pass")
    mine = [rule for rule in rules if _is_about(rule.limit, member)]
    if mine:
        rule = min(mine, key=lambda r: order.index(r.state))
        limit = rule.deciding if rule.deciding is not None else math.nan
        row["limit"] = plain(float(_transformed(np.array([limit]), member.transform)[0]))
        row["state"] = rule.state


def _is_about(limit: Limit, member: Member) -> bool:
    if limit.metric != member.metric or limit.stat not in ("max", "min"):
        return False
    return not limit.types or not member.types or bool(set(limit.types) & set(member.types))
