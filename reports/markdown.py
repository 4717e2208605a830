"""Markdown output, for merge requests, wikis and job summaries."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.tables import BINNINGS
from meshwright.reports.gate_markdown import gate_sections, rosetta_sections
from meshwright.reports.outputs import Batch, Page
from meshwright.reports.text_tables import entity_number
from meshwright.reports.wording import figure, markdown, not_defined, percent, size

__all__ = ["MARKER", "comment", "render"]

MARKER = "<!-- meshwright -->"
"""First line of every comment, by which a bot finds its own to replace it."""

_LONGEST = 60_000
"""Characters; a comment of GitHub may have 65,536."""

_ALIGN = {"l": ":--", "r": "--:"}


def render(batch: Batch, page: Page) -> str:
    """A comment for a pull request, or the tables alone."""
    return comment(batch, page, _LONGEST)


def comment(batch: Batch, page: Page, longest: int) -> str:
    """A section for each mesh; a table of verdicts first when there are several. What is too long is cut, and said."""
    parts: list[str] = [MARKER] if page.content == "audit" else []
    if len(batch.documents) + len(batch.unread) > 1:
        rows = [
            (markdown(d["mesh"]["path"]), size(sum(d["mesh"]["cells"].values())), f"**{d['gate']['verdict']}**")
            for d in batch.documents
        ]
        rows += [(markdown(u.path), "", f"**not read**: {markdown(u.message, 300)}") for u in batch.unread]
        parts.append(_table(("Mesh", "Cells", "Verdict"), "lrl", rows))
    elif batch.unread:
        parts.append(f"**not read**: {markdown(batch.unread[0].message, 300)}")
    for document in batch.documents:
        parts += _document(document, page)
    text = "\n\n".join(parts) + "\n"
    if len(text) <= longest:
        return text
    kept, room = [], longest - 200
    for part in parts:  # whole tables and folds, so that none is left open
        room -= len(part) + 2
        if room < 0:
            break
        kept.append(part)
    opened = sum(part.startswith("<details>") for part in kept) - kept.count("</details>")
    ends = ["</details>"] * opened
    return "\n\n".join([*kept, *ends, "_Cut here: the whole does not fit into a comment._"]) + "\n"


def _table(header: Sequence[str], align: str, rows: Iterable[Sequence[str]]) -> str:
    lines = [header, [_ALIGN[a] for a in align], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _document(document: dict[str, Any], page: Page) -> Iterator[str]:
    mesh, gate = document["mesh"], document["gate"]
    yield f"## {markdown(mesh['path'], none='mesh')}: {gate['verdict']}"
    cells = ", ".join(f"{size(n)} {CELL_TYPES[kind].title}" for kind, n in mesh["cells"].items())
    yield f"{markdown(mesh['format'])}, {mesh['dimension']}-D, {size(mesh['points'])} points, {cells}"
    if document["selection"]:
        chosen = document["selection"]
        yield f"Only cells of the zones `{chosen['zone'].replace('`', '')}`: {size(chosen['cells'])}."
    if page.content == "audit":
        yield from gate_sections(document["gate"])
        yield from _judgement(document)
        yield from rosetta_sections(document.get("rosetta"))
        yield "<details>\n<summary>Tables and statistics</summary>"
    yield from _tables(document)
    if page.zones:
        for table in document["zone_tables"]:
            yield f"### Zone {markdown(table['zone'])}"
            yield from _tables(table)
    if page.content == "audit":
        yield from _metrics(document)
        yield "</details>"
        if document["notes"]:
            yield "### Notes\n\n" + "\n".join(f"- {markdown(note, 400)}" for note in document["notes"])


def _judgement(document: dict[str, Any]) -> Iterator[str]:
    for reason in document["gate"]["reasons"]:
        yield f"Note: {markdown(reason, 200)}."
    if not document["findings"]:
        yield "No findings."
        return
    rows = [
        (f["severity"], f"`{f['code']}`", size(f["count"]), _ids(f), markdown(f["message"], 400))
        for f in document["findings"]
    ]
    yield _table(("Severity", "Finding", "Count", "Where", "What to do"), "llrll", rows)


def _ids(finding: dict[str, Any]) -> str:
    shown = ", ".join(map(str, finding["ids"][:5]))
    return f"{finding['entity']} {shown}{', …' if finding['count'] > 5 else ''}" if shown else ""


def _tables(tables: dict[str, Any]) -> Iterator[str]:
    rows = [
        (
            CELL_TYPES[row["type"]].title,
            size(row["count"]),
            "not defined" if row["over_0_8"] is None else figure(row["worst_equiangle_skew"]),
            "not defined" if row["share_over_0_8"] is None else _share(row, tables),
        )
        for row in tables["quality"]
    ]
    header = ("Type", "No. of elements", "Worst equi-angle skewness", "% with skewness > 0.8 \\| ICEM < 0.2")
    yield _table(header, "lrrr", rows)
    for binning in BINNINGS:
        found = tables["distributions"][binning.id]
        kinds = list(found["counts"])
        if not kinds:
            continue
        lines = [
            (
                binning.labels[k],
                binning.mirrored_labels[k],
                *(size(found["counts"][kind][k]) for kind in kinds),
            )
            for k in range(binning.n)
        ]
        if any(found["undefined"].values()):
            lines.append(("undefined", "", *(size(found["undefined"][kind]) for kind in kinds)))
        yield f"**{binning.title}**"
        yield _table((*binning.columns, *kinds), "ll" + "r" * len(kinds), lines)
        if left_out := not_defined(tables, kinds):
            yield left_out
    classes = tables["gambit_classes"]
    kinds = list(classes["counts"])
    if kinds:
        lines = [
            (c["name"], markdown(c["range"]), *(size(classes["counts"][kind][k]) for kind in kinds))
            for k, c in enumerate(classes["classes"])
        ]
        yield "**GAMBIT classes of equi-angle skew**"
        yield _table(("Class", "Range", *kinds), "ll" + "r" * len(kinds), lines)
        if left_out := not_defined(tables, kinds):
            yield left_out
        yield f"Mean {figure(classes['mean'])}; a high-quality mesh has about {classes['hint']}."


def _share(row: dict[str, Any], tables: dict[str, Any]) -> str:
    measured = row["count"] - tables["distributions"]["equiangle_skew"]["undefined"][row["type"]]
    return percent(row["over_0_8"], measured)


def _metrics(document: dict[str, Any]) -> Iterator[str]:
    rows = []
    for key, of_type in document["metrics"].items():
        unit = document["definitions"][key]["unit"]
        for kind, figures in of_type.items():
            values = (figure(figures[item], unit) for item in ("min", "p50", "mean", "p95", "max"))
            worst = entity_number(figures["worst"][0]) if figures["worst"] else "-"
            rows.append((f"`{key}`", kind, *(markdown(v) for v in values), str(worst)))
    if rows:
        yield _table(("Metric", "Type", "min", "p50", "mean", "p95", "max", "worst at"), "llrrrrrr", rows)
