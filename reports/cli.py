"""The `meshwright` command: the group, its errors and exit status. Importing it costs little more than click."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any, NoReturn

import click

from meshwright.audit.errors import MeshwrightError, UsageError

__all__ = ["COMMANDS", "cli", "main"]

COMMANDS = {
    "audit": "meshwright.reports.cmd_audit",
    "repair": "meshwright.reports.cmd_repair",
    "table": "meshwright.reports.cmd_table",
    "explain": "meshwright.reports.cmd_explain",
    "profiles": "meshwright.reports.cmd_profiles",
    "gate": "meshwright.reports.cmd_gate",
    "compare": "meshwright.reports.cmd_compare",
    "baseline": "meshwright.reports.cmd_baseline",
    "plot": "meshwright.reports.cmd_plot",
    "formats": "meshwright.reports.cmd_formats",
}
"""Module of each command; it holds a click command called `command` and imports no more than click."""

_EXIT_USAGE = 2
_EXIT_UNREADABLE = 3
_EXIT_INTERRUPTED = 130
_EXIT_PIPE_CLOSED = 141


class _Group(click.Group):
    """Loads commands on use, and turns every deliberate error into one line and an exit status."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = import_module(COMMANDS[cmd_name]).command
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """As click's, which would make a closed pipe 1 ("fail" here) and print a blank line for an interrupt."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            return _EXIT_INTERRUPTED
        except BrokenPipeError:
            return _pipe_closed()

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        **extra: Any,
    ) -> NoReturn:
        """Run a command and exit; errors are never passed on, so `standalone_mode` changes nothing."""
        try:
            status = super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
            sys.stdout.flush()
        except click.ClickException as error:
            error.show()
            status = error.exit_code
        except UsageError as error:
            status = _complain(error, _EXIT_USAGE)
        except MeshwrightError as error:
            status = _complain(error, _EXIT_UNREADABLE)
        except MemoryError:
            click.echo("meshwright: not enough memory for this mesh", err=True)
            status = _EXIT_UNREADABLE
        except (KeyboardInterrupt, click.Abort):
            status = _EXIT_INTERRUPTED
        except BrokenPipeError:
            status = _pipe_closed()
        sys.exit(status or 0)


def _pipe_closed() -> int:
    """Whoever read our output has seen enough; without this Python complains again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return _EXIT_PIPE_CLOSED


def _complain(error: MeshwrightError, status: int) -> int:
    click.echo(f"meshwright: {error}", err=True)
    return status


def _print_version(ctx: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        from importlib.metadata import version  # noqa: PLC0415 - slow to import, wanted here alone

        click.echo(f"meshwright {version('meshwright')}")
        ctx.exit()


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_print_version, help="Print it.")
def cli() -> None:
    """Audit the quality of CFD and FEA meshes by every vendor's own definition.

    Exit status: 0 pass (warnings included), 1 fail, 2 wrong usage, 3 a mesh could not be read or not be measured
    completely.
    """


def main() -> None:
    """Entry point of the `meshwright` command."""
    # Going over the objects of numba and its caches again and again takes a tenth of a run; meshes are no cycles.
    gc.disable()
    cli.main(prog_name="meshwright")
