"""Verdicts and the exit status they stand for."""

from __future__ import annotations

from meshwright.reports.outputs import Batch

__all__ = ["EXIT_INCOMPLETE", "EXIT_USAGE", "exit_status", "worst_verdict"]

EXIT_USAGE = 2
EXIT_INCOMPLETE = 3

_STATUS = {"pass": 0, "warn": 0, "fail": 1, "incomplete": EXIT_INCOMPLETE}
_ORDER = ("pass", "warn", "fail", "incomplete")


def worst_verdict(batch: Batch) -> str:
    """The verdict of a whole run: "incomplete" over "fail" over "warn" over "pass"; an unread mesh is incomplete."""
    verdicts = [document["gate"]["verdict"] for document in batch.documents]
    verdicts += ["incomplete"] * len(batch.unread)
    return max(verdicts, key=_ORDER.index, default="incomplete")


def exit_status(batch: Batch) -> int:
    """0 pass or warn, 1 fail, 3 unreadable or incomplete."""
    return _STATUS[worst_verdict(batch)]
