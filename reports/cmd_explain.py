"""`meshwright explain`: what a metric is."""

from __future__ import annotations

import click

__all__ = ["command"]


@click.command("explain")
@click.argument("metric", required=False)
def command(metric: str | None) -> None:
    """Print the formula, range, users, source and caveat of METRIC; without one, list all metrics."""
    from meshwright.reports.registry_text import explain, list_metrics  # noqa: PLC0415 - keeps --help fast
    from meshwright.reports.writing import deliver  # noqa: PLC0415

    deliver(list_metrics() if metric is None else explain(metric), None)
