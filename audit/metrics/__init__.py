"""The metric registry: every row of every family, by id, in the order in which reports show them."""

from __future__ import annotations

import difflib

from meshwright.audit.cells import LINEAR_TYPES
from meshwright.audit.errors import UsageError
from meshwright.audit.metrics import (
    angles,
    ansys,
    aspect,
    dihedral,
    edges,
    faces,
    fluent,
    gauss,
    hypermesh,
    icem,
    jacobian,
    modes,
    neighbours,
    openfoam,
    points,
    second_order,
    shells,
    size,
    structural,
    tets,
    verdict,
)
from meshwright.audit.metrics.row import Metric

__all__ = ["APPLICABILITY", "DEFAULT", "LEFT_OUT", "METRICS", "Metric", "find", "select"]

_FAMILIES = (
    *(angles, dihedral, aspect, edges, modes, jacobian, size),
    *(icem, fluent, neighbours, faces, openfoam, points),
    *(ansys, hypermesh, gauss, shells, tets, structural, verdict, second_order),
)

METRICS: dict[str, Metric] = {row.id: row for family in _FAMILIES for row in family.ROWS}
"""Every metric by id."""

LEFT_OUT: dict[str, str] = {
    (name if "." in name else f"{family.__name__.rpartition('.')[2]}: {name}"): reason
    for family in (icem, structural, verdict)
    for name, reason in family.LEFT_OUT.items()
}
"""Names of other programs' criteria that are no metrics here, and why: no usable definition, or another row has it."""

DEFAULT: tuple[str, ...] = tuple(
    row.id for family in (angles, aspect, edges, modes, jacobian, size) for row in family.ROWS
)
"""Ids measured when nothing else is asked for: the article's table, and what shows that a cell is bad."""

_ARTICLE = (
    ("Area", "area"),
    ("Aspect Ratio", "gambit.aspect_ratio"),
    ("Diagonal Ratio", "gambit.diagonal_ratio"),
    ("Edge Ratio", "gambit.edge_ratio"),
    ("Equi-Angle Skew", "gambit.equiangle_skew"),
    ("Equi-Size Skew", "gambit.equisize_skew"),
    ("Mid-Angle Skew", "gambit.midangle_skew"),
    ("Stretch", "gambit.stretch"),
    ("Taper", "gambit.taper"),
    ("Volume", "volume"),
    ("Warpage", "gambit.warpage"),
)

APPLICABILITY: tuple[tuple[str, str, dict[str, bool]], ...] = tuple(
    (title, id_, {name: name in METRICS[id_].on for name in LINEAR_TYPES}) for title, id_ in _ARTICLE
)
"""GAMBIT's table of parameters and element types: (parameter, metric id, {type: defined?})."""


def find(id_: str) -> Metric:
    """The metric of that id; UsageError with the nearest ids for an unknown one."""
    if id_ in METRICS:
        return METRICS[id_]
    near = difflib.get_close_matches(id_, METRICS, n=3, cutoff=0.5) or [m for m in METRICS if id_ and id_ in m][:3]
    hint = f"did you mean {' or '.join(near)}?" if near else "`meshwright explain` lists them all"
    raise UsageError(f"unknown metric {id_!r}; {hint}")


def select(text: str) -> tuple[Metric, ...]:
    """The metrics named by "default", "all" or a comma-separated list of ids, without repetition."""
    if text == "all":
        return tuple(METRICS.values())
    if text == "default":
        return tuple(METRICS[id_] for id_ in DEFAULT)
    ids = [word.strip() for word in text.split(",") if word.strip()]
    if not ids:
        raise UsageError("no metric named; give default, all or ids separated by commas")
    return tuple(dict.fromkeys(find(id_) for id_ in ids))
