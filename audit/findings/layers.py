"""The audit of boundary layers: count, first height, growth, collapse."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
