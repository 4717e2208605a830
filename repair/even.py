"""Even angles in structured blocks: interpolation from the sides, then as near to right angles as nothing gets worse.

Transfinite interpolation gives a smooth grid whatever its angles are. From there the points move down the slope of the
16-norm of the equiangle skews of all corners, which is smooth where the skew, the largest of them, has kinks. Let go
on, it trades the worst cells for the mean; so only the part of its way is taken over which neither mean falls, of the
scaled Jacobian and of the skew, and no cell gets worse than the worst of those that share a point with it. The way is
found by L-BFGS (D. C. Liu and J. Nocedal, On the limited memory BFGS method for large scale optimization, Math.
Program. 45, 1989).
"""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.blocks import Closed, inside, on_grids
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.tfi import tfi_points
from meshwright.repair.vectors import Vector, between, cross, dot

__all__ = ["even", "even_points"]

_STEPS = 10
"""Steps of L-BFGS: the gain of the first ones is what the conditions leave room for."""
_SHORTER = 12
_SHORTENED = 0.75
"""How often the way is made shorter, and by which factor: down to a thirtieth of it."""
_NOISE = 1e-12


def even(mesh: Mesh, options: Options) -> Outcome:
    """Place the points inside structured blocks by interpolation and even out their angles."""
    return on_grids(mesh, options, even_points)


def even_points(points: Floats, closed: Closed) -> Floats:
    """The points (n0 + 1, n1 + 1[, n2 + 1], d) of a grid from those of its sides; as `tfi_points` where that folds."""
    from scipy.optimize import minimize  # noqa: PLC0415 - slow to import

    start = tfi_points(points, closed)
    d = start.shape[-1]
    number = np.arange(math.prod(start.shape[:-1])).reshape(start.shape[:-1])
    for axis, turn in enumerate(closed):
        if turn:
            np.moveaxis(number, axis, 0)[-1] = np.moveaxis(number, axis, 0)[0]
    cells = _cells(number)
    origin = start[(0,) * d]
    x = np.zeros((number.size, 3))
    x[:, :d] = start.reshape(-1, d) - origin
    size = float(np.mean([np.linalg.norm(np.diff(start, axis=a), axis=-1).mean() for a in range(d)]))
    x /= size
    hand = max((1.0, -1.0), key=lambda sign: float(_measures(x, cells, sign)[0].sum()))
    first = _measures(x, cells, hand)
    if not first[0].min() > 0.0:
        return start
    free = number[inside(closed)].ravel()
    slope = np.empty_like(x)

    def skew(place: Floats) -> tuple[float, Floats]:
        trial = x.copy()
        trial[free, :d] = place.reshape(-1, d)
        total = _soft_skew(trial, cells, slope)
        return total, slope[free, :d].ravel()

    floor = _floor(first.min(axis=0), cells, len(x)) - _NOISE
    found = minimize(skew, x[free, :d].ravel(), jac=True, method="L-BFGS-B", options={"maxiter": _STEPS})
    way = np.zeros_like(x)
    way[free, :d] = found.x.reshape(-1, d) - x[free, :d]
    x = _best(x, way, cells, hand, floor)
    out = start.reshape(-1, d).copy()
    out[free] = x[free, :d] * size + origin
    return out[number.ravel()].reshape(start.shape)


def _floor(quality: Floats, cells: Ints, n: int) -> Floats:
    """(m,) quality of the worst of the cells that share a point with each."""
    low = np.full(n, np.inf)
    np.minimum.at(low, cells, quality[:, None])
    return low[cells].min(axis=1)


def _best(here: Floats, way: Floats, cells: Ints, hand: float, floor: Floats) -> Floats:
    """The places along the way of all points with the best mean skew; points that bar the way stay behind.

    No cell may be worse than `floor` (m,) and no mean of a measure lower than it is here.
    """
    first = best = _measures(here, cells, hand).mean(axis=1)
    out = here
    part = 1.0
    for _ in range(_SHORTER):
        moves = np.ones(len(here), bool)
        poor = np.ones(len(cells), bool)
        while poor.any() and moves.any():
            x = np.where(moves[:, None], here + part * way, here)
            now = _measures(x, cells, hand)
            poor = now.min(axis=0) < floor
            moves[cells[poor]] = False
        mean = now.mean(axis=1)
        if not poor.any() and mean[0] >= first[0] - _NOISE and mean[1] > best[1]:
            out, best = x, mean
        elif out is not here:
            break  # the way grows too short now
        part *= _SHORTENED
    return out


def _cells(number: Ints) -> Ints:
    """(m, 2 ** d) corners of the cells of a grid of numbered points; bit a of the place is the end of direction a."""
    d = number.ndim
    ends = [
        number[tuple(slice(1, None) if b >> a & 1 else slice(0, -1) for a in range(d))].ravel() for b in range(2**d)
    ]
    return np.stack(ends, axis=1)


@inner
def _skew(u: Vector, v: Vector) -> float:
    """How far the angle of two edges is from a right one, -1 to 1; positive where it is obtuse."""
    w = cross(u, v)
    return math.atan2(-dot(u, v), math.sqrt(dot(w, w))) * (2.0 / math.pi)


@inner
def _to_the_16th(r: float) -> float:
    r *= r
    r *= r
    r *= r
    return r * r


@kernel
def _measures(x: Floats, cells: Ints, hand: float) -> Floats:
    """(2, m) scaled Jacobian and 1 - equiangle skew of the cells of a grid.

    hand: 1.0 where the directions of the grid form a right hand, else -1.0.
    """
    width = cells.shape[1]
    out = np.empty((2, cells.shape[0]))
    for c in range(cells.shape[0]):
        least, skew = np.inf, 0.0
        for b in range(width):
            o = cells[c, b]
            sign = -hand if (b ^ b >> 1 ^ b >> 2) & 1 else hand
            u, v = between(x, o, cells[c, b ^ 1]), between(x, o, cells[c, b ^ 2])
            across = cross(u, v)
            square, det = dot(u, u) * dot(v, v), across[2]
            skew = max(skew, abs(_skew(u, v)))
            if width == 8:
                w = between(x, o, cells[c, b ^ 4])
                square, det = square * dot(w, w), dot(across, w)
                skew = max(skew, abs(_skew(u, w)), abs(_skew(v, w)))
            least = min(least, sign * det / math.sqrt(square) if square > 0.0 else 0.0)
        out[0, c], out[1, c] = least, 1.0 - skew
    return out


@kernel
def _soft_skew(x: Floats, cells: Ints, slope: Floats) -> float:
    """Sum of the 16-norms of the skews of all corners of each cell; its slope by x goes into `slope` (n, 3)."""
    width = cells.shape[1]
    ways = 3 if width == 8 else 1
    skews = np.empty(width * ways)
    slope[:] = 0.0
    total = 0.0
    for c in range(cells.shape[0]):
        most = 1e-300
        for b in range(width):
            for k in range(ways):
                u = between(x, cells[c, b], cells[c, b ^ (2 if k == 2 else 1)])
                v = between(x, cells[c, b], cells[c, b ^ (2 if k == 0 else 4)])
                skews[b * ways + k] = _skew(u, v)
                most = max(most, abs(skews[b * ways + k]))
        powers = 0.0
        for i in range(skews.size):
            powers += _to_the_16th(skews[i] / most)
        norm = powers**0.0625
        total += most * norm
        for b in range(width):
            o = cells[c, b]
            for k in range(ways):
                s = skews[b * ways + k]
                weight = most / s * _to_the_16th(s / most) * norm / powers * (2.0 / math.pi) if s != 0.0 else 0.0
                if abs(weight) < 1e-12:
                    continue
                p, q = cells[c, b ^ (2 if k == 2 else 1)], cells[c, b ^ (2 if k == 0 else 4)]
                u, v = between(x, o, p), between(x, o, q)
                across, along = cross(u, v), dot(u, v)
                sine = math.sqrt(dot(across, across))
                if not sine > 0.0:
                    continue
                weight /= sine
                by_u, by_v = along / dot(u, u), along / dot(v, v)
                for a in range(3):
                    du, dv = weight * (by_u * u[a] - v[a]), weight * (by_v * v[a] - u[a])
                    slope[p, a] += du
                    slope[q, a] += dv
                    slope[o, a] -= du + dv
    return total
