"""Text output: the page a person reads in a terminal, plain where it is not one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from meshwright.audit.cells import CELL_TYPES
from meshwright.reports.gate_text import gate_tables, rosetta_tables
from meshwright.reports.layout import Column, Grid, page_text
from meshwright.reports.outputs import Batch, Page
from meshwright.reports.text_tables import (
    article_tables,
    metric_table,
    section,
    type_title,
    worst_tables,
    zone_figures,
    zone_table,
    zones_left_out,
)
from meshwright.reports.verdicts import worst_verdict
from meshwright.reports.wording import name, number, plural, size

__all__ = ["render"]

_STYLES = {
    "pass": "bold green",
    "warn": "bold yellow",
    "fail": "bold red",
    "incomplete": "bold magenta",
    "error": "bold red",
    "warning": "yellow",
    "info": "cyan",
}
_SEVERITIES = ("error", "warning", "info")
_IDS_SHOWN = 6


def render(batch: Batch, page: Page) -> str:
    """The whole report of one mesh; for several a line each, since nobody reads ten reports in a row."""
    parts: Iterable[RenderableType]
    if page.content == "tables":
        parts = [part for document in batch.documents for part in _tables_page(document, page)]
    elif len(batch.documents) == 1 and not batch.unread:
        parts = _report(batch.documents[0], page)
    else:
        parts = _overview(batch)
    return page_text(parts, page.width, colour=page.colour)


def _report(document: dict[str, Any], page: Page) -> Iterator[RenderableType]:
    yield from _title(document, page, document["gate"]["verdict"])
    yield _facts(document)
    yield from _verdict(document, page)
    yield from gate_tables(document["gate"])
    if "rosetta" in document:
        yield from rosetta_tables(document["rosetta"])
    yield from article_tables(document)
    if any(document["metrics"].values()):
        yield section("Metrics", "clamped to the range of each metric; * marks the end that is worse")
        yield from metric_table(document)
        yield from worst_tables(document)
    if document["zones"]:
        yield _zones_title(document["gate"]["dialect"])
        yield zone_table(document)
        if left_out := zones_left_out(document):
            yield Text(f"  {left_out}", style="dim")
    if "surface" in document:
        yield section("Boundary surface", "measured as a shell of its own")
        yield from article_tables(document["surface"])
    if document["notes"]:
        yield section("Notes", "what the file holds and this audit does not")
        for note in document["notes"]:
            yield _item(name(note, 600))


def _zones_title(dialect: dict[str, str] | None) -> RenderableType:
    if dialect is None:
        return section("Zones")
    return section(dialect["zones"][0].upper() + dialect["zones"][1:], dialect["note"])


def _tables_page(document: dict[str, Any], page: Page) -> Iterator[RenderableType]:
    yield from _title(document, page, "")
    yield from article_tables(document)
    if page.zones:
        for table in document["zone_tables"]:
            yield section(f"Zone {name(table['zone'], 60)}", plural(table["count"], "cell"))
            yield from article_tables(table)


def _title(document: dict[str, Any], page: Page, verdict: str) -> Iterator[RenderableType]:
    room = page.width - len(verdict) - 2
    path = document["mesh"]["path"] or "(mesh in memory)"
    # The end of a path tells files apart.
    shown = name(path if len(path) <= room else f"…{path[1 - room :]}", room)
    line = Text(f"\n{shown}", style="bold", no_wrap=True, overflow="ignore")
    if verdict:
        line.append(" " * (page.width - len(shown) - len(verdict)))
        line.append(verdict.upper(), style=_STYLES[verdict])
    yield line
    yield Text("─" * page.width, style="dim")


def _facts(document: dict[str, Any]) -> Grid:
    mesh = document["mesh"]
    grid = Grid((Column(style="dim"), Column()), indent=0)
    surface = "" if any(CELL_TYPES[kind].dimension == mesh["dimension"] for kind in mesh["cells"]) else ", surface only"
    order = "second order" if mesh["order"] == 2 else "first order"
    grid.add("format", f"{mesh['format'] or '-'}, {mesh['dimension']}-D{surface}, {order}")
    grid.add("cells", size(sum(mesh["cells"].values())))
    if len(mesh["cells"]) > 1:
        for kind, n in mesh["cells"].items():
            grid.add("", f"{size(n)} {type_title(kind)}")
    else:
        grid.rows[-1][0][1].append(f" {type_title(next(iter(mesh['cells'])))}")
    grid.add("points", size(mesh["points"]))
    if mesh["bounds"] is not None:
        axes = zip("xyz"[: mesh["dimension"]], *mesh["bounds"], strict=False)
        grid.add("bounds", "   ".join(f"{axis} {low:.6g} to {high:.6g}" for axis, low, high in axes))
    if mesh["sha256"]:
        grid.add("sha256", mesh["sha256"])
    if document["selection"]:
        chosen = document["selection"]
        grid.add("only", f"zones {name(chosen['zone'])}, {plural(chosen['cells'], 'cell')}")
    return grid


def _verdict(document: dict[str, Any], page: Page) -> Iterator[RenderableType]:
    findings, gate = document["findings"], document["gate"]
    counts = {s: sum(f["severity"] == s for f in findings) for s in ("error", "warning")}
    words = [*_broken_rules(gate["rules"]), *(plural(n, severity) for severity, n in counts.items() if n)]
    line = Text("\n")
    line.append(gate["verdict"].upper(), style=_STYLES[gate["verdict"]])
    said = " and ".join(filter(None, (", ".join(words[:-1]), words[-1]))) if words else "no errors, no warnings"
    line.append(f"  {said}")
    yield line
    for reason in gate["reasons"]:
        yield _item(reason)
    if findings:
        yield section("Findings")
        for finding in sorted(findings, key=lambda f: _SEVERITIES.index(f["severity"])):
            yield from _finding(finding, page.width)


def _broken_rules(rules: list[dict[str, Any]]) -> list[str]:
    """What limits say: "2 rules failed", ..."""
    states = [rule["state"] for rule in rules]
    verbs = {"fail": "failed", "incomplete": "undecided", "warn": "warned"}
    return [f"{plural(states.count(s), 'rule')} {verb}" for s, verb in verbs.items() if s in states]


def _finding(finding: dict[str, Any], width: int) -> Iterator[RenderableType]:
    severity = finding["severity"]
    line = Text(f"  {severity:<9}", style=_STYLES[severity])
    line.append(finding["code"], style="bold default")
    if finding["entity"] != "zone":
        line.append(f"  {plural(finding['count'], finding['entity'])}", style="not bold default")
    for shown in range(min(_IDS_SHOWN, len(finding["ids"])), 0, -1):
        more = ", …" if finding["count"] > shown else ""
        ids = f"  {', '.join(map(str, finding['ids'][:shown]))}{more}"
        if len(line) + len(ids) <= width:
            line.append(ids, style="not bold dim default")
            break
    yield line
    text = Text(name(finding["message"], 600))
    if severity != "info" and finding["places"]:
        text.append(f"  (first at {'  '.join(f'{number(x):.6g}' for x in finding['places'][0])})", style="dim")
    yield Padding(text, (0, 0, 0, 11))


def _item(text: str) -> RenderableType:
    """A line of a list."""
    return Padding(Text(f"· {text}"), (0, 0, 0, 2))


def _overview(batch: Batch) -> Iterator[RenderableType]:
    """One line a mesh, then the verdict of the run."""
    numbers = ("cells", "worst skew", "> 0.8", "errors", "warnings")
    mesh = Column("mesh", cut=True, keep_end=True)
    grid = Grid((mesh, *(Column(title, "r") for title in numbers), Column("verdict")), indent=0)
    for document in batch.documents:
        severities = [finding["severity"] for finding in document["findings"]]
        verdict = document["gate"]["verdict"]
        grid.add(
            name(document["mesh"]["path"], 300),
            size(sum(document["mesh"]["cells"].values())),
            *zone_figures(document),
            size(severities.count("error")),
            size(severities.count("warning")),
            Text(verdict, style=_STYLES[verdict]),
        )
    for unread in batch.unread:
        grid.add(name(unread.path, 300), "-", "-", "-", "-", "-", Text("not read", style=_STYLES["incomplete"]))
    yield grid
    verdict = worst_verdict(batch)
    n = len(batch.documents) + len(batch.unread)
    line = Text(f"\n{verdict.upper()}", style=_STYLES[verdict])
    line.append(f"  {n} mesh{'es' if n != 1 else ''}", style="not bold default")
    yield line
