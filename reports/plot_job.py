"""One run of `plot`: read a mesh or a saved audit, measure what is to be drawn, write the file whole."""

from __future__ import annotations

import importlib.util
import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.files import check_writable, replacing
from meshwright.audit.histograms import aligned
from meshwright.audit.measurement import measure
from meshwright.audit.metrics import METRICS, select
from meshwright.audit.run import Audit
from meshwright.audit.summary import Summary, summarise
from meshwright.audit.tables import ASPECT, SKEW
from meshwright.reports.histogram_marks import marks_of
from meshwright.reports.histogram_svg import histogram_svg
from meshwright.reports.paths import STDIN, open_mesh, refuse_overwriting
from meshwright.reports.progress import announce_compilation, stages
from meshwright.reports.saved import is_saved, read_saved

__all__ = ["PlotJob", "run_plot"]

_FORMATS = (".svg", ".png", ".pdf")
_DRAWING, _FIGURE, _VIEW = (640, 320), (900, 480), (900, 560)
_SMALLEST, _LARGEST = 100, 8192


@dataclass(frozen=True)
class PlotJob:
    """The options of a run, as on the command line."""

    path: str
    output_file: str
    kind: str = "histogram"
    metric: str | None = None
    zone: str | None = None
    baseline: str | None = None
    worst: int | None = None
    beyond: float | None = None
    view: str = "all"
    dark: bool = False
    size: str | None = None
    input_format: str | None = None
    threads: int | None = None
    quiet: bool = False


def run_plot(job: PlotJob) -> None:
    """Draw, and write the file."""
    suffix = Path(job.output_file).suffix.lower()
    size = _check(job, suffix)
    ids = tuple(row.id for row in select(job.metric or ("default" if job.kind == "zones" else SKEW)))
    if job.kind != "zones" and len(ids) != 1:
        raise UsageError(f"--kind {job.kind} draws one metric, got {len(ids)}")
    inputs = [path for path in (job.path, job.baseline) if path is not None]
    refuse_overwriting(inputs, [job.output_file])
    check_writable(job.output_file)
    before = None if job.baseline is None else read_saved(job.baseline)[0]
    if job.path != STDIN and is_saved(job.path):
        data = _of_document(job, ids, read_saved(job.path)[0], before, suffix, size)
    else:
        announce_compilation(quiet=job.quiet)
        with stages(job.path, quiet=job.quiet) as tell, open_mesh(job.path, job.input_format) as (mesh, _):
            tell("metrics", 0, 0)
            wanted = dict.fromkeys((*ids, SKEW, ASPECT))
            found = Audit(mesh, measure(mesh, wanted, threads=job.threads), (), ids)
            tell("drawing", 0, 0)
            data = _of_audit(job, ids, found, before, suffix, size)
    with replacing(job.output_file) as stream:
        stream.write(data)


def _check(job: PlotJob, suffix: str) -> tuple[int, int] | None:
    """What can be said before anything is read; the size asked for."""
    shown = printable(job.output_file, 200)
    if suffix not in _FORMATS:
        raise UsageError(f"cannot tell what {shown} is to be: expected a name that ends with {', '.join(_FORMATS)}")
    if job.kind == "view" and suffix == ".pdf":
        raise UsageError(f"{shown}: a view is written as .svg or .png")
    for name, value, kinds in (
        ("--baseline", job.baseline, ("histogram",)),
        ("--worst", job.worst, ("view",)),
        ("--beyond", job.beyond, ("view",)),
        ("--dark", job.dark or None, ("view",)),
        ("--zone", job.zone, ("histogram", "cumulative", "view")),
    ):
        if value is not None and job.kind not in kinds:
            raise UsageError(f"{name} is for --kind {' and '.join(kinds)}, not for {job.kind}")
    if job.dark and suffix != ".png":
        raise UsageError("--dark is for views as .png")
    if (job.kind != "view" and (job.kind, suffix) != ("histogram", ".svg")) and not importlib.util.find_spec(
        "matplotlib"
    ):
        raise UsageError(f"{job.kind} as {suffix} needs matplotlib: pip install 'meshwright[plot]'")
    if job.size is None:
        if job.kind == "zones":
            return None  # by the number of zones and metrics
        return _VIEW if job.kind == "view" else _DRAWING if (job.kind, suffix) == ("histogram", ".svg") else _FIGURE
    found = re.fullmatch(r"([0-9]{1,5})x([0-9]{1,5})", job.size)
    size = (int(found[1]), int(found[2])) if found else (0, 0)
    if not all(_SMALLEST <= side <= _LARGEST for side in size):
        raise UsageError(f"--size {printable(job.size)}: expected WxH, {_SMALLEST} to {_LARGEST} each, such as 900x560")
    return size


def _of_document(
    job: PlotJob, ids: tuple[str, ...], document: Summary, before: Summary | None, suffix: str, size: Any
) -> bytes:
    if job.kind == "view":
        raise UsageError(f"{printable(job.path, 200)} is a saved audit; a view needs the mesh")
    if job.zone is not None:
        raise UsageError("--zone needs the mesh: a saved audit has been counted already")
    if (job.kind, suffix) == ("histogram", ".svg"):
        return _histogram(ids[0], document, before, size)
    return _figure(job, ids, document, before, suffix, size)


def _of_audit(
    job: PlotJob, ids: tuple[str, ...], found: Audit, before: Summary | None, suffix: str, size: Any
) -> bytes:
    if job.kind == "view":
        return _view(job, ids[0], found, suffix, size)
    if job.kind == "cumulative" and job.zone is None:
        return _figure(job, ids, found, before, suffix, size)
    document = summarise(found, zone=job.zone, worst=0, sha256="")
    if (job.kind, suffix) == ("histogram", ".svg"):
        return _histogram(ids[0], document, before, size)
    return _figure(job, ids, document, before, suffix, size)


def _histogram(metric: str, document: Summary, before: Summary | None, size: tuple[int, int]) -> bytes:
    entry = _entry(document, metric, "PATH")
    other = None
    if before is not None:
        entry, other = aligned(entry, _entry(before, metric, "the baseline"))
    row = METRICS[metric]
    marks = marks_of(document, metric)
    path = document["mesh"]["path"].rstrip("/").rpartition("/")[2]
    text = histogram_svg(
        entry, title=f"{row.title}, {path}" if path else row.title, baseline=other, marks=marks, best=row.best,
        width=size[0], height=size[1], alone=True,
    )  # fmt: skip
    return text.encode()


def _entry(document: Summary, metric: str, of: str) -> dict[str, Any]:
    found: dict[str, Any] | None = document.get("histograms", {}).get(metric)
    if found is None:
        raise UsageError(f"{of} has no histogram of {metric}; audit it with --metrics {metric}")
    return found


def _view(job: PlotJob, metric: str, found: Audit, suffix: str, size: tuple[int, int]) -> bytes:
    from meshwright.reports.bad_entities import colours_of, range_of, shown_of  # noqa: PLC0415 - compiles kernels
    from meshwright.reports.raster import DARK, LIGHT, picture, png  # noqa: PLC0415
    from meshwright.reports.view_svg import view_svg  # noqa: PLC0415

    shown = shown_of(found, metric, worst=job.worst, beyond=job.beyond, zone=job.zone)
    ends = range_of(shown.values, high_is_worse=METRICS[metric].worst_is_high)
    rows, colours = shown.rows[::-1], colours_of(shown, *ends)[::-1]
    if not job.quiet:
        lost = f", {shown.undefined:,} of them without a value" if shown.undefined else ""
        click.echo(f"meshwright: {len(rows):,} of {shown.of:,} {shown.entity}s shown{lost}", err=True)
    if suffix == ".svg":
        title = f"{METRICS[metric].title}: {len(rows):,} {shown.entity}s of {found.mesh.path}"
        return view_svg(found.mesh, rows, colours, title=title, entity=shown.entity, size=size, view=job.view).encode()
    theme = DARK if job.dark else LIGHT
    return png(picture(found.mesh, rows, colours, entity=shown.entity, size=size, view=job.view, theme=theme))


def _figure(
    job: PlotJob, ids: tuple[str, ...], source: Audit | Summary, before: Summary | None, suffix: str, size: Any
) -> bytes:
    from meshwright.reports import plot  # noqa: PLC0415 - optional, and slow to import

    with _canvas(size) as (figure, ax):
        if job.kind == "histogram":
            plot.histogram(source, ids[0], ax, baseline=before)
        elif job.kind == "cumulative":
            plot.cumulative(source, ids[0], ax)
        else:
            document = (
                summarise(replace(source, chosen=ids), sha256="", worst=0) if isinstance(source, Audit) else source
            )
            drawn = plot.zones_heat(document, ax, metrics=None if job.metric is None else ids)
            if size is None:
                columns, rows = len(drawn.get_xticks()), len(drawn.get_yticks())
                figure.set_size_inches(2.6 + 0.85 * columns, 1.8 + 0.32 * rows)
        stream = io.BytesIO()
        figure.savefig(stream, format=suffix[1:], metadata=_STEADY.get(suffix))
    return stream.getvalue()


_STEADY: dict[str, dict[str, Any]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""What keeps the time of day out of files, so that the same mesh gives the same bytes."""


@contextmanager
def _canvas(size: tuple[int, int] | None) -> Iterator[Any]:
    """A figure and its axes that no window system knows about."""
    from matplotlib import rc_context  # noqa: PLC0415 - optional
    from matplotlib.figure import Figure  # noqa: PLC0415

    wide, tall = size or _FIGURE
    with rc_context({"svg.hashsalt": "meshwright", "svg.fonttype": "none"}):
        figure = Figure(figsize=(wide / 100, tall / 100), dpi=100, layout="constrained")
        yield figure, figure.subplots()
