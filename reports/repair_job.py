"""One run of `repair`: read, repair, write the mesh, its journal and its receipt."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.files import check_new_folder, check_writable
from meshwright.audit.fingerprint import fingerprint
from meshwright.audit.gate.files import read_gate_file
from meshwright.audit.mesh import Mesh
from meshwright.audit.profiles import PROFILES, Profile, load
from meshwright.audit.run import Audit, audit
from meshwright.audit.summary import Summary, summarise
from meshwright.repair.journal import receipt, save_journal, undo
from meshwright.repair.run import Repair, repair
from meshwright.repair.writers import check_format, write
from meshwright.reports.paths import open_mesh, refuse_overwriting
from meshwright.reports.progress import announce_compilation, stages
from meshwright.reports.repair_text import METRICS_SHOWN, render_text
from meshwright.reports.writing import deliver, page_width, wants_colour

__all__ = ["RepairJob", "run_repair"]


@dataclass(frozen=True)
class RepairJob:
    """The options of a run, as on the command line."""

    path: str
    output_file: str | None = None
    passes: str | None = None
    target: str | None = None
    hold: tuple[str, ...] = ()
    tolerance: float | None = None
    boundary: str = "fixed"
    nodes: str = "keep"
    refine: tuple[str, ...] = ()
    max_edge: float | None = None
    max_hole: int = 0
    dry_run: bool = False
    output: str = "text"
    journal: str | None = None
    undo: str | None = None
    html: str | None = None
    input_format: str | None = None
    threads: int | None = None
    quiet: bool = False


def run_repair(job: RepairJob) -> int:
    """Repair and write; the exit status."""
    if job.undo is not None:
        return _undo(job)
    if job.output_file is None and not job.dry_run:
        raise UsageError("where to? Name the repaired mesh with -o OUT, or ask for --dry-run")
    target = None if job.dry_run else job.output_file
    _check_files(job, target)
    profile = None if job.target is None else _profile(job.target)
    announce_compilation(quiet=job.quiet)
    with stages(job.path, quiet=job.quiet) as tell, open_mesh(job.path, job.input_format) as (mesh, where):
        digest = fingerprint(where)
        done = repair(
            mesh, job.passes, target=profile, hold=job.hold, tolerance=job.tolerance, boundary=job.boundary,
            nodes=job.nodes, refine=job.refine, max_edge=job.max_edge, max_hole=job.max_hole,
            threads=job.threads, progress=tell,
        )  # fmt: skip
        tell("measure", 0, 0)
        (_, first), (last_audit, last) = _measured(done.before, digest, job), _measured(_unsaved(done), None, job)
        notes = list(mesh.notes)
        if target is None:
            document = receipt(done, str(where), None)
        else:
            document, lost = _write(job, done, str(where), target)
            notes += lost
    document["notes"] = notes + document["notes"]
    document["metrics"] = {"before": first["metrics"], "after": last["metrics"]}
    if job.output == "json":
        text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    else:
        text = render_text(job.path, target, document, first, last, width=page_width(), colour=wants_colour())
    if job.html is not None and target is not None:
        last["mesh"] |= {
            "path": target, "format": check_format(target).title, "sha256": document["output"]["sha256"],
        }  # fmt: skip
        _page(job.html, done, last_audit, first, last, document)
    deliver(text, None)
    failed = done.aim is not None and done.aim.last is not None and done.aim.last.judgement.state == "fail"
    return 1 if done.last.bad or failed else 0


def _profile(name: str) -> Profile:
    """The profile of that name, or the gate file."""
    return load(name) if name in PROFILES or not Path(name).exists() else read_gate_file(name)


def _check_files(job: RepairJob, target: str | None) -> None:
    if target is not None:
        writer = check_format(target)
        if writer.folder:
            check_new_folder(Path(target).parent / writer.folder)
            if job.journal is not None:
                raise UsageError(f"a journal brings back one file, and {writer.title} is several: write another format")
        same = Path(target).resolve() == Path(job.path).resolve()
        if same and job.journal is None:
            raise UsageError(
                f"{printable(target, 200)} is the input; give another OUT, or a --journal FILE that can bring it back"
            )
    files = [f for f in (job.html, job.journal) if f is not None]
    refuse_overwriting([job.path, *([target] if target else [])], files)
    for file in (*files, *([target] if target else [])):
        check_writable(file)
    if job.journal is not None and not Path(job.path).is_file():
        raise UsageError("a journal keeps the input file, so IN must be a file")


def _measured(mesh: Mesh, digest: str | None, job: RepairJob) -> tuple[Audit, Summary]:
    found = audit(mesh, ",".join(METRICS_SHOWN), threads=job.threads)
    return found, summarise(found, sha256=digest)


def _unsaved(done: Repair) -> Mesh:
    """The repaired mesh as one that came from no file: it is not the one that was read."""
    return done.after if done.after is done.before else replace(done.after, path="", format="")


def _write(job: RepairJob, done: Repair, source: str, target: str) -> tuple[dict[str, Any], list[str]]:
    """Write mesh and journal: the journal is whole before the mesh takes its place, which may be that of the input."""
    place = Path(target).resolve()
    if check_format(target).folder:
        lost = list(write(done.after, target))
        document = receipt(done, source, target)
        document["input"]["path"] = job.path
        return document, lost
    with tempfile.TemporaryDirectory(prefix=f".{place.name[:60]}.", dir=place.parent) as folder:
        fresh = Path(folder) / f"new{place.suffix}"
        lost = list(write(done.after, fresh))
        document = receipt(done, source, str(fresh))
        document["output"]["path"] = target
        document["input"]["path"] = job.path
        if job.journal is not None:
            save_journal(done, document, source, job.journal)
        if place.exists():
            fresh.chmod(place.stat().st_mode & 0o777)
        os.replace(fresh, place)  # noqa: PTH105 - the name says what it does
    return document, lost


def _undo(job: RepairJob) -> int:
    if job.output_file is None:
        raise UsageError("where to? Name the file that becomes the input again with -o OUT")
    refuse_overwriting([str(job.undo)], [job.output_file])
    check_writable(job.output_file)
    digest = undo(str(job.undo), job.path, job.output_file)
    click.echo(f"{printable(job.output_file, 200)} is the input of that repair again (SHA-256 {digest})")
    return 0


def _page(path: str, done: Repair, last_audit: Audit, first: Summary, last: Summary, document: dict[str, Any]) -> None:
    from meshwright.reports.html.report import report_html  # noqa: PLC0415 - loads jinja2

    section = {
        "before": first, "after": last,
        "passes": [
            {"name": s["pass"], "changed": s["changed"], "note": s["note"] or s["reason"]}
            for s in document["steps"] if s["state"] == "kept"
        ],
        "moved_points": document["moved_points"], "max_deviation": document["max_deviation"],
        "zones_kept": [z.name for z in done.before.zones] == [z.name for z in done.after.zones],
        "refused": document["refused"] + [left["words"] for left in (document["target"] or {}).get("left", ())],
    }  # fmt: skip
    deliver(report_html(last_audit, last, repair=section), path)
