"""Checks on the geometry behind a mesh: feature edges, corners, chordal deviation."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
