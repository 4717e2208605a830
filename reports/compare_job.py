"""One run of `compare`: read or audit both sides, compare, write."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

from meshwright.audit.errors import UsageError
from meshwright.audit.files import check_writable
from meshwright.audit.fingerprint import fingerprint
from meshwright.audit.run import Audit, audit
from meshwright.audit.summary import Summary, summarise
from meshwright.reports.compare_text import render_markdown, render_text
from meshwright.reports.comparison import Comparison, compare_documents, match_audits
from meshwright.reports.job import Job
from meshwright.reports.paths import open_mesh, refuse_overwriting
from meshwright.reports.plan import Plan, make_plan
from meshwright.reports.progress import announce_compilation, stages
from meshwright.reports.saved import is_saved, read_saved
from meshwright.reports.verdicts import EXIT_INCOMPLETE
from meshwright.reports.writing import deliver, page_width, wants_colour

__all__ = ["CompareJob", "run_compare"]


@dataclass(frozen=True)
class CompareJob:
    """The options of a run, as on the command line."""

    before: str
    after: str
    metrics: str = "default"
    zone: str | None = None
    profile: str | None = None
    gate: str | None = None
    output: str = "text"
    output_file: str | None = None
    html: str | None = None
    tolerance: float | None = None
    fail_on: str = "never"
    absolute: float = 0.0
    relative: float = 0.0
    input_format: str | None = None
    threads: int | None = None
    quiet: bool = False


def run_compare(job: CompareJob) -> int:
    """Compare and write; the exit status."""
    files = [path for path in (job.output_file, job.html) if path is not None and path != "-"]
    refuse_overwriting([path for path in (job.before, job.after, job.gate) if path is not None], files)
    for path in files:
        check_writable(path)
    if job.profile == "all":
        raise UsageError("compare judges by one profile, not by all of them")
    plan = make_plan(
        Job((job.before, job.after), metrics=job.metrics, zone=job.zone, profile=job.profile, gate=job.gate)
    )
    announce_compilation(quiet=job.quiet)
    (a, first), (b, second) = (_side(job, plan, path) for path in (job.before, job.after))
    comparison = compare_documents(first, second, absolute=job.absolute, relative=job.relative)
    if a is not None and b is not None:
        match_audits(comparison, a, b, job.tolerance)
    _write(job, comparison)
    if job.fail_on == "worse":
        if comparison["worse"]:
            return 1
        return 0 if comparison["nothing_worse"] else EXIT_INCOMPLETE
    return 0


def _side(job: CompareJob, plan: Plan, path: str) -> tuple[Audit | None, Summary]:
    """The document of one side, and the audit where it is a mesh."""
    if is_saved(path):
        return None, read_saved(path)[0]
    with stages(path, quiet=job.quiet) as tell, open_mesh(path, job.input_format) as (mesh, where):
        found = audit(mesh, plan.metrics, threads=job.threads, options=plan.options, progress=tell)
        digest = fingerprint(where)
        document = summarise(
            found, zone=job.zone, sha256=digest, profiles=[replace(p, baseline="") for p in plan.profiles]
        )
        return found, document


def _write(job: CompareJob, comparison: Comparison) -> None:
    to_page = job.output_file in (None, "-")
    if job.output == "json":
        text = json.dumps(comparison, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    elif job.output == "md":
        text = render_markdown(comparison)
    elif job.output == "html":
        text = _html(comparison)
    else:
        text = render_text(comparison, width=page_width() if to_page else 100, colour=to_page and wants_colour())
    deliver(text, job.output_file)
    if job.html is not None:
        deliver(_html(comparison), job.html)


def _html(comparison: Comparison) -> str:
    from meshwright.reports.compare_html import render_html  # noqa: PLC0415 - loads jinja2

    return render_html(comparison)
