"""The check that finds structured blocks in a mesh of hexahedra or quadrilaterals."""

from __future__ import annotations

from meshwright.audit.findings.finding import Check

__all__ = ["ROWS"]

ROWS: tuple[Check, ...] = ()
