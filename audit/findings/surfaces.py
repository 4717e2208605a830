"""Checks on shells: open edges and holes, T-joints, whether they are watertight."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
