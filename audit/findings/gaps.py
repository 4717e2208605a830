"""The check on points that nearly coincide: what a merge tolerance would weld."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, Severity, counted
from meshwright.audit.findings.hulls.collect import collected
from meshwright.audit.findings.hulls.contacts import mesh_contacts
from meshwright.audit.findings.hulls.hull import Hull
from meshwright.audit.findings.hulls.pairs import close_pairs
from meshwright.audit.findings.hulls.touching import MOST
from meshwright.audit.mesh import Ints
from meshwright.audit.places import plain

__all__ = ["CAD", "MESHER", "ROWS"]

CAD = 0.001
"""Millimetres: the merge tolerance of CAD systems; points closer than that are one point to them."""
MESHER = (0.1, 0.5)
"""Millimetres: the range of merge tolerances that mesh generators are run with."""

_NEAR = 0.12
"""Pairs closer than this share of the shortest edges at both points are counted. Like the other shares no round number,
so that rounding decides nothing in meshes of round sizes."""
_NEAR_IN_UNITS = 0.31
"""The same where lengths can be compared with the bands."""
_CRACK = 0.0012
"""Pairs on the outside of a solid or flat mesh are a crack below this share; above, they may face each other across
a plate that is not meshed. On the rim of a surface nothing else brings two points together: all are cracks."""
_SAME = 1e-6
"""Below this share of the edges, points are one point to every mesher, by rounding."""
_MOST_LISTED = 100


def near_points(facts: Facts) -> Found | None:
    """Points of the outside of a mesh close to another one that they have no edge to, and not exactly on it."""
    mesh, unit = facts.mesh, facts.options.unit
    contacts = mesh_contacts(mesh)
    hull = contacts.hull
    if len(hull.points) < 2:
        return None
    explained = np.zeros(len(hull.points), dtype=bool)
    explained[_corners(hull, np.flatnonzero(contacts.facets("cut", "hanging", "nonconformal")))] = True
    tree = hull.point_tree
    most = _NEAR if unit is None else _NEAR_IN_UNITS
    pairs = (
        hull.x,
        hull.reach,
        hull.outward,
        hull.offsets,
        hull.nodes,
        *hull.around,
        tree.order,
        tree.boxes,
        tree.nodes,
        most,
    )
    first, second, distance = collected(partial(close_pairs, *pairs), np.int32, np.int32, np.float64)
    open_ = ~(explained[first] & explained[second])
    if hull.kind == "rim":  # what lies on another edge is not at the rim once the points are merged
        sewn = np.zeros(len(hull.points), dtype=bool)
        sewn[_corners(hull, np.flatnonzero(contacts.facets("unmerged")))] = True
        open_ &= ~(sewn[first] & sewn[second]) | (distance <= MOST * hull.reach[first])
    first, second, distance = first[open_], second[open_], distance[open_]
    if not len(first):
        return None
    relative = distance / np.minimum(hull.reach[first], hull.reach[second])
    length = distance * hull.unit
    crack = (relative > _SAME) & (relative <= (_NEAR if hull.kind == "rim" else _CRACK))
    if unit is not None:
        size = length * unit
        between = (size > CAD) & (size <= MESHER[1])
        crack = between if hull.kind == "rim" else between & crack
    severity: Severity = "warning" if crack.any() else "info"
    shown = crack if crack.any() else np.ones(len(first), dtype=bool)
    rows = hull.points[np.union1d(first[shown], second[shown])]
    worst = float(length[shown].max())
    return Found(
        rows,
        _message(int(np.count_nonzero(shown)), float(length[shown].min()), worst, unit, cracked=severity == "warning"),
        severity=severity,
        detail={
            "pairs": len(first),
            "cracks": int(np.count_nonzero(crack)),
            "shortest": plain(float(length.min())),
            "longest": plain(float(length.max())),
            **_histograms(length, relative, unit),
            "merge_tolerance": plain(worst) if severity == "warning" else None,
            "list": _listed(hull, first, second, length, relative),
        },
    )


def _message(n: int, least: float, most: float, unit: float | None, *, cracked: bool) -> str:
    pairs = counted(n, "pair")
    range_ = f"{least:.3g}" if n == 1 else f"{least:.3g} to {most:.3g}"
    if not cracked:
        return (
            f"{pairs} of points without an edge between them lie {range_} apart: gaps that meshes go around, or cracks"
        )
    if unit is None:
        return (
            f"{pairs} of points lie {range_} apart, far below the edges around them: cracks through which parts come "
            f"apart; merge them within {most:.3g}"
        )
    return (
        f"{pairs} of points lie {range_} apart ({least * unit:.3g} to {most * unit:.3g} mm), above the {CAD:g} mm of "
        f"CAD systems and within the {MESHER[1]:g} mm of mesh generators: cracks; merge within {most * unit:.3g} mm"
    )


def _corners(hull: Hull, facets: Ints) -> Ints:
    sizes = np.diff(hull.offsets)[facets]
    starts = np.cumsum(sizes) - sizes
    rows: Ints = hull.nodes[np.repeat(hull.offsets[facets] - starts, sizes) + np.arange(sizes.sum())]
    return rows


def _histograms(length: NDArray[np.float64], relative: NDArray[np.float64], unit: float | None) -> dict[str, Any]:
    """Pairs by decade of their distance: over the edges around them, and in millimetres where the unit is known."""
    bins: dict[str, Any] = {"by_share_of_edge": _decades(relative)}
    if unit is not None:
        size = length * unit
        bins["by_millimetres"] = _decades(size)
        bins["bands"] = [
            {"name": "CAD", "low": 0.0, "high": CAD, "pairs": int(np.count_nonzero(size <= CAD))},
            {
                "name": "between",
                "low": CAD,
                "high": MESHER[0],
                "pairs": int(np.count_nonzero((size > CAD) & (size <= MESHER[0]))),
            },
            {
                "name": "mesher",
                "low": MESHER[0],
                "high": MESHER[1],
                "pairs": int(np.count_nonzero((size > MESHER[0]) & (size <= MESHER[1]))),
            },
        ]
    return bins


def _decades(values: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Counts by powers of ten, low end included."""
    finite = values[np.isfinite(values) & (values > 0.0)]
    powers = np.floor(np.log10(finite)).astype(int)
    # log10 may be off by a rounding just at a power of ten
    powers -= finite < 10.0 ** powers.astype(float)
    powers += finite >= 10.0 ** (powers + 1.0)
    found, counts = np.unique(powers, return_counts=True)
    return [
        {"low": plain(10.0**p), "high": plain(10.0 ** (p + 1.0)), "pairs": int(n)}
        for p, n in zip(found.astype(float), counts, strict=True)
    ]


def _listed(
    hull: Hull, first: Ints, second: Ints, length: NDArray[np.float64], relative: NDArray[np.float64]
) -> list[dict[str, Any]]:
    """The closest pairs."""
    mesh = hull.mesh
    ids = np.arange(len(mesh.points)) if mesh.point_ids is None else mesh.point_ids
    order = np.lexsort((second, first, length))[:_MOST_LISTED]
    return [
        {
            "points": [int(ids[hull.points[first[i]]]), int(ids[hull.points[second[i]]])],
            "distance": plain(float(length[i])),
            "share_of_edge": plain(float(relative[i])),
        }
        for i in order.tolist()
    ]


ROWS = (
    Check(
        "near-points", "warning", "Points that nearly coincide", "point",
        "a crack that a mesher does not weld leaks or splits a part; gaps wide enough to be meant are only told",
        near_points,
    ),
)  # fmt: skip
