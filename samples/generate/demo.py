"""The demonstration case: air around a car body, with layers on its skin and a fine block in its wake.

The skin comes from Gmsh (OpenCASCADE body, surface triangles); prism layers, wake block and pyramids are made here;
Gmsh fills the space between them and the walls, and the body itself, with tetrahedra.
"""

from __future__ import annotations

from dataclasses import dataclass

import gmsh
import numpy as np
from generate.grid import Boundary, Cells, Floats, Grid, Ints, joined
from generate.hybrid import lattice
from generate.sample import Sample

__all__ = ["car", "samples"]

PROFILE = ((0, 0.3), (4, 0.3), (4, 0.85), (3.55, 0.95), (2.9, 1.4), (1.75, 1.4), (1.15, 0.95), (0.1, 0.75))
WIDTH, FILLET, SKIN_SIZE = 1.7, 0.12, 0.15
FIRST_LAYER, LAYER_GROWTH, LAYERS = 0.006, 1.35, 5
WAKE_LOW, WAKE_HIGH, WAKE_CELLS = (4.5, -0.8, 0.3), (6.5, 0.8, 1.5), (12, 10, 8)
BOX_LOW, BOX_HIGH = (-4.0, -3.0, 0.0), (10.0, 3.0, 4.0)


@dataclass(frozen=True)
class Skin:
    """A closed surface of triangles, outward; `triangles` (n, 3) rows of `points`."""

    points: Floats
    triangles: Ints


def _quiet() -> None:
    gmsh.initialize(interruptible=False)
    for option in ("General.Terminal", "Mesh.Optimize", "Mesh.Renumber"):
        gmsh.option.setNumber(option, 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.option.setNumber("Mesh.RandomSeed", 1)


def _compact(points: Floats, nodes: Ints) -> tuple[Floats, Ints]:
    used, new = np.unique(nodes, return_inverse=True)
    return points[used], new.reshape(nodes.shape)


def body_skin() -> Skin:
    """The car body: a profile swept across its width, every edge rounded."""
    _quiet()
    try:
        occ = gmsh.model.occ
        corners = [occ.addPoint(x, -WIDTH / 2, z) for x, z in PROFILE]
        lines = [occ.addLine(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
        side = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        solid = next(tag for dimension, tag in occ.extrude([(2, side)], 0, WIDTH, 0) if dimension == 3)
        occ.synchronize()
        edges = [tag for _, tag in gmsh.model.getEntities(1)]
        occ.fillet([solid], edges, [FILLET])
        occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", SKIN_SIZE)
        gmsh.option.setNumber("Mesh.MeshSizeMin", SKIN_SIZE)
        gmsh.model.mesh.generate(2)
        tags, xyz, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(tags)
        _, nodes = gmsh.model.mesh.getElementsByType(2)
        points, triangles = _compact(xyz.reshape(-1, 3)[order], np.searchsorted(tags[order], nodes).reshape(-1, 3))
    finally:
        gmsh.finalize()
    a, b, c = (points[triangles[:, i]] for i in range(3))
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0:
        triangles = triangles[:, ::-1]
    return Skin(points, triangles)


def layers_on(skin: Skin) -> tuple[Grid, Skin]:
    """Prism layers pushed outward along the points' averaged normals, and the surface they end in."""
    a, b, c = (skin.points[skin.triangles[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)
    normal = np.zeros_like(skin.points)
    for i in range(3):
        np.add.at(normal, skin.triangles[:, i], area)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    heights = np.concatenate([[0.0], np.cumsum(FIRST_LAYER * LAYER_GROWTH ** np.arange(LAYERS))])
    n = len(skin.points)
    points = np.concatenate([skin.points + h * normal for h in heights])
    prisms = [np.hstack([skin.triangles + k * n, skin.triangles + (k + 1) * n]) for k in range(LAYERS)]
    wall = Boundary("tri", skin.triangles, "car", "wall")
    grid = Grid(points, (Cells("wedge", np.concatenate(prisms), "air"),), (wall,))
    return grid, Skin(points[-n:], skin.triangles)


def wake_block() -> tuple[Grid, Skin]:
    """A block of hexahedra behind the car with a pyramid on each of its outer faces, and the pyramids' sides."""
    low, high, cells = (np.array(v, dtype=float) for v in (WAKE_LOW, WAKE_HIGH, WAKE_CELLS))
    unit, corners = lattice(*(np.arange(n + 1.0) for n in cells))
    points = low + unit / cells * (high - low)
    bases: list[Ints] = []
    outward: list[Floats] = []
    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    for face in faces:
        four = corners[:, face]
        for axis in range(3):
            for end, sign in ((0.0, -1.0), (cells[axis], 1.0)):
                rows = four[(unit[four][:, :, axis] == end).all(axis=1)]
                bases.append(rows)
                outward.append(np.tile(sign * np.eye(3)[axis], (len(rows), 1)))
    base, push = np.concatenate(bases), np.concatenate(outward)
    apex = len(points) + np.arange(len(base))
    points = np.concatenate([points, points[base].mean(axis=1) + 0.45 * push * (high - low) / cells])
    around = [np.column_stack([base[:, i], base[:, (i + 1) % 4], apex]) for i in range(4)]
    # The faces run outward of the block, which is into the pyramid, as the base of a sound pyramid must.
    grid = Grid(points, (Cells("hex", corners, "air"), Cells("pyramid", np.column_stack([base, apex]), "air")))
    return grid, Skin(*_compact(points, np.concatenate(around)))


def _size(_d: int, _t: int, x: float, y: float, z: float, _lc: float) -> float:
    """Wanted edge length: fine at the car and its wake, growing with the distance from both."""
    away = max(0.0, -x, x - 6.5) + max(0.0, abs(y) - 0.9) + max(0.0, z - 1.5)
    return min(0.8, 0.17 + 0.28 * away)


def fill(holes: list[Skin], box: bool) -> Grid:
    """Tetrahedra inside the box around closed surfaces, or inside the one surface given."""
    _quiet()
    try:
        shells: list[int] = []
        first = 1
        for skin in holes:
            tag = gmsh.model.addDiscreteEntity(2)
            numbers = np.arange(first, first + len(skin.points))
            gmsh.model.mesh.addNodes(2, tag, numbers, skin.points.ravel())
            gmsh.model.mesh.addElementsByType(tag, 2, [], (skin.triangles + first).ravel())
            shells.append(tag)
            first += len(skin.points)
        geo = gmsh.model.geo
        loops = [geo.addSurfaceLoop([tag]) for tag in shells]
        sides: dict[str, list[int]] = {}
        if box:
            sides = _box_sides()
            loops.insert(0, geo.addSurfaceLoop([tag for tags in sides.values() for tag in tags]))
        volume = geo.addVolume(loops)
        geo.synchronize()
        if box:
            gmsh.model.mesh.setSizeCallback(_size)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0 if box else 1)
        gmsh.model.mesh.generate(3)
        tags, xyz, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(tags)
        points = xyz.reshape(-1, 3)[order]
        for start, skin in zip(np.cumsum([0, *(len(s.points) for s in holes)]), holes, strict=False):
            points[start : start + len(skin.points)] = skin.points
        nodes = gmsh.model.mesh.getElementsByType(4, volume)[1]
        tets = np.searchsorted(tags[order], nodes).reshape(-1, 4)
        boundary: list[Boundary] = []
        for name, surfaces in sides.items():
            rows = np.concatenate([gmsh.model.mesh.getElementsByType(2, tag)[1] for tag in surfaces])
            role = {"inlet": "inlet", "outlet": "outlet", "road": "wall"}.get(name, "symmetry")
            boundary.append(Boundary("tri", np.searchsorted(tags[order], rows).reshape(-1, 3), name, role))
    finally:
        gmsh.finalize()
    inside = Cells("tet", tets, "air") if box else Cells("tet", tets, "car-body", "solid")
    return Grid(points, (inside,), tuple(boundary))


def _box_sides() -> dict[str, list[int]]:
    """The six sides of the box as plane surfaces, by zone."""
    geo = gmsh.model.geo
    x, y, z = zip(BOX_LOW, BOX_HIGH, strict=True)
    corner = [geo.addPoint(x[i], y[j], z[k]) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    faces = {
        "inlet": [(0, 4, 6, 2)], "outlet": [(1, 3, 7, 5)], "road": [(0, 2, 3, 1)],
        "tunnel-sides": [(0, 1, 5, 4), (2, 6, 7, 3)], "tunnel-roof": [(4, 5, 7, 6)],
    }  # fmt: skip
    line: dict[tuple[int, int], int] = {}
    sides: dict[str, list[int]] = {}
    for name, rings in faces.items():
        for ring in rings:
            loop: list[int] = []
            for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
                if (b, a) in line:
                    loop.append(-line[b, a])
                else:
                    line[a, b] = geo.addLine(corner[a], corner[b])
                    loop.append(line[a, b])
            sides.setdefault(name, []).append(geo.addPlaneSurface([geo.addCurveLoop(loop)]))
    return sides


def car() -> Grid:
    """The whole case, points to a micrometre."""
    skin = body_skin()
    layers, hull = layers_on(skin)
    wake, wake_hull = wake_block()
    body = fill([skin], box=False)
    whole = joined(layers, wake, fill([hull, wake_hull], box=True), body)
    return Grid(np.round(whole.points, 6), whole.cells, whole.boundary)


def samples() -> list[Sample]:
    """The case in Fluent's format and in Gmsh's."""
    grid = car()
    shows = "air around a car body: prism layers, a hexahedral wake block, pyramids, tetrahedra; the body is a solid"
    return [
        Sample("demo.msh.gz", f"{shows}; Fluent", grid, how="VTK", format="fluent"),
        Sample("demo.v41.msh.gz", f"{shows}; Gmsh 4.1", grid, how="VTK"),
    ]
