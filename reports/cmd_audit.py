"""`meshwright audit`: options. The work is in `job.py`, imported when it begins."""

from __future__ import annotations

from typing import Any

import click

__all__ = ["FORMATS", "command"]

FORMATS = ("text", "json", "md", "csv")


@click.command("audit")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True)
@click.option("--metrics", default="default", metavar="default|all|ID,ID", help="What to measure.")
@click.option("--zone", metavar="GLOB", help="Count only the cells of matching zones.")
@click.option("--format", "output", type=click.Choice(FORMATS), default="text", help="Of the result on stdout.")
@click.option("-o", "--output-file", metavar="FILE", help="Write the result there instead of to stdout.")
@click.option("--out", "outs", multiple=True, metavar="FORMAT=FILE", help="Write another result; may be repeated.")
@click.option("--cells", metavar="FILE", help="Write the values of every cell: .parquet, .csv or .vtu.")
@click.option("--input-format", metavar="NAME", help="Read as this format instead of looking at the content.")
@click.option("--surfaces", is_flag=True, help="Measure the boundary surface of a 3-D mesh too.")
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all processors.")
@click.option(
    "--worst", type=click.IntRange(0, 10_000), default=5, show_default=True, metavar="N", help="Cells listed."
)
@click.option("--quiet", is_flag=True, help="No progress on stderr.")
@click.pass_context
def command(ctx: click.Context, /, **options: Any) -> None:
    """Measure meshes and check them.

    PATH is a mesh file, an OpenFOAM case folder or .foam marker, a pattern, or - for stdin. Several meshes give a
    line each and the worst exit status of them all.
    """
    from meshwright.reports.job import Job, run_audit  # noqa: PLC0415 - `--help` must not load the engine

    ctx.exit(run_audit(Job(**options)))
