"""`meshwright audit`: options. The work is in `job.py`, imported when it begins."""

from __future__ import annotations

from typing import Any

import click

__all__ = ["FORMATS", "command"]

FORMATS = ("text", "json", "md", "csv")
"""Outputs that know tables alone as well as audits."""

_CI_FORMATS = ("junit", "sarif", "github", "gitlab")


@click.command("audit")
@click.argument("paths", metavar="PATH...", nargs=-1, required=True)
@click.option(
    "--profile",
    metavar="NAME",
    help="Judge by the limits of a system: fluent, icem, gambit, cfx, openfoam, hypermesh, optistruct, ansys, femap, "
    "patran, nastran, cubit, verdict, pointwise, cfd or fea; `all` compares them all and judges by none.",
)
@click.option(
    "--gate",
    metavar="FILE",
    help="Judge by the rules of a gate file (`meshwright gate init` writes one), preset:NAME, an OpenFOAM "
    "meshQualityDict, HyperMesh criteria, or TOML as `meshwright profiles export` writes it.",
)
@click.option(
    "--baseline",
    metavar="FILE|NAME",
    help="An earlier audit to hold this one against: JSON, an HTML report, or a name of `meshwright baseline save`.",
)
@click.option(
    "--fail-on",
    type=click.Choice(("fail", "warn")),
    default="fail",
    show_default=True,
    help="The verdict from which on the exit status is 1.",
)
@click.option("--exit-zero", is_flag=True, help="Exit with 0 for a failure too; with 3 for what could not be checked.")
@click.option(
    "--metrics", default="default", metavar="default|all|ID,ID", help="What to measure, beside what limits need."
)
@click.option("--zone", metavar="GLOB", help="Count only the cells of matching zones.")
@click.option(
    "--format",
    "output",
    type=click.Choice((*FORMATS, *_CI_FORMATS)),
    default="text",
    help="Of the result on stdout.",
)
@click.option("-o", "--output-file", metavar="FILE", help="Write the result there instead of to stdout.")
@click.option("--out", "outs", multiple=True, metavar="FORMAT=FILE", help="Write another result; may be repeated.")
@click.option("--html", metavar="FILE", help="Write a report to look at: one page with a 3-D view, for any browser.")
@click.option("--cells", metavar="FILE", help="Write the values of every cell: .parquet, .csv or .vtu.")
@click.option("--input-format", metavar="NAME", help="Read as this format instead of looking at the content.")
@click.option("--surfaces", is_flag=True, help="Measure the boundary surface of a 3-D mesh too.")
@click.option(
    "--discipline",
    type=click.Choice(("cfd", "fea")),
    help="Whose customs hold for element order and 1-D elements. Default: the profile's.",
)
@click.option(
    "--axis",
    type=click.Choice(("x", "y")),
    help="Axis of rotation of an axisymmetric 2-D mesh: no point may lie below.",
)
@click.option("--unit", metavar="mm|cm|m|in|FLOAT", help="Unit of length of the mesh, or its millimetres.")
@click.option(
    "--feature-angle",
    type=click.FloatRange(0, 180),
    default=10.0,
    show_default=True,
    metavar="DEG",
    help="Angle between surface normals from which on an edge is a feature.",
)
@click.option("--sizes", metavar="FILE", help="Wanted element sizes: TOML with [[region]] tables.")
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

    Exit status: 0 pass or warn; 1 a check reports an error or a rule of --profile or --gate fails; 2 wrong usage, a
    mistake in a file of limits included; 3 a mesh or a baseline could not be read, or a rule not be decided. A value
    that equals a limit passes; `meshwright profiles show NAME` lists limits with their sources, `meshwright gate check
    FILE` the rules of a gate file.

    \b
    --sizes:  [[region]]          name = "wake"    size = 0.5
              shape = "box"       low = [0, -1, -1]    high = [5, 1, 1]
              Shapes: global, zone (zone = "wing*"), box, cylinder (start, end, radius),
              sphere (centre, radius). A later region overrules an earlier one.
    """
    from meshwright.reports.job import Job, run_audit  # noqa: PLC0415 - `--help` must not load the engine

    ctx.exit(run_audit(Job(**options)))
