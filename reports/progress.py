"""Progress on stderr: a bar per mesh on a terminal, silence elsewhere, and one line when kernels are compiled."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from meshwright.audit.errors import printable

__all__ = ["announce_compilation", "stages"]

Tell = Callable[[str, int, int], None]


def announce_compilation(*, quiet: bool) -> None:
    """Say on stderr, once, that kernels are being compiled: the first run takes much longer than the next."""
    if not quiet:
        from meshwright.audit.jit import on_first_compilation  # noqa: PLC0415 - numba is slow to import

        on_first_compilation(
            lambda: click.echo(
                "meshwright: compiling kernels new to this machine; later runs find them ready", err=True
            )
        )


@contextmanager
def stages(path: str, *, quiet: bool) -> Iterator[Tell]:
    """A function that shows (stage, done, of); it does nothing unless stderr is a terminal."""
    if quiet or not sys.stderr.isatty():
        yield lambda stage, done, of: None
        return
    from rich.console import Console  # noqa: PLC0415 - wanted on terminals only
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        TextColumn("{task.fields[stage]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(printable(path, 40), total=None, stage="read")

        def tell(stage: str, done: int, of: int) -> None:
            progress.update(task, stage=stage, completed=done, total=of or None)

        yield tell
