"""What the sections of a report show, as plain values that templates print: spelled, cut and sorted here."""

from __future__ import annotations

from typing import Any

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.metrics import DEFAULT, METRICS
from meshwright.audit.summary import Summary
from meshwright.audit.tables import BINNINGS, SKEW
from meshwright.reports.html.fragments import Panels, mirrored
from meshwright.reports.html.overview import cut, facts_of, figures_of, gate_of, title_of, view_words
from meshwright.reports.limits import (
    beside,
    measured_text,
    rule_limit,
    verdict_words,
)
from meshwright.reports.wording import figure, not_defined, number, percent, plural, size

__all__ = ["ICONS", "page_data"]

ICONS = {
    "pass": "✓",
    "warn": "!",
    "fail": "✕",
    "incomplete": "?",
    "waived": "~",
    "info": "i",
    "error": "✕",
    "warning": "!",
}
"""Beside every state, which is never told by colour alone."""

_MOST_IDS = 12
_MOST_ZONES = 60
_WORDS = {
    "pass": "PASS",
    "warn": "PASS WITH WARNINGS",
    "fail": "FAIL",
    "incomplete": "INCOMPLETE: not everything was checked",
}


def page_data(
    document: Summary, facts: dict[str, Any], panels: Panels, repair: dict[str, Any] | None
) -> dict[str, Any]:
    """All names that the template of the report uses, but for its files and payloads."""
    gate = document["gate"]
    return {
        "title": title_of(document),
        "path": cut(document["mesh"]["path"] or "mesh"),
        "version": document["version"],
        "verdict": gate["verdict"],
        "verdict_words": _WORDS[gate["verdict"]],
        "icons": ICONS,
        "facts": facts_of(document),
        "figures": figures_of(document),
        "reasons": [cut(reason, 400) for reason in gate["reasons"]],
        "gate": gate_of(document),
        "view_facts": view_words(facts),
        "panels": panels,
        "first_panel": panels.html.get(panels.first, ""),
        "groups": _groups(panels),
        "cell_zones": _zone_options(document, "cell"),
        "face_zones": _zone_options(document, "face") if facts["shell_zones"] == "face" else [],
        "types": list(facts["kinds"]),
        "quality": _quality(document),
        "distributions": _distributions(document),
        "classes": _classes(document),
        "heat": _heat(document),
        "rosetta": _rosetta(document),
        "findings": [_finding(f) for f in document["findings"]],
        "definitions": [METRICS[id_] for id_ in document["definitions"]],
        "missing": _missing(document),
        "notes": [cut(note, 500) for note in document["notes"]],
        "surface": _surface(document),
        "repair": None if repair is None else _repair(repair),
        "selection": document["selection"],
    }


def _groups(panels: Panels) -> list[tuple[str, list[tuple[str, str]]]]:
    """Options of the metric picker: the default ones, then the rest by what they are values of."""
    default = [id_ for id_ in panels.html if id_ in DEFAULT]
    found = [("default", default)]
    found += [
        (f"{entity}s", [i for i in panels.html if i not in DEFAULT and panels.entities[i] == entity])
        for entity in ("cell", "face", "point")
    ]
    return [(name, [(i, f"{panels.titles[i]} ({i})") for i in ids]) for name, ids in found if ids]


def _zone_options(document: Summary, entity: str) -> list[tuple[str, str]]:
    """(name in the payload, name as shown); the payload has it whole, and so must the value of an option."""
    zones = [zone for zone in document["zones"] if zone["entity"] == entity and zone["kind"] != "faceZone"]
    return [(str(k), cut(zone["name"], 60) or "(unnamed)") for k, zone in enumerate(zones)][:500]


def _quality(document: Summary) -> list[list[str]]:
    rows = []
    for q in document["quality"]:
        undefined = document["distributions"]["equiangle_skew"]["undefined"].get(q["type"], 0)
        known = q["over_0_8"] is not None
        worst = figure(q["worst_equiangle_skew"]) if known else "not defined"
        mirror = mirrored(SKEW, q["worst_equiangle_skew"]) if known and q["worst_equiangle_skew"] is not None else "-"
        share = percent(q["over_0_8"], q["count"] - undefined) if known else "not defined"
        rows.append([CELL_TYPES[q["type"]].title, size(q["count"]), worst, mirror, share])
    return rows


def _distributions(document: Summary) -> list[dict[str, Any]]:
    found = []
    for binning in BINNINGS:
        table = document["distributions"][binning.id]
        kinds = list(table["counts"])
        if not kinds:
            continue
        whole = sum(map(sum, table["counts"].values()))
        rows = []
        for k in range(binning.n):
            counts = [table["counts"][kind][k] for kind in kinds]
            rows.append(
                [binning.labels[k], binning.mirrored_labels[k], *map(size, counts), percent(sum(counts), whole)]
            )
        if any(table["undefined"].values()):
            rows.append(["undefined", "", *(size(table["undefined"][kind]) for kind in kinds), ""])
        found.append({"title": binning.title, "columns": [*binning.columns, *kinds, "share"], "rows": rows,
                      "left_out": not_defined(document, kinds)})  # fmt: skip
    return found


def _classes(document: Summary) -> dict[str, Any] | None:
    table = document["gambit_classes"]
    kinds = list(table["counts"])
    if not kinds:
        return None
    rows = [
        [c["name"], c["range"], *(size(table["counts"][kind][k]) for kind in kinds)]
        for k, c in enumerate(table["classes"])
    ]
    return {"columns": ["class", "range", *kinds], "rows": rows, "mean": figure(table["mean"]), "hint": table["hint"]}


def _heat(document: Summary) -> dict[str, Any] | None:
    """Zones by metrics: the worst value, shaded by how bad it is on the scale of its histogram."""
    tables = {id_: rows for id_, rows in document.get("zone_metrics", {}).items() if rows}
    if not tables:
        return None
    ids = [id_ for id_ in tables if id_ in DEFAULT and METRICS[id_].best != "none"] or list(tables)[:12]
    names: dict[int | None, None] = {}
    for id_ in ids:
        names |= dict.fromkeys(row["zone"] for row in tables[id_])
    cells = {id_: {row["zone"]: row for row in tables[id_]} for id_ in ids}
    rows = [
        {
            "zone": "(no zone)" if zone is None else cut(document["zones"][zone]["name"], 80) or "(unnamed)",
            "cells": [_heat_cell(document, id_, cells[id_].get(zone)) for id_ in ids],
        }
        for zone in list(names)[:_MOST_ZONES]
    ]
    columns = [(id_, METRICS[id_].title, "0 best" if METRICS[id_].best == "low" and METRICS[id_].low == 0 else
                "small is good" if METRICS[id_].best == "low" else "large is good") for id_ in ids]  # fmt: skip
    return {"columns": columns, "rows": rows, "more": max(0, len(names) - _MOST_ZONES)}


def _heat_cell(document: Summary, id_: str, row: dict[str, Any] | None) -> dict[str, Any]:
    if row is None or row["worst"] is None:
        return {"text": "-", "mean": "", "heat": "0"}
    metric = METRICS[id_]
    entry = document["histograms"][id_]
    edges = [number(edge) for edge in entry["edges"]]
    worst = number(row["worst"])
    bins = len(edges) - 1
    at = next((k for k in range(bins) if worst < edges[k + 1]), bins - 1)
    bad = (at + 1) / bins if metric.best == "low" else 1 - at / bins
    return {"text": figure(row["worst"], metric.unit), "mean": figure(row["mean"], metric.unit),
            "heat": f"{max(0.0, bad - 0.4) * 0.75:.2f}"}  # fmt: skip


def _rosetta(document: Summary) -> dict[str, Any] | None:
    rosetta = document.get("rosetta")
    if rosetta is None:
        return None
    systems = [
        {
            "name": system["profile"],
            "title": system["title"],
            "verdict": system["verdict"],
            "words": verdict_words(system),
            "because": [_because(rule) for rule in system["because"]],
        }
        for system in rosetta["systems"]
    ]  # fmt: skip
    families = []
    for family in rosetta["families"]:
        rows = [
            [
                member["system"],
                member["name"],
                beside(member["worst"], member["limit"], member["unit"]),
                figure(member["mean"], member["unit"]),
                "" if member["limit"] is None else f"{number(member['limit']):.6g}",
                member["state"] or "",
                member["scale"],
                {"": "{}", "1-x": "1 - {}", "1/x": "1 / {}"}[member["transform"]].format(member["metric"]),
            ]
            for member in family["members"]
            if member["count"] or member["undefined"]
        ]
        if rows:
            families.append({"title": family["title"], "rows": rows})
    return {"systems": systems, "families": families}


def _because(rule: dict[str, Any]) -> str:
    if rule["state"] == "incomplete":
        return f"{cut(rule['name'])}: {cut(rule['reason'])}"
    mark = "" if rule["verified"] else " (unverified)"
    return f"{cut(rule['name'])} {measured_text(rule)}, limit {rule_limit(rule)}{mark} on {rule['on']}"


def _finding(finding: dict[str, Any]) -> dict[str, Any]:
    entity = finding["entity"]
    ids = finding["ids"][:_MOST_IDS]
    return {
        "severity": finding["severity"],
        "code": finding["code"],
        "count": plural(finding["count"], entity),
        "message": cut(finding["message"], 1500),
        "ids": ids,
        "entity": entity if entity in ("cell", "face", "point") else "",
        "more": max(0, finding["count"] - len(ids)),
    }


def _missing(document: Summary) -> dict[str, Any]:
    """Counts of values that are not there: undefined, of no shape, and metrics that no cell here has."""
    undefined = []
    for id_, figures in document["metrics"].items():
        n = sum(f["undefined"] for f in figures.values())
        broken = sum(f["degenerate"] for f in figures.values())
        if n or broken:
            undefined.append([METRICS[id_].title, id_, size(n), size(broken)])
    absent = [id_ for id_, figures in document["metrics"].items() if not figures]
    return {"undefined": undefined, "absent": absent, "others": [i for i in METRICS if i not in document["metrics"]]}


def _surface(document: Summary) -> list[list[str]] | None:
    surface = document.get("surface")
    if surface is None:
        return None
    rows = []
    for id_, figures in surface["metrics"].items():
        unit = document["definitions"][id_]["unit"]
        for kind, f in figures.items():
            rows.append(
                [METRICS[id_].title, kind, size(f["count"]), *(figure(f[k], unit) for k in ("min", "mean", "max"))]
            )
    return rows


def _repair(repair: dict[str, Any]) -> dict[str, Any]:
    before, after = repair["before"], repair["after"]
    rows = []
    for id_ in before["metrics"]:
        if id_ not in after["metrics"] or METRICS[id_].best == "none":
            continue
        unit = before["definitions"][id_]["unit"]
        for kind in before["metrics"][id_]:
            if kind in after["metrics"][id_]:
                end = "max" if METRICS[id_].worst_is_high else "min"
                a, b = before["metrics"][id_][kind], after["metrics"][id_][kind]
                rows.append([METRICS[id_].title, kind, figure(a[end], unit), figure(b[end], unit),
                             figure(a["mean"], unit), figure(b["mean"], unit)])  # fmt: skip
    return {
        "rows": rows,
        "passes": [(cut(p["name"]), size(p["changed"]), cut(p["note"], 300)) for p in repair["passes"]],
        "moved": size(repair["moved_points"]),
        "deviation": figure(repair["max_deviation"], "L"),
        "kept": repair["zones_kept"],
        "refused": [cut(text, 300) for text in repair["refused"]],
    }
