"""`meshwright formats`: what can be read."""

from __future__ import annotations

import click

__all__ = ["command"]


@click.command("formats")
def command() -> None:
    """List the file formats that can be read; the names are those of --input-format."""
    from meshwright.reports.registry_text import list_formats  # noqa: PLC0415 - keeps --help fast
    from meshwright.reports.writing import deliver  # noqa: PLC0415

    deliver(list_formats(), None)
