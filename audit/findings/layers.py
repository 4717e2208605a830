"""The audit of boundary layers: count, first height, growth, thickness, jumps between columns, collapse."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.columns import END_OF_LAYERS, Columns, wall_columns
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.places import plain, text

__all__ = ["ROWS", "collapsed_columns"]

_LAYERED = 2
"""Layers from which on a column counts as part of a boundary layer."""


def boundary_layers(facts: Facts) -> Found | None:
    """First cells of the columns of boundary layers, with a table of the wall zones."""
    walls = [wall for wall in wall_columns(facts.mesh) if np.any(wall.layers >= _LAYERED)]
    if not walls:
        return None
    table = [_figures(wall) for wall in walls]
    rows = np.unique(np.concatenate([wall.cell[wall.layers > 0] for wall in walls]))
    lines = [
        f"{entry['zone']}: {entry['layers']['min']} to {entry['layers']['max']} layers, first height "
        f"{_short(entry['first_height']['min'])} to {_short(entry['first_height']['max'])}, growth up to "
        f"{_short(entry['growth']['max'])}"
        for entry in table[:5]
    ]
    more = f"; and {len(table) - 5} more zones" if len(table) > 5 else ""
    return Found(
        rows,
        f"boundary layers on {counted(len(table), 'wall zone')} ({'; '.join(lines)}{more}): compare the first height "
        "with the y+ of the turbulence model",
        detail={"zones": table},
    )


def _figures(wall: Columns) -> dict[str, Any]:
    there = wall.layers > 0
    steps = wall.layers > 1
    # the mean step of a column is the root of the ratio of its last height to its first
    mean = (wall.last[steps] / wall.first[steps]) ** (1.0 / (wall.layers[steps] - 1))
    return {
        "zone": text(wall.zone.name),
        "columns": len(wall.layers),
        "without_layers": int(np.count_nonzero(~there)),
        "layers": {
            "min": int(wall.layers.min()), "mean": float(wall.layers.mean()), "max": int(wall.layers.max()),
        },
        "first_height": _range(wall.first[there]),
        "total_thickness": _range(wall.total[there]),
        "growth": {
            "min": plain(float(wall.least[steps].min())), "mean": plain(float(mean.mean())),
            "max": plain(float(wall.most[steps].max())),
        },
        "max_thickness_jump": _jump(wall),
        "shortened": int(np.count_nonzero(shortened_columns(wall))),
        "collapsed": int(np.count_nonzero(collapsed_columns(wall))),
    }  # fmt: skip


def _range(values: NDArray[np.float64]) -> dict[str, float | str]:
    with np.errstate(over="ignore"):
        return {name: plain(float(f(values))) for name, f in (("min", np.min), ("mean", np.mean), ("max", np.max))}


def _short(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


def _jump(wall: Columns) -> float | str | None:
    """Largest ratio of the thickness of two neighbouring columns with layers."""
    a, b = wall.total[wall.pairs].T
    both = (a > 0.0) & (b > 0.0)
    return plain(float(np.max(np.maximum(a[both] / b[both], b[both] / a[both])))) if both.any() else None


def shortened_columns(wall: Columns) -> NDArray[np.bool_]:
    """Columns that end for want of a prism with fewer layers than one beside them: the steps of a staircase."""
    most = wall.layers.copy()
    a, b = wall.pairs.T
    np.maximum.at(most, a, wall.layers[b])
    np.maximum.at(most, b, wall.layers[a])
    return (wall.reason == END_OF_LAYERS) & (wall.layers < most)


def collapsed_columns(wall: Columns) -> NDArray[np.bool_]:
    """Columns that end for want of a prism with half the layers of the wall's median column or fewer.

    None on a wall of which less than half is layered.
    """
    if not len(wall.layers) or np.median(wall.layers) < _LAYERED:
        return np.zeros(len(wall.layers), dtype=bool)
    return (wall.reason == END_OF_LAYERS) & (2 * wall.layers <= np.median(wall.layers))


def layer_collapse(facts: Facts) -> Found | None:
    """First cells of the columns that end early."""
    walls = wall_columns(facts.mesh)
    lost = [wall.cell[collapsed_columns(wall)] for wall in walls]
    rows = np.unique(np.concatenate([*lost, np.empty(0, np.int32)]))
    if not len(rows):
        return None
    names = [text(wall.zone.name) for wall, cells in zip(walls, lost, strict=True) if len(cells)]
    return Found(
        rows,
        f"{counted(len(rows), 'column')} of the boundary layer with half the usual layers or fewer (on "
        f"{', '.join(names[:5])}): the layer collapses there and wall friction and heat flux are off; grow the layers "
        "with less height or smooth the surface below them",
        detail={
            "zones": {text(wall.zone.name): len(cells) for wall, cells in zip(walls, lost, strict=True) if len(cells)}
        },
    )


ROWS = (
    Check(
        "boundary-layers", "info", "Boundary layers", "cell",
        "figures to judge by: what is right depends on the flow", boundary_layers,
    ),
    Check(
        "layer-collapse", "warning", "Layers that end early", "cell",
        "the flow at the wall is resolved on one side of the step and not on the other", layer_collapse,
    ),
)  # fmt: skip
