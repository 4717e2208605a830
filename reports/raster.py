"""Pictures without a graphics card: the shell of a mesh in grey, chosen cells in colour on top, as an image of bytes.

An orthographic z-buffer of two samples a pixel each way. What lies behind the shell shines through it, and an entity
too small for a pixel still gets a dot; a few such get a ring as well, so that one cell among a million is found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshwright.audit.errors import UsageError
from meshwright.audit.mesh import Ints, Mesh
from meshwright.audit.surface_edges import face_normals
from meshwright.reports.png import png
from meshwright.reports.raster_kernels import NOTHING, draw_dots, draw_lines, draw_polygons, pixels, plot_cells
from meshwright.reports.raster_scene import VIEWS, Camera, Scene, Shapes, scene_of, shapes_of, views_of

__all__ = ["DARK", "LIGHT", "VIEWS", "Theme", "boxes_of", "picture", "png"]

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Box = tuple[float, float, float, float]

_SAMPLES = 2
_SMALLEST, _LARGEST = 16, 8192
_FEW = 24
"""Entities up to which small ones get a ring."""

_DOTS = ((200, 5.0), (3000, 3.5))
"""Radius of a dot in samples by the number of entities; of more it is 2."""

_MANY_EDGES = 0.02
"""Edges a sample from which on only creases are drawn: more would be a grey haze."""

_CREASE, _FAINT = 190, 70
_AXIS = 20
_GLYPHS = {
    "x": ("#...#", ".#.#.", "..#..", ".#.#.", "#...#"),
    "y": ("#...#", ".#.#.", "..#..", "..#..", "..#.."),
    "z": ("#####", "...#.", "..#..", ".#...", "#####"),
}


@dataclass(frozen=True)
class Theme:
    """Colours, 0 to 255: background, shell seen edge-on and in full light, lines.

    through: how much of the colour of a cell behind the shell is seen, 0 to 1.
    """

    back: tuple[int, int, int] = (255, 255, 255)
    dark: tuple[int, int, int] = (138, 150, 162)
    bright: tuple[int, int, int] = (226, 231, 236)
    ink: tuple[int, int, int] = (52, 64, 76)
    through: float = 0.62


LIGHT = Theme()
DARK = Theme((20, 24, 29), (48, 57, 66), (108, 120, 132), (196, 206, 216))


def picture(
    mesh: Mesh,
    rows: ArrayLike,
    colours: ArrayLike = (192, 57, 43),
    *,
    entity: Literal["cell", "face", "point"] = "cell",
    size: tuple[int, int] = (900, 560),
    view: str = "all",
    theme: Theme = LIGHT,
) -> Image:
    """(height, width, 3) bytes: the mesh with these entities in these colours.

    rows: rows of cells of the mesh, of faces of `connectivity.faces`, or of points.  colours: (n, 3) one each, 0 to
    255, or (3,) one for all. Where dots lie on each other the last is on top, elsewhere what is nearest.
    size: (width, height) in pixels, 16 to 8192 each.  view: a key of `VIEWS`, or "all" for `iso` and the two axis views
    that show most; a planar mesh is always seen from above. UsageError for other rows, sizes or views.
    """
    width, height = size
    if not (_SMALLEST <= width <= _LARGEST and _SMALLEST <= height <= _LARGEST):
        raise UsageError(f"a picture has {_SMALLEST} to {_LARGEST} pixels a side, not {width} x {height}")
    chosen = np.asarray(rows, np.intp).ravel()
    tints = np.broadcast_to(np.asarray(colours, float), (len(chosen), 3))
    scene, shapes = scene_of(mesh), shapes_of(mesh, entity, chosen)
    out = np.empty((height, width, 3), np.uint8)
    out[:] = theme.back
    corners = scene.placed(shapes.points)
    normals = face_normals(corners, shapes.offsets, shapes.nodes)
    for name, (left, top, wide, tall) in boxes_of(mesh, scene, view, size):
        here = out[top : top + tall, left : left + wide]
        room = min(wide, tall) >= 6 * _AXIS
        edge = 1.3 * _AXIS if room and name != "iso" else 0.0  # seen askew, a mesh leaves the corners free
        camera = Camera.fitting(scene.points, name, tuple(_SAMPLES * x for x in (edge, 0.0, wide - edge, tall - edge)))
        _draw(scene, shapes, corners, normals, tints, camera, theme, here)
        if room:
            _triad(camera.turn, theme, here)
    return out


def boxes_of(mesh: Mesh, scene: Scene, view: str, size: tuple[int, int]) -> list[tuple[str, tuple[int, int, int, int]]]:
    """Which views a picture shows, and where: (left, top, width, height) of each; UsageError for an unknown one."""
    if view != "all" and view not in VIEWS:
        raise UsageError(f"unknown view {view!r}; there are all, {', '.join(VIEWS)}")
    width, height = size
    names = views_of(scene, mesh.dimension == 2) if view == "all" or mesh.dimension == 2 else (view,)
    if len(names) == 1:
        return [(names[0], (0, 0, width, height))]
    n = len(names) - 1
    if width >= 1.2 * height:
        large = width * 5 // 8
        return [(names[0], (0, 0, large, height))] + [
            (name, (large, height * k // n, width - large, height * (k + 1) // n - height * k // n))
            for k, name in enumerate(names[1:])
        ]
    large = height * 5 // 8
    return [(names[0], (0, 0, width, large))] + [
        (name, (width * k // n, large, width * (k + 1) // n - width * k // n, height - large))
        for k, name in enumerate(names[1:])
    ]


def _draw(
    scene: Scene,
    shapes: Shapes,
    corners: Floats,
    normals: Floats,
    tints: Floats,
    camera: Camera,
    theme: Theme,
    out: Image,
) -> None:
    """One view into its part of the picture."""
    height, width = (_SAMPLES * side for side in out.shape[:2])
    at = camera.seen(scene.points)
    depth = np.full((height, width), -np.inf, np.float32)
    shell = np.full((height, width), NOTHING, np.int32)
    draw_polygons(at, scene.offsets, scene.nodes, depth, shell)
    ink = np.zeros((height, width), np.uint8)
    if len(scene.edges) < _MANY_EDGES * np.count_nonzero(shell >= 0):
        draw_lines(at, scene.edges, 1, depth, ink, _FAINT)
    creases: Ints = scene.feature_edges
    if len(creases) < 4 * _MANY_EDGES * np.count_nonzero(shell >= 0):
        draw_lines(at, creases, 2, depth, ink, _CREASE)
    cells, dots, rings = (np.full((height, width), NOTHING, np.int32) for _ in range(3))
    hidden, dot_hidden = np.zeros((height, width), np.uint8), np.zeros((height, width), np.uint8)
    if len(shapes.owner):
        own = np.full((height, width), -np.inf, np.float32)
        plot_cells(camera.seen(corners), shapes.offsets, shapes.nodes, shapes.owner, depth, own, cells, hidden)
    n = len(shapes.sizes)
    radius = next((r for most, r in _DOTS if n <= most), 2.0)
    with np.errstate(invalid="ignore"):
        extent = shapes.sizes / scene.size * camera.scale
    tiny = np.flatnonzero(~(extent > 2 * radius))
    spots = camera.seen(scene.placed(shapes.middles))
    ring = 16.0 if n <= _FEW else 0.0
    marks, marked = np.full((height, width), NOTHING, np.int32), np.full((height, width), NOTHING, np.int32)
    draw_dots(spots[tiny], radius, ring, depth, marks, dot_hidden, marked)
    for into, found in ((dots, marks), (rings, marked)):
        np.copyto(into, tiny[found].astype(np.int32) if len(tiny) else NOTHING, where=found >= 0)
    pixels(
        shell, camera.shades(scene.normals), ink, cells, camera.shades(normals), np.asarray(shapes.owner, np.int64),
        hidden, dots, dot_hidden, rings, np.ascontiguousarray(tints),
        np.array([theme.back, theme.dark, theme.bright, theme.ink], float), theme.through, out,
    )  # fmt: skip


def _triad(turn: Floats, theme: Theme, out: Image) -> None:
    """The three axes with their names, in the lower left corner of a view."""
    height = out.shape[0]
    middle = np.array([0.7 * _AXIS, height - 0.7 * _AXIS])
    for d, name in enumerate("xyz"):
        way = turn[:2, d] * (1.0, -1.0)
        length = float(np.hypot(*way))
        if length < 0.15:
            continue  # it points at the eye
        for t in np.linspace(0.0, 1.0, 2 * _AXIS):
            x, y = np.rint(middle + t * _AXIS * way).astype(int)
            out[y, x] = theme.ink
        x, y = np.rint(middle + (_AXIS * length + 6) * way / length).astype(int)
        for row, bits in enumerate(_GLYPHS[name]):
            for column, bit in enumerate(bits):
                if bit == "#":
                    out[y + row - 2, x + column - 2] = theme.ink
