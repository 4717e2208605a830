"""The limits of a document's gate that are values of a metric, to be drawn into its histogram."""

from __future__ import annotations

from typing import Any, Literal

from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.mirrors import scale_of
from meshwright.reports.histogram_svg import Mark

__all__ = ["marks_of"]

Side = Literal["above", "below"]
_OTHER: dict[Side, Side] = {"above": "below", "below": "above"}
_MOST = 4


def marks_of(document: dict[str, Any], metric: str) -> tuple[Mark, ...]:
    """A mark for every limit on a value of the metric, on the stored scale; equal ones once, at most four.

    Limits on single values are meant: of a largest or smallest value, and the value from which on a share or a number
    is counted. Limits on a mean or a percentile say nothing about one cell and are left out, and so are rules that
    never count.
    """
    found: dict[Mark, None] = {}
    for rule in document["gate"]["rules"]:
        if rule["metric"] != metric or rule.get("severity") == "info":
            continue
        bad: Side = rule["sense"]
        levels: list[tuple[float | None, Literal["warn", "fail"]]]
        if rule["stat"] in ("share", "count"):
            levels, bad = [(rule["value_beyond"], "fail" if rule["fail"] is not None else "warn")], rule["value_sense"]
        elif rule["stat"] in ("max", "min"):
            levels = [(rule["fail"], "fail"), (rule["warn"], "warn")]
        else:
            continue
        turned = bool(rule.get("scale")) and metric in METRICS and rule["scale"] != scale_of(METRICS[metric])
        for value, level in levels:
            if value is None:
                continue
            scale = f" ({rule['scale']})" if turned else ""
            words = f"{level} {'>' if bad == 'above' else '<'} {value:.6g}{scale}"
            stored, side = (_mirror(metric, value), _OTHER[bad]) if turned else (value, bad)
            found.setdefault(Mark(stored, level, words, side))
    return tuple(found)[:_MOST]


def _mirror(metric: str, value: float) -> float:
    """The value on the scale that is stored: 1 - x, or 1/x of a ratio."""
    if METRICS[metric].high == 1.0:
        return 1.0 - value
    return 1.0 / value if value else float("inf")
