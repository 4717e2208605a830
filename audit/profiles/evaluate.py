"""The rules of a profile against measured values, and how many entities lie beyond.

    any value beyond `fail`                          fail, whatever else is unknown
    else values undefined, or nothing measured       incomplete: what is not known does not pass
    else any value beyond `warn`                     warn
    else                                             pass

Values that are undefined leave a figure a range: it fails when its better end does, and is incomplete when only its
worse end is beyond a limit. A gate file may let an incomplete rule warn or be ignored, hold a figure against that of a
baseline, and accept a failure for a while. A limit on entities that the mesh does not have is no rule but is listed as
not applicable, unless a gate file of the user asks for it: then that is reported as a rule.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import Measured
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.parallel import in_parallel
from meshwright.audit.places import Places, text
from meshwright.audit.profiles.baseline import Baseline
from meshwright.audit.profiles.figures import beyond_by_zone, count_beyond, figure_of, worst_of
from meshwright.audit.profiles.mirrors import turn_for, turned, turned_back
from meshwright.audit.profiles.model import CELLS, Limit, Profile, Waiver
from meshwright.audit.profiles.quantities import QUANTITIES
from meshwright.audit.profiles.rule import Judgement, NotApplicable, Rule, State, is_beyond, judge, worse_than
from meshwright.audit.profiles.sampling import Sample, matches, samples
from meshwright.audit.profiles.where import NoMatchError, Part, cells_of, matching, parts

__all__ = ["evaluate"]

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Case:
    """All that the rules of a profile are judged by."""

    measured: Measured
    profile: Profile
    findings: Mapping[str, int]
    chosen: Mask | None
    selection: str | None
    baseline: Baseline
    today: dt.date


def evaluate(
    measured: Measured,
    profile: Profile,
    findings: Mapping[str, int] | None = None,
    chosen: Mask | None = None,
    *,
    selection: str | None = None,
    baseline: Baseline | None = None,
    today: dt.date | None = None,
) -> Judgement:
    """Every limit of the profile against the raw values of an audit.

    findings: how many entities each check reported, by code.  chosen: (n_cells,) cells to count, with the faces and
    points around them; None for all.  selection: the pattern that chose them.  baseline: what `no_worse` looks at.
    today: by which waivers expire. A metric that was not measured makes its rule incomplete, never a pass.
    """
    case = _Case(
        *(measured, profile, findings or {}, chosen, selection, baseline or Baseline(None)),
        today or dt.datetime.now(dt.UTC).date(),
    )
    for id_ in {limit.metric for limit in profile.limits} & QUANTITIES.keys():
        QUANTITIES[id_].values(measured.mesh)  # kept with the mesh, and not computed by several rules at once
    results = [r for found in in_parallel(lambda limit: list(_rules(case, limit)), list(profile.limits)) for r in found]
    rules = [r for r in results if isinstance(r, Rule)]
    rules += [
        Rule(profile.name, Limit(u.id, u.name, "max", "", True), "low", "1", None, "incomplete", reason=u.reason)
        for u in profile.unmeasurable
    ]
    return Judgement(profile, tuple(rules), tuple(r for r in results if isinstance(r, NotApplicable)))


def _rules(case: _Case, limit: Limit) -> Iterator[Rule | NotApplicable]:
    """What becomes of a limit: one rule, or one for every zone."""
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    entity = "cell" if metric is None else metric.entity
    try:
        for part in parts(case.measured.mesh, limit.where, entity, case.chosen, each=limit.each):
            rule = _on_part(case, limit, part.places)
            if isinstance(rule, NotApplicable):
                yield _unmatched(case, limit, rule.reason, misnamed=False)
            else:
                yield _settled(case, replace(rule, zone=part.zone), part)
    except NoMatchError as error:
        yield _unmatched(case, limit, str(error), misnamed=error.misnamed)


def _unmatched(case: _Case, limit: Limit, reason: str, *, misnamed: bool) -> Rule | NotApplicable:
    """A limit that nothing is subject to: reported as a rule where the user wrote it."""
    skipped = NotApplicable(f"{case.profile.name}.{limit.id}", reason)
    become = limit.on_no_match or ("error" if misnamed else "warn")
    if not limit.own or become == "ignore":
        return skipped
    best, unit = _scale(limit)
    state: State = "incomplete" if become == "error" else "warn"
    rule = Rule(case.profile.name, limit, best, unit, None, state, reason=f"matches nothing: {reason}")
    return _by_severity(rule)


def _scale(limit: Limit) -> tuple[str, str]:
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    return ("low", "1") if metric is None else (metric.best, metric.unit)


def _on_part(case: _Case, limit: Limit, places: Places) -> Rule | NotApplicable:
    """The rule by its own limits alone."""
    measured, profile = case.measured, case.profile
    if limit.finding:
        return _of_finding(profile, limit, case.findings.get(limit.finding, 0))
    if limit.metric == CELLS:
        return _of_types(measured.mesh, places, profile, limit)
    turn = turn_for(limit, measured.values)
    if turn is not None:
        return turned_back(_on_part(case, turned(limit, turn), places), limit, turn)
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    name = f"{profile.name}.{limit.id}"
    if metric is None or (limit.metric in METRICS and limit.metric not in measured.values):
        if limit.types and not any(matches(block.type, limit) and len(block) for block in measured.mesh.blocks):
            return NotApplicable(name, f"the mesh has no {' or '.join(limit.types)} cells")
        return Rule(profile.name, limit, *_scale(limit), None, "incomplete", reason=f"{limit.metric} was not measured")
    found = [s for s in samples(measured, places, limit) if len(s.values)]
    if not found:
        return NotApplicable(name, _absence(limit, metric.entity))
    return _of_values(measured.mesh, places, profile, limit, metric.best, metric.unit, found)


def _absence(limit: Limit, entity: str) -> str:
    if entity != "cell":
        return f"the mesh has no such {entity}s"
    kinds = " or ".join(limit.types)
    order = {1: "first-order ", 2: "second-order "}.get(limit.order, "")
    return f"the mesh has no {order}{kinds} cells" if kinds else f"the mesh has no {order}cells it is defined on"


def _of_finding(profile: Profile, limit: Limit, n: int) -> Rule:
    state = judge(n, n, limit, limit.direction("low"))
    warned, failed = (
        n if is_beyond(n, x, limit.direction("low"), inclusive=limit.inclusive) else 0 for x in (limit.warn, limit.fail)
    )
    return Rule(profile.name, limit, "low", "1", float(n), state, n, 0, warned, failed)


def _of_types(mesh: Mesh, places: Places, profile: Profile, limit: Limit) -> Rule | NotApplicable:
    """The share of cells of some types among the cells of the same dimension."""
    counts: dict[str, int] = {}
    for block in mesh.blocks:
        rows = places.chosen(block.type, None)
        counts[block.type] = len(block) if rows is None else len(rows)
    dimensions = {CELL_TYPES[kind].dimension for kind in limit.types}
    total = sum(n for kind, n in counts.items() if CELL_TYPES[kind].dimension in dimensions)
    if not total:
        return NotApplicable(f"{profile.name}.{limit.id}", "the mesh has no cells of this dimension")
    n = sum(n for kind, n in counts.items() if matches(kind, limit))
    share, sense = n / total, limit.direction("low")
    warned, failed = (
        n if is_beyond(share, x, sense, inclusive=limit.inclusive) else 0 for x in (limit.warn, limit.fail)
    )
    return Rule(profile.name, limit, "low", "1", share, judge(share, share, limit, sense), total, 0, warned, failed)


def _of_values(
    mesh: Mesh, places: Places, profile: Profile, limit: Limit, best: str, unit: str, found: list[Sample]
) -> Rule:
    total = sum(len(s.values) for s in found)
    undefined = sum(int(np.count_nonzero(np.isnan(s.values))) for s in found)
    sense = limit.direction(best)
    bad = limit.values_beyond(best) if limit.tally else sense
    figure = figure_of(found, limit, bad)
    state = judge(figure.low, figure.high, limit, sense)
    if not limit.tally and state != "fail" and figure.low != figure.high:
        state = "incomplete"  # a warning does not say that all is known
    reason = ""
    if state == "incomplete":
        reason = f"no value on {undefined:,} of {total:,}" if undefined else "the mean is not a number"
    if figure.measured is None:
        return Rule(profile.name, limit, best, unit, None, "incomplete", total, undefined, reason=reason)
    if limit.stat == "undefined":
        counts = [undefined, undefined]
    elif limit.tally:
        counts = [count_beyond(found, limit.beyond, bad, inclusive=False)] * 2
    else:
        counts = [count_beyond(found, x, bad, inclusive=limit.inclusive) for x in (limit.warn, limit.fail)]
    if limit.tally or limit.stat == "mean":  # entities beyond it count where the figure itself is
        over = [is_beyond(figure.measured, x, sense, inclusive=limit.inclusive) for x in (limit.warn, limit.fail)]
        counts = [n if passed else 0 for n, passed in zip(counts, over, strict=True)]
    warned, failed = counts
    worst = worst_of(places, found, bad)
    figures = (total, undefined, warned, failed, worst, reason)
    rule = Rule(profile.name, limit, best, unit, figure.measured, state, *figures)
    level = limit.beyond if limit.tally else rule.deciding
    if state in ("warn", "fail") and level is not None:
        inclusive = limit.inclusive and not limit.tally
        return replace(rule, zones=beyond_by_zone(mesh, places, found, level, bad, inclusive=inclusive))
    return rule


def _settled(case: _Case, rule: Rule, part: Part) -> Rule:
    """The rule after the baseline, what is missing, waivers and its severity have had their say."""
    if rule.state == "incomplete" and rule.limit.on_missing != "error":
        rule = replace(rule, state="warn" if rule.limit.on_missing == "warn" else "pass")
    rule = _against_baseline(case, rule)
    if rule.state == "fail":
        rule = _waived(case, rule, part)
    return _by_severity(rule)


def _by_severity(rule: Rule) -> Rule:
    if rule.limit.severity == "info" and rule.state in ("fail", "warn"):
        return replace(rule, state="info")
    if rule.limit.severity == "warn" and rule.state == "fail":
        return replace(rule, state="warn")
    return rule


def _against_baseline(case: _Case, rule: Rule) -> Rule:
    """The rule with the figure of the baseline; worse than that is a failure where the limit says so."""
    limit = rule.limit
    if limit.no_worse is None and case.baseline.document is None:
        return rule
    before, trouble = case.baseline.figure(rule, case.selection)
    rule = replace(rule, baseline=before)
    if limit.no_worse is None or rule.state == "fail":
        return rule
    if before is None:
        return replace(rule, state="incomplete", reason=trouble)
    if rule.measured is None:
        return rule
    if worse_than(rule.measured, before, limit.direction(rule.best), limit.no_worse):
        return replace(rule, state="fail", reason=f"worse than the baseline, {before:.6g}")
    return rule


def _waived(case: _Case, rule: Rule, part: Part) -> Rule:
    """The failed rule, accepted where waivers say so and all that they do not excuse passes."""
    name = rule.limit.id
    here = [w for w in case.profile.waivers if name == w.rule or fnmatchcase(name, w.rule)]
    here = [w for w in here if not w.zone or not rule.zone or w.zone == rule.zone or fnmatchcase(rule.zone, w.zone)]
    valid = [w for w in here if w.until >= case.today]
    if not valid:
        if not here:
            return rule
        last = max(here, key=lambda w: w.until)
        said = f"the waiver has expired on {last.until.isoformat()}: {last.reason}"
        return replace(rule, reason="; ".join(filter(None, (rule.reason, said))), waiver=_told(last, expired=True))
    whole = next((w for w in valid if not w.zone or rule.zone), None)
    if whole is not None:
        return replace(rule, state="waived", reason=whole.reason, waiver=_told(whole, expired=False))
    mesh = case.measured.mesh
    zones = matching(tuple(w.zone for w in valid), mesh.cell_zones)
    others = _on_part(case, rule.limit, part.places.without(cells_of(mesh, zones)))
    if isinstance(others, Rule):
        others = _against_baseline(case, others) if rule.limit.no_worse is not None else others
        if others.state not in ("pass", "warn"):
            return replace(rule, reason="; ".join(filter(None, (rule.reason, "fails outside the waived zones too"))))
    first = valid[0]
    return replace(rule, state="waived", reason=first.reason, waiver=_told(first, expired=False))


def _told(waiver: Waiver, *, expired: bool) -> dict[str, Any]:
    return {
        "reason": text(waiver.reason),
        "until": waiver.until.isoformat(),
        "zone": text(waiver.zone) or None,
        "expired": expired,
    }
