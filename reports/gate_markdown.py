"""The gate and the comparison of systems in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from meshwright.reports.limits import (
    baseline_text,
    beside,
    beyond_text,
    measured_text,
    on_text,
    rule_limit,
    state_text,
    verdict_words,
    worst_text,
)
from meshwright.reports.wording import figure, markdown, number, plural

__all__ = ["gate_sections", "rosetta_sections"]


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, [":--"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def gate_sections(gate: dict[str, Any]) -> Iterator[str]:
    """A table of rules with their sources; nothing where there are none."""
    if not gate["rules"] and not gate["not_applicable"]:
        return
    file = Path(gate["file"]).name if gate["file"] else None
    yield f"### Gate {' and '.join(markdown(x) for x in (gate['profile'], file) if x)}"
    based = any(rule["baseline"] is not None for rule in gate["rules"])
    rows = [
        (
            f"**{state_text(rule)}**" if rule["state"] != "pass" else "pass",
            markdown(rule["name"]),
            markdown(on_text(rule)),
            markdown(rule_limit(rule)),
            markdown(measured_text(rule)),
            *((markdown(baseline_text(rule)) if rule["baseline"] is not None else "",) if based else ()),
            markdown(beyond_text(rule)),
            markdown(worst_text(rule["worst"], gate["dialect"]), none="") if rule["worst"] else "",
            markdown(rule["source"], 300) + ("" if rule["verified"] else " (unverified)") if rule["source"] else "",
        )
        for rule in gate["rules"]
    ]
    passed = [row for row in rows if row[0] == "pass"]
    if rows:
        header = ("State", "Rule", "On", "Limit", "Measured", *(("Baseline",) if based else ()))
        header = (*header, "Beyond", "Worst", "Source")
        if len(passed) < len(rows):
            yield _table(header, [row for row in rows if row[0] != "pass"])
        if passed:
            yield f"<details>\n<summary>{plural(len(passed), 'rule')} passed</summary>"
            yield _table(header, passed)
            yield "</details>"
    for rule in gate["rules"]:
        if rule["reason"] and rule["state"] != "incomplete":
            yield f"`{rule['id'].replace('`', '')}`: {markdown(rule['reason'], 300)}"
    if gate["not_applicable"]:
        yield "Not applicable to this mesh: " + ", ".join(f"`{entry['id']}`" for entry in gate["not_applicable"])


def rosetta_sections(rosetta: dict[str, Any] | None) -> Iterator[str]:
    """Which system would accept the mesh; every quantity under every convention."""
    if rosetta is None:
        return
    yield "### Systems"
    rows = []
    for system in rosetta["systems"]:
        reasons = [
            f"{markdown(rule['name'])} {markdown(measured_text(rule))}, limit {markdown(rule_limit(rule))}"
            for rule in system["because"]
            if rule["state"] != "incomplete"
        ]
        rows.append((f"`{system['profile']}`", markdown(verdict_words(system)), "; ".join(reasons)))
    yield _table(("System", "Verdict", "Because"), rows)
    for family in rosetta["families"]:
        members = [member for member in family["members"] if member["count"] or member["undefined"]]
        if members:
            yield f"**{family['title']}**"
            yield _table(
                ("System", "Quantity", "Worst", "Mean", "Limit", "Verdict", "Scale", "Made of"), map(_row, members)
            )


def _row(member: dict[str, Any]) -> tuple[str, ...]:
    formula = {"": "`{}`", "1-x": "1 - `{}`", "1/x": "1 / `{}`"}[member["transform"]].format(member["metric"])
    return (
        markdown(member["system"]),
        markdown(member["name"]),
        markdown(beside(member["worst"], member["limit"], member["unit"])),
        markdown(figure(member["mean"], member["unit"])),
        "" if member["limit"] is None else f"{number(member['limit']):.6g}",
        member["state"] or "",
        member["scale"],
        formula,
    )
