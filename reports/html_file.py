"""`--html`: the report of an audit into a file, whole or not at all."""

from __future__ import annotations

import click

from meshwright.audit.errors import printable
from meshwright.audit.files import replacing
from meshwright.audit.profiles.baseline import Baseline
from meshwright.audit.run import Audit
from meshwright.audit.summary import Summary

__all__ = ["write_incomplete", "write_report"]


def write_report(path: str, audit: Audit, document: Summary, baseline: Baseline | None) -> None:
    """Write the report; a word on stderr where it has become too large to be sent around."""
    from meshwright.reports.html.report import WARN_BYTES, report_html  # noqa: PLC0415 - loads jinja2

    before = None if baseline is None or baseline.document is None else dict(baseline.document)
    data = report_html(audit, document, baseline=before).encode("utf-8", "replace")
    with replacing(path) as stream:
        stream.write(data)
    if len(data) > WARN_BYTES:
        click.echo(
            f"meshwright: {printable(path, 200)} has {len(data) / 2**20:.0f} MB, which browsers and mail bear badly; "
            "--metrics default and --zone make it smaller",
            err=True,
        )


def write_incomplete(path: str, mesh: str, reason: str) -> None:
    """A page that says that the mesh could not be read, in place of that of an earlier run."""
    from meshwright.reports.html.report import incomplete_html  # noqa: PLC0415 - loads jinja2

    text = incomplete_html(printable(mesh, 300), printable(reason, 1000))
    with replacing(path) as stream:
        stream.write(text.encode("utf-8", "replace"))
