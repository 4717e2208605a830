"""Checks on element types and order: what CFD and FEA expect, misplaced pyramids, one-dimensional elements."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
