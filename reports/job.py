"""One run of `audit` or `table`: read, measure, summarise each mesh, then write every output that was asked for."""

from __future__ import annotations

import ctypes
import gc
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from threading import Thread

import click

from meshwright.audit.errors import MeshwrightError, UsageError
from meshwright.audit.files import check_writable
from meshwright.audit.fingerprint import fingerprint, weight
from meshwright.audit.metrics import select
from meshwright.audit.run import audit
from meshwright.audit.summary import Summary, cells_of_zones, summarise
from meshwright.audit.warm import warm_up
from meshwright.reports.html_file import write_incomplete, write_report
from meshwright.reports.outputs import OF_UNREAD, OUTPUTS, Batch, Page, Unread, render
from meshwright.reports.paths import STDIN, expand, open_mesh, refuse_overwriting
from meshwright.reports.plan import Plan, make_plan
from meshwright.reports.progress import announce_compilation, stages
from meshwright.reports.verdicts import EXIT_INCOMPLETE, exit_status
from meshwright.reports.writing import deliver, page_width, wants_colour

__all__ = ["Job", "run_audit", "run_table"]


_LARGE = 16 << 20
"""Bytes from which on reading takes longer than loading kernels beside it."""

_M_ARENA_MAX = -8
"""glibc's number of that option, from malloc.h."""


@dataclass(frozen=True)
class Job:
    """The options of a run, as on the command line."""

    paths: tuple[str, ...]
    metrics: str = "default"
    zone: str | None = None
    output: str = "text"
    output_file: str | None = None
    outs: tuple[str, ...] = ()
    cells: str | None = None
    input_format: str | None = None
    surfaces: bool = False
    threads: int | None = None
    worst: int = 5
    quiet: bool = False
    profile: str | None = None
    gate: str | None = None
    discipline: str | None = None
    axis: str | None = None
    unit: str | None = None
    feature_angle: float = 10.0
    sizes: str | None = None
    baseline: str | None = None
    fail_on: str = "fail"
    exit_zero: bool = False
    html: str | None = None


def run_audit(job: Job) -> int:
    """Audit all meshes and write all outputs; the exit status."""
    batch = _run(job, Page())
    return exit_status(batch, fail_on=job.fail_on, exit_zero=job.exit_zero)


def run_table(job: Job, *, by_zone: bool) -> int:
    """Write the tables of all meshes; 0, or 3 where a mesh could not be read."""
    batch = _run(job, Page(content="tables", zones=by_zone))
    return EXIT_INCOMPLETE if batch.unread else 0


def _share_one_heap() -> None:
    """Let all threads use one heap of the C library (glibc): each its own would keep a tenth more memory to itself."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, 1)


def _run(job: Job, page: Page) -> Batch:
    _share_one_heap()
    outputs = _outputs(job)
    paths = expand(job.paths)
    plan = make_plan(job)  # a misspelt metric or a wrong limit is told before anything is read
    _check_cells(job, paths)
    files = [path for _, path in outputs if path is not None]
    if job.html is not None:
        if len(paths) != 1:
            raise UsageError("--html takes one mesh at a time")
        files.append(job.html)
    inputs = [*paths, *(path for path in (job.gate, job.sizes) if path is not None)]
    refuse_overwriting(inputs, [*files, *([job.cells] if job.cells else [])])
    for path in files:
        check_writable(path)
    announce_compilation(quiet=job.quiet)
    batch = Batch([], [])
    if job.threads != 1 and any(weight(path) > _LARGE for path in paths[:1]):
        Thread(target=warm_up, args=(select(plan.metrics),)).start()
    for path in paths:
        try:
            batch.documents.append(_one(job, plan, path))
        except MeshwrightError as error:
            if isinstance(error, UsageError) and len(paths) == 1:
                raise  # of several, the others are still audited
            click.echo(f"meshwright: {error}", err=True)
            if job.html is not None:
                write_incomplete(job.html, path, str(error))
            batch.unread.append(Unread(path, str(error)))
        if len(paths) > 1:
            gc.collect()  # the command line leaves the collector off
    _write(job, outputs, batch, page)
    return batch


def _outputs(job: Job) -> list[tuple[str, str | None]]:
    """(output, file) in the order of writing; None is stdout. Files first, so that a closed pipe loses none."""
    found: list[tuple[str, str | None]] = []
    for text in job.outs:
        output, equals, path = text.partition("=")
        if not equals or not path or output not in OUTPUTS:
            raise UsageError(f"--out {text}: expected FORMAT=FILE with FORMAT one of {', '.join(OUTPUTS)}")
        found.append((output, path))
    main = None if job.output_file in (None, STDIN) else job.output_file
    return [*found, (job.output, main)]


def _check_cells(job: Job, paths: list[str]) -> None:
    if job.cells is None:
        return
    from meshwright.reports.cells import check_cell_file  # noqa: PLC0415 - loads pyarrow

    if len(paths) != 1:
        raise UsageError("--cells takes one mesh at a time")
    check_cell_file(job.cells)
    check_writable(job.cells)


def _one(job: Job, plan: Plan, path: str) -> Summary:
    with (
        stages(path, quiet=job.quiet) as tell,
        open_mesh(path, job.input_format) as (mesh, place),
        ThreadPoolExecutor(1) as beside,
    ):
        digest = beside.submit(fingerprint, place)
        found = audit(
            mesh,
            plan.metrics,
            also=plan.also,
            threads=job.threads,
            surfaces=job.surfaces,
            options=plan.options,
            progress=tell,
        )
        tell("summary", 0, 0)
        document = summarise(
            found,
            zone=job.zone,
            worst=job.worst,
            sha256=digest.result(),
            profiles=plan.profiles,
            compare=plan.compare,
            baseline=plan.baseline,
        )
        if job.cells is not None:
            from meshwright.reports.cells import write_cells  # noqa: PLC0415 - loads pyarrow

            tell("cells", 0, 0)
            write_cells(found, None if job.zone is None else cells_of_zones(mesh, job.zone), job.cells)
        if job.html is not None:
            tell("report", 0, 0)
            write_report(job.html, found, document, plan.baseline)
        return document


def _write(job: Job, outputs: list[tuple[str, str | None]], batch: Batch, page: Page) -> None:
    """Every output is attempted; the first failure is raised once the others are safe."""
    if not batch.documents and len(batch.unread) == 1:
        # the one line on stderr has said it all, and what an earlier run wrote stays
        outputs = [(output, path) for output, path in outputs if output in OF_UNREAD]
    failed: UsageError | None = None
    for output, path in outputs:
        here = replace(page, width=page_width(), colour=wants_colour()) if path is None else page
        try:
            deliver(render(output, batch, here), path)
        except UsageError as error:
            failed = failed or error
    if failed is not None:
        raise failed
