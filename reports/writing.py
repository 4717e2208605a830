"""Delivering a result: to stdout in what the terminal can show, or whole into a file."""

from __future__ import annotations

import os
import shutil
import sys

import click

from meshwright.audit.files import replacing

__all__ = ["deliver", "page_width", "wants_colour"]

_WIDEST = 100
_NARROWEST = 60
_PLAIN = str.maketrans({"─": "-", "█": "#", "…": "~", "·": "-", "—": "-"} | dict.fromkeys("▏▎▍▌▋▊▉", "|"))


def wants_colour() -> bool:
    """Colour only on a terminal that can show it, and never against NO_COLOR."""
    return sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def page_width() -> int:
    """Columns of the page: the terminal's, but no more than is comfortable to read."""
    if not sys.stdout.isatty() and "COLUMNS" not in os.environ:
        return _WIDEST
    return max(_NARROWEST, min(_WIDEST, shutil.get_terminal_size((_WIDEST, 40)).columns))


def deliver(text: str, path: str | None) -> None:
    """Print `text`, or put it into the file `path` (UTF-8); UsageError where that cannot be written."""
    if path is not None and path != "-":
        with replacing(path) as stream:
            stream.write(text.encode("utf-8", "replace"))
        return
    encoding = sys.stdout.encoding or "utf-8"
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        text = text.translate(_PLAIN).encode(encoding, "backslashreplace").decode(encoding)
    click.echo(text, nl=False, color=True)
