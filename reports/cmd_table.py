"""`meshwright table`: the article's tables alone."""

from __future__ import annotations

import click

from meshwright.reports.cmd_audit import FORMATS

__all__ = ["command"]


@click.command("table")
@click.argument("paths", metavar="[PATH]...", nargs=-1)
@click.option("--applicability", is_flag=True, help="Print which parameter is defined for which type of element.")
@click.option("--by-zone", is_flag=True, help="The tables of every cell zone as well.")
@click.option("--zone", metavar="GLOB", help="Count only the cells of matching zones.")
@click.option("--format", "output", type=click.Choice(FORMATS), default="text", help="Of the result on stdout.")
@click.option("-o", "--output-file", metavar="FILE", help="Write the result there instead of to stdout.")
@click.option("--input-format", metavar="NAME", help="Read as this format instead of looking at the content.")
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all processors.")
@click.option("--quiet", is_flag=True, help="No progress on stderr.")
@click.pass_context
def command(
    ctx: click.Context,
    paths: tuple[str, ...],
    applicability: bool,
    by_zone: bool,
    zone: str | None,
    output: str,
    output_file: str | None,
    input_format: str | None,
    threads: int | None,
    quiet: bool,
) -> None:
    """Print quality by type and the distributions of skewness and aspect ratio, on the Fluent and the ICEM scale.

    The exit status says whether the tables could be made (0 or 3); it judges nothing.
    """
    if applicability:
        if paths:
            raise click.UsageError("--applicability is about metrics and takes no PATH")
        from meshwright.reports.registry_text import applicability_table  # noqa: PLC0415 - keeps --help fast
        from meshwright.reports.writing import deliver  # noqa: PLC0415

        deliver(applicability_table(output), output_file)
        return
    if not paths:
        raise click.UsageError("Missing argument 'PATH'.")
    from meshwright.reports.job import Job, run_table  # noqa: PLC0415 - `--help` must not load the engine

    job = Job(
        paths=paths,
        metrics="gambit.equiangle_skew,gambit.aspect_ratio",
        zone=zone,
        output=output,
        output_file=output_file,
        input_format=input_format,
        threads=threads,
        quiet=quiet,
    )
    ctx.exit(run_table(job, by_zone=by_zone))
