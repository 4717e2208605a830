"""Pictures without a graphics card: the shell of a mesh in grey, the bad cells in colour, as an image of bytes.

An orthographic z-buffer in twice the resolution. Cells behind the shell shine through, and one too small for a pixel
still gets a dot.
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import faces_of_cells
from meshwright.audit.csr import take
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Mesh
from meshwright.reports.html.shell import Shell, shell_of

__all__ = ["VIEWS", "Theme", "picture", "png", "triangles_of_cells"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Image = NDArray[np.uint8]

VIEWS = {
    "iso": (-0.62, 0.5),
    "x": (0.0, 0.0),
    "y": (math.pi / 2, 0.0),
    "z": (-math.pi / 2, math.pi / 2),
}
"""Angles of the eye, around z from x and above the x-y plane, in radians; `iso` is in front, on the right and above."""

_SAMPLES = 2
_DOT = 3
_MOST_FACES = 400_000


@dataclass(frozen=True)
class Theme:
    """Colours from 0 to 255: background, shell facing the eye and edge-on."""

    back: tuple[int, int, int] = (255, 255, 255)
    bright: tuple[int, int, int] = (222, 227, 232)
    dark: tuple[int, int, int] = (128, 140, 152)


def picture(
    mesh: Mesh,
    cells: Ints,
    colours: NDArray[np.uint8],
    *,
    size: tuple[int, int] = (900, 560),
    view: str = "iso",
    theme: Theme | None = None,
) -> Image:
    """(height, width, 3) the mesh with these cells in these colours (n, 3), the last on top.

    view: a key of `VIEWS`; a planar mesh is always seen from above.
    """
    theme = theme or Theme()
    shell = shell_of(mesh, _MOST_FACES)
    width, height = (_SAMPLES * side for side in size)
    turn = _turn(*(VIEWS["z"] if mesh.dimension == 2 else VIEWS[view]))
    corners, tri = _fans(shell)
    at, scale = _screen(corners, turn, width, height)
    depth = np.full((height, width), -np.inf)
    image = np.empty((height, width, 3), np.float64)
    image[:] = theme.back
    shade = _shades(corners, tri, turn)
    ends = np.array([theme.dark, theme.bright], float)
    _draw_shell(at, tri, shade, ends, depth, image)
    if len(cells):
        points, triangles, owner = triangles_of_cells(mesh, cells)
        spots = _project(points, turn, *scale)
        _draw_cells(spots, triangles, owner, colours.astype(float), depth, image)
        middles = np.zeros((len(cells), 3))
        counts = np.bincount(owner, minlength=len(cells)).astype(float)
        for d in range(3):
            middles[:, d] = np.bincount(owner, weights=spots[triangles].mean(axis=1)[:, d], minlength=len(cells))
        middles /= np.maximum(counts, 1)[:, None]
        _draw_dots(middles, colours.astype(float), _DOT, image)
    small = image.reshape(size[1], _SAMPLES, size[0], _SAMPLES, 3).mean(axis=(1, 3))
    return np.rint(small).astype(np.uint8)


def _turn(around: float, above: float) -> Floats:
    """(3, 3) rows: right, up and towards the eye."""
    eye = np.array([math.cos(above) * math.cos(around), math.cos(above) * math.sin(around), math.sin(above)])
    right = np.array([-math.sin(around), math.cos(around), 0.0])
    return np.array([right, np.cross(eye, right), eye])


def _fans(shell: Shell) -> tuple[Floats, Ints]:
    """Points and (m, 3) triangles of the polygons, as fans."""
    sizes = np.diff(shell.offsets)
    counts = np.maximum(sizes - 2, 0)
    start = np.repeat(shell.offsets[:-1], counts)
    step = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    nodes = shell.nodes
    return shell.points, np.column_stack([nodes[start], nodes[start + step + 1], nodes[start + step + 2]]).astype(
        np.int64
    )


def _screen(points: Floats, turn: Floats, width: int, height: int) -> tuple[Floats, tuple[Floats, float, Floats]]:
    """Places on the screen (x, y, depth), and what makes them of places: centre, scale, middle of the screen."""
    sound = points[np.isfinite(points).all(axis=1)]
    centre = (sound.min(axis=0) + sound.max(axis=0)) / 2 if len(sound) else np.zeros(3)
    seen = (sound - centre) @ turn.T
    low, high = (seen.min(axis=0), seen.max(axis=0)) if len(seen) else (np.zeros(3), np.ones(3))
    span = np.maximum(high - low, 1e-300)
    scale = 0.94 * min(width / span[0], height / span[1])
    middle = np.array([width / 2, height / 2]) - scale * np.array([1, -1]) * (low + high)[:2] / 2
    return _project(points, turn, centre, scale, middle), (centre, scale, middle)


def _project(points: Floats, turn: Floats, centre: Floats, scale: float, middle: Floats) -> Floats:
    with np.errstate(invalid="ignore"):
        seen = (points - centre) @ turn.T * scale
    return np.column_stack([middle[0] + seen[:, 0], middle[1] - seen[:, 1], seen[:, 2]])


def _shades(points: Floats, tri: Ints, turn: Floats) -> Floats:
    """(m,) from 0, edge-on, to 1, facing a light beside the eye."""
    a, b, c = (points[tri[:, k]] for k in range(3))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        normal = np.cross(b - a, c - a)
        normal /= np.sqrt((normal**2).sum(axis=1))[:, None]
        light = turn[2] * 0.85 + turn[1] * 0.42 + turn[0] * 0.3
        found: Floats = np.abs(normal @ light) / np.linalg.norm(light)
    return np.nan_to_num(found)


def triangles_of_cells(mesh: Mesh, cells: Ints) -> tuple[Floats, Ints, Ints]:
    """Points, triangles (m, 3) and the number in `cells` of the cell of each."""
    found: list[tuple[int, int, int]] = []
    owner: list[int] = []
    where = {int(cell): k for k, cell in enumerate(cells)}
    table = faces_of_cells(mesh) if mesh.faces is not None else None
    for block in mesh.blocks:
        for at in np.flatnonzero(np.isin(block.rows, cells)).tolist():
            k = where[int(block.rows[at])]
            if block.items is None or block.offsets is None:
                kind = CELL_TYPES[CELL_TYPES[block.type].corners]
                nodes = block.nodes[at]
                loops = [nodes[list(face)] for face in kind.faces] if kind.dimension == 3 else [nodes[: kind.n_corners]]
            elif block.type == "polygon" or mesh.faces is None or table is None:
                loops = [block.items[block.offsets[at] : block.offsets[at + 1]]]
            else:
                rows = block.items[block.offsets[at] : block.offsets[at + 1]]
                offsets, items = take(mesh.faces.offsets, mesh.faces.nodes, rows)
                loops = [items[offsets[i] : offsets[i + 1]] for i in range(len(rows))]
            for loop in loops:
                found += [(int(loop[0]), int(loop[i]), int(loop[i + 1])) for i in range(1, len(loop) - 1)]
                owner += [k] * (len(loop) - 2)
    return mesh.points, np.array(found, np.int64).reshape(-1, 3), np.array(owner, np.int64)


@kernel
def _draw_shell(at: Floats, tri: Ints, shade: Floats, ends: Floats, depth: Floats, image: Floats) -> None:
    height, width = depth.shape
    for t in range(tri.shape[0]):
        ax, ay, az = at[tri[t, 0]]
        bx, by, bz = at[tri[t, 1]]
        cx, cy, cz = at[tri[t, 2]]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if not abs(area) > 1e-12:
            continue
        low_x, high_x = max(0, math.floor(min(ax, bx, cx))), min(width - 1, math.ceil(max(ax, bx, cx)))
        low_y, high_y = max(0, math.floor(min(ay, by, cy))), min(height - 1, math.ceil(max(ay, by, cy)))
        for y in range(low_y, high_y + 1):
            for x in range(low_x, high_x + 1):
                px, py = x + 0.5, y + 0.5
                u = ((bx - px) * (cy - py) - (by - py) * (cx - px)) / area
                v = ((cx - px) * (ay - py) - (cy - py) * (ax - px)) / area
                w = 1.0 - u - v
                if u < -1e-9 or v < -1e-9 or w < -1e-9:
                    continue
                z = u * az + v * bz + w * cz
                if z > depth[y, x]:
                    depth[y, x] = z
                    for d in range(3):
                        image[y, x, d] = ends[0, d] + (ends[1, d] - ends[0, d]) * shade[t]


@kernel
def _draw_cells(at: Floats, tri: Ints, owner: Ints, colours: Floats, depth: Floats, image: Floats) -> None:
    """Cells over the shell: strong where they lie before it, half as strong where they shine through."""
    height, width = depth.shape
    own = np.full((height, width), -np.inf)
    base = image.copy()
    for t in range(tri.shape[0]):
        ax, ay, az = at[tri[t, 0]]
        bx, by, bz = at[tri[t, 1]]
        cx, cy, cz = at[tri[t, 2]]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if not abs(area) > 1e-12:
            continue
        low_x, high_x = max(0, math.floor(min(ax, bx, cx))), min(width - 1, math.ceil(max(ax, bx, cx)))
        low_y, high_y = max(0, math.floor(min(ay, by, cy))), min(height - 1, math.ceil(max(ay, by, cy)))
        for y in range(low_y, high_y + 1):
            for x in range(low_x, high_x + 1):
                px, py = x + 0.5, y + 0.5
                u = ((bx - px) * (cy - py) - (by - py) * (cx - px)) / area
                v = ((cx - px) * (ay - py) - (cy - py) * (ax - px)) / area
                w = 1.0 - u - v
                if u < -1e-9 or v < -1e-9 or w < -1e-9:
                    continue
                z = u * az + v * bz + w * cz
                if z > own[y, x]:
                    own[y, x] = z
                    edge = 0.72 if min(u, v, w) * math.sqrt(abs(area)) < 0.8 else 1.0
                    strong = 1.0 if z >= depth[y, x] - 1e-6 * (1.0 + abs(z)) else 0.55
                    for d in range(3):
                        image[y, x, d] = base[y, x, d] * (1 - strong) + colours[owner[t], d] * edge * strong


@kernel
def _draw_dots(at: Floats, colours: Floats, radius: int, image: Floats) -> None:
    height, width = image.shape[0], image.shape[1]
    for i in range(at.shape[0]):
        if not (math.isfinite(at[i, 0]) and math.isfinite(at[i, 1])):
            continue
        mx, my = int(at[i, 0]), int(at[i, 1])
        for y in range(max(0, my - radius), min(height, my + radius + 1)):
            for x in range(max(0, mx - radius), min(width, mx + radius + 1)):
                if (x - mx) ** 2 + (y - my) ** 2 <= radius * radius:
                    for d in range(3):
                        image[y, x, d] = 0.25 * image[y, x, d] + 0.75 * colours[i, d]


def png(image: Image) -> bytes:
    """The image as a PNG file, in few bytes: a palette of 256 colours where they are enough, else 5 bits a channel.

    Source: W3C PNG specification, third edition.
    """
    colours, index = _colours(image)
    if len(colours) > 256:
        colours, index = _colours(np.minimum((image.astype(np.int32) + 4) // 8 * 8, 255))
    height, width = image.shape[:2]
    if len(colours) <= 256:
        rows = np.hstack([np.zeros((height, 1), np.uint8), index.reshape(height, width).astype(np.uint8)])
        head, palette = (8, 3), _chunk(b"PLTE", colours.astype(np.uint8).tobytes())
    else:
        pixels = colours[index].reshape(height, width * 3)
        rows = np.hstack(
            [np.full((height, 1), 2, np.uint8), np.diff(pixels, axis=0, prepend=np.zeros((1, width * 3), np.uint8))]
        )
        head, palette = (8, 2), b""
    ihdr = _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, *head, 0, 0, 0))
    data = _chunk(b"IDAT", zlib.compress(rows.astype(np.uint8).tobytes(), 9))
    return b"\x89PNG\r\n\x1a\n" + ihdr + palette + data + _chunk(b"IEND", b"")


def _colours(image: NDArray[np.integer]) -> tuple[NDArray[np.uint8], Ints]:
    """(k, 3) the colours that occur, and the number of that of each pixel."""
    flat = image.reshape(-1, 3).astype(np.int64)
    codes, index = np.unique(flat[:, 0] << 16 | flat[:, 1] << 8 | flat[:, 2], return_inverse=True)
    return np.column_stack([codes >> 16, codes >> 8 & 255, codes & 255]).astype(np.uint8), index


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
