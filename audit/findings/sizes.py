"""Checks on sizes: jumps between neighbours, wanted sizes, volume ratios."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
