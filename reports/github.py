"""GitHub Actions: a workflow command for each broken rule, and a table in the summary of the job.

https://docs.github.com/actions/reference/workflow-commands-for-github-actions
"""

from __future__ import annotations

import os
from pathlib import Path

import click

from meshwright.audit.errors import printable
from meshwright.reports.markdown import MARKER, comment
from meshwright.reports.outputs import Batch, Page
from meshwright.reports.results import LONGEST, file_uri, results
from meshwright.reports.verdicts import worst_verdict
from meshwright.reports.wording import name

__all__ = ["render"]

_COMMANDS = {"fail": "error", "incomplete": "error", "warn": "warning", "waived": "notice"}
_MOST = 50
_SUMMARY_ENV = "GITHUB_STEP_SUMMARY"
_MOST_SUMMARY = 900_000
"""Bytes of a summary; GitHub refuses those of more than 1 MiB."""


def render(batch: Batch, page: Page) -> str:
    """The commands, failures first, and a line with the verdict; the summary of the job is written beside."""
    gates = {d["mesh"]["path"] or "mesh": d["gate"]["file"] for d in batch.documents}
    found = [result for result in results(batch) if result.state in _COMMANDS]
    found.sort(key=lambda result: list(_COMMANDS).index(result.state))
    lines = []
    for result in found[:_MOST]:
        path = _property(printable(file_uri(result.mesh, gates.get(result.mesh)), 1000))
        title = _property(name(f"meshwright {result.rule}", LONGEST))
        message = _data(name(result.message, 10 * LONGEST))
        lines.append(f"::{_COMMANDS[result.state]} file={path},line=1,title={title}::{message}")
    if len(found) > _MOST:
        lines.append(f"::notice title=meshwright::{len(found) - _MOST} more results are in the other outputs")
    lines.append(f"meshwright: {worst_verdict(batch)}")
    _write_summary(batch, page)
    return "\n".join(lines) + "\n"


def _data(value: str) -> str:
    return value.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(value: str) -> str:
    return _data(value).replace(":", "%3A").replace(",", "%2C")


def _write_summary(batch: Batch, page: Page) -> None:
    path = os.environ.get(_SUMMARY_ENV)
    if not path:
        return
    text = comment(batch, page, _MOST_SUMMARY).removeprefix(f"{MARKER}\n")
    try:
        with Path(path).open("ab") as stream:
            stream.write(text.encode("utf-8", "replace") + b"\n")
    except OSError as error:
        click.echo(f"meshwright: the summary of the job could not be written: {error.strerror}", err=True)
