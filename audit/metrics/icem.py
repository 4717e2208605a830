"""ICEM CFD's criteria beyond aspect ratio and determinant."""

from __future__ import annotations

from meshwright.audit.metrics.row import Metric

__all__ = ["ROWS"]

ROWS: tuple[Metric, ...] = ()
