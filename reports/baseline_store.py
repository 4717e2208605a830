"""Saving, listing and removing baselines."""

from __future__ import annotations

import datetime as dt
import json
from pathlib import Path
from typing import Any

import click
from rich.text import Text

from meshwright.audit.errors import MeshwrightError, UsageError, printable
from meshwright.audit.files import replacing
from meshwright.audit.fingerprint import fingerprint
from meshwright.audit.run import audit
from meshwright.audit.summary import Summary, summarise
from meshwright.reports.baselines import checked_name, folder_of
from meshwright.reports.job import Job
from meshwright.reports.layout import Column, Grid, page_text
from meshwright.reports.paths import open_mesh
from meshwright.reports.plan import make_plan
from meshwright.reports.progress import announce_compilation, stages
from meshwright.reports.saved import is_saved, read_saved
from meshwright.reports.wording import name as spelled
from meshwright.reports.wording import size
from meshwright.reports.writing import page_width, wants_colour

__all__ = ["list_baselines", "remove_baseline", "save_baseline"]


def save_baseline(name: str, job: Job) -> Path:
    """Audit the mesh of the job and keep the document, whole or not at all; where it is."""
    path = folder_of() / f"{checked_name(name)}.json"
    (mesh,) = job.paths
    document = read_saved(mesh)[0] if is_saved(mesh) else _document(job, mesh)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as stream:
        stream.write((json.dumps(document, ensure_ascii=False, allow_nan=False) + "\n").encode("utf-8", "replace"))
    click.echo(f"meshwright: kept as {name}: audit with --baseline {name}", err=True)
    return path


def _document(job: Job, path: str) -> Summary:
    plan = make_plan(job)
    announce_compilation(quiet=job.quiet)
    with stages(path, quiet=job.quiet) as tell, open_mesh(path, job.input_format) as (mesh, where):
        found = audit(mesh, plan.metrics, options=plan.options, progress=tell)
        return summarise(found, zone=job.zone, sha256=fingerprint(where), profiles=plan.profiles)


def list_baselines(output: str) -> str:
    """The baselines of the project, by name; one that cannot be read says so."""
    rows: list[dict[str, Any]] = []
    for path in sorted(folder_of().glob("*.json")):
        entry: dict[str, Any] = {"name": path.stem, "saved": _date(path)}
        try:
            document, digest = read_saved(path)
        except MeshwrightError as error:
            rows.append({**entry, "error": str(error)})
            continue
        mesh = document["mesh"]
        rows.append({**entry, "mesh": mesh["path"], "cells": sum(mesh["cells"].values()),
                     "verdict": document["gate"]["verdict"], "rules": len(document["gate"]["rules"]),
                     "version": document["version"], "sha256": digest})  # fmt: skip
    if output == "json":
        return json.dumps(rows, indent=2, ensure_ascii=False) + "\n"
    if not rows:
        return "no baselines here: `meshwright baseline save NAME MESH` keeps one\n"
    columns = (Column("name"), Column("mesh", cut=True, keep_end=True), Column("cells", "r"), Column("verdict"))
    grid = Grid((*columns, Column("rules", "r"), Column("saved"), Column("version")), indent=0)
    for row in rows:
        if "error" in row:
            grid.add(row["name"], Text(spelled(row["error"], 80), style="red"), "", "unreadable", "", row["saved"], "")
            continue
        cells = (spelled(row["mesh"], 60, "mesh"), size(row["cells"]), row["verdict"], str(row["rules"]))
        grid.add(row["name"], *cells, row["saved"], row["version"])
    return page_text((grid,), page_width(), colour=wants_colour())


def _date(path: Path) -> str:
    return dt.datetime.fromtimestamp(path.stat().st_mtime, dt.UTC).strftime("%Y-%m-%d %H:%M")


def remove_baseline(name: str) -> None:
    """Remove one; UsageError where there is none of that name."""
    path = folder_of() / f"{checked_name(name)}.json"
    try:
        path.unlink()
    except FileNotFoundError:
        raise UsageError(f"no baseline {printable(name)!r} here; `meshwright baseline list` lists them") from None
    except OSError as error:
        raise UsageError(f"cannot remove baseline {printable(name)!r}: {error.strerror}") from None
