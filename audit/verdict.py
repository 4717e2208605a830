"""The part of a document that judges: the verdict, the rules, what they were judged by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.mesh import Mesh
from meshwright.audit.places import text
from meshwright.audit.profiles.baseline import Baseline
from meshwright.audit.profiles.model import Preset, Profile
from meshwright.audit.profiles.rule import Judgement
from meshwright.audit.tables import Tables

__all__ = ["gate_section"]


def gate_section(
    mesh: Mesh,
    tables: Tables,
    metrics: dict[str, Any],
    findings: list[dict[str, Any]],
    judgements: Sequence[Judgement],
    baseline: Baseline | None,
) -> dict[str, Any]:
    """The verdict: of the findings, of what could not be measured, and of the rules of all profiles."""
    unmeasured = []
    for k, name in enumerate(tables.types):
        n = int(tables.cells[0, k])
        if n and not any(name in of_type for of_type in metrics.values()):
            cells = "cell" if n == 1 else "cells"
            unmeasured.append(f"{n:,} {CELL_TYPES[name].title} {cells}: no chosen metric is defined for this type")
    undefined = []
    for key, of_type in metrics.items():
        n = sum(figures["undefined"] for figures in of_type.values())
        if n:
            undefined.append(f"{key} has no value on {n:,} {'cell' if n == 1 else 'cells'}")
    for judgement in judgements:
        if not judgement.rules:
            unmeasured.append(f"no limit of {text(judgement.profile.name)} applies to this mesh")
        unmeasured += [
            f"{text(rule.limit.name)} is not decided: {text(rule.reason)}"
            for rule in judgement.rules
            if rule.state == "incomplete"
        ]
    if baseline is not None and baseline.document is None:  # it was asked for, whether or not a rule needs it
        unmeasured.append(text(baseline.trouble))
    severities = {finding["severity"] for finding in findings}
    states = {judgement.state for judgement in judgements}
    if mesh.n_nonfinite:  # nothing can be said about such a mesh, good or bad
        unmeasured.append(f"{mesh.n_nonfinite:,} points have a coordinate that is not a finite number")
        verdict = "incomplete"
    elif "error" in severities or "fail" in states:
        verdict = "fail"
    elif unmeasured:
        verdict = "incomplete"
    else:
        verdict = "warn" if undefined or "warning" in severities or "warn" in states else "pass"
    profiles = [judgement.profile for judgement in judgements]
    dialect = next((p.dialect for p in profiles if not p.file), None)
    return {
        "profile": next((p.name for p in profiles if not p.file), None),
        "verdict": verdict,
        "rules": [rule.as_json() for judgement in judgements for rule in judgement.rules],
        "reasons": list(dict.fromkeys([*unmeasured, *undefined])),
        "file": next((text(p.file) for p in profiles if p.file), None),
        "not_applicable": [
            {"id": skipped.id, "reason": skipped.reason}
            for judgement in judgements
            for skipped in judgement.not_applicable
        ],
        "dialect": None if dialect is None else asdict(dialect),
        "notes": [text(note) for p in profiles for note in p.notes],
        "presets": [asdict(preset) for preset in _presets(profiles)],
        "baseline": None if baseline is None else _baseline(baseline),
        "waivers": [
            {"rule": w.rule, "zone": text(w.zone) or None, "reason": text(w.reason), "until": w.until.isoformat()}
            for p in profiles
            for w in p.waivers
        ],
    }


def _presets(profiles: Sequence[Profile]) -> list[Preset]:
    """The editions of the program's own profiles that were judged by."""
    found = [p for profile in profiles for p in profile.presets]
    found += [Preset(p.name, p.version, p.sha256) for p in profiles if p.sha256 and not p.presets]
    return list(dict.fromkeys(found))


def _baseline(baseline: Baseline) -> dict[str, Any]:
    document = baseline.document
    return {
        "path": text(baseline.path),
        "sha256": baseline.sha256 or None,
        "version": None if document is None else document["version"],
        "mesh": None if document is None else text(str(document["mesh"]["path"])),
        "trouble": text(baseline.trouble),
    }
