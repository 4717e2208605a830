"""What a picture of a mesh is made of: its shell, its edges, the chosen cells, and where the eye is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces, faces_of_cells
from meshwright.audit.csr import take
from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import CellBlock, Ints, Mesh
from meshwright.audit.surface_edges import face_normals, surface_edges
from meshwright.reports.html.shell import shell_of
from meshwright.reports.raster_kernels import moved

__all__ = ["FEATURE", "VIEWS", "Camera", "Scene", "Shapes", "scene_of", "shapes_of", "views_of"]

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

VIEWS = {"iso": (-60.0, 28.0), "x": (0.0, 0.0), "y": (-90.0, 0.0), "z": (-90.0, 90.0)}
"""Where the eye is: degrees around z from x, and above the x-y plane. `iso` looks from the front, right and above; the
others along an axis, x and y with z up, z with y up."""

FEATURE = 25.0
"""Degrees between two faces from which on the edge between them is drawn."""

_MOST_FACES = 400_000


@dataclass(frozen=True, eq=False)
class Shapes:
    """Polygons of cells, faces or points: offsets (m + 1,) into nodes, owner (m,) position in the list of rows.

    points (k, 3): places of their corners, which nodes count.  middles (n, 3): of each entity, the middle of the box
    around its finite corners, nan where there is none; sizes (n,): greatest extent of that box along an axis.
    """

    points: Floats
    offsets: Ints
    nodes: Ints
    owner: Ints
    middles: Floats
    sizes: Floats


@dataclass(frozen=True, eq=False)
class Scene:
    """points (n, 3), scaled to the cube from -1 to 1; polygons of the shell and their unit normals; edges (e, 2).

    degrees (e,): between the faces at an edge, nan where there are not two.  centre, size: what scales points of the
    mesh; `placed` does.
    """

    points: Floats
    offsets: Ints
    nodes: Ints
    normals: Floats
    edges: Ints
    degrees: Floats
    centre: Floats
    size: float

    def placed(self, points: Floats) -> Floats:
        """Points of the mesh in the cube of the scene."""
        with np.errstate(invalid="ignore", over="ignore"):
            return (points - self.centre) / self.size

    @property
    def feature_edges(self) -> Ints:
        """Creases, ends of surfaces and places where more than two faces meet."""
        return self.edges[~(self.degrees < FEATURE)]


def scene_of(mesh: Mesh) -> Scene:
    """The boundary of a mesh, or the cells of a 2-D one; faces with a point that is not finite are left out."""
    shell = shell_of(mesh, _MOST_FACES)
    used = np.zeros(len(shell.points), bool)
    used[shell.nodes] = True
    number = np.cumsum(used) - 1
    points = shell.points[used]
    if not len(points):
        finite = mesh.points[np.isfinite(mesh.points).all(axis=1)]
        points = finite if len(finite) else np.zeros((1, 3))
    low, high = points.min(axis=0), points.max(axis=0)
    centre = low / 2 + high / 2
    size = float((high / 2 - low / 2).max()) or 1.0
    placed = (points - centre) / size
    offsets, nodes = shell.offsets.astype(np.int32), number[shell.nodes].astype(np.int32)
    normals = face_normals(placed, offsets, nodes)
    edges, _, degrees = surface_edges(offsets, nodes, normals, len(placed))
    return Scene(placed, offsets, nodes, normals, edges, degrees, centre, size)


def shapes_of(mesh: Mesh, entity: Literal["cell", "face", "point"], rows: Rows) -> Shapes:
    """The polygons of entities; UsageError for a row that is none."""
    found = faces(mesh) if entity == "face" else None
    most = {"cell": mesh.n_cells, "point": len(mesh.points)}.get(entity, 0 if found is None else len(found))
    rows = np.asarray(rows, np.intp)
    if len(rows) and not 0 <= rows.min() <= rows.max() < most:
        raise UsageError(f"rows of {entity}s go from 0 to {most - 1}, got {rows.min()} to {rows.max()}")
    offsets: Ints
    nodes: Ints
    owner: Ints
    if entity == "point":
        offsets, nodes, owner = np.arange(len(rows) + 1), rows, np.arange(len(rows))
    elif found is not None:
        offsets, nodes = take(found.offsets, found.nodes, rows)
        owner = np.arange(len(rows))
    else:
        offsets, nodes, owner = _polygons(mesh, rows)
    middles, sizes = _middles(mesh.points, offsets, nodes, owner, len(rows))
    if entity == "point":
        offsets, nodes, owner = np.zeros(1, np.int32), nodes[:0], owner[:0]
    finite = np.isfinite(mesh.points[nodes]).all(axis=1)
    whole = np.logical_and.reduceat(finite, offsets[:-1]) if len(owner) else np.empty(0, bool)
    kept = np.flatnonzero(whole)
    offsets, nodes = take(offsets.astype(np.int32), nodes.astype(np.int32), kept)
    used, number = np.unique(nodes, return_inverse=True)
    return Shapes(mesh.points[used], offsets, number.astype(np.int32), owner[kept], middles, sizes)


def _polygons(mesh: Mesh, rows: Rows) -> tuple[Ints, Ints, Ints]:
    """Sides of 3-D cells, or 2-D cells themselves, by their corners."""
    counts: list[Ints] = [np.empty(0, np.int64)]
    nodes: list[Ints] = [np.empty(0, np.int64)]
    owners: list[Ints] = [np.empty(0, np.int64)]
    order = np.argsort(rows, kind="stable")
    for block in mesh.blocks:
        place = np.searchsorted(block.rows, rows[order])
        here = order[(place < len(block)) & (block.rows[np.minimum(place, len(block) - 1)] == rows[order])]
        at = np.searchsorted(block.rows, rows[here])
        for owner, corners in _sides(mesh, block, at):
            width = corners.shape[1]
            counts.append(np.full(len(corners), width))
            nodes.append(corners.ravel())
            owners.append(here[owner])
        if block.items is not None and len(at):
            count, items, owner = _ragged_sides(mesh, block, at)
            counts.append(count)
            nodes.append(items)
            owners.append(here[owner])
    return np.concatenate([[0], np.cumsum(np.concatenate(counts))]), np.concatenate(nodes), np.concatenate(owners)


def _sides(mesh: Mesh, block: CellBlock, at: Rows) -> list[tuple[Ints, Ints]]:
    """(position in `at`, corners (m, 3 or 4)) of the sides of cells with a fixed number of nodes."""
    if block.items is not None or not len(at):
        return []
    kind = CELL_TYPES[CELL_TYPES[block.type].corners]
    corners = block.nodes[at][:, : kind.n_corners]
    if kind.dimension == 2:
        return [(np.arange(len(at)), corners)]
    return [(np.arange(len(at)), corners[:, list(side)]) for side in kind.faces]


def _ragged_sides(mesh: Mesh, block: CellBlock, at: Rows) -> tuple[Ints, Ints, Ints]:
    """(nodes a side, nodes, position in `at`) of polygons and polyhedra."""
    assert block.offsets is not None  # noqa: S101 - the mesh has checked it
    assert block.items is not None  # noqa: S101
    if block.type == "polygon":
        offsets, nodes = take(block.offsets, block.items, at)
        return np.diff(offsets), nodes, np.arange(len(at))
    found = faces(mesh)
    starts, sides = take(*faces_of_cells(mesh), block.rows[at])
    offsets, nodes = take(found.offsets, found.nodes, sides)
    return np.diff(offsets), nodes, np.repeat(np.arange(len(at)), np.diff(starts))


def _middles(points: Floats, offsets: Ints, nodes: Ints, owner: Ints, n: int) -> tuple[Floats, Floats]:
    who = np.repeat(owner, np.diff(offsets))
    finite = np.isfinite(points[nodes]).all(axis=1)
    who, here = who[finite], points[nodes[finite]]
    low, high = np.full((n, 3), np.inf), np.full((n, 3), -np.inf)
    np.minimum.at(low, who, here)
    np.maximum.at(high, who, here)
    known = np.bincount(who, minlength=n) > 0
    middles, sizes = np.full((n, 3), np.nan), np.zeros(n)
    middles[known] = low[known] / 2 + high[known] / 2
    with np.errstate(over="ignore"):
        sizes[known] = (high[known] - low[known]).max(axis=1)
    return middles, sizes


@dataclass(frozen=True, eq=False)
class Camera:
    """An orthographic view: turn (3, 3), rows to the right, up and towards the eye; scale, middle: of the screen."""

    turn: Floats
    scale: float
    middle: Floats

    @staticmethod
    def fitting(points: Floats, view: str, box: tuple[float, ...], margin: float = 0.94) -> Camera:
        """The view of these points that fills a box (left, top, width, height)."""
        turn = _turn(*VIEWS[view])
        seen = moved(np.ascontiguousarray(points), turn, np.zeros(3))
        low, high = seen.min(axis=0), seen.max(axis=0)
        left, top, width, height = box
        wide, tall = np.maximum(high - low, 1e-12)[:2]
        scale = margin * min(width / wide, height / tall)
        if not high[0] > low[0] and not high[1] > low[1]:
            scale = 1.0
        centre = (low + high)[:2] / 2 * scale
        return Camera(turn, scale, np.array([left + width / 2 - centre[0], top + height / 2 + centre[1]]))

    def seen(self, points: Floats) -> Floats:
        """(n, 3) places on the screen: x, y downwards, and how near to the eye; all of one scale."""
        matrix = self.turn * np.array([[self.scale], [-self.scale], [self.scale]])
        found: Floats = moved(np.ascontiguousarray(points), matrix, np.append(self.middle, 0.0))
        return found

    def shades(self, normals: Floats) -> Floats:
        """(m,) from 0 to 1: how much light from beside the eye falls on faces, either side of them."""
        light = self.turn.T @ np.array([0.34, 0.46, 0.82])
        return np.clip(np.abs(normals @ light) ** 0.9, 0.0, 1.0)


def _turn(around: float, above: float) -> Floats:
    a, b = math.radians(around), math.radians(above)
    eye = np.array([math.cos(b) * math.cos(a), math.cos(b) * math.sin(a), math.sin(b)])
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    return np.round(np.array([right, np.cross(eye, right), eye]), 15)


def views_of(scene: Scene, flat: bool) -> tuple[str, ...]:
    """The views that show most: z alone of a planar mesh; else iso and the two axis views with the largest outline."""
    if flat:
        return ("z",)
    x, y, z = np.ptp(scene.points, axis=0)
    areas = {"x": y * z, "y": x * z, "z": x * y}
    order = sorted(areas, key=lambda view: -areas[view])
    return ("iso", *(view for view in order[:2] if areas[view] > 1e-3 * areas[order[0]]))
