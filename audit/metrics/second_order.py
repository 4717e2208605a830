"""Metrics of second-order cells that look at the mid-side nodes."""

from __future__ import annotations

from meshwright.audit.metrics.row import Metric

__all__ = ["ROWS"]

ROWS: tuple[Metric, ...] = ()
