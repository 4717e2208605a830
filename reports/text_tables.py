"""The tables of the text page: the article's, GAMBIT's classes, metrics, worst cells, zones."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from meshwright.audit.cells import CELL_TYPES, POLYTOPES
from meshwright.audit.tables import BINNINGS, OVER, ROUNDING, SKEW
from meshwright.reports.layout import Column, Grid
from meshwright.reports.wording import figure, name, not_defined, number, percent, plural, size

__all__ = [
    "article_tables",
    "entity_number",
    "metric_table",
    "section",
    "type_title",
    "worst_tables",
    "zone_figures",
    "zone_table",
    "zones_left_out",
]

_MOST_ZONES = 30
_EIGHTHS = " ▏▎▍▌▋▊▉█"
_BAR = 24
_NOT_DEFINED = "not defined"
_POLYTOPE_HINT = "polyhedra: each face against the regular polygon; reflex corners and hanging nodes score 1"
"""Why a sound polyhedral mesh may have many cells of skew 1."""


def section(title: str, aside: str = "") -> RenderableType:
    """A heading with a blank line above it."""
    line = Text(f"\n{title}", style="bold")
    if aside:
        line.append(f"  {aside}", style="not bold dim")
    return line


def type_title(kind: str) -> str:
    """The article's spelling of a cell type: Hexahedron, Prism/Wedge, ..."""
    title = CELL_TYPES[kind].title
    return "Prism/Wedge" if kind == "wedge" else title[0].upper() + title[1:]


def article_tables(tables: dict[str, Any]) -> Iterator[RenderableType]:
    """The per-type table, both distributions and GAMBIT's classes."""
    yield section("Quality by type")
    yield _quality(tables)
    if any(row["type"] in POLYTOPES for row in tables["quality"]):
        yield Padding(Text(_POLYTOPE_HINT, style="dim"), (0, 0, 0, 2))
    for binning in BINNINGS:
        found = tables["distributions"][binning.id]
        if found["counts"]:
            yield section(binning.title)
            labels = list(zip(binning.labels, binning.mirrored_labels, strict=True))
            yield _counts(binning.columns, labels, found["counts"], found["undefined"])
            yield from _left_out(tables, found["counts"])
    classes = tables["gambit_classes"]
    if classes["counts"]:
        aside = f"mean {figure(classes['mean'])}; a high-quality mesh has about {classes['hint']}"
        yield section("GAMBIT classes of equi-angle skew", aside)
        labels = [(entry["name"], entry["range"].replace("<=", "≤")) for entry in classes["classes"]]
        undefined = tables["distributions"]["equiangle_skew"]["undefined"]
        yield _counts(("class", "range"), labels, classes["counts"], undefined)
        yield from _left_out(tables, classes["counts"])


def _left_out(tables: dict[str, Any], counts: dict[str, list[int]]) -> Iterator[RenderableType]:
    """A line under a table that does not count every cell."""
    if text := not_defined(tables, counts):
        yield Padding(Text(text, style="dim"), (0, 0, 0, 2))


def _quality(tables: dict[str, Any]) -> Grid:
    grid = Grid(
        (
            Column("Type", cut=True),
            Column("No. of elements", "r"),
            Column("Worst equi-angle skewness", "r", short="Worst skewness"),
            Column("% with skewness > 0.8 | ICEM < 0.2", "r", short="% > 0.8 | ICEM < 0.2"),
        )
    )
    undefined = tables["distributions"]["equiangle_skew"]["undefined"]
    for row in tables["quality"]:
        count = Text(size(row["count"]))
        if row["over_0_8"] is None:
            grid.add(type_title(row["type"]), count, _NOT_DEFINED, _NOT_DEFINED)
            continue
        worst = row["worst_equiangle_skew"]
        measured = row["count"] - undefined[row["type"]]
        style = "red" if worst is not None and worst > OVER else ""
        shown = "undefined" if worst is None else figure(worst)
        grid.add(type_title(row["type"]), count, Text(shown, style=style), percent(row["over_0_8"], measured))
    if len(tables["quality"]) > 1:
        grid.add("all", size(sum(row["count"] for row in tables["quality"])), *zone_figures(tables), style="bold")
    return grid


def _counts(
    columns: tuple[str, str], labels: list[tuple[str, str]], counts: dict[str, list[int]], undefined: dict[str, int]
) -> Grid:
    """Two label columns, a column of counts per type, their sum, its share and a bar."""
    kinds = list(counts) if len(counts) > 1 else []
    sums = [sum(of_kind[k] for of_kind in counts.values()) for k in range(len(labels))]
    total, longest = sum(sums), max(sums)
    grid = Grid(
        (
            *(Column(title) for title in columns),
            *(Column(kind, "r") for kind in kinds),
            Column("all" if kinds else "cells", "r"),
            Column("share", "r"),
            Column(" " * _BAR, optional=1, style="cyan"),
        )
    )
    for k, pair in enumerate(labels):
        each = [size(counts[kind][k]) for kind in kinds]
        style = "" if sums[k] else "dim"
        grid.add(*pair, *each, size(sums[k]), percent(sums[k], total), _bar(sums[k], longest), style=style)
    if any(undefined.values()):
        each = [size(undefined[kind]) for kind in kinds]
        grid.add("undefined", "", *each, size(sum(undefined.values())), style="red")
    return grid


def _bar(n: int, longest: int) -> str:
    """A bar in eighths of a character; whatever is not nothing shows."""
    if not n:
        return ""
    eighths = max(1, round(8 * _BAR * n / longest))
    return "█" * (eighths // 8) + _EIGHTHS[eighths % 8].strip()


def metric_table(document: dict[str, Any]) -> Iterator[RenderableType]:
    """A row per metric and type: smallest, middle, mean and largest value; the worse end marked."""
    metrics, definitions = document["metrics"], document["definitions"]
    any_undefined = any(f["undefined"] for of_type in metrics.values() for f in of_type.values())
    items = ("min", "p50", "mean", "p95", "max")
    optional = {"p95": 2, "p50": 1}
    grid = Grid(
        (
            Column("metric", cut=True),
            Column("type"),
            *(Column(f"{item} ", "r", optional=optional.get(item, 0)) for item in items),
            *([Column("undefined", "r", style="red")] if any_undefined else []),
        ),
        gap=1,
    )
    for key, of_type in metrics.items():
        worse = {"low": "max", "high": "min"}.get(definitions[key]["best"])
        shown = key
        for kind, figures in of_type.items():
            values = [figure(figures[i], definitions[key]["unit"]) + ("*" if i == worse else " ") for i in items]
            grid.add(shown, kind, *values, *([size(figures["undefined"])] if figures["undefined"] else []))
            shown = ""
    yield grid
    nowhere = [key for key, of_type in metrics.items() if not of_type]
    if nowhere:
        yield Padding(Text(f"not defined for these cells: {', '.join(nowhere)}", style="dim"), (0, 0, 0, 2))


def worst_tables(document: dict[str, Any]) -> Iterator[RenderableType]:
    """The worst cells by equi-angle skew over all types, then the worst cell, face or point of every other metric."""
    metrics = document["metrics"]
    judged = [key for key in metrics if document["definitions"][key]["best"] != "none" and _merged(document, key)]
    if not judged:
        return
    first = SKEW if SKEW in judged else judged[0]
    yield section(f"Worst cells by {first}")
    merged = _merged(document, first)
    longest = max(len(figures["worst"]) for figures in metrics[first].values())
    yield _cell_grid(document, [(first, kind, cell) for kind, cell in merged[:longest]], with_metric=False)
    others = [(key, *_merged(document, key)[0]) for key in judged if key != first]
    others = [row for row in others if not _perfect(document["definitions"][row[0]], row[2]["value"])]
    if others:
        yield section("Worst of every other metric", "those without a fault are left out")
        yield _cell_grid(document, others, with_metric=True)


def _cell_grid(document: dict[str, Any], rows: list[tuple[str, str, dict[str, Any]]], *, with_metric: bool) -> Grid:
    """Cells with their place; of a table that is too wide the place is left out first."""
    where = "number" if with_metric else "cell"
    word = _zone_word(document)
    columns = (Column(where, "r"), Column("type"), Column("value", "r"), Column(word, cut=True))
    grid = Grid(
        (
            *([Column("metric", cut=True)] if with_metric else []),
            *columns,
            Column("centroid", optional=int(with_metric)),
        )
    )
    places = [[f"{number(x):.4g}" for x in cell["centroid"]] for _, _, cell in rows]
    widths = [max(map(len, axis)) for axis in zip(*places, strict=True)]
    for (key, kind, cell), place in zip(rows, places, strict=True):
        grid.add(
            *([key] if with_metric else []),
            str(entity_number(cell)),
            kind,
            figure(cell["value"], document["definitions"][key]["unit"]),
            name(cell["zone"], 60, f"(no {word})"),
            "  ".join(x.rjust(width) for x, width in zip(place, widths, strict=True)),
        )
    return grid


def entity_number(entry: dict[str, Any]) -> int:
    """The file's own number of the cell, face or point of an entry of a list of worst values."""
    return next(int(entry[key]) for key in ("cell", "face", "point") if key in entry)


def _perfect(definition: dict[str, Any], value: Any) -> bool:
    """Whether a value is the best there is, to rounding."""
    best = definition["low"] if definition["best"] == "low" else definition["high"]
    return abs(number(value) - number(best)) <= ROUNDING


def _merged(document: dict[str, Any], key: str) -> list[tuple[str, dict[str, Any]]]:
    """The worst lists of all types as one, worst first."""
    sign = -1 if document["definitions"][key]["best"] == "low" else 1
    listed = [(kind, cell) for kind, figures in document["metrics"][key].items() for cell in figures["worst"]]
    return sorted(listed, key=lambda pair: sign * number(pair[1]["value"]))


def zone_table(document: dict[str, Any]) -> Grid:
    """The zones with their size; cell zones with their worst skew and share above 0.8; of many, the worst."""
    word = _zone_word(document)
    grid = Grid(
        (
            Column(word, cut=True),
            Column("kind", cut=True, optional=1),
            Column("role", cut=True),
            Column("size", "r"),
            Column("worst skew", "r"),
            Column("> 0.8", "r"),
        )
    )
    rows = list(_zones_with_tables(document))
    if len(rows) > _MOST_ZONES:
        rows.sort(key=lambda row: -_worst_skew(row[1]))
    for zone, measured in rows[:_MOST_ZONES]:
        figures = zone_figures(measured) if measured else ()
        words = (name(zone[key], 60) if zone[key] else "" for key in ("kind", "role"))
        grid.add(name(zone["name"], 60), *words, plural(zone["count"], zone["entity"]), *figures)
    for loose in document["zone_tables"]:
        if loose["zone"] is None:
            grid.add(f"(no {word})", "", "", plural(loose["count"], "cell"), *zone_figures(loose), style="dim")
    return grid


def _zone_word(document: dict[str, Any]) -> str:
    """What the system of the profile calls a zone of cells."""
    dialect = document["gate"]["dialect"]
    return "zone" if dialect is None else str(dialect["zone"])


def zones_left_out(document: dict[str, Any]) -> str:
    """What the table of zones does not show, "" for nothing."""
    left = len(document["zones"]) - _MOST_ZONES
    return f"… and {plural(left, 'more zone')}; the worst stand first" if left > 0 else ""


def _zones_with_tables(document: dict[str, Any]) -> Iterator[tuple[dict[str, Any], dict[str, Any] | None]]:
    """Each zone and its tables, None for faces and points; two zones of one name have theirs in the same order."""
    tables: dict[str, list[dict[str, Any]]] = {}
    for table in document["zone_tables"]:
        tables.setdefault(table["zone"], []).append(table)
    for zone in document["zones"]:
        of_name = tables.get(zone["name"]) if zone["entity"] == "cell" else None
        yield zone, of_name.pop(0) if of_name else None


def _worst_skew(tables: dict[str, Any] | None) -> float:
    """Largest equi-angle skew, -1 where none is measured."""
    worst = [row["worst_equiangle_skew"] for row in tables["quality"]] if tables else []
    return max((value for value in worst if value is not None), default=-1.0)


def zone_figures(tables: dict[str, Any]) -> tuple[str, str]:
    """Worst equi-angle skew and share above 0.8 over all types of a set of tables."""
    worst = [row["worst_equiangle_skew"] for row in tables["quality"] if row["worst_equiangle_skew"] is not None]
    measured = sum(map(sum, tables["gambit_classes"]["counts"].values()))
    over = sum(row["over_0_8"] or 0 for row in tables["quality"])
    return figure(max(worst, default=None)), percent(over, measured)
