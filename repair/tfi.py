"""Transfinite interpolation: the points inside a structured block, placed from its sides.

The Boolean sum of the interpolations in each direction (W. J. Gordon and C. A. Hall, Construction of curvilinear
co-ordinate systems and applications to mesh generation, Int. J. Numer. Meth. Eng. 7, 1973), blended by arc length
(B. K. Soni, Two- and three-dimensional grid generation for internal flow applications, AIAA 85-1526, 1985), so that the
spacing of the sides goes on inside. It may fold where a side is concave; such a block stays as it was.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from meshwright.audit.errors import MeshError
from meshwright.audit.mesh import Floats, Mesh
from meshwright.repair.blocks import Closed, on_grids
from meshwright.repair.outcome import Options, Outcome

__all__ = ["enclosed_area", "hermite", "hermite_points", "tfi", "tfi_points", "transfinite"]

_MOST_TURNS = 1000
_SETTLED = 1e-15


def tfi(mesh: Mesh, options: Options) -> Outcome:
    """Place the points inside structured blocks by linear transfinite interpolation."""
    return on_grids(mesh, options, tfi_points)


def hermite(mesh: Mesh, options: Options) -> Outcome:
    """The same with cubic interpolation, its lines normal to the sides; blocks of quads."""
    if mesh.cell_dimension == 3:
        raise MeshError("hermite places blocks of quads in the plane; this mesh has 3-D cells: use tfi")
    return on_grids(mesh, options, hermite_points)


def transfinite(values: Floats, weights: Sequence[tuple[int, Floats]]) -> Floats:
    """Interpolate from the sides: values (n0, n1[, n2], c), of which the ends along the axes of `weights` are read.

    weights: (axis, w) with w broadcast to (n0, n1[, n2]), 0 at the first end and 1 at the last.
    """
    total = np.zeros_like(values)
    for ends in product((None, 0, 1), repeat=len(weights)):
        term, weight, sign = values, np.ones(()), -1.0
        for (axis, w), end in zip(weights, ends, strict=True):
            if end is not None:
                term = np.take(term, [-end], axis=axis)
                weight = weight * (w if end else 1.0 - w)
                sign = -sign
        if weight.ndim:
            total += sign * weight[..., None] * term
    return total


def tfi_points(points: Floats, closed: Closed) -> Floats:
    """The points (n0 + 1, n1 + 1[, n2 + 1], d) of a grid from those of its sides."""
    # of the corners alone: where the points inside stand now has no say, not even by rounding
    origin = points[np.ix_(*([0, -1] for _ in closed))].reshape(-1, points.shape[-1]).mean(axis=0)
    return transfinite(points - origin, blending(points, closed)) + origin


def blending(points: Floats, closed: Closed) -> list[tuple[int, Floats]]:
    """(axis, part of the way) for each open direction: 0 to 1, of the arc lengths of the edges of the block.

    On the edges it is the part of their own length. Inside, each direction blends its edges by the parts of the others,
    the implicit equations of Soni. Where all other directions are closed there are no edges: then the mean over all
    lines of the grid stands for them.
    """
    axes = [axis for axis, turn in enumerate(closed) if not turn]
    if not axes:
        raise MeshError("all its directions are closed, so that it has no sides to start from")
    edges = {axis: _edges(points, closed, axis, axes) for axis in axes}
    shape = points.shape[:-1]
    parts = {axis: np.broadcast_to(e.mean(axis=tuple(b for b in axes if b != axis), keepdims=True), shape)
             for axis, e in edges.items()}  # fmt: skip
    for _ in range(_MOST_TURNS):
        change = 0.0
        for axis in axes:
            fresh = np.zeros(shape)
            others = [b for b in axes if b != axis]
            for ends in product((0, 1), repeat=len(others)):
                term, weight = edges[axis], np.ones(())
                for b, end in zip(others, ends, strict=True):
                    term = np.take(term, [end], axis=b)
                    weight = weight * (parts[b] if end else 1.0 - parts[b])
                fresh = fresh + weight * term
            change = max(change, float(np.abs(fresh - parts[axis]).max()))
            parts[axis] = fresh
        if change <= _SETTLED:
            return list(parts.items())
    raise MeshError("the spacings of its opposite sides differ so much that no blending of them was found")


def _edges(points: Floats, closed: Closed, axis: int, axes: list[int]) -> Floats:
    """Part of the length at which the points of each edge along `axis` lie; two edges for each other open direction."""
    lines = points
    for b in axes:
        if b != axis:
            lines = np.take(lines, [0, -1], axis=b)
    part = _parts(lines, axis)
    if axes == [axis]:
        around = tuple(b for b, turn in enumerate(closed) if turn)
        once = part[tuple(slice(0, -1) if turn else slice(None) for turn in closed)]
        part = once.mean(axis=around, keepdims=True)
    return part


def _parts(lines: Floats, axis: int) -> Floats:
    """Part of the arc length of lines along `axis`: 0 at the first point, 1 at the last."""
    steps = np.linalg.norm(np.diff(lines, axis=axis), axis=-1)
    if (steps <= 0.0).any():
        raise MeshError("two neighbouring points of a side lie on one another")
    way = np.insert(np.cumsum(steps, axis=axis), 0, 0.0, axis=axis)
    return way / np.take(way, [-1], axis=axis)


def hermite_points(points: Floats, closed: Closed) -> Floats:
    """The points (n0 + 1, n1 + 1, 2) of a flat grid from those of its sides, with lines that leave the sides normally.

    The derivative at a side is as long as the chord to the opposite point; at the corners it is that of the sides that
    meet there. The mixed derivative of a corner is the mean of what the two sides that meet there tell of it.
    """
    if any(closed):
        raise MeshError("it is closed in one direction, where Hermite interpolation has no sides to be normal to")
    origin = points.reshape(-1, 2).mean(axis=0)
    x = points - origin
    (_, u), (_, v) = blending(points, closed)
    hand = float(np.sign(enclosed_area(x)))
    if hand == 0.0:
        raise MeshError("its sides enclose no area")
    # slopes at the corners, [end of u][end of v]: of the sides, then how those across the sides change along them
    by_u = np.stack([_end_slopes(x[:, e], u[:, e]) for e in (0, -1)], axis=1)
    by_v = np.stack([_end_slopes(x[e], v[e]) for e in (0, -1)])
    across_u = [_normal(x[e], x[-1] - x[0], hand, v[e], by_u[e]) for e in (0, -1)]
    across_v = [_normal(x[:, e], x[:, -1] - x[:, 0], -hand, u[:, e], by_v[:, e]) for e in (0, -1)]
    one = np.stack([_end_slopes(across_u[e], v[e]) for e in (0, -1)])
    two = np.stack([_end_slopes(across_v[e], u[:, e]) for e in (0, -1)], axis=1)
    twist = 0.5 * (one + two)
    h, k = _cubics(u), _cubics(v)
    along_u = [side[None] for side in (x[0], x[-1], *across_u)]
    along_v = [side[:, None] for side in (x[:, 0], x[:, -1], *across_v)]
    ends = np.ix_([0, -1], [0, -1])
    corners = np.concatenate([np.concatenate([x[ends], by_v], axis=1), np.concatenate([by_u, twist], axis=1)])
    total = np.zeros_like(x)
    for i in range(4):
        total += h[i][..., None] * along_u[i] + k[i][..., None] * along_v[i]
        for j in range(4):
            total -= (h[i] * k[j])[..., None] * corners[i, j]
    return total + origin


def enclosed_area(x: Floats) -> float:
    """Area that the sides of a flat grid (n0, n1, 2) enclose; negative where its directions form a left hand."""
    rim = np.concatenate([x[:-1, 0], x[-1, :-1], x[:0:-1, -1], x[0, :0:-1]])
    after = np.roll(rim, -1, axis=0)
    return 0.5 * float(np.sum(rim[:, 0] * after[:, 1] - rim[:, 1] * after[:, 0]))


def _cubics(t: Floats) -> list[Floats]:
    """Hermite's cubics: value at 0 and 1, derivative at 0 and 1."""
    return [
        (1.0 + 2.0 * t) * (1.0 - t) ** 2,
        t * t * (3.0 - 2.0 * t),
        t * (1.0 - t) ** 2,
        t * t * (t - 1.0),
    ]


def _end_slopes(line: Floats, t: Floats) -> Floats:
    """(2, c) slopes of a line (n, c) by its parameter t (n,) at its two ends."""
    return np.stack([(line[1] - line[0]) / (t[1] - t[0]), (line[-1] - line[-2]) / (t[-1] - t[-2])])


def _inverted(steps: Floats) -> Floats:
    """Steps (n, 2) over their square: inversion at a point turns circles through it into lines along its tangent."""
    return steps / np.sum(steps * steps, axis=1)[:, None]


def _normal(side: Floats, chord: Floats, hand: float, t: Floats, ends: Floats) -> Floats:
    """(n, 2) derivative across a side (n, 2): normal to it, as long as the chord, corrected to `ends` at its ends.

    The tangent is that of the circle through a point and its two neighbours; at an end through the last three points.
    """
    steps, wide = _inverted(np.diff(side, axis=0)), _inverted(side[2:] - side[:-2])
    along = np.concatenate([steps[:1] - wide[:1], steps[:-1] + steps[1:], steps[-1:] - wide[-1:]])
    normal = hand * np.stack([along[:, 1], -along[:, 0]], axis=1)
    length = np.linalg.norm(normal, axis=1)
    if (length == 0.0).any():
        raise MeshError("a side turns back on itself")
    out = normal * (np.linalg.norm(chord, axis=1) / length)[:, None]
    return out + np.outer(1.0 - t, ends[0] - out[0]) + np.outer(t, ends[1] - out[-1])
