"""A comparison as a text page and as Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from meshwright.audit.metrics import METRICS
from meshwright.reports.comparison import Comparison
from meshwright.reports.gate_text import STYLES
from meshwright.reports.layout import Column, Grid, page_text
from meshwright.reports.text_tables import section
from meshwright.reports.wording import figure, markdown, name, plural, size

__all__ = ["conclusion", "delta_rows", "matching_lines", "render_markdown", "render_text"]

_MOST_ROWS = 40


def conclusion(comparison: Comparison) -> str:
    """The one sentence that most readers want."""
    if comparison["worse"]:
        return f"{plural(len(comparison['worse']), 'figure')} got worse"
    if comparison["cautions"]:
        return "nothing that both sides measured got worse, but not everything can be compared"
    return "nothing got worse"


def matching_lines(comparison: Comparison) -> list[str]:
    """What became of the cells, in sentences."""
    matching = comparison["matching"]
    if matching is None:
        return ["cells are not matched: that takes both meshes, and not saved audits"]
    lines = []
    if matching["scale"] != 1.0:
        lines.append(f"the whole mesh is scaled by {matching['scale']:.9g}: another unit of length?")
    if any(matching["shift"]):
        lines.append(f"the whole mesh is moved by ({', '.join(f'{x:.6g}' for x in matching['shift'])})")
    counts = [f"{size(matching['same'])} the same"]
    counts += [f"{size(matching[key]['count'])} {key}" for key in ("moved", "added", "removed")]
    lines.append(f"cells: {', '.join(counts)}")
    if matching["moved"]["count"]:
        lines.append(f"corners moved by up to {matching['moved']['largest']:.4g}")
    for key in ("moved", "added", "removed"):
        entry = matching[key]
        if entry["count"]:
            more = ", …" if entry["count"] > 8 else ""
            lines.append(f"{key}: cells {', '.join(map(str, entry['ids'][:8]))}{more}")
    lines += [
        f"{plural(change['count'], 'cell')} from zone {name(change['before'])} to {name(change['after'])}"
        for change in matching["zone_changed"][:8]
    ]
    for entry in matching["worse"][:8]:
        first = entry["cells"][0]
        lines.append(
            f"{entry['metric']}: {plural(entry['count'], 'matched cell')} worse, most of all cell {first['cell']}, "
            f"{figure(first['before'])} to {figure(first['after'])}"
        )
    return lines


def delta_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """(metric, key, worst before, worst after, mean before, mean after, undefined, which way), worse ones first."""
    rows = []
    for entry in comparison["metrics"]["changed"]:
        unit = METRICS[entry["metric"]].unit if entry["metric"] in METRICS else "1"
        end = "max" if entry["best"] == "low" else "min"
        cells = [entry["metric"], entry["key"]]
        for item in (end, "mean"):
            cells += ["-" if side is None else figure(side[item], unit) for side in (entry["before"], entry["after"])]
        lost = ["-" if side is None else size(side["undefined"]) for side in (entry["before"], entry["after"])]
        cells.append(lost[0] if lost[0] == lost[1] else f"{lost[0]} to {lost[1]}")
        way = "worse" if entry["worse"] else "better" if entry["better"] else "changed"
        cells.append(f"{way}: {', '.join(entry[way])}" if way != "changed" else way)
        rows.append((0 if entry["worse"] else 1 if entry["better"] else 2, tuple(cells)))
    return [cells for _, cells in sorted(rows, key=lambda row: row[0])]


def render_text(comparison: Comparison, *, width: int, colour: bool) -> str:
    """The page for a terminal."""
    return page_text(_page(comparison), width, colour=colour)


def _page(comparison: Comparison) -> Iterator[RenderableType]:
    before, after = comparison["before"], comparison["after"]
    for word, side in (("before", before), ("after", after)):
        cells = ", ".join(f"{size(n)} {kind}" for kind, n in side["cells"].items())
        title = Text(f"{word:<7}", style="dim").append(name(side["path"], 60, "mesh"), "bold")
        yield title.append(f"  {cells}  ", "not bold").append(side["verdict"], STYLES[side["verdict"]])
    yield Text("")
    yield Text(conclusion(comparison), style="bold red" if comparison["worse"] else "bold green")
    for said in (*comparison["worse"][:12], *(f"note: {c}" for c in comparison["cautions"])):
        yield _small(name(said, 300))
    yield section("Cells", "matched by their places, not by their numbers")
    for line in matching_lines(comparison):
        yield _small(line)
    rows = delta_rows(comparison)
    if rows:
        yield section("Metrics", f"{comparison['metrics']['unchanged']} are unchanged")
        values = (Column("worst", "r"), Column("now", "r"), Column("mean", "r"), Column("now", "r"))
        columns = (Column("metric", cut=True), Column("on"), *values, Column("undefined", "r", optional=1), Column(""))
        grid = Grid(columns, gap=1)
        for row in rows[:_MOST_ROWS]:
            grid.add(*row, style="red" if row[-1].startswith("worse") else "")
        yield grid
        if len(rows) > _MOST_ROWS:
            yield _small(f"and {len(rows) - _MOST_ROWS} more: --format json has them all")
    yield from _zone_lines(comparison)
    changes = [
        f"{f['severity']} {f['code']}: {size(f['before'])} to {size(f['after'])}" for f in comparison["findings"]
    ]
    if changes:
        yield section("Findings")
        yield from map(_small, changes)
    if comparison["rules"]:
        yield section("Rules")
        for rule in comparison["rules"]:
            figures = f"{figure(rule['measured_before'])} to {figure(rule['measured_after'])}"
            yield _small(
                f"{name(rule['id'], 60)}: {rule['before'] or 'absent'} to {rule['after'] or 'absent'}, {figures}"
            )


def _zone_lines(comparison: Comparison) -> Iterator[RenderableType]:
    zones = comparison["zones"]
    lines = [f"lost: {z['entity']} zone {name(z['name'])}, {size(z['count'])}" for z in zones["lost"][:20]]
    lines += [f"new: {z['entity']} zone {name(z['name'])}, {size(z['count'])}" for z in zones["new"][:20]]
    lines += [f"renamed, it seems: {name(z['before'])} to {name(z['after'])}" for z in zones["maybe_renamed"][:20]]
    lines += [
        f"resized: {z['entity']} zone {name(z['name'])}, {size(z['before'])} to {size(z['after'])}"
        for z in zones["resized"][:20]
    ]
    lines += [
        f"worse: {name(z['zone'])}: {z['metric']} {figure(z['before'])} to {figure(z['after'])}"
        for z in zones["metrics"]
        if z["worse"]
    ][:20]
    if lines:
        yield section("Zones")
        yield from map(_small, lines)


def _small(text: str) -> RenderableType:
    return Padding(Text(text), (0, 0, 0, 2))


def render_markdown(comparison: Comparison) -> str:
    """The comparison for a pull request."""
    before, after = comparison["before"], comparison["after"]
    parts = ["<!-- meshwright compare -->", f"## {markdown(conclusion(comparison))}"]
    sides = [
        (
            word,
            markdown(side["path"], none="mesh"),
            ", ".join(f"{size(n)} {k}" for k, n in side["cells"].items()),
            f"**{side['verdict']}**",
        )
        for word, side in (("before", before), ("after", after))
    ]
    parts.append(_table(("", "Mesh", "Cells", "Verdict"), sides))
    parts += [f"- {markdown(text, 300)}" for text in comparison["worse"][:20]]
    parts += [f"Note: {markdown(text, 300)}." for text in comparison["cautions"]]
    parts.append("\n".join(f"- {markdown(line, 300)}" for line in matching_lines(comparison)))
    rows = delta_rows(comparison)
    if rows:
        shown = [tuple(markdown(cell) for cell in row) for row in rows[:_MOST_ROWS]]
        parts.append("<details>\n<summary>Metrics</summary>")
        parts.append(_table(("Metric", "On", "Worst before", "after", "Mean before", "after", "Undefined", ""), shown))
        parts.append("</details>")
    findings = [(f["severity"], f"`{f['code']}`", size(f["before"]), size(f["after"])) for f in comparison["findings"]]
    if findings:
        parts.append(_table(("Severity", "Finding", "Before", "After"), findings))
    return "\n\n".join(parts) + "\n"


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join("| " + " | ".join(line) + " |" for line in (header, [":--"] * len(header), *rows))
