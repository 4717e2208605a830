"""`meshwright compare`: two meshes, or two saved audits, against each other."""

from __future__ import annotations

from typing import Any

import click

__all__ = ["command"]


@click.command("compare")
@click.argument("before", metavar="BEFORE")
@click.argument("after", metavar="AFTER")
@click.option("--metrics", default="default", metavar="default|all|ID,ID", help="What to measure of meshes.")
@click.option("--zone", metavar="GLOB", help="Count only the cells of matching zones.")
@click.option("--profile", metavar="NAME", help="Judge both by the limits of a system.")
@click.option("--gate", metavar="FILE", help="Judge both by the rules of a gate file.")
@click.option(
    "--format", "output", type=click.Choice(("text", "json", "md", "html")), default="text", help="Of the result."
)
@click.option("-o", "--output-file", metavar="FILE", help="Write the result there instead of to stdout.")
@click.option("--html", metavar="FILE", help="Write a page to look at as well.")
@click.option("--tolerance", type=click.FloatRange(0), metavar="LENGTH", help="Distance up to which points are one.")
@click.option(
    "--fail-on", type=click.Choice(("never", "worse")), default="never", show_default=True, help="When to exit with 1."
)
@click.option("--abs", "absolute", type=click.FloatRange(0), default=0.0, metavar="X", help="Worse by X is not worse.")
@click.option(
    "--rel", "relative", type=click.FloatRange(0), default=0.0, metavar="X", help="Worse by that part is not."
)
@click.option("--input-format", metavar="NAME", help="Read both as this format.")
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all processors.")
@click.option("--quiet", is_flag=True, help="No progress on stderr.")
@click.pass_context
def command(ctx: click.Context, /, **options: Any) -> None:
    """Compare the mesh or saved audit AFTER with BEFORE.

    Saved audits are `audit --format json` or `--html`. Of two meshes the cells are matched by their places, whatever
    their numbers: the same, moved, added, removed.

    Exit status: 0 compared; 1 with --fail-on worse where something got worse; 2 wrong usage; 3 a side could not be
    read, or with --fail-on worse not everything be compared.
    """
    from meshwright.reports.compare_job import CompareJob, run_compare  # noqa: PLC0415 - keeps --help fast

    ctx.exit(run_compare(CompareJob(**options)))
