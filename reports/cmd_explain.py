"""`meshwright explain`: what a metric or a check is."""

from __future__ import annotations

import click

__all__ = ["command"]


@click.command("explain")
@click.argument("name", metavar="[METRIC|CHECK]", required=False)
@click.option("--checks", is_flag=True, help="List the checks instead of the metrics.")
@click.option("--left-out", is_flag=True, help="List what other programs have and this one does not, and why.")
def command(name: str | None, checks: bool, left_out: bool) -> None:
    """Print the formula, range, users, source, caveat and limits of METRIC, or what CHECK looks for.

    Without a name, list all metrics.
    """
    from meshwright.reports.registry_text import (  # noqa: PLC0415 - keeps --help fast
        explain,
        list_checks,
        list_left_out,
        list_metrics,
    )
    from meshwright.reports.writing import deliver  # noqa: PLC0415

    if (name is not None) + checks + left_out > 1:
        raise click.UsageError("give a name, --checks or --left-out, one of them")
    if name is not None:
        deliver(explain(name), None)
    else:
        deliver(list_checks() if checks else list_left_out() if left_out else list_metrics(), None)
