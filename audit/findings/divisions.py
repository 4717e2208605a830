"""The check on how curves of the geometry are divided: edges counted against length over requested size."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from meshwright.audit.connectivity import edges
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.features import features_of
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.requests import requested, wanted_sizes

__all__ = ["ROWS", "curve_counts"]

_LISTED = 100


def curve_counts(facts: Facts) -> list[dict[str, Any]]:
    """A row for each curve of the geometry with a requested size h: length L, edges counted, edges expected: L // h.

    The size of a curve is the smallest that rules any of its edges.
    """
    found, wanted = features_of(facts), requested(facts)
    table = edges(facts.mesh)
    scale = np.array([len(facts.mesh.points), 1], dtype=np.int64)
    chosen = np.flatnonzero(found.curve >= 0)
    at = np.searchsorted(table @ scale, found.edges[chosen] @ scale)
    length, size, of = wanted.length[at], wanted_sizes(facts, wanted)[at], found.curve[chosen]
    h = np.full(found.n_curves, np.nan)
    np.fmin.at(h, of, size)
    total, count = np.bincount(of, length, found.n_curves), np.bincount(of, minlength=found.n_curves)
    with np.errstate(all="ignore"):
        ratio = total / h
    rows = []
    for k in np.flatnonzero((h > 0.0) & (ratio < 1e18)).tolist():
        expected = max(math.floor(float(ratio[k]) * (1.0 + 1e-9)), 1)
        rows.append(
            {
                "curve": k, "length": float(total[k]), "wanted": float(h[k]), "edges": int(count[k]),
                "expected": expected,
            }
        )  # fmt: skip
    return rows


def curve_count(facts: Facts) -> Found | None:
    """Points of curves that are divided otherwise than requested."""
    if not facts.options.sizes:
        return None
    rows = curve_counts(facts)
    other = [row for row in rows if row["edges"] != row["expected"]]
    if not other:
        return None
    found = features_of(facts)
    points = np.unique(found.edges[np.isin(found.curve, [row["curve"] for row in other])])
    few = sum(row["edges"] < row["expected"] for row in other)
    return Found(
        points,
        f"{counted(len(other), 'curve')} of {len(rows)} with another number of edges than its length over the "
        f"requested size, rounded down ({few} with fewer): check the sizes there if they are to be exact",
        detail={"curves": other[:_LISTED]},
    )


ROWS = (
    Check(
        "curve-count", "info", "Divisions of curves", "point",
        "neighbouring curves and growth laws may ask for more edges than the size alone", curve_count,
    ),
)  # fmt: skip
