"""`meshwright gate`: check a gate file, begin one, and the schema that editors check it by."""

from __future__ import annotations

import click

__all__ = ["command"]


@click.group("gate")
def command() -> None:
    """Rules that a mesh has to keep, in a file of your own: `meshgate.toml`, for `audit --gate`."""


@command.command("check")
@click.argument("file", metavar="FILE")
@click.pass_context
def check(ctx: click.Context, file: str) -> None:
    """Say what is wrong in gate FILE, or list the rules it comes to, inherited ones included.

    FILE may be preset:NAME. Exit status: 0, or 2 where FILE has mistakes; each names line, key and what may stand
    there.
    """
    from meshwright.reports.gate_list import check_gate  # noqa: PLC0415 - keeps --help fast

    ctx.exit(check_gate(file))


@command.command("schema")
@click.option("-o", "--output-file", metavar="FILE", help="Write it there instead of to stdout.")
def schema(output_file: str | None) -> None:
    """Print the JSON Schema of gate files, for editors."""
    from meshwright.reports.gate_list import schema_text  # noqa: PLC0415
    from meshwright.reports.writing import deliver  # noqa: PLC0415

    deliver(schema_text(), output_file)


@command.command("init")
@click.option("-o", "--output-file", default="meshgate.toml", show_default=True, metavar="FILE", help="Where to.")
@click.option("--preset", default="cfd", show_default=True, metavar="NAME", help="The profile to begin with.")
def init(output_file: str, preset: str) -> None:
    """Write a gate file with a preset, examples of rules and comments to edit; an existing file stays."""
    from meshwright.reports.gate_list import write_starter  # noqa: PLC0415

    write_starter(output_file, preset)
