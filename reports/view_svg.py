"""A view of a mesh as a drawing of lines: creases of the shell, and the chosen cells as polygons, far ones first.

Every line and polygon is a vector, so the drawing can be printed at any size and edited; what the shell hides of the
creases is found with a depth buffer and drawn dotted.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from markupsafe import escape
from numpy.typing import ArrayLike, NDArray

from meshwright.audit.errors import UsageError, printable
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints, Mesh
from meshwright.audit.surface_edges import face_normals
from meshwright.reports.raster import boxes_of
from meshwright.reports.raster_kernels import draw_polygons
from meshwright.reports.raster_scene import Camera, Scene, Shapes, scene_of, shapes_of

__all__ = ["MOST_POLYGONS", "view_svg"]

Floats = NDArray[np.float64]

MOST_POLYGONS = 60_000
"""Polygons and lines of a drawing, above which it is refused: programs that open it would stall."""

_DOT = 2.2
_FINE = 2
"""Samples of the depth buffer a unit of the drawing."""


def view_svg(
    mesh: Mesh,
    rows: ArrayLike,
    colours: ArrayLike = (192, 57, 43),
    *,
    title: str,
    entity: Literal["cell", "face", "point"] = "cell",
    size: tuple[int, int] = (900, 560),
    view: str = "all",
) -> str:
    """The text of an SVG file; arguments as of `raster.picture`.

    UsageError where it would take more than `MOST_POLYGONS`, which a PNG can show.
    """
    chosen = np.asarray(rows, np.intp).ravel()
    tints = np.broadcast_to(np.asarray(colours, int), (len(chosen), 3))
    scene, shapes = scene_of(mesh), shapes_of(mesh, entity, chosen)
    boxes = boxes_of(mesh, scene, view, size)
    creases = scene.feature_edges
    amount = len(boxes) * (len(shapes.owner) + len(creases))
    if amount > MOST_POLYGONS:
        raise UsageError(
            f"a drawing of {amount:,} lines and polygons is too much (limit {MOST_POLYGONS:,}); "
            "write a .png, or show fewer with --worst or --view"
        )
    corners = scene.placed(shapes.points)
    normals = face_normals(corners, shapes.offsets, shapes.nodes)
    width, height = size
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">'
        f"<title>{escape(printable(title, 200))}</title>"
        '<rect width="100%" height="100%" fill="#fff"/>'
    ]
    for name, box in boxes:
        camera = Camera.fitting(scene.points, name, tuple(map(float, box)))
        parts.append(f'<g class="view" data-view="{name}" stroke-linejoin="round">')
        parts.append(_creases(scene, creases, camera, box))
        parts.append(_polygons(shapes, corners, normals, tints, camera))
        parts.append(_dots(scene, shapes, tints, camera))
        parts.append("</g>")
    return "".join(parts) + "</svg>\n"


def _creases(scene: Scene, creases: Ints, camera: Camera, box: tuple[int, int, int, int]) -> str:
    """Two paths: what is seen of the creases, and what is hidden."""
    left, top, width, height = box
    at = camera.seen(scene.points)
    fine = (at - (left, top, 0.0)) * _FINE
    depth = np.full((height * _FINE, width * _FINE), -np.inf, np.float32)
    draw_polygons(fine, scene.offsets, scene.nodes, depth, np.empty(depth.shape, np.int32))
    pieces, seen = _runs(fine, creases, depth)
    ends = pieces / _FINE + (left, top)
    found = []
    for wanted, look in ((0, 'stroke="#9aa7b3" stroke-width=".6" stroke-dasharray="1 2"'), (1, 'stroke="#34404c"')):
        d = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {e:.1f}" for (a, b), (c, e) in ends[seen == wanted])
        if d:
            found.append(f'<path class="{"crease" if wanted else "hidden"}" fill="none" {look} d="{d}"/>')
    return "".join(found)


@kernel
def _runs(at: Floats, lines: Ints, depth: NDArray[np.float32]) -> tuple[Floats, NDArray[np.uint8]]:
    """Pieces (k, 2 ends, x and y) of lines that are seen or hidden as a whole, and which they are."""
    height, width = depth.shape
    out = np.empty((16 * lines.shape[0] + 16, 2, 2))
    seen = np.empty(out.shape[0], np.uint8)
    n = 0
    for m in range(lines.shape[0]):
        ax, ay, az = at[lines[m, 0], 0], at[lines[m, 0], 1], at[lines[m, 0], 2]
        bx, by, bz = at[lines[m, 1], 0], at[lines[m, 1], 1], at[lines[m, 1], 2]
        steps = max(int(max(abs(bx - ax), abs(by - ay)) / 4.0), 1)
        begin, state = 0.0, -1
        for k in range(steps):
            t = (k + 0.5) / steps
            x = min(max(int(ax + t * (bx - ax)), 0), width - 1)
            y = min(max(int(ay + t * (by - ay)), 0), height - 1)
            now = 1 if az + t * (bz - az) + 6.0 >= depth[y, x] else 0
            if state >= 0 and now != state and n < out.shape[0] - (lines.shape[0] - m) - 1:
                out[n, 0, 0], out[n, 0, 1] = ax + begin * (bx - ax), ay + begin * (by - ay)
                begin = k / steps
                out[n, 1, 0], out[n, 1, 1] = ax + begin * (bx - ax), ay + begin * (by - ay)
                seen[n] = state
                n += 1
                state = now
            elif state < 0:
                state = now
        out[n, 0, 0], out[n, 0, 1] = ax + begin * (bx - ax), ay + begin * (by - ay)
        out[n, 1, 0], out[n, 1, 1] = bx, by
        seen[n] = max(state, 0)
        n += 1
    return out[:n], seen[:n]


def _polygons(shapes: Shapes, corners: Floats, normals: Floats, tints: NDArray, camera: Camera) -> str:
    """The sides of the cells that face the eye or have no inside, the farthest first."""
    if not len(shapes.owner):
        return ""
    at = camera.seen(corners)
    starts = shapes.offsets[:-1]
    far = np.add.reduceat(at[shapes.nodes, 2], starts) / np.diff(shapes.offsets)
    shade = 0.62 + 0.38 * camera.shades(normals)
    parts = []
    for f in np.argsort(far, kind="stable").tolist():
        nodes = shapes.nodes[shapes.offsets[f] : shapes.offsets[f + 1]]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in at[nodes, :2])
        red, green, blue = (int(c * shade[f]) for c in tints[shapes.owner[f]])
        parts.append(f'<polygon points="{points}" fill="#{red:02x}{green:02x}{blue:02x}"/>')
    return f'<g class="bad" stroke="#fff" stroke-width=".25">{"".join(parts)}</g>'


def _dots(scene: Scene, shapes: Shapes, tints: NDArray, camera: Camera) -> str:
    """A dot for everything too small to be seen otherwise."""
    with np.errstate(invalid="ignore"):
        tiny = np.flatnonzero(~(shapes.sizes / scene.size * camera.scale > 2 * _DOT))
    spots = camera.seen(scene.placed(shapes.middles[tiny]))
    parts = [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_DOT}" fill="#{r:02x}{g:02x}{b:02x}"/>'
        for (x, y, _), (r, g, b) in zip(spots.tolist(), tints[tiny].tolist(), strict=True)
        if np.isfinite(x) and np.isfinite(y)
    ]
    return f'<g class="dots">{"".join(parts)}</g>' if parts else ""
