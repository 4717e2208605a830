"""Eight meshes of one circle: the ways to fill a round section, without and with layers along the wall."""

from __future__ import annotations

from dataclasses import replace

import gmsh
import numpy as np
from generate.grid import Boundary, Cells, Floats, Grid, Ints, joined
from generate.sample import Sample

__all__ = ["samples"]

SEGMENTS = 48
CORE = 0.55  # half width of the middle block of the multiblock meshes
LAYER_RADII = 1.0 - np.concatenate([[0.0], np.cumsum(0.02 * 1.25 ** np.arange(6))])


def _circle(radius: float, n: int = SEGMENTS) -> Floats:
    """(n, 3) points on a circle, the first at 45 degrees, counter-clockwise."""
    turn = np.pi / 4 + 2.0 * np.pi * np.arange(n) / n
    return radius * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n)])


def _wall(n: int) -> Boundary:
    return Boundary("line", np.column_stack([np.arange(n), np.roll(np.arange(n), -1)]), "wall")


def _ring(outer: Floats, inner: Floats, layers: Floats) -> Grid:
    """Quadrilaterals between two closed lines of equal count; `layers` from 0 (outer) to 1 (inner)."""
    n = len(outer)
    points = np.concatenate([(1.0 - t) * outer + t * inner for t in layers])
    at = np.arange(len(points)).reshape(len(layers), n)
    quads = np.stack([at[1:], at[:-1], np.roll(at, -1, axis=1)[:-1], np.roll(at, -1, axis=1)[1:]], axis=-1)
    return Grid(points, (Cells("quad", quads.reshape(-1, 4), "fluid"),), (_wall(n),), 2)


def _wall_layers() -> Grid:
    """Six rings along the wall, thickness growing by 1.25."""
    unit = _circle(1.0)
    t = (1.0 - LAYER_RADII) / (1.0 - LAYER_RADII[-1])
    return _ring(unit, unit * LAYER_RADII[-1], t)


def _square_rim(half: float, n: int, bulge: float = 0.0) -> Floats:
    """(n, 3) points on a square (sides bowed outward by `bulge`) that starts at its corner (half, half)."""
    k = n // 4
    s = np.linspace(1.0, -1.0, k, endpoint=False)
    side = np.column_stack([half * s, half + bulge * (1.0 - s * s), np.zeros(k)])
    turns = [side]
    for _ in range(3):
        side = np.column_stack([-side[:, 1], side[:, 0], side[:, 2]])
        turns.append(side)
    return np.concatenate(turns)


def _square_core(half: float, n: int, bulge: float = 0.0) -> Grid:
    """The block inside `_square_rim`, by transfinite interpolation from its four sides."""
    k = n // 4
    rim = _square_rim(half, n, bulge)[:, :2]
    rim = np.concatenate([rim, rim[:1]])
    top, left, bottom, right = rim[k::-1], rim[2 * k : k - 1 : -1], rim[2 * k : 3 * k + 1], rim[3 * k : 4 * k + 1]
    u = np.linspace(0.0, 1.0, k + 1)
    s, t = np.meshgrid(u, u, indexing="ij")
    s, t = s[..., None], t[..., None]
    flat = (
        (1 - t) * bottom[:, None] + t * top[:, None] + (1 - s) * left[None] + s * right[None]
        - (1 - s) * (1 - t) * bottom[0] - s * (1 - t) * bottom[-1] - (1 - s) * t * top[0] - s * t * top[-1]
    )  # fmt: skip
    at = np.arange((k + 1) ** 2).reshape(k + 1, k + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    points = np.column_stack([flat.reshape(-1, 2), np.zeros((k + 1) ** 2)])
    return Grid(points, (Cells("quad", quads, "fluid"),), dimension=2)


def _mapping() -> Grid:
    """A square grid bent onto the disc: its four corners become corners of nearly 180 degrees."""
    n = SEGMENTS // 4
    square = _square_core(1.0, SEGMENTS)
    x, y = square.points[:, 0], square.points[:, 1]
    points = np.column_stack([x * np.sqrt(1 - y * y / 2), y * np.sqrt(1 - x * x / 2), 0 * x])
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    rim = np.concatenate([at[:-1, 0], at[-1, :-1], at[:0:-1, -1], at[0, :0:-1]])
    wall = Boundary("line", np.column_stack([rim, np.roll(rim, -1)]), "wall")
    return Grid(points, square.cells, (wall,), 2)


def _filled(rim: Floats, quads: bool) -> Grid:
    """The inside of a closed polygon, meshed by Gmsh with the polygon's own edges as its boundary."""
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.Algorithm", 8 if quads else 6)
        size = float(np.linalg.norm(rim[1] - rim[0]))
        corners = [gmsh.model.geo.addPoint(*p, size) for p in rim.tolist()]
        lines = [gmsh.model.geo.addLine(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
        surface = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(lines)])
        for line in lines:
            gmsh.model.geo.mesh.setTransfiniteCurve(line, 2)
        if quads:
            gmsh.model.geo.mesh.setRecombine(2, surface)
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(2)
        tags, xyz, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(tags)
        points = xyz.reshape(-1, 3)[order]
        parts: list[Cells] = []
        for kind, number, width in (("tri", 2, 3), ("quad", 3, 4)):
            _, nodes = gmsh.model.mesh.getElementsByType(number)
            rows: Ints = np.searchsorted(tags[order], nodes).reshape(-1, width)
            if len(rows):
                parts.append(Cells(kind, rows, "fluid"))
    finally:
        gmsh.finalize()
    points[: len(rim)] = rim
    return Grid(points, tuple(parts), (_wall(len(rim)),), 2)


def _multiblock() -> Grid:
    rim = _square_rim(CORE, SEGMENTS, 0.1)
    return joined(_ring(_circle(1.0), rim, np.linspace(0, 1, 7)), _square_core(CORE, SEGMENTS, 0.1))


def _layer_multiblock() -> Grid:
    rim = _square_rim(0.45, SEGMENTS, 0.1)
    inner = _ring(_circle(LAYER_RADII[-1]), rim, np.linspace(0, 1, 4))
    return _walled(_wall_layers(), inner, _square_core(0.45, SEGMENTS, 0.1))


def _walled(layers: Grid, *rest: Grid) -> Grid:
    """The layers and what fills them, with the layers' wall alone."""
    return joined(layers, *(Grid(g.points, g.cells, (), 2) for g in rest))


def _three_to_one(outer: Floats, inner: Floats) -> Grid:
    """A ring whose outside has three edges for each inside edge: four quadrilaterals a template."""
    m, n = len(inner), len(outer)
    k = np.arange(m)
    o = [(3 * k + i) % n for i in range(4)]
    low = outer[o[1]] * 0.5 + 0.5 * (2 * inner[k] + inner[(k + 1) % m]) / 3
    high = outer[o[2]] * 0.5 + 0.5 * (inner[k] + 2 * inner[(k + 1) % m]) / 3
    points = np.concatenate([outer, inner, low, high])
    i0, i1, a, b = n + k, n + (k + 1) % m, n + m + k, n + 2 * m + k
    quads = [(o[0], o[1], a, i0), (o[1], o[2], b, a), (o[2], o[3], i1, b), (a, b, i1, i0)]
    return Grid(points, (Cells("quad", np.concatenate([np.column_stack(q) for q in quads]), "fluid"),), (), 2)


def _transition() -> Grid:
    """72 edges at the wall, 24 inside."""
    fine, coarse = _circle(1.0, 72), _circle(1.0, 24)
    layers = _ring(fine, fine * 0.86, np.linspace(0, 1, 6))
    middle = _three_to_one(fine * 0.86, coarse * 0.74)
    rim = _square_rim(0.4, 24, 0.08)
    return _walled(layers, middle, _ring(coarse * 0.74, rim, np.linspace(0, 1, 3)), _square_core(0.4, 24, 0.08))


def samples() -> list[Sample]:
    """The eight circles."""
    unit = _circle(1.0)
    core, layers = unit * LAYER_RADII[-1], _wall_layers()
    grids = [
        ("mapping", "one block mapped onto the disc, skewed where the square's corners lie on the rim", _mapping()),
        ("triangulation", "triangles (Gmsh, frontal Delaunay)", _filled(unit, quads=False)),
        ("paving", "unstructured quadrilaterals (Gmsh, recombined triangles)", _filled(unit, quads=True)),
        ("multiblock", "five blocks: a bowed square in the middle, four around it", _multiblock()),
        ("layer-triangulation", "six wall layers, triangles inside", _walled(layers, _filled(core, quads=False))),
        (
            "layer-paving",
            "six wall layers, unstructured quadrilaterals inside",
            _walled(layers, _filled(core, quads=True)),
        ),
        ("layer-multiblock", "six wall layers around five blocks", _layer_multiblock()),
        ("layer-transition-multiblock", "72 edges on the wall, 24 inside: three-to-one transition", _transition()),
    ]
    return [
        Sample(f"circle/{i}-{name}.msh", text, replace(g, points=np.round(g.points, 7)), how="VTK")
        for i, (name, text, g) in enumerate(grids, 1)
    ]
