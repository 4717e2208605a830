"""`Options`: what checks cannot read off a mesh and a user may tell them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["Options", "SizeRegion"]


@dataclass(frozen=True)
class SizeRegion:
    """A wanted element size.

    shape: "global", "zone" (cells or faces of the zones that match `zone`), "box" (low and high corner), "cylinder"
    (two ends and a radius) or "sphere" (centre and radius), as in `place`.  size: wanted edge length.
    """

    name: str
    size: float
    shape: Literal["global", "zone", "box", "cylinder", "sphere"] = "global"
    zone: str = "*"
    place: tuple[float, ...] = ()


@dataclass(frozen=True)
class Options:
    """discipline: "cfd", "fea" or "" for no opinion on element order and 1-D elements.

    axis: of rotation ("x", "y"), for a 2-D mesh that is axisymmetric; None where it is not.  unit: millimetres that one
    unit of length stands for, None where it is not known; for the bands of the merge tolerance.
    feature_angle: degrees between surface normals above which an edge is a feature.
    growth: largest ratio of sizes of neighbours that share a face or an edge.
    sizes: wanted sizes, the general before the special: a later region overrules an earlier one, and zones of points,
    lines and surfaces overrule regions of space and cells, in this order.
    """

    discipline: Literal["cfd", "fea", ""] = ""
    axis: Literal["x", "y"] | None = None
    unit: float | None = None
    feature_angle: float = 10.0
    growth: float = 2.0
    sizes: tuple[SizeRegion, ...] = ()
