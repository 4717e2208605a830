"""The figure a limit asks for, from the values it is on: known exactly, or up to what has no value."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.mesh import Mesh
from meshwright.audit.places import Places, plain, short
from meshwright.audit.profiles.model import Limit, Sense
from meshwright.audit.profiles.sampling import Sample
from meshwright.audit.ranks import at_ranks
from meshwright.audit.statistics import worst_first

__all__ = ["Figure", "beyond_by_zone", "count_beyond", "figure_of", "is_beyond_each", "worst_of"]

_MOST_ZONES = 100


@dataclass(frozen=True)
class Figure:
    """A figure that lies from `low` to `high`; both are its value where all values it is made of are known.

    measured: the figure of what is known, None where nothing is.
    """

    low: float
    high: float
    measured: float | None


def figure_of(found: list[Sample], limit: Limit, bad: Sense) -> Figure:
    """The figure of the values.  bad: the side of `Limit.beyond` on which values count."""
    total = sum(len(s.values) for s in found)
    undefined = sum(int(np.count_nonzero(np.isnan(s.values))) for s in found)
    known = total - undefined
    if limit.stat == "undefined":
        return Figure(undefined, undefined, float(undefined))
    if limit.tally:
        n = float(count_beyond(found, limit.beyond, bad, inclusive=False))
        low, high = (n, n + undefined) if limit.stat == "count" else (n / total, (n + undefined) / total)
        return Figure(low, high, low)
    if not known:
        return Figure(-math.inf, math.inf, None)
    values = [s.values[~np.isnan(s.values)] for s in found]
    values = [v for v in values if len(v)]
    if limit.stat == "mean":
        with np.errstate(invalid="ignore", over="ignore"):
            mean = float(sum(float(v.sum()) for v in values) / known)
        sure = not undefined and not math.isnan(mean)  # inf - inf is no mean
        return Figure(mean, mean, mean) if sure else Figure(-math.inf, math.inf, mean)
    if limit.percentile is not None:
        everything = np.concatenate(values)
        here = _percentile(everything, known, limit.percentile, 0)
        if not undefined:
            return Figure(here, here, here)
        low, high = (_percentile(everything, total, limit.percentile, skipped) for skipped in (undefined, 0))
        return Figure(low, high, here)
    if limit.stat == "max":
        high = max(float(v.max()) for v in values)
        return Figure(high, math.inf if undefined else high, high)
    low = min(float(v.min()) for v in values)
    return Figure(-math.inf if undefined else low, low, low)


def _percentile(known: NDArray[np.float64], total: int, percent: float, below: int) -> float:
    """Linear percentile of `total` values of which those that are not known are -inf (`below` of them) or inf."""
    place = (total - 1) * percent / 100
    low = min(int(place), total - 1)
    high = min(low + 1, total - 1)
    ranks = {rank - below for rank in (low, high) if 0 <= rank - below < len(known)}
    ordered = at_ranks(known, ranks) if ranks else {}
    a, b = (
        -math.inf if rank < 0 else math.inf if rank >= len(known) else ordered[rank]
        for rank in (low - below, high - below)
    )
    fraction = place - low
    if a == b or fraction == 0:
        return a
    if math.isinf(a) or math.isinf(b):
        return a if math.isinf(a) else b
    return a + (b - a) * fraction if fraction < 0.5 else b - (b - a) * (1 - fraction)


def is_beyond_each(values: NDArray[np.float64], limit: float, sense: Sense, *, inclusive: bool) -> NDArray[np.bool_]:
    """Which values lie on the bad side of a limit; nan does not."""
    with np.errstate(invalid="ignore"):
        if sense == "above":
            return values >= limit if inclusive else values > limit
        return values <= limit if inclusive else values < limit


def count_beyond(found: Iterable[Sample], limit: float | None, sense: Sense, *, inclusive: bool) -> int:
    """How many values lie on the bad side of a limit; none do where there is no limit."""
    if limit is None:
        return 0
    return sum(int(np.count_nonzero(is_beyond_each(s.values, limit, sense, inclusive=inclusive))) for s in found)


def worst_of(places: Places, found: list[Sample], sense: Sense) -> dict[str, Any] | None:
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


def beyond_by_zone(
    mesh: Mesh, places: Places, found: list[Sample], limit: float, sense: Sense, *, inclusive: bool
) -> tuple[dict[str, Any], ...]:
    """How many values beyond a limit each zone of cells holds, and the worst of each, worst zone first.

    Of faces and points, and of a mesh without zones, it is one entry without a zone. A cell in several zones counts
    in the first.
    """
    zone_of_cell = mesh.cell_zone_index() if mesh.cell_zones else None
    names = [*(short(zone.name) for zone in mesh.cell_zones), None]
    counts = np.zeros(len(names), np.int64)
    worst: dict[int, tuple[float, Sample, int]] = {}
    for sample in found:
        at = np.flatnonzero(is_beyond_each(sample.values, limit, sense, inclusive=inclusive))
        if not len(at):
            continue
        if zone_of_cell is None or sample.key in ("face", "point"):
            zones = np.full(len(at), len(names) - 1)
        else:
            rows = at if sample.rows is None else sample.rows[at]
            zones = zone_of_cell[mesh.block(sample.key).rows[rows]]
            zones = np.where(zones < 0, len(names) - 1, zones)
        counts += np.bincount(zones, minlength=len(names))
        badness = sample.values[at] if sense == "above" else -sample.values[at]
        order = np.lexsort((at, -badness))
        for k, first in zip(*np.unique(zones[order], return_index=True), strict=True):
            entry = at[order[first]]
            value = float(sample.values[entry])
            if k not in worst or (value > worst[k][0] if sense == "above" else value < worst[k][0]):
                worst[int(k)] = value, sample, int(entry)
    ranked = sorted(worst, key=lambda k: ((-worst[k][0] if sense == "above" else worst[k][0]), k))[:_MOST_ZONES]
    return tuple(
        {
            "zone": names[k],
            "beyond": int(counts[k]),
            "worst": {
                "type": worst[k][1].key,
                **places.describe(worst[k][1].key, worst[k][1].row(worst[k][2]), plain(worst[k][0])),
            },
        }
        for k in ranked
    )
