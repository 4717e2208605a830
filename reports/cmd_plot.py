"""`meshwright plot`: options. The work is in `plot_job.py`, imported when it begins."""

from __future__ import annotations

from typing import Any

import click

__all__ = ["KINDS", "command"]

KINDS = ("histogram", "cumulative", "zones", "view")


@click.command("plot")
@click.argument("path", metavar="PATH")
@click.option("-o", "--output-file", metavar="FILE", required=True, help="A .svg, .png or .pdf.")
@click.option("--kind", type=click.Choice(KINDS), default="histogram", show_default=True, help="What to draw.")
@click.option(
    "--metric",
    metavar="ID",
    help="Of what. Default: gambit.equiangle_skew; for --kind zones, which takes several with commas, the article's.",
)
@click.option("--zone", metavar="GLOB", help="Count, or show, only the cells of matching zones.")
@click.option("--baseline", metavar="FILE", help="An earlier audit, drawn into the histogram: JSON or an HTML report.")
@click.option("--worst", type=click.IntRange(1, 200_000), metavar="N", help="Of a view: the N worst. Default: 100.")
@click.option("--beyond", type=float, metavar="X", help="Of a view: everything worse than X.")
@click.option(
    "--view",
    type=click.Choice(("all", "iso", "x", "y", "z")),
    default="all",
    help="From where: obliquely, along an axis, or (default) the three that show most.",
)
@click.option("--dark", is_flag=True, help="A view on dark ground (.png).")
@click.option("--size", metavar="WxH", help="Pixels of a .png, units of a .svg, hundredths of an inch of a .pdf.")
@click.option("--input-format", metavar="NAME", help="Read as this format instead of looking at the content.")
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all processors.")
@click.option("--quiet", is_flag=True, help="No progress on stderr.")
def command(**options: Any) -> None:
    """Draw a histogram, the share of cells up to each value, the zones, or the mesh with its worst cells.

    PATH is a mesh, - for stdin, or, but for views, a saved audit (`audit --format json` or `--html`). Histograms as
    .svg and views need nothing more; all else needs matplotlib: pip install 'meshwright[plot]'.

    Exit status: 0, 2 wrong usage, 3 PATH or the baseline could not be read. It judges nothing.
    """
    from meshwright.reports.plot_job import PlotJob, run_plot  # noqa: PLC0415 - `--help` must not load the engine

    run_plot(PlotJob(**options))
