"""The registry of outputs. A new one is a file with a `render` function and a row here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, Literal, cast

__all__ = ["OF_UNREAD", "OUTPUTS", "Batch", "Page", "Unread", "render"]


@dataclass(frozen=True)
class Unread:
    """A mesh that could not be audited, and why."""

    path: str
    message: str


@dataclass(frozen=True)
class Batch:
    """All results of one run: documents in the order of the arguments, and what failed."""

    documents: list[dict[str, Any]]
    unread: list[Unread] = field(default_factory=list)


@dataclass(frozen=True)
class Page:
    """What is wanted of an output: `tables` leaves out all but the article's tables; zones adds them per zone."""

    width: int = 100
    colour: bool = False
    content: Literal["audit", "tables"] = "audit"
    zones: bool = False


OUTPUTS = {
    "text": "meshwright.reports.text",
    "json": "meshwright.reports.json_",
    "md": "meshwright.reports.markdown",
    "csv": "meshwright.reports.csv_",
    "junit": "meshwright.reports.junit",
    "sarif": "meshwright.reports.sarif",
    "github": "meshwright.reports.github",
    "gitlab": "meshwright.reports.gitlab",
}
"""Module of each output by the name used in `--format`; modules load when they are used."""


OF_UNREAD = ("junit", "sarif", "github", "gitlab")
"""Outputs that are written of a mesh that could not be read too, lest those of an earlier run stand for this one."""


def render(output: str, batch: Batch, page: Page) -> str:
    """The text of one output, ending with a line feed; KeyError for an unknown one."""
    module = import_module(OUTPUTS[output])
    return cast(Callable[[Batch, Page], str], module.render)(batch, page)
