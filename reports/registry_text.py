"""What the program knows, as text: metrics, checks, the applicability table, file formats."""

from __future__ import annotations

import math

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from meshwright.audit.cells import CELL_TYPES, LINEAR_TYPES, POLYTOPES
from meshwright.audit.findings import CHECKS, Check
from meshwright.audit.metrics import APPLICABILITY, DEFAULT, LEFT_OUT, METRICS, Metric, find
from meshwright.audit.profiles.quantities import QUANTITIES, Quantity
from meshwright.audit.readers import FORMATS
from meshwright.reports.layout import Column, Grid, page_text
from meshwright.reports.profile_text import limits_on
from meshwright.reports.writing import page_width, wants_colour

__all__ = ["applicability_table", "explain", "list_checks", "list_formats", "list_left_out", "list_metrics"]


def _print(*parts: RenderableType) -> str:
    return page_text(parts, page_width(), colour=wants_colour())


def list_metrics() -> str:
    """A line per metric."""
    table = Grid((Column("metric"), Column("title", cut=True), Column("best"), Column("defined on")), indent=0)
    for metric in METRICS.values():
        kinds = "all" if set(metric.on) >= set(LINEAR_TYPES + POLYTOPES) else " ".join(metric.on)
        kinds = {"cell": kinds, "face": f"faces ({kinds})", "point": "points"}[metric.entity]
        table.add(metric.id, metric.title, _best(metric), kinds)
    note = "" if len(DEFAULT) == len(METRICS) else f"\n`--metrics default` measures: {', '.join(DEFAULT)}"
    more = "meshwright explain METRIC tells more; --checks lists the checks, --left-out what is no metric here and why."
    return _print(table, Text(f"{note}\n{more}", style="dim"))


def list_checks() -> str:
    """A line per check, by its code."""
    table = Grid((Column("check"), Column("severity"), Column("what", cut=True)), indent=0)
    for check in CHECKS.values():
        table.add(check.code, check.severity, check.title)
    return _print(table, Text("\nmeshwright explain CHECK tells more.", style="dim"))


def list_left_out() -> str:
    """A line per name of another program that is no metric here."""
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(ratio=1, style="dim")
    for name, reason in LEFT_OUT.items():
        table.add_row(name, reason)
    return _print(table)


def _explain_check(check: Check) -> str:
    """Everything about one check."""
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(style="dim", no_wrap=True)
    table.add_column(ratio=1)
    table.add_row("looks for", " ".join((check.find.__doc__ or "").split()))
    table.add_row("severity", check.severity)
    table.add_row("because", check.reason)
    table.add_row("lists", f"{check.entity}s")
    if check.needs:
        table.add_row("looks at", f"meshes with {', '.join(check.needs)}")
    table.add_row("limits", "\n".join(limits_on(check.code)) or "no profile counts it")
    return _print(Text(check.code, style="bold").append(f"  {check.title}", style="not bold"), Text(""), table)


def _left_out(key: str) -> str | None:
    """What is said of a name that is no metric here, None for a name nobody knows."""
    words = key.casefold().replace("_", " ").strip()
    for name, reason in LEFT_OUT.items():
        spelled = name.casefold().replace("_", " ")
        if words in (spelled, spelled.partition(": ")[2], spelled.replace(": ", "."), spelled.partition(".")[2]):
            return _print(Text(name, style="bold").append("  no metric here", style="not bold"), Text(f"\n{reason}"))
    return None


def explain(key: str) -> str:
    """Everything about a metric or a check and who limits it; UsageError with near matches for an unknown one."""
    if key in QUANTITIES:
        return _explain_quantity(QUANTITIES[key])
    if key in CHECKS:
        return _explain_check(CHECKS[key])
    if key not in METRICS and (known := _left_out(key)) is not None:
        return known
    metric = find(key)
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(style="dim", no_wrap=True)
    table.add_column(ratio=1)
    table.add_row("formula", metric.formula)
    table.add_row("unit", _unit(metric.unit))
    table.add_row("range", f"{_end(metric.low)} to {_end(metric.high)}")
    table.add_row("best", _best(metric))
    mirrored = _mirrored(metric)
    if mirrored:
        table.add_row("other scale", mirrored)
    if metric.ideal is not None:
        table.add_row("perfect cell", f"{metric.ideal:g}")
    worth = "undefined (nan)" if math.isnan(metric.degenerate) else _end(metric.degenerate)
    table.add_row("degenerate cell", worth)
    _add_domain(table, metric)
    table.add_row("known as", "\n".join(metric.systems))
    table.add_row("source", metric.source)
    if metric.caveat:
        table.add_row("beware", metric.caveat)
    table.add_row("limits", "\n".join(limits_on(metric.id)) or "no profile limits it")
    return _print(Text(metric.id, style="bold").append(f"  {metric.title}", style="not bold"), Text(""), table)


def _explain_quantity(quantity: Quantity) -> str:
    """The same of a number of faces that only OpenFOAM's limits ask for."""
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(style="dim", no_wrap=True)
    table.add_column(ratio=1)
    table.add_row("formula", quantity.formula)
    table.add_row("unit", _unit(quantity.unit))
    table.add_row("range", f"{_end(quantity.low)} to {_end(quantity.high)}")
    table.add_row("best", "the lowest" if quantity.best == "low" else "the highest")
    table.add_row("defined on", "faces of a 3-D mesh")
    table.add_row("source", quantity.source)
    table.add_row("beware", "Measured where a limit asks for it, and no choice of --metrics.")
    table.add_row("limits", "\n".join(limits_on(quantity.id)) or "no profile limits it; a meshQualityDict may")
    return _print(Text(quantity.id, style="bold").append(f"  {quantity.title}", style="not bold"), Text(""), table)


def _add_domain(table: Table, metric: Metric) -> None:
    """What the metric is defined on and what not."""
    if metric.entity != "cell":
        kinds = "points that a cell uses" if metric.entity == "point" else f"{' and '.join(metric.on)} faces"
        table.add_row("defined on", kinds)
        return
    candidates = tuple(dict.fromkeys((*LINEAR_TYPES, *POLYTOPES, *metric.on)))
    for defined, title in {True: "defined on", False: "not defined on"}.items():
        titles = [CELL_TYPES[kind].title for kind in candidates if (kind in metric.on) == defined]
        if titles:
            table.add_row(title, ", ".join(titles))


def _end(value: float) -> str:
    return f"{value:g}"


def _unit(unit: str) -> str:
    words = {"1": "none", "deg": "degrees", "L": "length", "L2": "length squared", "L3": "length cubed"}
    return words.get(unit, unit)


def _best(metric: Metric) -> str:
    if metric.best == "none":
        return "neither end"
    end = metric.low if metric.best == "low" else metric.high
    word = "lowest" if metric.best == "low" else "highest"
    return f"{_end(end)}, the {word}" if math.isfinite(end) else f"the {word}"


def _mirrored(metric: Metric) -> str:
    """How systems with the opposite scale show the same quantity."""
    if metric.best == "low" and (metric.low, metric.high) == (0.0, 1.0):
        return "1 - value on scales where 1 is best, as ICEM's"
    if metric.best == "low" and metric.low == 1.0:
        return "1 / value on scales from 0 to 1 where 1 is best, as ICEM's"
    if metric.best == "high" and (metric.low, metric.high) == (0.0, 1.0):
        return "1 - value on scales where 0 is best, as Fluent's and GAMBIT's"
    return ""


def applicability_table(output: str) -> str:
    """Which of GAMBIT's parameters is defined for which type of element: text, md, csv or json."""
    header = ["Parameter", *LINEAR_TYPES]
    rows = [[title, *("y" if on[kind] else "-" for kind in LINEAR_TYPES)] for title, _, on in APPLICABILITY]
    if output == "json":
        import json  # noqa: PLC0415 - wanted by one format

        defined = {key: {"title": title, "defined": on} for title, key, on in APPLICABILITY}
        return json.dumps(defined, indent=2) + "\n"
    if output == "csv":
        return "".join(",".join(line) + "\n" for line in [header, *rows])
    if output == "md":
        lines = [header, [":--"] + [":-:"] * len(LINEAR_TYPES), *rows]
        return "".join("| " + " | ".join(line) + " |\n" for line in lines)
    table = Grid((*(Column(title) for title in header), Column("metric", style="dim")), indent=0)
    for row, (_, key, _on) in zip(rows, APPLICABILITY, strict=True):
        table.add(*row, key)
    return _print(table, Text("\ny defined   - not defined", style="dim"))


def list_formats() -> str:
    """A line per format that can be read."""
    table = Grid((Column("format"), Column("files"), Column("what", cut=True)), indent=0)
    for row in FORMATS:
        table.add(row.name, " ".join(row.suffixes), row.title)
    return _print(table, Text("\nThe content decides, not the suffix.", style="dim"))
