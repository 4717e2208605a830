"""The gate and the comparison of systems on the text page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from meshwright.reports.layout import Column, Grid
from meshwright.reports.limits import (
    Sources,
    baseline_text,
    beside,
    beyond_text,
    measured_text,
    on_text,
    rule_limit,
    verdict_words,
    worst_text,
)
from meshwright.reports.text_tables import section
from meshwright.reports.wording import figure, name, number, plural

__all__ = ["STYLES", "gate_tables", "rosetta_tables"]

STYLES = {
    "pass": "green",
    "info": "cyan",
    "waived": "cyan",
    "warn": "yellow",
    "fail": "bold red",
    "incomplete": "magenta",
}
_MOST_SKIPPED = 6


def gate_tables(gate: dict[str, Any]) -> Iterator[RenderableType]:
    """A row per rule, what its worst entity is, the sources, and what does not apply."""
    if not gate["rules"] and not gate["not_applicable"]:
        return
    file = Path(gate["file"]).name if gate["file"] else ""
    title = " and ".join(name(x, 40) for x in (gate["profile"], file) if x)
    yield section(f"Gate {title}", "a value that equals its limit passes, but for < and >")
    sources = Sources()
    based = any(rule["baseline"] is not None for rule in gate["rules"])
    columns = (
        *(Column("state"), Column("rule", cut=True), Column("on", cut=True), Column("limit"), Column("measured", "r")),
        *((Column("baseline", "r"),) if based else ()),
        *(Column("beyond", "r"), Column("worst", cut=True, optional=1), Column("source")),
    )
    grid = Grid(columns, gap=1)
    for rule in gate["rules"]:
        grid.add(
            Text(rule["state"], style=STYLES[rule["state"]]),
            name(rule["name"], 60),
            name(on_text(rule), 80),
            rule_limit(rule),
            measured_text(rule),
            *((baseline_text(rule),) if based else ()),
            beyond_text(rule),
            worst_text(rule["worst"], gate["dialect"]) if rule["state"] not in ("pass", "incomplete") else "",
            sources.cite(name(rule["source"], 200), rule["verified"]) if rule["source"] else "-",
        )
    yield grid
    for rule in gate["rules"]:
        if rule["reason"] and rule["state"] != "incomplete":
            yield _small(f"{name(rule['id'], 80)}: {name(rule['reason'], 200)}{_until(rule)}")
    for preset in gate["presets"]:
        yield _small(f"preset {preset['name']}, version {preset['version']}, sha256 {preset['sha256'][:12]}")
    if gate["baseline"] and gate["baseline"]["sha256"]:
        yield _small(f"baseline: {name(gate['baseline']['path'], 80)}, version {name(gate['baseline']['version'], 20)}")
    for n, source, verified in sources:
        yield _small(f"{n}  {source}{'' if verified else ' (unverified)'}")
    skipped = gate["not_applicable"]
    if skipped:
        more = f" and {len(skipped) - _MOST_SKIPPED} more" if len(skipped) > _MOST_SKIPPED else ""
        ids = ", ".join(entry["id"] for entry in skipped[:_MOST_SKIPPED])
        yield _small(f"not applicable to this mesh: {ids}{more}")
    for note in gate["notes"]:
        yield _small(name(note, 300))


def _until(rule: dict[str, Any]) -> str:
    waiver = rule["waiver"]
    return f" (waived until {waiver['until']})" if waiver and not waiver["expired"] else ""


def _small(text: str) -> RenderableType:
    return Padding(Text(text, style="dim"), (0, 0, 0, 2))


def rosetta_tables(rosetta: dict[str, Any]) -> Iterator[RenderableType]:
    """Which system would accept the mesh and which rule refuses it; then every quantity under every convention."""
    yield section("Systems", "which would accept this mesh")
    grid = Grid((Column("system"), Column("verdict"), Column("because", cut=True)), gap=2)
    for system in rosetta["systems"]:
        reasons = [_reason(rule) for rule in system["because"]]
        more = system["against"] - len(reasons)
        verdict = Text(verdict_words(system), style=STYLES[system["verdict"]])
        first = reasons[0] if reasons else ""
        grid.add(system["profile"], verdict, first)
        for reason in reasons[1:]:
            grid.add("", "", reason)
        if reasons and more > 0:
            grid.add("", "", f"and {plural(more, 'more rule')}", style="dim")
    yield grid
    for family in rosetta["families"]:
        members = [member for member in family["members"] if member["count"] or member["undefined"]]
        if members:
            yield section(family["title"], "as each system spells it")
            yield _members(members)


def _reason(rule: dict[str, Any]) -> str:
    if rule["state"] == "incomplete":
        return f"{rule['name']}: {rule['reason']}"
    mark = "" if rule["verified"] else " (unverified)"
    return f"{rule['name']} {measured_text(rule)}, limit {rule_limit(rule)}{mark} on {rule['on']}"


def _members(members: list[dict[str, Any]]) -> Grid:
    columns = (
        *(Column("system"), Column("quantity", cut=True), Column("worst", "r"), Column("mean", "r", optional=1)),
        *(Column("limit", "r"), Column("verdict"), Column("scale", cut=True, optional=2), Column("made of", cut=True)),
    )
    grid = Grid(columns, gap=1)
    for member in members:
        formula = {"": "{}", "1-x": "1 - {}", "1/x": "1 / {}"}[member["transform"]].format(member["metric"])
        state = member["state"]
        grid.add(
            member["system"],
            member["name"],
            beside(member["worst"], member["limit"], member["unit"]),
            figure(member["mean"], member["unit"]),
            "" if member["limit"] is None else f"{number(member['limit']):.6g}",
            Text(state or "", style=STYLES.get(state or "", "")),
            member["scale"],
            formula,
        )
    return grid
