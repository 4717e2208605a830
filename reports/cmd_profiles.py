"""`meshwright profiles`: what each system demands of a mesh, and writing it as another program's file of limits."""

from __future__ import annotations

import click

__all__ = ["command"]

_FORMATS = ("text", "json")
_KINDS = ("meshQualityDict", "hypermesh", "toml")


@click.group("profiles", invoke_without_command=True)
@click.option("--format", "output", type=click.Choice(_FORMATS), default="text", help="Of the list.")
@click.pass_context
def command(ctx: click.Context, output: str) -> None:
    """List the profiles: what each system demands of a mesh, for `audit --profile NAME`."""
    if ctx.invoked_subcommand is None:
        from meshwright.reports.profile_text import list_profiles  # noqa: PLC0415 - keeps --help fast
        from meshwright.reports.writing import deliver  # noqa: PLC0415

        deliver(list_profiles(output), None)


@command.command("show")
@click.argument("name")
@click.option("--format", "output", type=click.Choice(_FORMATS), default="text", help="Of the result.")
@click.option("-o", "--output-file", metavar="FILE", help="Write the result there instead of to stdout.")
def show(name: str, output: str, output_file: str | None) -> None:
    """Print the limits of profile NAME with the source of each, and what is left out and why."""
    from meshwright.reports.profile_text import show_profile  # noqa: PLC0415
    from meshwright.reports.writing import deliver  # noqa: PLC0415

    deliver(show_profile(name, output), output_file)


@command.command("export")
@click.argument("name")
@click.option("--as", "kind", type=click.Choice(_KINDS), required=True, help="Whose file to write.")
@click.option("-o", "--output-file", metavar="FILE", help="Write it there, whole or not at all, instead of to stdout.")
def export(name: str, kind: str, output_file: str | None) -> None:
    """Write the limits of profile NAME as a file of another program, or as TOML to edit for `audit --gate`.

    meshQualityDict is OpenFOAM's, for checkMesh -meshQuality and snappyHexMesh; hypermesh a command file that sets the
    quality criteria for shells. What such a file cannot say is told on stderr and in a comment of the file.
    """
    from meshwright.reports.profile_text import export_profile  # noqa: PLC0415
    from meshwright.reports.writing import deliver  # noqa: PLC0415

    text, lost = export_profile(name, kind)
    deliver(text, output_file)
    for line in lost:
        click.echo(f"meshwright: left out: {line}", err=True)
