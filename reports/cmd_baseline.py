"""`meshwright baseline`: audits kept under a name, to hold later ones against."""

from __future__ import annotations

import click

__all__ = ["command"]


@click.group("baseline")
def command() -> None:
    """Keep audits under a name, for `audit --baseline NAME` and for rules with `no_worse`.

    They are JSON documents in `.meshwright/baselines` of the project: the nearest folder with `.meshwright` or `.git`.
    """


@command.command("save")
@click.argument("name")
@click.argument("mesh", metavar="MESH|AUDIT")
@click.option("--metrics", default="default", metavar="default|all|ID,ID", help="What to measure.")
@click.option("--gate", metavar="FILE", help="Measure the rules of a gate file too: rules with no_worse need that.")
@click.option("--profile", metavar="NAME", help="Measure the rules of a system too.")
@click.option("--zone", metavar="GLOB", help="Count only the cells of matching zones.")
@click.option("--input-format", metavar="NAME", help="Read as this format instead of looking at the content.")
@click.option("--quiet", is_flag=True, help="No progress on stderr.")
def save(
    name: str, mesh: str, metrics: str, gate: str | None, profile: str | None, zone: str | None,
    input_format: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Audit MESH and keep the result as NAME, in place of an earlier one; a saved audit is kept as it is."""
    from meshwright.reports.baseline_store import save_baseline  # noqa: PLC0415 - keeps --help fast
    from meshwright.reports.job import Job  # noqa: PLC0415

    job = Job((mesh,), metrics=metrics, gate=gate, profile=profile, zone=zone, input_format=input_format, quiet=quiet)
    save_baseline(name, job)


@command.command("list")
@click.option("--format", "output", type=click.Choice(("text", "json")), default="text", help="Of the list.")
def list_(output: str) -> None:
    """List the baselines of this project."""
    from meshwright.reports.baseline_store import list_baselines  # noqa: PLC0415
    from meshwright.reports.writing import deliver  # noqa: PLC0415

    deliver(list_baselines(output), None)


@command.command("remove")
@click.argument("name")
def remove(name: str) -> None:
    """Remove the baseline NAME."""
    from meshwright.reports.baseline_store import remove_baseline  # noqa: PLC0415

    remove_baseline(name)
