"""Which cells, faces or points of an audit are to be shown: the worst, or all beyond a value; and their colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.measurement import clamp
from meshwright.audit.metrics import METRICS
from meshwright.audit.metrics.row import Entity
from meshwright.audit.places import Places
from meshwright.audit.run import Audit
from meshwright.audit.statistics import worst_first
from meshwright.audit.summary import cells_of_zones

__all__ = ["MOST_SHOWN", "RAMP", "UNDEFINED", "Shown", "colours_of", "range_of", "shown_of"]

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

MOST_SHOWN = 200_000
"""Entities in a picture; of more, the worst are shown."""

RAMP = ((246, 178, 60), (158, 16, 26))
"""Colours from the least bad to the worst value shown, which differ in grey as well; 0 to 255."""

UNDEFINED = (107, 63, 160)
"""Colour of entities without a value."""


@dataclass(frozen=True, eq=False)
class Shown:
    """Entities to show, the worst first; those without a value come before all others.

    rows: of cells of the mesh, of faces or of points.  values: nan where undefined.  of: how many there are beyond the
    limit, or with a value or without one where there was no limit.
    """

    metric: str
    entity: Entity
    rows: Rows
    values: Floats
    of: int

    @property
    def undefined(self) -> int:
        """How many have no value."""
        return int(np.count_nonzero(np.isnan(self.values)))


def shown_of(
    audit: Audit, metric: str, *, worst: int | None = None, beyond: float | None = None, zone: str | None = None
) -> Shown:
    """The `worst` entities by a metric of the audit, or those strictly beyond a value, `MOST_SHOWN` at most.

    worst: 100 where there is no `beyond` either; with it, no more than that.  zone: count only cells of zones that
    match the pattern, and what is around them. An entity without a value counts as the worst there is. UsageError for a
    metric that was not measured, for a zone that is not there, and for `beyond` of a size, which has no bad end.
    """
    row = METRICS.get(metric)
    if row is None or metric not in audit.measured.values:
        raise UsageError(f"{printable(metric)} was not measured; there are {', '.join(audit.measured.values)}")
    if beyond is not None and row.best == "none":
        raise UsageError(f"{metric} has no bad end, so nothing lies beyond a value")
    found = audit.measured.values[metric]
    if not found:
        raise UsageError(f"{metric} is not defined for the cells of this mesh")
    mesh = audit.mesh
    places = Places(mesh, None if zone is None else cells_of_zones(mesh, zone))
    rows, values = [], []
    for key, raw in found.items():
        here = places.chosen(key, audit.measured.domain(metric, key))
        here = np.arange(len(raw)) if here is None else here
        values.append(clamp(row, raw[here]))
        rows.append(mesh.block(key).rows[here] if row.entity == "cell" else here)
    value, number = np.concatenate(values), np.concatenate(rows).astype(np.intp)
    lost = np.flatnonzero(np.isnan(value))
    most = worst if worst is not None else MOST_SHOWN if beyond is not None else 100
    if beyond is not None:
        with np.errstate(invalid="ignore"):
            bad = np.flatnonzero(value > beyond if row.worst_is_high else value < beyond)
    else:
        bad = np.flatnonzero(~np.isnan(value))
    listed = bad[worst_first(value[bad], min(most, MOST_SHOWN), high_is_worse=row.worst_is_high)]
    chosen = np.concatenate([lost, listed])[: min(most, MOST_SHOWN)]
    return Shown(metric, row.entity, number[chosen], value[chosen], len(lost) + len(bad))


def colours_of(shown: Shown, low: float, high: float) -> NDArray[np.uint8]:
    """(n, 3) colours, 0 to 255: along `RAMP` from `low`, the least bad value, to `high`, the worst."""
    share: Any = np.ones(len(shown.values))
    if np.isfinite(high - low) and high != low:
        share = np.clip((shown.values - low) / (high - low), 0.0, 1.0)
    ends = np.array(RAMP, float)
    mixed = ends[0] + np.nan_to_num(np.asarray(share))[:, None] * (ends[1] - ends[0])
    mixed[np.isnan(shown.values)] = UNDEFINED
    return np.rint(mixed).astype(np.uint8)


def range_of(values: ArrayLike, *, high_is_worse: bool) -> tuple[float, float]:
    """(the least bad, the worst) of the finite values; (nan, nan) where there is none."""
    known = np.asarray(values, float)
    known = known[np.isfinite(known)]
    if not len(known):
        return np.nan, np.nan
    ends = float(known.min()), float(known.max())
    return ends if high_is_worse else ends[::-1]
