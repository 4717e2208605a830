"""GitLab's code quality report: https://docs.gitlab.com/ci/testing/code_quality/."""

from __future__ import annotations

import json

from meshwright.audit.errors import printable
from meshwright.audit.places import text
from meshwright.reports.outputs import Batch, Page
from meshwright.reports.results import LONGEST, file_uri, results
from meshwright.reports.wording import name

__all__ = ["render"]

_SEVERITIES = {"fail": "critical", "incomplete": "blocker", "warn": "major", "waived": "info", "info": "info"}


def render(batch: Batch, page: Page) -> str:
    """An entry for each result that did not pass."""
    del page
    gates = {d["mesh"]["path"] or "mesh": d["gate"]["file"] for d in batch.documents}
    entries = [
        {
            "description": text(name(result.message, 10 * LONGEST)),
            "check_name": text(name(result.rule, LONGEST)),
            "fingerprint": result.fingerprint,
            "severity": _SEVERITIES[result.state],
            "location": {"path": printable(file_uri(result.mesh, gates.get(result.mesh)), 1000), "lines": {"begin": 1}},
        }
        for result in results(batch)
        if result.state != "pass"
    ]
    return json.dumps(entries, indent=2, ensure_ascii=False) + "\n"
