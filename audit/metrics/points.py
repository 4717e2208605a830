"""Metrics of points: what CFX's vertex-centred control volumes look like, and valence."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import edges, faces, nodes_of_cells
from meshwright.audit.csr import ragged, take, uniform_offsets
from meshwright.audit.geometry import in_safe_units
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import CellBlock, Floats, Mesh, index_array
from meshwright.audit.metrics.dual import dual_tables, gather_block, gather_surface
from meshwright.audit.metrics.dual_fields import finish, new_fields
from meshwright.audit.metrics.dual_polytopes import gather_polytopes
from meshwright.audit.metrics.row import Metric

__all__ = ["ROWS", "measure_points"]

_DUAL = ("expansion", "angle", "smallest_angle", "factor", "aspect")
_OF_CELLS = ("connectivity", "edge_ratio", "volume_ratio", "face_angle_min", "face_angle_max")
_COLUMNS = (*_DUAL, *_OF_CELLS)
_SOLID_ONLY = (*_DUAL, "volume_ratio")


def measure_points(mesh: Mesh, columns: Iterable[str]) -> dict[str, Floats]:
    """(n_points,) values of these columns (`Metric.column`); nan at points that are no corner of a cell.

    Columns that need volumes are absent for 2-D and surface meshes. The same bits for any number of threads.
    """
    wanted = [name for name in columns if mesh.cell_dimension == 3 or name not in _SOLID_ONLY]
    found = {}
    if "valence" in wanted:
        found["valence"] = _valence(mesh)
    rest = [name for name in wanted if name != "valence"]
    if rest:
        scaled, _ = in_safe_units(mesh)
        fields = new_fields(len(mesh.points))
        for block in scaled.blocks:
            if len(block):
                _gather(scaled, block, fields)
        for name in rest:
            found[name] = np.empty(len(mesh.points))
            finish(fields, _COLUMNS.index(name), found[name])
    return found


def _gather(mesh: Mesh, block: CellBlock, fields: Floats) -> None:
    """Add a block to the rows of the points."""
    if block.items is None:
        work = gather_block if mesh.cell_dimension == 3 else gather_surface
        work(mesh.points, block.nodes, dual_tables(CELL_TYPES[block.type].corners), fields)
        return
    cells = take(*nodes_of_cells(mesh), block.rows)
    starts, items = ragged(block)
    if block.type == "polyhedron":
        table = faces(mesh)
        sides = (starts, items, table.offsets, table.nodes, table.owner)
    else:
        own = index_array(np.arange(len(block)))
        sides = (uniform_offsets(len(block), 1), own, starts, items, block.rows)
    gather_polytopes(mesh.points, block.rows, *sides, cells, block.type == "polyhedron", fields)


def _valence(mesh: Mesh) -> Floats:
    """Edges at each point; nan at points that are no end of an edge."""
    counts = np.zeros(len(mesh.points))
    _count_ends(edges(mesh), counts)
    counts[counts == 0.0] = np.nan
    return counts


@kernel
def _count_ends(ends: NDArray[np.integer], counts: Floats) -> None:
    for e in range(ends.shape[0]):
        counts[ends[e, 0]] += 1.0
        counts[ends[e, 1]] += 1.0


_GUIDE = "Ansys CFX-Solver modelling guide, 'Measures of mesh quality'"
_POST = "Ansys CFD-Post user's guide, mesh calculator"


def _row(column: str, id_: str, title: str, unit: str, low: float, high: float, best: str, ideal: float | None,
         degenerate: float, systems: str, formula: str, source: str, caveat: str = "") -> Metric:  # fmt: skip
    return Metric(
        id=id_, title=title, entity="point", on=("point",), unit=unit, low=low, high=high, best=best,  # type: ignore[arg-type]
        ideal=ideal, degenerate=degenerate, systems=(systems,), formula=formula, source=source, caveat=caveat,
        column=column,
    )  # fmt: skip


_INF, _NAN = math.inf, math.nan
_SECTORS = "Only 3-D meshes have it. Sectors and faces are those of the median dual, with the means of faces and cells."

ROWS = (
    _row("expansion", "cfx.expansion_factor", "Mesh expansion factor", "1", 1.0, _INF, "low", 1.0, _INF, "CFX: Mesh Expansion Factor",
         "largest / smallest sector volume at the point", _GUIDE, f"{_SECTORS} inf where a sector is inverted."),
    _row("angle", "cfx.orthogonality_angle", "Orthogonality angle", "deg", -90.0, 90.0, "high", 90.0, _NAN, "CFX: Orthogonality Angle",
         "mean of 90 - angle(n, s) over the dual faces at the point, weighted by their area; n of the face, s along its edge", _GUIDE,
         f"90 is perfect, not 0. {_SECTORS}"),
    _row("smallest_angle", "cfx.orthogonality_angle_min", "Orthogonality angle, minimum", "deg", -90.0, 90.0, "high", 90.0, _NAN,
         "CFX: Orthogonality Angle Minimum", "smallest 90 - angle(n, s) over the dual faces at the point", _GUIDE, _SECTORS),
    _row("factor", "cfx.orthogonality_factor", "Orthogonality factor", "1", -1.0, 1.0, "high", 1.0, _NAN, "CFX: Orthogonality Factor",
         "mean of n.s over the dual faces at the point, unit vectors, weighted by area", _GUIDE, _SECTORS),
    _row("aspect", "cfx.aspect_ratio", "Aspect ratio (CFX)", "1", 1.0, _INF, "low", 1.0, _INF, "CFX: Aspect Ratio",
         "largest / smallest area of the dual faces at the point", _GUIDE, _SECTORS),
    _row("connectivity", "cfx.connectivity_number", "Connectivity number", "1", 1.0, _INF, "none", None, _NAN, "CFD-Post: Connectivity Number",
         "cells at the point", _POST),
    _row("edge_ratio", "cfx.edge_length_ratio", "Edge length ratio (CFX)", "1", 1.0, _INF, "low", 1.0, _INF, "CFD-Post: Edge Length Ratio",
         "largest, over the face corners at the point, of longer / shorter of the two edges", f"{_POST} (wording unverified)"),
    _row("volume_ratio", "cfx.element_volume_ratio", "Element volume ratio (CFX)", "1", 1.0, _INF, "low", 1.0, _INF,
         "CFD-Post: Element Volume Ratio", "largest / smallest volume of the cells at the point", f"{_POST} (wording unverified)",
         "Only 3-D meshes have it."),
    _row("face_angle_min", "cfx.face_angle_min", "Smallest face angle at the point", "deg", 0.0, 180.0, "high", None, _NAN,
         "CFD-Post: Minimum Face Angle", "smallest corner angle at the point over the faces there", _POST,
         "Ideal 60 on triangles, 90 on quadrilaterals."),
    _row("face_angle_max", "cfx.face_angle_max", "Largest face angle at the point", "deg", 60.0, 360.0, "low", None, _NAN,
         "CFD-Post: Maximum Face Angle", "largest corner angle at the point over the faces there; above 180 at a reflex corner", _POST,
         "Ideal 60 on triangles, 90 on quadrilaterals."),
    _row("valence", "valence", "Valence", "1", 1.0, _INF, "none", None, _NAN, "Fluent Meshing: degree of a node",
         "edges that meet at the point", "Frey and George, Mesh Generation (2008): ideal 6 in a plane mesh of triangles, 4 of quadrilaterals"),
)  # fmt: skip
