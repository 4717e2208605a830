"""The check on curved cells: valid, invalid or undecided, by Bezier bounds of the Jacobian."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
