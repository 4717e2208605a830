"""The rules of a profile against measured values: pass, warn, fail or incomplete, and how many entities lie beyond.

    any value beyond `fail`                          fail, whatever else is unknown
    else values undefined, or nothing measured       incomplete: what is not known does not pass
    else any value beyond `warn`                     warn
    else                                             pass

Of a count or a share the undefined values leave a range: it fails when its lower end does, is incomplete when only its
upper end is beyond a limit. A mean with undefined values is incomplete. A limit on entities that the mesh does not have
is no rule but is listed as not applicable.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import Measured
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.parallel import in_parallel
from meshwright.audit.places import Places, plain
from meshwright.audit.profiles.mirrors import MIRRORS, mirrored, mirrored_back
from meshwright.audit.profiles.model import CELLS, Limit, Profile, Sense
from meshwright.audit.profiles.quantities import QUANTITIES
from meshwright.audit.profiles.rule import Judgement, NotApplicable, Rule, is_beyond, judge
from meshwright.audit.profiles.sampling import Sample, matches, samples
from meshwright.audit.statistics import worst_first

__all__ = ["evaluate"]


def evaluate(
    measured: Measured,
    profile: Profile,
    findings: Mapping[str, int] | None = None,
    chosen: NDArray[np.bool_] | None = None,
) -> Judgement:
    """Every limit of the profile against the raw values of an audit.

    findings: how many entities each check reported, by code.  chosen: (n_cells,) cells to count, with the faces and
    points around them; None for all. A metric that was not measured makes its rule incomplete, never a pass.
    """
    places = Places(measured.mesh, chosen)
    for id_ in {limit.metric for limit in profile.limits} & QUANTITIES.keys():
        QUANTITIES[id_].values(measured.mesh)  # kept with the mesh, and not computed by several rules at once
    found = in_parallel(lambda limit: _rule(measured, places, profile, limit, findings or {}), list(profile.limits))
    results = list(found)
    rules = [r for r in results if isinstance(r, Rule)]
    rules += [
        Rule(profile.name, Limit(u.id, u.name, "max", "", True), "low", "1", None, "incomplete", reason=u.reason)
        for u in profile.unmeasurable
    ]
    return Judgement(profile, tuple(rules), tuple(r for r in results if isinstance(r, NotApplicable)))


def _rule(
    measured: Measured, places: Places, profile: Profile, limit: Limit, findings: Mapping[str, int]
) -> Rule | NotApplicable:
    if limit.finding:
        return _of_finding(profile, limit, findings.get(limit.finding, 0))
    if limit.metric == CELLS:
        return _of_types(measured.mesh, places, profile, limit)
    if MIRRORS.get(limit.metric) in measured.values:
        return mirrored_back(_rule(measured, places, profile, mirrored(limit), findings), limit)
    metric = METRICS.get(limit.metric) or QUANTITIES.get(limit.metric)
    name = f"{profile.name}.{limit.id}"
    if metric is None or (limit.metric in METRICS and limit.metric not in measured.values):
        if limit.types and not any(matches(block.type, limit) and len(block) for block in measured.mesh.blocks):
            return NotApplicable(name, f"the mesh has no {' or '.join(limit.types)} cells")
        best, unit = ("low", "1") if metric is None else (metric.best, metric.unit)
        return Rule(profile.name, limit, best, unit, None, "incomplete", reason=f"{limit.metric} was not measured")
    found = [s for s in samples(measured, places, limit) if len(s.values)]
    if not found:
        return NotApplicable(name, _absence(limit, metric.entity))
    return _of_values(places, profile, limit, metric.best, metric.unit, found)


def _absence(limit: Limit, entity: str) -> str:
    if entity != "cell":
        return f"the mesh has no such {entity}s"
    kinds = " or ".join(limit.types)
    order = {1: "first-order ", 2: "second-order "}.get(limit.order, "")
    return f"the mesh has no {order}{kinds} cells" if kinds else f"the mesh has no {order}cells it is defined on"


def _of_finding(profile: Profile, limit: Limit, n: int) -> Rule:
    state = judge(n, n, limit, "above")
    warned, failed = (n if is_beyond(n, x, "above", inclusive=limit.inclusive) else 0 for x in (limit.warn, limit.fail))
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
    share = n / total
    warned, failed = (
        n if is_beyond(share, x, "above", inclusive=limit.inclusive) else 0 for x in (limit.warn, limit.fail)
    )
    return Rule(profile.name, limit, "low", "1", share, judge(share, share, limit, "above"), total, 0, warned, failed)


def _count(found: list[Sample], limit: float | None, sense: Sense, *, inclusive: bool) -> int:
    if limit is None:
        return 0
    n = 0
    for sample in found:
        values = sample.values
        with np.errstate(invalid="ignore"):
            if sense == "above":
                n += int(np.count_nonzero(values >= limit if inclusive else values > limit))
            else:
                n += int(np.count_nonzero(values <= limit if inclusive else values < limit))
    return n


def _of_values(places: Places, profile: Profile, limit: Limit, best: str, unit: str, found: list[Sample]) -> Rule:
    total = sum(len(s.values) for s in found)
    undefined = sum(int(np.count_nonzero(np.isnan(s.values))) for s in found)
    known = total - undefined
    reason = f"no value on {undefined:,} of {total:,}" if undefined else ""
    sense = limit.direction(best)
    bad = limit.values_beyond(best) if limit.stat not in ("max", "min") else sense
    worst = _worst(places, found, bad)
    if limit.stat in ("count", "share"):
        n = _count(found, limit.beyond, bad, inclusive=False)
        low, high = float(n), float(n + undefined)
        if limit.stat == "share":
            low, high = low / total, high / total
        state = judge(low, high, limit, "above")
        passed = [is_beyond(low, x, "above", inclusive=limit.inclusive) for x in (limit.warn, limit.fail)]
        warned, failed = (n if over else 0 for over in passed)
        return Rule(profile.name, limit, best, unit, low, state, total, undefined, warned, failed, worst,
                    reason if state == "incomplete" else "")  # fmt: skip
    warned, failed = (_count(found, x, bad, inclusive=limit.inclusive) for x in (limit.warn, limit.fail))
    if not known:
        return Rule(profile.name, limit, best, unit, None, "incomplete", total, undefined, reason=reason)
    figure = _figure(found, limit.stat, known)
    if limit.stat == "mean":  # cells beyond it count where the mean itself is
        passed = [is_beyond(figure, x, sense, inclusive=limit.inclusive) for x in (limit.warn, limit.fail)]
        warned, failed = (n if over else 0 for n, over in zip((warned, failed), passed, strict=True))
    state = judge(figure, figure, limit, sense)
    if math.isnan(figure):  # the mean of inf and -inf
        state, reason = "incomplete", reason or "the mean is not a number"
    if undefined and not (state == "fail" and limit.stat != "mean"):
        state = "incomplete"
    return Rule(profile.name, limit, best, unit, figure, state, total, undefined, warned, failed, worst,
                reason if state == "incomplete" else "")  # fmt: skip


def _figure(found: list[Sample], stat: str, known: int) -> float:
    """The largest, smallest or mean of the values that are defined."""
    values = [s.values[~np.isnan(s.values)] for s in found]
    values = [v for v in values if len(v)]
    if stat == "mean":
        with np.errstate(invalid="ignore", over="ignore"):
            return float(sum(float(v.sum()) for v in values) / known)
    return max(float(v.max()) for v in values) if stat == "max" else min(float(v.min()) for v in values)


def _worst(places: Places, found: list[Sample], sense: Sense) -> dict[str, Any] | None:
    """The worst entity over all types; of equal ones that of the first type."""
    high = sense == "above"
    first: tuple[float, Sample, int] | None = None
    for sample in found:
        for at in worst_first(sample.values, 1, high_is_worse=high).tolist():
            value = float(sample.values[at])
            if first is None or (value > first[0] if high else value < first[0]):
                first = value, sample, at
    if first is None:
        return None
    value, sample, at = first
    return {"type": sample.key, **places.describe(sample.key, sample.row(at), plain(value))}
