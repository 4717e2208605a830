"""`meshwright repair`: options. The work is in `repair_job.py`, imported when it begins."""

from __future__ import annotations

from typing import Any

import click

__all__ = ["command"]


@click.command("repair")
@click.argument("path", metavar="IN")
@click.option(
    "-o", "--output-file", metavar="OUT", help="The repaired mesh: .msh, .su2, .vtk, .vtu, .stl, .obj, .off or .foam."
)
@click.option(
    "--passes",
    metavar="NAME,NAME",
    help="Which passes to run; default orient, untangle, improve, triangles. `--list-passes` tells what each does.",
)
@click.option(
    "--target",
    metavar="PROFILE",
    help="In place of --passes: run what this profile (`meshwright profiles`) or gate file calls for, until the mesh "
    "keeps it, and tell which cells are left and what holds them.",
)
@click.option("--list-passes", is_flag=True, is_eager=True, expose_value=False, help="Tell the passes and stop.",
              callback=lambda ctx, _, value: _list(ctx) if value and not ctx.resilient_parsing else None)  # fmt: skip
@click.option(
    "--hold", multiple=True, metavar="GLOB", help="Do not move the points of matching zones; may be repeated."
)
@click.option(
    "--tolerance", type=click.FloatRange(0), metavar="LENGTH", help="Of weld; default 1e-6 of the shortest edge."
)
@click.option(
    "--boundary",
    type=click.Choice(("fixed", "slide", "project")),
    default="fixed",
    help="Of tets: slide moves points inside flat parts of the boundary, project inside smooth ones, along the surface "
    "as it is. Edges of the geometry and borders of zones stay. Default: fixed.",
)
@click.option(
    "--nodes",
    type=click.Choice(("keep", "free")),
    default="keep",
    help="Of tets and triangles: free puts points in and takes inner ones away where cells are bad. Default: keep.",
)
@click.option(
    "--refine", multiple=True, metavar="GLOB", help="Zones of cells to be refined; may be repeated. Default: all."
)
@click.option(
    "--max-edge", type=click.FloatRange(0, min_open=True), metavar="LENGTH", help="Refine until no edge is longer."
)
@click.option(
    "--max-hole", type=click.IntRange(0), default=0, metavar="EDGES", help="Close larger holes too; default 16 edges."
)
@click.option("--dry-run", is_flag=True, help="Tell what would be done and write nothing.")
@click.option(
    "--format", "output", type=click.Choice(("text", "json")), default="text", help="Of the receipt on stdout."
)
@click.option("--journal", metavar="FILE", help="Write every change and the input itself there, for --undo.")
@click.option(
    "--undo", metavar="JOURNAL", help="IN is a repaired mesh: write what it was before, byte for byte, to OUT."
)
@click.option("--html", metavar="FILE", help="Write a report on the repaired mesh, with before and after.")
@click.option("--input-format", metavar="NAME", help="Read as this format instead of looking at the content.")
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all processors; the result is the same.")
@click.option("--quiet", is_flag=True, help="No progress on stderr.")
@click.pass_context
def command(ctx: click.Context, /, **options: Any) -> None:
    """Repair the mesh IN and write it to OUT, with a receipt.

    Boundaries (see --boundary), borders between zones and layers of wedges stay where they are, to the last bit. A pass
    that would invert a cell, change the volume or make the worst cell of a neighbourhood worse is rolled back, and the
    receipt says so. Repairing the result again changes nothing.

    \b
      meshwright repair part.msh -o better.msh --journal part.journal
      meshwright repair better.msh --undo part.journal -o part.msh

    Exit status: 0 done; 1 written, but inverted or degenerate cells are left or --target still fails; 2 wrong usage;
    3 IN could not be read.
    """
    from meshwright.reports.repair_job import RepairJob, run_repair  # noqa: PLC0415 - keeps --help fast

    ctx.exit(run_repair(RepairJob(**options)))


def _list(ctx: click.Context) -> None:
    from meshwright.repair.passes import GROUPS, PASSES  # noqa: PLC0415

    width = max(map(len, PASSES))
    for row in PASSES.values():
        click.echo(f"{row.name:{width}}  {row.title}{'' if row.explicit else ' (default)'}")
    for name, members in GROUPS.items():
        click.echo(f"{name:{width}}  all of {', '.join(members)}")
    ctx.exit(0)
