"""Two audits against each other, as one plain dictionary: the JSON document `meshwright.compare/1`."""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import Any

import numpy as np

from meshwright.audit.histograms import aligned
from meshwright.audit.matching import Match, match_meshes
from meshwright.audit.metrics import METRICS
from meshwright.audit.places import place, plain, short
from meshwright.audit.run import Audit
from meshwright.audit.summary import Summary
from meshwright.reports.wording import number

__all__ = ["SCHEMA", "Comparison", "compare_documents", "match_audits"]

SCHEMA = "meshwright.compare/1"
Comparison = dict[str, Any]

_MOST_IDS = 100
_NOISE = 1e-9
"""Relative difference up to which two figures are the same."""

_MOST_WORSE = 10
_FIGURES = ("min", "max", "mean", "p50", "p95", "p99")


def compare_documents(a: Summary, b: Summary, *, absolute: float = 0.0, relative: float = 0.0) -> Comparison:
    """Everything that differs between two documents, the first being what was before.

    absolute, relative: how much worse a figure may get without being called worse, the larger of both. "matching" is
    None: `match_audits` fills it where both meshes are at hand.
    """
    metrics = _metrics(a, b, absolute, relative)
    findings = _findings(a, b)
    rules = _rules(a, b)
    cautions = _cautions(a, b)
    worse = [f"{m['metric']} on {m['key']}: {', '.join(m['worse'])}" for m in metrics["changed"] if m["worse"]]
    worse += [f"finding {f['code']}: {f['before']} to {f['after']}" for f in findings if f["worse"]]
    worse += [f"rule {r['id']}: {r['before']} to {r['after']}" for r in rules if r["worse"]]
    return {
        "schema": SCHEMA,
        "version": version("meshwright"),
        "before": _side(a),
        "after": _side(b),
        "metrics": metrics,
        "zones": _zones(a, b),
        "findings": findings,
        "rules": rules,
        "histograms": _histograms(a, b),
        "matching": None,
        "worse": worse,
        "nothing_worse": not worse and not cautions,
        "cautions": cautions,
    }


def _side(document: Summary) -> dict[str, Any]:
    mesh = document["mesh"]
    return {
        "path": mesh["path"],
        "format": mesh["format"],
        "sha256": mesh["sha256"],
        "points": mesh["points"],
        "cells": mesh["cells"],
        "verdict": document["gate"]["verdict"],
        "version": document["version"],
        "selection": document["selection"],
    }


def _cautions(a: Summary, b: Summary) -> list[str]:
    """Why "nothing is worse" cannot be said, or means less than it seems."""
    found = []
    if a["version"] != b["version"]:
        found.append(f"the audits are by versions {a['version']} and {b['version']}, whose definitions may differ")
    zones = [d["selection"]["zone"] if d["selection"] else None for d in (a, b)]
    if zones[0] != zones[1]:
        found.append("the audits count different zones")
    for one, other, which in ((a, b, "before"), (b, a, "after")):
        alone = sorted(set(one["metrics"]) - set(other["metrics"]))
        if alone:
            found.append(f"measured {which} only: {', '.join(alone)}")
    for document, which in ((a, "before"), (b, "after")):
        if document["gate"]["verdict"] == "incomplete":
            found.append(f"the audit {which} is incomplete: {'; '.join(document['gate']['reasons'][:3])}")
    differing = [
        id_
        for id_ in a["definitions"].keys() & b["definitions"].keys()
        if any(a["definitions"][id_][key] != b["definitions"][id_][key] for key in ("unit", "low", "high", "best"))
    ]
    if differing:
        found.append(f"defined differently: {', '.join(sorted(differing))}")
    return found


def _metrics(a: Summary, b: Summary, absolute: float, relative: float) -> dict[str, Any]:
    """Figures of the metrics that both have, cell type by cell type."""
    changed, unchanged = [], 0
    for id_ in b["metrics"]:
        if id_ not in a["metrics"]:
            continue
        best = b["definitions"][id_]["best"]
        for key in dict.fromkeys((*a["metrics"][id_], *b["metrics"][id_])):
            before, after = (d["metrics"][id_].get(key) for d in (a, b))
            entry = _metric(id_, key, best, before, after, absolute, relative)
            if entry is None:
                unchanged += 1
            else:
                changed.append(entry)
    return {"changed": changed, "unchanged": unchanged}


def _metric(
    id_: str,
    key: str,
    best: str,
    before: dict[str, Any] | None,
    after: dict[str, Any] | None,
    absolute: float,
    relative: float,
) -> dict[str, Any] | None:
    """The figures of one metric on one type, None where all are equal; absent on one side is null there."""
    items = (*_FIGURES, "count", "undefined", "degenerate")
    pick = [None if side is None else {item: side.get(item, 0) for item in items} for side in (before, after)]
    if pick[0] is not None and pick[1] is not None and all(_same(pick[0][i], pick[1][i]) for i in items):
        return None
    worse, better = [], []
    if before is not None and after is not None and best != "none":
        end = "max" if best == "low" else "min"
        for item in (end, "mean"):
            x, y = number(before[item]), number(after[item])
            loss = (y - x) if best == "low" else (x - y)
            if math.isnan(loss):  # inf - inf, or no value on one side
                loss = 0.0 if x == y or (math.isnan(x) and math.isnan(y)) else math.inf if math.isnan(y) else -math.inf
            slack = max(absolute, relative * abs(x), _noise(x)) if math.isfinite(x) else 0.0
            name = "worst" if item == end else item
            if loss > slack:
                worse.append(name)
            elif loss < -_noise(x):
                better.append(name)
    if before is not None and after is not None:
        for item in ("undefined", "degenerate"):
            x, y = before.get(item, 0), after.get(item, 0)
            (worse if y > x else better if y < x else []).append(item)
    return {
        "metric": id_,
        "key": key,
        "best": best,
        "before": pick[0],
        "after": pick[1],
        "worse": worse,
        "better": better,
    }


def _noise(value: float) -> float:
    """How far the same cell may score apart after its corners are numbered anew: the rounding of sums."""
    return _NOISE * abs(value) + _NOISE**1.5


def _same(x: Any, y: Any) -> bool:
    """Whether two figures are equal but for rounding; None and nan are equal to themselves."""
    a, b = number(x), number(y)
    return x == y or (math.isnan(a) and math.isnan(b)) or abs(a - b) <= _noise(a)


def _zones(a: Summary, b: Summary) -> dict[str, Any]:
    """Zones by name and kind of entity: lost, new, and those whose number of entities or worst values changed."""
    sides = [{(z["entity"], z["name"]): z for z in d["zones"]} for d in (a, b)]
    lost = [key for key in sides[0] if key not in sides[1]]
    new = [key for key in sides[1] if key not in sides[0]]
    renamed = _renamed(sides, lost, new)
    resized = [
        {"entity": key[0], "name": key[1], "before": sides[0][key]["count"], "after": sides[1][key]["count"]}
        for key in sides[0]
        if key in sides[1] and sides[0][key]["count"] != sides[1][key]["count"]
    ]
    return {
        "lost": [{"entity": e, "name": n, "count": sides[0][e, n]["count"]} for e, n in lost],
        "new": [{"entity": e, "name": n, "count": sides[1][e, n]["count"]} for e, n in new],
        "maybe_renamed": renamed,
        "resized": resized,
        "metrics": _zone_metrics(a, b),
    }


def _renamed(sides: list[dict[tuple[str, str], Any]], lost: list[Any], new: list[Any]) -> list[dict[str, Any]]:
    """Lost zones with a new one of the same kind and size, where there is but one of each."""
    found = []
    for entity, name in lost:
        count = sides[0][entity, name]["count"]
        alike = [n for e, n in new if e == entity and sides[1][e, n]["count"] == count]
        rivals = [n for e, n in lost if e == entity and sides[0][e, n]["count"] == count]
        if len(alike) == len(rivals) == 1:
            found.append({"entity": entity, "before": name, "after": alike[0], "count": count})
    return found


def _zone_metrics(a: Summary, b: Summary) -> list[dict[str, Any]]:
    """The worst value of every metric in the zones that both have, where it changed."""
    found = []
    for id_ in b.get("zone_metrics", {}):
        rows = [{_zone_name(d, row["zone"]): row for row in d.get("zone_metrics", {}).get(id_, [])} for d in (a, b)]
        best = b["definitions"].get(id_, {}).get("best", "none")
        for zone in rows[1]:
            if zone not in rows[0]:
                continue
            x, y = rows[0][zone], rows[1][zone]
            if x["worst"] is None or y["worst"] is None or all(_same(x[k], y[k]) for k in ("worst", "mean")):
                continue
            loss = (number(y["worst"]) - number(x["worst"])) * (1 if best == "low" else -1)
            found.append(
                {
                    "zone": None if zone is None else short(zone),
                    "metric": id_,
                    "before": x["worst"],
                    "after": y["worst"],
                    "mean_before": x["mean"],
                    "mean_after": y["mean"],
                    "worse": best != "none" and loss > _noise(number(x["worst"])),
                }
            )
    return found


def _zone_name(document: Summary, index: int | None) -> str | None:
    return None if index is None else str(document["zones"][index]["name"])


def _findings(a: Summary, b: Summary) -> list[dict[str, Any]]:
    """Findings whose number of entities changed; 0 for none. More of an error or a warning is worse."""
    sides = [{f["code"]: f for f in d["findings"]} for d in (a, b)]
    found = []
    for code in dict.fromkeys((*sides[0], *sides[1])):
        before, after = (side[code]["count"] if code in side else 0 for side in sides)
        severity = (sides[1].get(code) or sides[0][code])["severity"]
        if before != after:
            worse = after > before and severity in ("error", "warning")
            found.append({"code": code, "severity": severity, "before": before, "after": after, "worse": worse})
    return found


def _rules(a: Summary, b: Summary) -> list[dict[str, Any]]:
    """Rules of the gate whose state or figure changed."""
    order = ("pass", "info", "waived", "warn", "fail", "incomplete")
    sides = [{r["id"]: r for r in d["gate"]["rules"]} for d in (a, b)]
    found = []
    for id_ in dict.fromkeys((*sides[0], *sides[1])):
        x, y = (side.get(id_) for side in sides)
        before, after = (None if r is None else r["state"] for r in (x, y))
        figures = [None if r is None else r["measured"] for r in (x, y)]
        if before == after and figures[0] == figures[1]:
            continue
        worse = before is not None and after is not None and order.index(after) > order.index(before)
        found.append({"id": id_, "name": (y or x or {})["name"], "before": before, "after": after,
                      "measured_before": figures[0], "measured_after": figures[1], "worse": worse})  # fmt: skip
    return found


def _histograms(a: Summary, b: Summary) -> dict[str, Any]:
    """Histograms of both on the same bins, of the metrics whose counts differ."""
    found = {}
    for id_, after in b.get("histograms", {}).items():
        before = a.get("histograms", {}).get(id_)
        if before is not None and (before["counts"] != after["counts"] or before["edges"] != after["edges"]):
            x, y = aligned(before, after)
            found[id_] = {"before": x, "after": y}
    return found


def match_audits(comparison: Comparison, a: Audit, b: Audit, tolerance: float | None = None) -> None:
    """Fill "matching": cells that are the same, moved, new and gone, and those of the first two that got worse."""
    match = match_meshes(a.mesh, b.mesh, tolerance)
    comparison["matching"] = {
        "tolerance": match.tolerance,
        "shift": list(match.shift),
        "scale": match.scale,
        "same": len(match.same),
        "moved": _entry(b, match.moved[:, 1], match.distance),
        "removed": _entry(a, match.removed),
        "added": _entry(b, match.added),
        "zone_changed": _zone_changes(a, b, match),
        "worse": _worse_cells(a, b, match),
    }


def _entry(audit: Audit, rows: Any, distance: Any = None) -> dict[str, Any]:
    """How many cells, the first of them by number, where the first few lie, and how far they moved at most."""
    numbers = audit.mesh.ids_of_cells(rows[:_MOST_IDS]).tolist()
    found = {
        "count": len(rows),
        "ids": numbers,
        "places": [[plain(x) for x in place(audit.mesh, "cell", int(row))] for row in rows[:_MOST_WORSE]],
    }
    if distance is not None:
        found["largest"] = float(np.nanmax(distance)) if len(distance) else 0.0
    return found


def _zone_changes(a: Audit, b: Audit, match: Match) -> list[dict[str, Any]]:
    """Same and moved cells that lie in a zone of another name, by pair of names."""
    pairs = np.concatenate([match.same, match.moved])
    names = []
    for audit, column in ((a, 0), (b, 1)):
        zones = [*(zone.name for zone in audit.mesh.cell_zones), None]
        names.append([zones[k] for k in audit.mesh.cell_zone_index()[pairs[:, column]].tolist()])
    counts: dict[tuple[str | None, str | None], int] = {}
    for x, y in zip(*names, strict=True):
        if x != y:
            counts[x, y] = counts.get((x, y), 0) + 1
    ordered = sorted(counts.items(), key=lambda item: -item[1])[:_MOST_IDS]
    return [
        {"before": None if x is None else short(x), "after": None if y is None else short(y), "count": n}
        for (x, y), n in ordered
    ]


def _worse_cells(a: Audit, b: Audit, match: Match) -> list[dict[str, Any]]:
    """Of every metric of cells, how many of the matched cells got worse, and those that lost most."""
    pairs = np.concatenate([match.same, match.moved])
    found = []
    for id_ in b.cell_metrics:
        metric = METRICS[id_]
        if id_ not in a.cell_metrics or metric.best == "none" or not len(pairs):
            continue
        x, y = (_values(audit, id_)[pairs[:, column]] for audit, column in ((a, 0), (b, 1)))
        with np.errstate(invalid="ignore"):
            loss = (y - x) if metric.worst_is_high else (x - y)
        noise = 1e-9 * np.maximum(1.0, np.where(np.isfinite(x), np.abs(x), 1.0))
        worse = np.flatnonzero(loss > noise)
        if len(worse):
            top = worse[np.lexsort((worse, -loss[worse]))[:_MOST_WORSE]]
            cells = [
                {
                    "cell": int(b.mesh.ids_of_cells(int(pairs[k, 1]))),
                    "before": plain(float(x[k])),
                    "after": plain(float(y[k])),
                    "centroid": [plain(c) for c in place(b.mesh, "cell", int(pairs[k, 1]))],
                }
                for k in top.tolist()
            ]
            found.append({"metric": id_, "count": len(worse), "cells": cells})
    return found


def _values(audit: Audit, id_: str) -> Any:
    """(n_cells,) clamped values of a metric of cells, nan where it has none."""
    metric = METRICS[id_]
    found = np.full(audit.mesh.n_cells, np.nan)
    for key, raw in audit.measured.values[id_].items():
        found[audit.mesh.block(key).rows] = np.clip(raw, metric.low, metric.high)
    return found
