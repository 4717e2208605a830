"""The check that lists features: corners, curves and surfaces of the geometry, and edges that need not be kept."""

from __future__ import annotations

from threading import Lock
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces
from meshwright.audit.findings.face_sets import faces_of_zone, named_faces
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.mesh import NO_CELL, Ints, Mesh, index_array
from meshwright.audit.node_classes import CORNER, CURVE, SURFACE, VOLUME, Features, features

__all__ = ["ROWS", "features_of", "inner_surface"]

_LISTED = 100

_ONE_AT_A_TIME = Lock()
_kept: WeakKeyDictionary[Mesh, dict[float, Features]] = WeakKeyDictionary()


def features_of(facts: Facts) -> Features:
    """The features at the angle of the options, computed once for a mesh."""
    angle = facts.options.feature_angle
    with _ONE_AT_A_TIME:  # several checks ask for them, in threads of their own
        by_angle = _kept.setdefault(facts.mesh, {})
        if angle not in by_angle:
            by_angle[angle] = features(facts.mesh, angle, inner_surface)
        return by_angle[angle]


def inner_surface(mesh: Mesh) -> Ints:
    """Faces with cells on both sides that lie between zones or have a zone or an element of their own."""
    if not mesh.zones and not mesh.boundary:
        return index_array([])
    found = faces(mesh)
    inner = named_faces(mesh) & (found.neighbour != NO_CELL)
    if len(mesh.cell_zones) > 1:
        zone = mesh.cell_zone_index()
        inner |= (found.neighbour != NO_CELL) & (zone[found.owner] != zone[found.neighbour])
    return index_array(np.flatnonzero(inner))


def geometry_features(facts: Facts) -> Found | None:
    """Points on corners and curves, with counts of all classes."""
    mesh = facts.mesh
    found = features_of(facts)
    rows = np.flatnonzero((found.classes == CORNER) | (found.classes == CURVE))
    if not len(rows):
        return None
    count = {name: int(np.count_nonzero(found.classes == k)) for name, k in _CLASSES.items()}
    idle = _suppressible(mesh, found)
    detail: dict[str, Any] = {
        "feature_angle": facts.options.feature_angle,
        "corners": count["corner"],
        "curves": found.n_curves,
        "surfaces": found.n_surfaces,
        "feature_edges": int(np.count_nonzero(found.sharp)),
        "points": count,
        "suppressible_edges": len(idle),
        "suppressible": (idle if mesh.point_ids is None else mesh.point_ids[idle])[:_LISTED].tolist(),
    }
    message = (
        f"{counted(count['corner'], 'corner')}, {counted(found.n_curves, 'curve')} and "
        f"{counted(found.n_surfaces, 'surface')} at a feature angle of {facts.options.feature_angle:g} degrees: "
        "smoothing must keep corners where they are and points of curves on their curve"
    )
    if len(idle):
        message += (
            f"; {counted(len(idle), 'edge')} between zones or listed as a curve where the surface is smooth: "
            "safe to suppress"
        )
    return Found(rows, message, detail=detail)


_CLASSES = {"corner": CORNER, "curve": CURVE, "surface": SURFACE, "volume": VOLUME}


def _suppressible(mesh: Mesh, found: Features) -> Ints:
    """(n, 2) smooth edges of the surface that part two face zones, or that a file lists as line elements."""
    smooth = ~found.sharp & (found.sides[:, 0] >= 0)
    chosen = np.zeros(len(smooth), dtype=bool)
    zones = [zone for zone in mesh.zones if zone.entity == "face" and zone.kind != "faceZone"]
    if mesh.cell_dimension == 3 and len(zones) > 1:
        of = np.full(len(faces(mesh)), -1, dtype=np.int32)
        for i, zone in reversed(list(enumerate(zones))):
            of[faces_of_zone(mesh, zone)] = i
        here = of[found.faces][found.sides[smooth]]
        chosen[smooth] = here[:, 0] != here[:, 1]
    elif mesh.cell_dimension == 2 and len(mesh.cell_zones) > 1:
        beside = mesh.cell_zone_index()[found.sides[smooth]]
        chosen[smooth] = beside[:, 0] != beside[:, 1]
    lines = [b.nodes[:, :2] for b in mesh.boundary if CELL_TYPES[b.type].dimension == 1]
    if lines and mesh.dimension == 3:
        n = len(mesh.points)
        keys = np.sort(np.concatenate(lines).astype(np.int64), axis=1) @ np.array([n, 1])
        chosen |= smooth & np.isin(found.edges.astype(np.int64) @ np.array([n, 1]), keys)
    return index_array(found.edges[chosen])


ROWS = (
    Check(
        "features", "info", "Corners and curves of the geometry", "point",
        "what smoothing and coarsening have to keep", geometry_features,
    ),
)  # fmt: skip
