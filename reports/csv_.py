"""CSV output: one long table, a figure a row, so that any two runs can be compared or filtered by a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import Any

from meshwright.audit.tables import BINNINGS
from meshwright.reports.outputs import Batch, Page
from meshwright.reports.wording import csv_cell

__all__ = ["COLUMNS", "render"]

COLUMNS = ("path", "table", "zone", "type", "item", "fluent", "icem", "value")
_STATISTICS = ("count", "undefined", "degenerate", "min", "max", "mean", "p50", "p95", "p99")
_OF_RULE = ("state", "stat", "limit", "measured", "beyond", "count", "undefined", "source", "verified")

Row = tuple[Any, ...]


def render(batch: Batch, page: Page) -> str:
    """Rows of `COLUMNS`.

    table: "quality", "equiangle_skew", "aspect_ratio", "gambit_class", a metric id, "finding", "rule", "system" or
    "rosetta". A rule has its id and what it is on under zone and type, and a row for each of `_OF_RULE`; a system
    (of a comparison) its name under zone; a form of a quantity its system under zone and its metric under type.
    zone: empty for the whole mesh.  item: which figure.  fluent, icem: labels of a bin on both scales.  Values are
    unrounded, and empty where not defined. A mesh that could not be read has one row, table "error".
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for document in batch.documents:
        path = csv_cell(document["mesh"]["path"])
        for row in _rows(document, page):
            writer.writerow((path, *map(_field, row)))
    for unread in batch.unread:
        writer.writerow((csv_cell(unread.path), "error", "", "", "", "", "", csv_cell(unread.message)))
    return stream.getvalue()


def _field(value: Any) -> Any:
    """A field: empty for None."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else value


def _rows(document: dict[str, Any], page: Page) -> Iterator[Row]:
    yield from _tables(document, None)
    for table in document["zone_tables"]:
        yield from _tables(table, "(no zone)" if table["zone"] is None else csv_cell(table["zone"]))
    if page.content == "tables":
        return
    for key, of_type in document["metrics"].items():
        for kind, figures in of_type.items():
            for item in _STATISTICS:
                yield key, None, kind, item, None, None, figures[item]
    for finding in document["findings"]:
        yield "finding", None, None, finding["code"], None, None, finding["count"]
    for rule in document["gate"]["rules"]:
        for item in _OF_RULE:
            value = csv_cell(rule[item]) if item == "source" else rule[item]
            yield "rule", rule["id"], rule["on"], item, None, None, value
    yield from _rosetta(document.get("rosetta", {"systems": [], "families": []}))
    yield "verdict", None, None, document["gate"]["verdict"], None, None, None


def _rosetta(rosetta: dict[str, Any]) -> Iterator[Row]:
    for system in rosetta["systems"]:
        for item in ("verdict", "rules", "against"):
            yield "system", system["profile"], None, item, None, None, system[item]
    for family in rosetta["families"]:
        for member in family["members"]:
            if member["count"] or member["undefined"]:
                for item in ("worst", "mean", "limit", "state"):
                    label = f"{family['id']}: {member['name']}: {item}"
                    yield "rosetta", member["system"], member["metric"], label, None, None, member[item]


def _tables(tables: dict[str, Any], zone: str | None) -> Iterator[Row]:
    for row in tables["quality"]:
        for item in ("count", "worst_equiangle_skew", "share_over_0_8"):
            yield "quality", zone, row["type"], item, None, None, row[item]
    for binning in BINNINGS:
        found = tables["distributions"][binning.id]
        for kind, counts in found["counts"].items():
            for k, (low, high) in enumerate(zip(binning.labels, binning.mirrored_labels, strict=True)):
                yield binning.id, zone, kind, "count", low, high, counts[k]
            yield binning.id, zone, kind, "undefined", None, None, found["undefined"][kind]
    classes = tables["gambit_classes"]
    for kind, counts in classes["counts"].items():
        for entry, n in zip(classes["classes"], counts, strict=True):
            yield "gambit_class", zone, kind, entry["name"], entry["range"], None, n
