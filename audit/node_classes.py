"""Where the points of a mesh may move: corners, curves, surfaces, volume, found by the angle between surface normals.

The surface of a solid mesh is its boundary, the faces between two cell zones, and inner faces with a zone or element
of their own (baffles, walls with cells on both sides); the curves of a flat mesh likewise. An edge of a surface is a
feature where the normals of its two faces differ by more than the angle, or where it has not two faces. A point is a
corner where one, three or more features meet, or two that turn by more than the angle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import cell_components, faces, used_points
from meshwright.audit.csr import ragged, take, uniform_offsets
from meshwright.audit.mesh import NO_CELL, Ints, Mesh, index_array
from meshwright.audit.orientation import traversed_alike
from meshwright.audit.sets import find_parts
from meshwright.audit.surface_edges import face_normals, surface_edges

__all__ = ["CORNER", "CURVE", "SURFACE", "UNUSED", "VOLUME", "Features", "features", "node_classes"]

UNUSED, CORNER, CURVE, SURFACE, VOLUME = -1, 0, 1, 2, 3
"""Class of a point: the dimension of the geometry it lies on, and so in how many directions it may move."""

_HEX27_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
"""Corners around nodes 20 to 25."""

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Features:
    """What the geometry of a mesh looks like from its surface.

    classes (n_points,) int8: UNUSED, CORNER, CURVE, SURFACE or VOLUME (in a flat mesh or shell SURFACE is the inside).
    edges (m, 2): edges of the surface, each once, smaller point row first.  sharp (m,): which of them are features.
    angle (m,): degrees between the normals of the two faces, nan where there are not two.  sides (m, 2): rows of
    `faces` on both sides, -1 where there are not two.
    faces (k,): rows of `connectivity.faces` that make up the surface of a solid mesh; the cells of a shell.
    surface (k,): number of the smooth surface each of them belongs to.  curve (m,): of the curve, -1 off features.
    n_surfaces, n_curves: how many.
    """

    classes: NDArray[np.int8]
    edges: Ints
    sharp: Mask
    angle: Floats
    sides: Ints
    faces: Ints
    surface: Ints
    curve: Ints
    n_surfaces: int
    n_curves: int


def node_classes(mesh: Mesh, angle: float = 10.0) -> NDArray[np.int8]:
    """(n_points,) int8: UNUSED, CORNER, CURVE, SURFACE or VOLUME for every point.

    angle: degrees between surface normals (directions of edges) above which an edge (a point) is a feature.
    """
    return features(mesh, angle).classes


def features(mesh: Mesh, angle: float = 10.0, inner: Callable[[Mesh], Ints] | None = None) -> Features:
    """Classify the points of a mesh; `angle` in degrees.

    inner: rows of faces with cells on both sides that belong to the surface; None for those between two cell zones.
    """
    if mesh.cell_dimension == 3:
        rows, edges, sides, degrees = _of_solid(mesh, inner or _between_zones)
    elif mesh.dimension == 2:
        rows, edges, sides, degrees = _of_flat(mesh, inner or _between_zones)
    else:
        rows, edges, sides, degrees = _of_shell(mesh)
    sharp = ~(degrees <= angle) & ~(np.isnan(degrees) & (sides[:, 0] >= 0))
    classes = np.full(len(mesh.points), UNUSED, dtype=np.int8)
    classes[used_points(mesh)] = VOLUME if mesh.cell_dimension == 3 else SURFACE
    if mesh.cell_dimension == 3:
        classes[edges] = SURFACE
    curves = edges[sharp]
    count = np.bincount(curves.ravel(), minlength=len(mesh.points))
    classes[curves] = CURVE
    corner = (count > 0) & (count != 2)
    corner[_turning(mesh, curves, count == 2, angle)] = True
    classes[corner] = CORNER
    if mesh.order == 2:
        _mid_nodes(mesh, edges, sharp, rows, classes)
    smooth = sides[~sharp]
    surface = _parts(smooth, len(rows)) if mesh.dimension == 3 else cell_components(mesh)
    curve = np.full(len(edges), -1, dtype=np.int32)
    curve[sharp] = _chains(curves, ~corner, len(mesh.points))
    return Features(
        classes, index_array(edges), sharp, degrees, index_array(sides), index_array(rows), index_array(surface),
        index_array(curve), int(surface.max(initial=-1)) + 1, int(curve.max(initial=-1)) + 1,
    )  # fmt: skip


def _between_zones(mesh: Mesh) -> Ints:
    if len(mesh.cell_zones) < 2:
        return index_array([])
    found, zone = faces(mesh), mesh.cell_zone_index()
    inside = found.neighbour != NO_CELL
    return index_array(np.flatnonzero(inside & (zone[found.owner] != zone[found.neighbour])))


def _of_solid(mesh: Mesh, inner: Callable[[Mesh], Ints]) -> tuple[Ints, Ints, Ints, Floats]:
    found = faces(mesh)
    outside = found.neighbour == NO_CELL
    outside[inner(mesh)] = True
    rows = index_array(np.flatnonzero(outside))
    offsets, nodes = take(found.offsets, found.nodes, rows)
    normals = face_normals(mesh.points, offsets, nodes)
    edges, sides, degrees = surface_edges(offsets, nodes, normals, len(mesh.points))
    return rows, edges, sides, degrees


def _angles(normals: Floats, sides: Ints, same: Mask) -> Floats:
    """Degrees between the normals on both sides; nan where there are not two."""
    out = np.full(len(sides), np.nan)
    two = sides[:, 0] >= 0
    u, v = normals[sides[two, 0]], normals[sides[two, 1]]
    dot = np.einsum("ij,ij->i", u, v) * np.where(same[two], -1.0, 1.0)
    cross = np.cross(u, v)
    out[two] = np.degrees(np.arctan2(np.sqrt(np.einsum("ij,ij->i", cross, cross)), dot))
    without = ~(np.einsum("ij,ij->i", u, u) > 0.0) | ~(np.einsum("ij,ij->i", v, v) > 0.0)
    out[np.flatnonzero(two)[without]] = np.nan  # a face without area looks nowhere
    return out


def _of_flat(mesh: Mesh, inner: Callable[[Mesh], Ints]) -> tuple[Ints, Ints, Ints, Floats]:
    found = faces(mesh)
    outside = found.neighbour == NO_CELL
    outside[inner(mesh)] = True
    edges = np.unique(np.sort(found.nodes.reshape(-1, 2)[outside], axis=1), axis=0)
    return index_array([]), edges, np.full((len(edges), 2), -1), np.full(len(edges), np.nan)


def _of_shell(mesh: Mesh) -> tuple[Ints, Ints, Ints, Floats]:
    found = faces(mesh)
    edges = np.sort(found.nodes.reshape(-1, 2), axis=1)
    inside = found.neighbour != NO_CELL
    sides = np.where(inside[:, None], np.stack([found.owner, found.neighbour], axis=1), -1)
    return (
        index_array(np.arange(mesh.n_cells)),
        edges,
        sides,
        _angles(_shell_normals(mesh), sides, traversed_alike(mesh)),
    )


def _shell_normals(mesh: Mesh) -> Floats:
    out = np.empty((mesh.n_cells, 3))
    for block in mesh.blocks:
        if block.items is None:
            nodes = block.nodes[:, : CELL_TYPES[block.type].n_corners]
            table = uniform_offsets(*nodes.shape), index_array(nodes.ravel())
        else:
            table = ragged(block)
        out[block.rows] = face_normals(mesh.points, *table)
    return out


def _turning(mesh: Mesh, curves: Ints, two: Mask, angle: float) -> Ints:
    """Points with two features that do not go straight on."""
    start, end = np.concatenate([curves, curves[:, ::-1]]).T
    order = np.argsort(start, kind="stable")
    order = order[two[start[order]]]
    p, q, r = start[order[::2]], end[order[::2]], end[order[1::2]]
    points = mesh.points
    with np.errstate(all="ignore"):
        u, v = points[p] - points[q], points[r] - points[p]
        u, v = (x / np.abs(x).max(axis=1, initial=0.0)[:, None] for x in (u, v))
        cross = np.cross(u, v)
        turn = np.arctan2(np.sqrt(np.einsum("ij,ij->i", cross, cross)), np.einsum("ij,ij->i", u, v))
    return index_array(p[np.degrees(turn) > angle])


def _parts(pairs: Ints, n: int) -> Ints:
    return find_parts(index_array(pairs[:, 0]), index_array(pairs[:, 1]), n)


def _chains(curves: Ints, passing: Mask, n_points: int) -> Ints:
    """Number of the curve of each feature edge; curves end at the points that are not `passing`."""
    n = len(curves)
    ends = np.concatenate([curves[:, 0], curves[:, 1]])
    of = np.tile(np.arange(n), 2)
    chosen = np.flatnonzero(passing[ends])
    order = chosen[np.argsort(ends[chosen], kind="stable")]
    pairs = np.stack([of[order[::2]], of[order[1::2]]], axis=1)
    return _parts(pairs, n)


def _mid_nodes(mesh: Mesh, edges: Ints, sharp: Mask, rows: Ints, classes: NDArray[np.int8]) -> None:
    """Classes of the nodes of higher order: those of the edge or face they lie on."""
    n = len(mesh.points)
    keys = edges[:, 0].astype(np.int64) * n + edges[:, 1]
    order = np.argsort(keys)
    keys, sharp = keys[order], sharp[order]
    inside = VOLUME if mesh.cell_dimension == 3 else SURFACE
    for block in mesh.blocks:
        kind = CELL_TYPES[block.type]
        if kind.order == 1 or not len(block) or not len(keys):
            continue
        table = kind.edge_table
        a, b = (block.nodes[:, table[:, i]].astype(np.int64) for i in range(2))
        wanted = np.minimum(a, b) * n + np.maximum(a, b)
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        there = keys[at] == wanted
        mid = block.nodes[:, list(kind.mid_edges)]
        classes[mid] = inside
        classes[mid[there]] = SURFACE
        classes[mid[there & sharp[at]]] = CURVE
        if block.type == "hex27":
            _face_nodes(mesh, rows, block.nodes, classes)


def _face_nodes(mesh: Mesh, rows: Ints, nodes: Ints, classes: NDArray[np.int8]) -> None:
    """SURFACE for the centres of those faces of hexahedra of 27 nodes that are in the surface."""
    found = faces(mesh)
    _, corners = take(found.offsets, found.nodes, rows[np.diff(found.offsets)[rows] == 4])
    surface = {tuple(sorted(ring)) for ring in corners.reshape(-1, 4).tolist()}
    near = np.isin(nodes[:, :8], corners).sum(axis=1) >= 4
    for cell in nodes[near].tolist():
        for i, ring in enumerate(_HEX27_FACES):
            if tuple(sorted(cell[j] for j in ring)) in surface:
                classes[cell[20 + i]] = SURFACE
