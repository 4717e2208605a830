"""SARIF 2.1.0, for code scanning: https://docs.oasis-open.org/sarif/sarif/v2.1.0/."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import Any
from urllib.parse import quote

from meshwright.audit.places import text
from meshwright.reports.outputs import Batch, Page
from meshwright.reports.results import LONGEST, Result, file_uri, results
from meshwright.reports.verdicts import exit_status, worst_verdict
from meshwright.reports.wording import name

__all__ = ["render"]

_LEVELS = {"fail": "error", "incomplete": "error", "waived": "error", "warn": "warning", "info": "note", "pass": "none"}
_KINDS = {"pass": "pass", "incomplete": "open", "info": "informational"}
_MOST = 5000
"""Results that GitHub shows; those that matter most come first."""

_ORDER = ("fail", "incomplete", "warn", "waived", "info", "pass")


def render(batch: Batch, page: Page) -> str:
    """One run with all results, broken ones first; a waived failure is suppressed, with the reason."""
    del page
    found = sorted(results(batch), key=lambda result: _ORDER.index(result.state))
    gates = {d["mesh"]["path"] or "mesh": d["gate"]["file"] for d in batch.documents}
    rules: dict[str, dict[str, Any]] = {}
    for result in found:
        rules.setdefault(result.rule, _rule(result))
    index = {id_: k for k, id_ in enumerate(rules)}
    unread = [
        {"level": "error", "message": {"text": text(name(f"{u.path}: {u.message}", 10 * LONGEST))}}
        for u in batch.unread
    ]
    run = {
        "tool": {
            "driver": {
                "name": "meshwright",
                "version": version("meshwright"),
                "semanticVersion": version("meshwright"),
                "rules": list(rules.values()),
            }
        },
        "columnKind": "unicodeCodePoints",
        "invocations": [
            {
                "executionSuccessful": worst_verdict(batch) != "incomplete",
                "exitCode": exit_status(batch),
                **({"toolExecutionNotifications": unread} if unread else {}),
            }
        ],
        "results": [_result(r, index[r.rule], gates.get(r.mesh)) for r in found[:_MOST]],
        "properties": {"resultsLeftOut": max(0, len(found) - _MOST)},
    }
    document = {
        "$schema": "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json",
        "version": "2.1.0",
        "runs": [run],
    }
    return json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _rule(result: Result) -> dict[str, Any]:
    title = text(name(result.name, LONGEST))
    help_text = f"{title}. Source of the limit: {text(name(result.source, 300))}" if result.source else title
    return {
        "id": text(name(result.rule, LONGEST)),
        "shortDescription": {"text": title},
        "fullDescription": {"text": title},
        "help": {"text": help_text},
        "properties": {"tags": ["mesh-quality"]},
    }


def _result(result: Result, index: int, gate: str | None) -> dict[str, Any]:
    worst = result.worst
    properties: dict[str, Any] = {"state": result.state, **(result.figures or {})}
    if result.zone:
        properties["zone"] = text(name(result.zone, LONGEST))
    if worst is not None:
        properties["worst"] = {**worst, "zone": text(name(worst["zone"], LONGEST)) if worst["zone"] else None}
    found: dict[str, Any] = {
        "ruleId": text(name(result.rule, LONGEST)),
        "ruleIndex": index,
        "kind": _KINDS.get(result.state, "fail"),
        "level": _LEVELS[result.state] if result.state not in _KINDS else "none",
        "message": {"text": text(name(result.message, 10 * LONGEST))},
        "locations": [
            {
                "physicalLocation": {
                    "artifactLocation": {"uri": quote(text(file_uri(result.mesh, gate))[:1000])},
                    "region": {"startLine": 1},
                }
            }
        ],
        "partialFingerprints": {"meshwright/v1": result.fingerprint},
        "properties": properties,
    }
    if result.state == "incomplete":  # "open" results are not shown: what could not be checked has to be
        found |= {"kind": "fail", "level": "error"}
    if result.state == "waived":
        found["suppressions"] = [{"kind": "external", "justification": text(name(result.reason, 10 * LONGEST))}]
    return found
