"""How limits and what became of them are spelled, for every output made for people."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

from meshwright.audit.profiles.model import Limit
from meshwright.reports.wording import figure, name, number, percent, plural

__all__ = [
    "Sources",
    "baseline_text",
    "beside",
    "beyond_text",
    "bound",
    "limit_text",
    "measured_text",
    "no_worse_text",
    "on_text",
    "rule_limit",
    "state_text",
    "verdict_words",
    "worst_text",
    "zone_word",
]

_MOST_DIGITS = 17


class Sources:
    """Numbers for sources, in the order in which they are first cited."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[str, bool], int] = {}

    def cite(self, source: str, verified: bool) -> str:
        """'3', or '3 unverified'; 'line 3' of a file of limits as it is."""
        if re.fullmatch(r"line \d+", source):
            return source if verified else f"{source} unverified"
        n = self._numbers.setdefault((source, verified), len(self._numbers) + 1)
        return f"{n}" if verified else f"{n} unverified"

    def __iter__(self) -> Iterator[tuple[int, str, bool]]:
        for (source, verified), n in self._numbers.items():
            yield n, source, verified


def _plain(value: float) -> str:
    """A limit as its author wrote it, as far as twelve digits go."""
    return f"{value:.12g}"


def beside(value: Any, limit: Any, unit: str = "1") -> str:
    """A measured value with as many digits as set it apart from its limit: it never rounds onto or past it."""
    text = figure(value, unit)
    x, limit = number(value), number(limit)
    if not math.isfinite(limit) or not math.isfinite(x) or x == limit:
        return text
    for digits in range(4, _MOST_DIGITS + 1):
        try:
            shown = float(text)
        except ValueError:  # "<0.001"
            return text
        if shown != limit and (shown > limit) == (x > limit):
            return text
        text = f"{x:.{digits}g}"
    return text


def bound(limit: float | None, sense: str, *, inclusive: bool = False) -> str:
    """What a good value keeps to: "≤ 0.95", "> 0"; "" for no limit."""
    if limit is None:
        return ""
    sign = {("above", False): "≤", ("above", True): "<", ("below", False): "≥", ("below", True): ">"}
    return f"{sign[sense, inclusive]} {_plain(limit)}"


def _of_stat(text: str, stat: str, beyond: float | None, bad: str) -> str:
    if not text:
        return ""
    if stat in ("mean", "undefined") or stat.startswith("p"):
        return f"{stat} {text}"
    if beyond is None:
        return f"{stat} {text}" if stat in ("share", "count") else text
    return f"{stat} {'>' if bad == 'above' else '<'} {_plain(beyond)}: {text}"


def rule_limit(rule: dict[str, Any]) -> str:
    """The limit of a rule of the document, as what a good mesh keeps to."""
    text = bound(rule["limit"], rule["sense"], inclusive=rule["inclusive"])
    text = _of_stat(text, rule["stat"], rule["value_beyond"], rule["value_sense"])
    allowed = rule.get("no_worse")
    if allowed is None:
        return text or "-"
    return f"{text}, {no_worse_text(allowed)}" if text else no_worse_text(allowed)


def no_worse_text(allowed: dict[str, float]) -> str:
    """'no worse', 'at most 0.001 worse'."""
    parts = [f"{_plain(allowed['abs'])}"] if allowed["abs"] else []
    parts += [f"{_plain(100 * allowed['rel'])} %"] if allowed["rel"] else []
    return f"at most {' or '.join(parts)} worse" if parts else "no worse"


def on_text(rule: dict[str, Any]) -> str:
    """What a rule is on: 'tet, zone fluid*', 'all in gap'."""
    parts = [rule["on"] if rule["on"] != "all" or not rule.get("where") else "", rule.get("where", "")]
    text = ", ".join(part for part in parts if part)
    zone = rule.get("zone")
    return f"{text} in {name(zone, 60)}" if zone else text


def state_text(rule: dict[str, Any]) -> str:
    """The state, and until when a waived one is."""
    waiver = rule.get("waiver")
    return f"waived until {waiver['until']}" if rule["state"] == "waived" and waiver else str(rule["state"])


def baseline_text(rule: dict[str, Any]) -> str:
    """The figure of the baseline, "" where there is none."""
    if rule.get("baseline") is None:
        return ""
    if rule["stat"] in ("count", "undefined"):
        return f"{number(rule['baseline']):.0f}"
    return beside(rule["baseline"], rule["measured"], rule["unit"])


def limit_text(limit: Limit, best: str) -> tuple[str, str]:
    """(warn, fail) of a limit, as what a good mesh keeps to; "" for a level it does not have."""
    sense, bad = limit.direction(best), limit.values_beyond(best)
    warn, fail = (
        _of_stat(bound(x, sense, inclusive=limit.inclusive), limit.stat, limit.beyond, bad)
        for x in (limit.warn, limit.fail)
    )
    return warn, fail


def measured_text(rule: dict[str, Any]) -> str:
    """The figure of a rule; a share in percent where that says enough."""
    if rule["measured"] is None:
        return "-"
    if rule["stat"] in ("count", "undefined"):
        return f"{number(rule['measured']):.0f}"
    return beside(rule["measured"], rule["limit"], rule["unit"])


def worst_text(worst: dict[str, Any] | None, dialect: dict[str, str] | None) -> str:
    """'cell 12 in part wing', "" for none."""
    if worst is None:
        return ""
    entity = next(key for key in ("cell", "face", "point") if key in worst)
    text = f"{entity} {worst[entity]}"
    return text if worst["zone"] is None else f"{text} in {zone_word(dialect)} {name(worst['zone'], 60)}"


def zone_word(dialect: dict[str, str] | None) -> str:
    """What the chosen system calls a zone of cells."""
    return "zone" if dialect is None else dialect["zone"]


def beyond_text(rule: dict[str, Any]) -> str:
    """How many entities lie beyond the limit: '12, 0.3 %'."""
    n, count = rule["beyond"], rule["count"]
    if rule["measured"] is None:
        return "-"
    return f"{n:,}, {percent(n, count)}" if n and count else f"{n:,}"


def verdict_words(system: dict[str, Any]) -> str:
    """'refuses it: 2 of 10 rules'."""
    words = {"pass": "accepts it", "warn": "warns", "fail": "refuses it", "incomplete": "cannot tell"}[
        system["verdict"]
    ]
    if system["errors"]:
        return f"{words}: {', '.join(system['errors'][:2])}"
    if not system["rules"]:
        return f"{words}: none of its limits applies"
    if system["verdict"] == "pass":
        return f"{words}: {plural(system['rules'], 'rule')}"
    return f"{words}: {system['against']} of {plural(system['rules'], 'rule')}"
