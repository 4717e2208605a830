"""Checks that need to know what a boundary is for: points below the axis, orthogonality at walls."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
