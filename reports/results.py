"""What an audit says to a CI system: one result a rule, a zone and a mesh, never one a cell."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Literal

from meshwright.reports.limits import beyond_text, measured_text, on_text, rule_limit, worst_text
from meshwright.reports.outputs import Batch
from meshwright.reports.wording import name, size

__all__ = ["LONGEST", "Result", "file_uri", "results"]

State = Literal["pass", "info", "waived", "warn", "fail", "incomplete"]

LONGEST = 200
"""Characters of a foreign name at most; the whole name stands in the JSON document."""


@dataclass(frozen=True)
class Result:
    """One result.

    mesh: path as given.  rule: stable id of a rule or code of a finding; "not-readable" and "not-decided" for what
    could not be checked.  zone: the zone it is about, "" for the whole mesh.  message: one line for people.
    worst: entry of the worst entity, None for none.  figures: for programs.  fingerprint: the same in every run for the
    same rule, zone and mesh, whatever the values.
    """

    mesh: str
    rule: str
    name: str
    zone: str
    state: State
    message: str
    source: str = ""
    worst: dict[str, Any] | None = None
    figures: dict[str, Any] | None = None
    reason: str = ""

    @property
    def broken(self) -> bool:
        """Whether somebody should look at it."""
        return self.state in ("warn", "fail", "incomplete")

    @property
    def fingerprint(self) -> str:
        """64 hexadecimal digits of mesh, rule and zone."""
        text = "\0".join((self.mesh, self.rule, self.zone)).encode("utf-8", "surrogatepass")
        return hashlib.sha256(text).hexdigest()


def results(batch: Batch) -> Iterator[Result]:
    """All results of a run, mesh by mesh in the order of the arguments: rules, findings, then what is not known."""
    for document in batch.documents:
        yield from _of_document(document)
    for unread in batch.unread:
        yield Result(unread.path, "not-readable", "mesh could not be read", "", "incomplete", unread.message)


def _of_document(document: dict[str, Any]) -> Iterator[Result]:
    mesh, gate = document["mesh"]["path"] or "mesh", document["gate"]
    for rule in gate["rules"]:
        yield from _of_rule(mesh, rule, gate["dialect"])
    for finding in document["findings"]:
        state: State = {"error": "fail", "warning": "warn"}.get(finding["severity"], "info")  # type: ignore[assignment]
        if state != "info":
            figures = {"count": finding["count"], "entity": finding["entity"], "ids": finding["ids"][:10]}
            message = f"{finding['code']}: {finding['message']}"
            title = finding["code"].replace("-", " ")
            yield Result(mesh, finding["code"], title, "", state, message, figures=figures)
    covered = {f"{rule['name']} is not decided: {rule['reason']}" for rule in gate["rules"]}
    reasons = [reason for reason in gate["reasons"] if reason not in covered]
    if reasons:
        undecided: State = "incomplete" if gate["verdict"] == "incomplete" else "warn"
        yield Result(mesh, "not-decided", "not everything was measured", "", undecided, "; ".join(reasons))


def _of_rule(mesh: str, rule: dict[str, Any], dialect: dict[str, str] | None) -> Iterator[Result]:
    """One result, or of a broken rule one for each zone that holds what is beyond the limit."""
    figures = {
        key: rule[key] for key in ("metric", "stat", "measured", "limit", "unit", "count", "beyond", "undefined")
    }
    own = rule["zone"] or ""
    zones = [entry for entry in rule["zones"] if entry["zone"]]
    if not zones or own or rule["state"] == "pass":
        message = _message(rule, rule["worst"], "", dialect)
        yield Result(mesh, rule["id"], rule["name"], own, rule["state"], message, rule["source"], rule["worst"],
                     figures, rule["reason"])  # fmt: skip
        return
    for entry in zones:
        here = {**figures, "beyond_in_zone": entry["beyond"]}
        said = f"{size(entry['beyond'])} beyond it in zone {name(entry['zone'], LONGEST)}"
        message = _message(rule, entry["worst"], said, dialect)
        yield Result(mesh, rule["id"], rule["name"], entry["zone"], rule["state"], message, rule["source"],
                     entry["worst"], here, rule["reason"])  # fmt: skip


def _message(rule: dict[str, Any], worst: dict[str, Any] | None, there: str, dialect: dict[str, str] | None) -> str:
    """'Equi-angle skew on tet is 0.96, limit ≤ 0.95: 12, 0.3 % beyond it; worst: cell 7 in zone air at (0, 1, 2)'."""
    if rule["measured"] is None:
        return f"{name(rule['name'], LONGEST)} on {on_text(rule)}: {name(rule['reason'], 2 * LONGEST)}"
    figure = measured_text(rule)
    text = f"{name(rule['name'], LONGEST)} on {on_text(rule)} is {figure}, limit {rule_limit(rule)}"
    if rule["state"] == "pass":
        return text
    text += f": {there or f'{beyond_text(rule)} beyond it'}"
    if worst is not None:
        x, y, z = (f"{float(c):.6g}" for c in worst["centroid"])
        text += f"; worst: {worst_text(worst, dialect)} at ({x}, {y}, {z})"
    if rule["reason"]:
        text += f" ({name(rule['reason'], LONGEST)})"
    return text


def file_uri(path: str, fallback: str | None = None) -> str:
    """A path relative to the checkout with forward slashes, for tools that show results beside files of it.

    A path outside of the checkout is of no use there: then `fallback` is told, a file inside that is as good.
    """
    root = Path(os.environ.get("GITHUB_WORKSPACE") or os.environ.get("CI_PROJECT_DIR") or Path.cwd())
    for candidate in (path, fallback):
        if not candidate or "\0" in candidate:
            continue
        try:
            inside = Path(os.path.abspath(candidate)).relative_to(os.path.abspath(root))  # noqa: PTH100 - links stay
        except (ValueError, OSError):
            continue
        return str(PurePosixPath(*inside.parts))
    return PurePosixPath(path.replace("\0", "").replace("\\", "/")).name or "mesh"
