"""O-grid and C-grid around a NACA 0012 aerofoil: layers marched outward along smoothed normals (hyperbolic style)."""

from __future__ import annotations

import numpy as np
from generate.grid import Boundary, Cells, Floats, Grid, Ints, extruded
from generate.sample import Sample

__all__ = ["c_grid", "o_grid", "samples"]

FIRST_STEP, GROWTH, LAYERS = 0.004, 1.16, 36
AROUND, WAKE = 96, 28


def naca0012(stations: Floats) -> Floats:
    """Half thickness at these x of the unit chord, with the last coefficient that closes the trailing edge."""
    x = stations
    return 0.6 * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)


def _surface(n: int) -> Floats:
    """(n + 1, 2) points from the trailing edge along the lower side to the nose and back along the upper side."""
    along = np.linspace(-1.0, 1.0, n + 1)
    x = np.abs(along) ** 1.6  # about 0.03 of the chord a step at the trailing edge, 0.002 at the nose
    y = naca0012(x) * np.sign(along)
    y[[0, -1]] = 0.0
    return np.column_stack([x, y])


def _march(curve: Floats, closed: bool) -> list[Floats]:
    """The curve and LAYERS copies of it, each a step to the left of the last one's direction.

    The normals are averaged along the line before each step, more often as the layers grow, so that the layers of a
    kinked curve do not cross; the points then relax a little towards the middle of their neighbours.
    """
    layers = [curve]
    step = FIRST_STEP
    for k in range(LAYERS):
        here = layers[-1]
        normal = _normals(here, closed)
        for _ in range(10 + 6 * k):
            normal = _averaged(normal, closed)
            if not closed:
                normal[0], normal[-1] = (0.0, -1.0), (0.0, 1.0)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        there = here + step * normal
        weight = min(0.5, 0.02 * k)
        eased = (1.0 - weight) * there + weight * _averaged(there, closed)
        if not closed:
            eased[[0, -1]] = there[[0, -1]]
        layers.append(eased)
        step *= GROWTH
    return layers


def _normals(line: Floats, closed: bool) -> Floats:
    """Unit normals to the left of the line's direction, from the difference of the two neighbours."""
    along = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0) if closed else np.gradient(line, axis=0)
    left = np.column_stack([-along[:, 1], along[:, 0]])
    return left / np.linalg.norm(left, axis=1, keepdims=True)


def _averaged(rows: Floats, closed: bool) -> Floats:
    if closed:
        return 0.25 * np.roll(rows, 1, axis=0) + 0.5 * rows + 0.25 * np.roll(rows, -1, axis=0)
    inner = 0.25 * rows[:-2] + 0.5 * rows[1:-1] + 0.25 * rows[2:]
    return np.vstack([rows[:1], inner, rows[-1:]])


def _line(a: Ints) -> Ints:
    return np.column_stack([a[:-1], a[1:]])


def _flat(points: Floats, at: Ints, boundary: list[Boundary]) -> Grid:
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    flat = np.round(np.column_stack([points, np.zeros(len(points))]), 7)
    return Grid(flat, (Cells("quad", quads, "air"),), tuple(boundary), 2)


def o_grid() -> Grid:
    """Closed lines around the aerofoil; the ring closes on itself without a seam."""
    layers = _march(_surface(AROUND)[:-1], closed=True)
    at = np.arange(len(layers) * AROUND).reshape(len(layers), AROUND)
    at = np.column_stack([at, at[:, 0]])
    wall = Boundary("line", _line(at[0]), "aerofoil", "wall")
    far = Boundary("line", _line(at[-1]), "farfield", "inlet")
    return _flat(np.concatenate(layers), at, [wall, far])


def c_grid(merged: bool = True) -> Grid:
    """Lines from the wake around the nose back to the wake; the two sides of the wake cut are one line if merged."""
    stretch = 1.0 + 0.02 * np.cumsum(1.18 ** np.arange(WAKE))
    wake = np.column_stack([stretch, np.zeros(WAKE)])
    curve = np.concatenate([wake[::-1], _surface(AROUND), wake])
    layers = _march(curve, closed=False)
    n = len(curve)
    points = np.concatenate(layers)
    at = np.arange(len(points)).reshape(len(layers), n)
    if merged:
        at[0, n - WAKE - 1 :] = at[0, : WAKE + 1][::-1]
        points, at = _without_unused(points, at)
    wall = Boundary("line", _line(at[0, WAKE : n - WAKE]), "aerofoil", "wall")
    far = Boundary("line", _line(at[-1]), "farfield", "inlet")
    ends = np.concatenate([_line(at[:, 0]), _line(at[:, -1])])
    return _flat(points, at, [wall, far, Boundary("line", ends, "outflow", "outlet")])


def _without_unused(points: Floats, at: Ints) -> tuple[Floats, Ints]:
    used, new = np.unique(at, return_inverse=True)
    return points[used], new.reshape(at.shape)


def samples() -> list[Sample]:
    """The grids, flat and one cell thick."""
    o, c, open_c = o_grid(), c_grid(), c_grid(merged=False)
    cut = WAKE + 1
    return [
        Sample("aerofoil/naca0012-o.v41.msh.gz", "O-grid around a NACA 0012 aerofoil", o, how="VTK"),
        Sample("aerofoil/naca0012-c.msh.gz", "C-grid, its wake cut merged", c, how="VTK"),
        Sample(
            "aerofoil/naca0012-c-cut.msh.gz",
            f"the same C-grid with its wake cut open: {cut} pairs of points in one place",
            open_c,
            findings={"duplicate-points": cut},
            how="VTK",
        ),
        Sample("aerofoil/naca0012-o.fluent.msh.gz", "the O-grid as a 2-D Fluent mesh", o, how="VTK"),
        Sample(
            "aerofoil/naca0012-c-openfoam",
            "the C-grid one cell thick, an OpenFOAM case with empty front and back",
            extruded(c, [0.0, 0.1], role="empty"),
            how="VTK",
        ),
    ]
