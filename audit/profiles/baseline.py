"""Figures of an earlier audit, to hold those of today against."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

from meshwright.audit.profiles.model import Limit
from meshwright.audit.profiles.rule import Rule
from meshwright.audit.profiles.sampling import matches

__all__ = ["Baseline"]

_SAVE_AGAIN = "save the baseline again with this gate"


@dataclass(frozen=True, eq=False)
class Baseline:
    """A saved audit, or why there is none.

    document: of an earlier audit, None where it could not be read.  path: as the user named it.  trouble: why it is
    not there, "" where it is.
    """

    document: Mapping[str, Any] | None
    path: str = ""
    trouble: str = ""
    sha256: str = ""

    def figure(self, rule: Rule, selection: str | None) -> tuple[float | None, str]:
        """What the rule measured in the baseline, and why that is not known, "" where it is.

        selection: pattern of the zones that are counted today.
        """
        if self.document is None:
            return None, self.trouble or "there is no baseline: give one with --baseline or `baseline = ...`"
        chosen = self.document.get("selection")
        if (chosen["zone"] if chosen else None) != selection:
            return None, f"the baseline counts other zones; {_SAVE_AGAIN}"
        told = rule.as_json()
        same = [other for other in self.document["gate"]["rules"] if _measures_the_same(told, other)]
        known = [other for other in same if other["measured"] is not None]
        known.sort(key=lambda other: other["id"] != told["id"])
        if known:
            return float(known[0]["measured"]), ""
        if same:
            return None, f"the baseline has no value for it: {same[0].get('reason') or 'undecided'}"
        found = self._of_summary(rule.limit, rule.zone)
        return (found, "") if found is not None else (None, f"the baseline did not measure this; {_SAVE_AGAIN}")

    def _of_summary(self, limit: Limit, zone: str) -> float | None:
        """The figure from the parts of the document that are not about rules."""
        assert self.document is not None  # noqa: S101 - the caller has seen to it
        if limit.where or zone or limit.scale or limit.faces or limit.order:
            return None
        if limit.finding:
            if self.document.get("version") != version("meshwright"):
                return None  # that version may not have looked
            return float(sum(f["count"] for f in self.document["findings"] if f["code"] == limit.finding))
        figures = [
            found
            for key, found in self.document["metrics"].get(limit.metric, {}).items()
            if found["count"] and (key in ("face", "point") or matches(key, limit))
        ]
        if limit.stat not in ("max", "min") or not figures:
            return None
        choose = max if limit.stat == "max" else min
        return choose(float(found[limit.stat]) for found in figures)


def _measures_the_same(a: Mapping[str, Any], b: Mapping[str, Any]) -> bool:
    """Whether two rules of documents are about the same figure, whatever their limits."""
    keys = ("metric", "stat", "on", "value_beyond")
    later = {"where": "", "zone": None, "scale": ""}
    if any(a[key] != b.get(key) for key in keys):
        return False
    if any(a[key] != b.get(key, default) for key, default in later.items()):
        return False
    return a["value_beyond"] is None or a["value_sense"] == b.get("value_sense")
