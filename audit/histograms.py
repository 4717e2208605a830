"""Histograms over bins that belong to the metric and not to the mesh, so that those of two meshes can be overlaid.

Angles and numbers between two bounds have the same bins everywhere. Sizes, which know no bounds, are counted on one
ladder (1, 2, 5, 10, ...), of which a mesh shows the stretch its values take up; `aligned` brings two together.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import kernel
from meshwright.audit.metrics.row import Metric
from meshwright.audit.places import plain
from meshwright.audit.tables import BINNINGS

__all__ = ["Histogram", "aligned", "count_into", "histogram_for"]

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

_TENTHS = tuple(k / 10 for k in range(11))
_RATIO = BINNINGS[1].edges
_LOW_RATIO = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, math.inf)
_NUMBERS = (1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 48.0, 64.0, math.inf)
_BLOCK = 1024
_FINE_DECADES = 7
_DECADES = 21


@dataclass(frozen=True)
class Histogram:
    """The bins of one metric: [low, high), the last one closed.

    edges: ascending, on the stored scale; the first may be -inf, the last inf.  mirrored: the same bins on the scale
    whose good end is the other one, None where there is no such scale.  scales: names of both.
    """

    edges: tuple[float, ...]
    labels: tuple[str, ...]
    mirrored: tuple[str, ...] | None
    scales: tuple[str, str | None]

    def as_json(self, counts: dict[str, Counts]) -> dict[str, Any]:
        """The entry of a document.  counts: by cell type, "face" or "point"."""
        return {
            "edges": [plain(edge) for edge in self.edges],
            "labels": list(self.labels),
            "mirrored": None if self.mirrored is None else list(self.mirrored),
            "scales": list(self.scales),
            "counts": {key: found.tolist() for key, found in counts.items()},
        }


def histogram_for(metric: Metric, low: float, high: float) -> Histogram:
    """The bins of a metric.  low, high: of its values in this mesh; they matter for sizes alone."""
    binning = next((b for b in BINNINGS if b.metric == metric.id), None)
    if binning is not None:
        return Histogram(binning.edges, binning.labels, binning.mirrored_labels, binning.columns)
    edges = _edges(metric, low, high)
    labels = _labels(edges)
    if metric.best == "none":
        return Histogram(edges, labels, None, (_unit(metric), None))
    if (edges[0], edges[-1]) == (0.0, 1.0):
        names = ("Fluent (0 best)", "ICEM (1 best)")
        mirrored = _labels(tuple((10 - k) / 10 for k in range(11)))
        return Histogram(edges, labels, mirrored, names if metric.best == "low" else (names[1], names[0]))
    if edges == _RATIO:
        return Histogram(edges, BINNINGS[1].labels, BINNINGS[1].mirrored_labels, ("ratio (1 best)", "1/ratio (1 best)"))
    good = f", {'small' if metric.best == 'low' else 'large'} is good"
    return Histogram(edges, labels, None, (_unit(metric) + good, None))


def _unit(metric: Metric) -> str:
    return {"1": "value", "deg": "degrees", "L": "length", "L2": "area", "L3": "volume"}[metric.unit]


def _edges(metric: Metric, low: float, high: float) -> tuple[float, ...]:
    if metric.unit.startswith("L"):
        return _ladder(low, high)
    if metric.unit == "deg":
        return _degrees(metric.low, metric.high)
    if metric.high == math.inf:
        if metric.low >= 1:
            return _RATIO if metric.best == "low" else _NUMBERS
        return _LOW_RATIO if metric.low == 0 else (-math.inf, *_LOW_RATIO)
    if metric.low == 0 and metric.high == 0.5:
        return tuple(k / 20 for k in range(11))
    if metric.high == 2 or (metric.low == -1 and metric.best == "low"):
        return tuple(metric.low + k / 5 for k in range(round((metric.high - metric.low) * 5) + 1))
    upward = [k / 10 for k in range(11) if k / 10 < metric.high - 0.05]
    return (*([metric.low] if metric.low < 0 else []), *upward, metric.high)


def _degrees(low: float, high: float) -> tuple[float, ...]:
    """Bins of ten degrees, all below 0 in one and all above 180 in another; of 30 where they go round to 270."""
    if high == 270:
        return tuple(float(x) for x in range(0, 271, 30))
    upward = [float(x) for x in range(int(max(low, 0)), int(min(high, 180)) + 1, 10)]
    return (*([low] if low < 0 else []), *upward, *([high] if high > 180 else []))


def _ladder(low: float, high: float) -> tuple[float, ...]:
    """The rungs 1, 2, 5 times powers of ten around the values; of powers of ten alone where there are many decades.

    What lies below 0 is one bin, and so is what lies from 0 to the first rung where there are values of 0.
    """
    below = (*((-math.inf,) if low < 0 else ()), *((0.0,) if low <= 0 else ()))
    if not (math.isfinite(high) and high > 0):
        return (*(below or (0.0,)), math.inf)
    top = math.floor(math.log10(high)) + 1
    bottom = max(math.floor(math.log10(low)) if low > 0 else top - _DECADES, top - _DECADES, -307)
    steps = (1, 2, 5) if top - bottom <= _FINE_DECADES else (1,)
    rungs = [float(f"{step}e{power}") for power in range(bottom, min(top + 1, 308)) for step in steps]
    last = next((k for k, rung in enumerate(rungs) if rung > high), len(rungs))
    first = max((k for k, rung in enumerate(rungs) if rung <= low), default=0)
    end = () if last < len(rungs) else (math.inf,)
    return (*(below or (() if rungs[first] <= low else (0.0,))), *rungs[first : last + 1], *end)


def _labels(edges: tuple[float, ...]) -> tuple[str, ...]:
    """'0.1-0.2', '< 0', '>= 50'."""
    found = []
    finite = [edge for edge in edges if math.isfinite(edge)]
    tenths = max(map(abs, finite), default=0) <= 1 and all(abs(edge * 10 - round(edge * 10)) < 1e-9 for edge in finite)
    shown = [f"{edge:.1f}" if tenths else f"{edge:.3g}" for edge in edges]
    for k in range(len(edges) - 1):
        if edges[k] == -math.inf:
            found.append(f"< {shown[k + 1]}")
        elif edges[k + 1] == math.inf:
            found.append(f">= {shown[k]}")
        else:
            middle = " to " if edges[k] < 0 or edges[k + 1] < 0 else "-"
            found.append(f"{shown[k]}{middle}{shown[k + 1]}")
    return tuple(found)


def count_into(edges: tuple[float, ...], values: Floats) -> Counts:
    """(n bins,) how many of the values lie in each bin; nan is in none, and what lies outside in the nearest."""
    return _count(np.array(edges[1:-1]), np.ascontiguousarray(values))


@kernel
def _count(inner: Floats, values: Floats) -> Counts:
    """Counted are the values at or above each edge, block by block, which is vector code; bins are the differences."""
    n = inner.size
    above = np.zeros(n + 2, np.int64)
    for start in range(0, values.size, _BLOCK):
        stop = min(start + _BLOCK, values.size)
        for j in range(n):
            edge = inner[j]
            k = np.int64(0)
            for i in range(start, stop):
                k += np.int64(values[i] >= edge)
            above[j + 1] += k
        k = np.int64(0)
        for i in range(start, stop):
            k += np.int64(values[i] == values[i])
        above[0] += k
    return above[:-1] - above[1:]


def aligned(a: dict[str, Any], b: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Two entries of documents on the same bins; equal entries come back as they are.

    Exact: an edge of one stays where the other has it too, or nothing in the bin it would split.
    """
    if a["edges"] == b["edges"]:
        return a, b
    x, y = ([float(edge) for edge in entry["edges"]] for entry in (a, b))
    edges = sorted(_usable(x, y, b) | _usable(y, x, a))
    labels = list(_labels(tuple(edges)))

    def moved(entry: dict[str, Any], old: list[float]) -> dict[str, Any]:
        counts = {}
        for key, found in entry["counts"].items():
            into = [0] * len(labels)
            for k, n in enumerate(found):
                if n:
                    into[bisect_right(edges, old[k]) - 1] += n
            counts[key] = into
        common = {"edges": [plain(edge) for edge in edges], "labels": labels, "mirrored": None}
        return {**entry, **common, "scales": [entry["scales"][0], None], "counts": counts}

    return moved(a, x), moved(b, y)


def _usable(edges: list[float], others: list[float], entry: dict[str, Any]) -> set[float]:
    """The edges that split no bin of the other entry that holds anything."""
    totals = [sum(column) for column in zip(*entry["counts"].values(), strict=True)] or [0] * (len(others) - 1)
    found = set()
    for edge in edges:
        k = bisect_right(others, edge) - 1
        if edge in others or not 0 <= k < len(totals) or totals[k] == 0:
            found.add(edge)
    return found
