"""Verdicts and the exit status they stand for."""

from __future__ import annotations

from meshwright.reports.outputs import Batch

__all__ = ["EXIT_INCOMPLETE", "EXIT_USAGE", "exit_status", "worst_verdict"]

EXIT_USAGE = 2
EXIT_INCOMPLETE = 3

_ORDER = ("pass", "warn", "fail", "incomplete")


def worst_verdict(batch: Batch) -> str:
    """The verdict of a whole run: "incomplete" over "fail" over "warn" over "pass"; an unread mesh is incomplete."""
    verdicts = [document["gate"]["verdict"] for document in batch.documents]
    verdicts += ["incomplete"] * len(batch.unread)
    return max(verdicts, key=_ORDER.index, default="incomplete")


def exit_status(batch: Batch, *, fail_on: str = "fail", exit_zero: bool = False) -> int:
    """0 pass or warn, 1 fail, 3 unreadable or incomplete.

    fail_on: "warn" makes warnings 1 as well.  exit_zero: 0 for a failure too; what could not be checked stays 3.
    """
    verdict = worst_verdict(batch)
    if verdict == "incomplete":
        return EXIT_INCOMPLETE
    if exit_zero:
        return 0
    return 1 if verdict == "fail" or (verdict == "warn" and fail_on == "warn") else 0
