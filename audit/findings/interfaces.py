"""Checks on what should fit together: interfaces, hanging nodes, periodic zones, branch cuts."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
