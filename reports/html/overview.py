"""The top of a report: what was audited, the verdict in figures, the rules."""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import Any

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import printable
from meshwright.audit.summary import Summary
from meshwright.audit.tables import SKEW
from meshwright.reports.html.fragments import mirrored
from meshwright.reports.limits import (
    baseline_text,
    beyond_text,
    measured_text,
    on_text,
    rule_limit,
    state_text,
    worst_text,
)
from meshwright.reports.wording import figure, number, percent, size

__all__ = ["cut", "facts_of", "figures_of", "gate_of", "title_of", "view_words"]

_NAME = 200


def cut(text: str, longest: int = _NAME) -> str:
    """A foreign text on one line, cut; how long it is, where it is cut."""
    shown = printable(text, longest)
    return f"{shown} ({size(len(text))} characters)" if len(text) > longest else shown


def title_of(document: Summary) -> str:
    """Name of the mesh, for the head of the page."""
    path = document["mesh"]["path"] or "mesh"
    return cut(PurePosixPath(path.replace("\\", "/")).name or path, 120)


def facts_of(document: Summary) -> list[tuple[str, str]]:
    """What was audited and by what it was judged, as (name, value)."""
    mesh, gate = document["mesh"], document["gate"]
    order = "second order" if mesh["order"] == 2 else "first order"
    found = [("format", f"{mesh['format']}, {mesh['dimension']}-D, {order}")]
    found.append(("cells", ", ".join(f"{size(n)} {CELL_TYPES[k].title}" for k, n in mesh["cells"].items())))
    if mesh["bounds"]:
        low, high = mesh["bounds"]
        found.append(("bounds", "  ".join(f"{a} {x:.5g} to {y:.5g}" for a, x, y in zip("xyz", low, high, strict=True))))
    if document["selection"]:
        chosen = document["selection"]
        found.append(("counted", f"{size(chosen['cells'])} cells of zones {cut(chosen['zone'])}"))
    judged = [cut(str(x)) for x in (gate["profile"], gate["file"]) if x]
    if judged:
        found.append(("judged by", " and ".join(judged)))
    found += [
        ("preset", f"{preset['name']} version {preset['version']}, sha256 {preset['sha256'][:12]}")
        for preset in gate.get("presets", [])
    ]
    baseline = gate.get("baseline")
    if baseline:
        trouble = (
            f": {cut(baseline['trouble'])}" if baseline["trouble"] else f", version {cut(str(baseline['version']))}"
        )
        found.append(("baseline", f"{cut(baseline['path'])}{trouble}"))
    if mesh["sha256"]:
        found.append(("sha256", mesh["sha256"]))
    return found


def figures_of(document: Summary) -> list[tuple[str, str]]:
    """The figures that most readers want, as (figure, what it is)."""
    mesh, gate = document["mesh"], document["gate"]
    found = [(size(sum(mesh["cells"].values())), "cells"), (size(mesh["points"]), "points")]
    skews = [number(q["worst_equiangle_skew"]) for q in document["quality"] if q["worst_equiangle_skew"] is not None]
    if skews:
        worst = max(skews)
        found.append((f"{figure(worst)} | {mirrored(SKEW, worst)}", "worst equi-angle skewness, Fluent | ICEM"))
    over = sum(q["over_0_8"] or 0 for q in document["quality"])
    whole = sum(q["count"] for q in document["quality"] if q["over_0_8"] is not None)
    if whole:
        found.append((f"{size(over)}, {percent(over, whole)}", "cells with skewness > 0.8 | ICEM < 0.2"))
    rules = gate["rules"]
    if rules:
        broken = sum(rule["state"] in ("fail", "warn", "incomplete") for rule in rules)
        found.append((f"{broken} of {len(rules)}", "rules not passed"))
    worst_findings = sum(f["severity"] in ("error", "warning") for f in document["findings"])
    found.append((str(worst_findings), "findings of errors and warnings"))
    return found


def _go(entry: dict[str, Any] | None) -> dict[str, Any] | None:
    """What a link into the view needs."""
    if entry is None:
        return None
    entity = next(key for key in ("cell", "face", "point") if key in entry)
    return {"entity": entity, "id": entry[entity]}


def gate_of(document: Summary) -> dict[str, Any]:
    """The rules, those that are broken first, with the sources they cite."""
    gate = document["gate"]
    rules = [
        {
            "state": rule["state"],
            "state_text": state_text(rule),
            "name": cut(rule["name"]),
            "id": cut(rule["id"]),
            "on": cut(on_text(rule)),
            "scale": rule.get("scale", ""),
            "limit": rule_limit(rule),
            "measured": measured_text(rule),
            "baseline": baseline_text(rule),
            "beyond": beyond_text(rule),
            "worst": worst_text(rule["worst"], gate["dialect"]).partition(" in ")[0],
            "worst_title": worst_text(rule["worst"], gate["dialect"]),
            "go": _go(rule["worst"]),
            "zones": [f"{cut(z['zone'], 60)}: {size(z['beyond'])}" for z in rule.get("zones", [])[:8] if z["zone"]],
            "source": cut(rule["source"], 300),
            "verified": rule["verified"],
            "reason": cut(rule["reason"], 400),
            "until": (rule.get("waiver") or {}).get("until", ""),
            "cite": 0,
        }
        for rule in gate["rules"]
    ]
    sources: dict[tuple[str, bool], int] = {}
    for rule in rules:
        if rule["source"]:
            rule["cite"] = sources.setdefault((rule["source"], rule["verified"]), len(sources) + 1)
    order = ("fail", "incomplete", "warn", "waived", "info", "pass")
    rules.sort(key=lambda rule: order.index(rule["state"]))
    return {
        "rules": rules,
        "sources": list(sources),
        "based": any(rule["baseline"] for rule in rules),
        "not_applicable": [(cut(e["id"]), cut(e["reason"])) for e in gate["not_applicable"]],
        "notes": [cut(note, 300) for note in gate["notes"]],
    }


def view_words(facts: dict[str, Any]) -> str:
    """What of the mesh is in the file, as a sentence."""
    shell = f"{size(facts['faces'])} boundary faces"
    if facts["thinned"]:
        shell += f", thinned from {size(facts['faces_of'])}"
    cells = "all cells" if facts["cells"] == facts["cells_of"] else (
        f"{size(facts['cells'])} of {size(facts['cells_of'])} cells: those of findings, the worst of every metric, and "
        "some of every bar"
    )  # fmt: skip
    return f"In this file: {shell}; {cells}."
