"""Sides of a periodic pair: which belongs to which, by what motion, and how well their faces and points match."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.findings.hulls.boxes import Tree, box_tree
from meshwright.audit.findings.hulls.congruence import Motion, best_fit, guesses, nearest
from meshwright.audit.findings.hulls.hull import Hull
from meshwright.audit.mesh import Ints
from meshwright.audit.sets import find_parts

__all__ = ["MATCH", "PLANAR", "Pair", "Side", "pair_up", "pieces", "side_of"]

MATCH = 1e-3
"""Faces match when their centres do, within this share of their size (the root of their area)."""
PLANAR = 1e-4
"""A side is planar when its points keep this close to a plane, over its extent."""

_SAME_AREA = 0.02
_SEEN = 256
_REACH = 0.5

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Side:
    """One side: name for people, facets of the hull, what they measure. size: root of the area, or length."""

    name: str
    facets: Ints
    corners: Ints
    centre: Floats
    normal: Floats
    area: Floats
    size: Floats
    flatness: float
    tree: Tree

    @property
    def planar(self) -> bool:
        """Whether all its points lie in a plane."""
        return self.flatness <= PLANAR

    @property
    def total(self) -> float:
        """Its area."""
        return float(self.area.sum())


@dataclass(frozen=True, eq=False)
class Pair:
    """Two sides and the motion from the first to the second; figures are in units of the hull.

    partner (n,): facet of the second side, by its place there, that each of the first one's matches, -1 for none.
    error (n,): distance of their centres over their size.  point_error: the same of the corners, over their shortest
    edges.  spans: the angle (radians) or distance that the motion carries each matched corner.
    """

    first: Side
    second: Side
    motion: Motion
    partner: Ints
    error: Floats
    point_error: Floats
    spans: Floats

    @property
    def unmatched(self) -> tuple[Ints, Ints]:
        """Facets of the hull without a partner, on either side."""
        left = self.first.facets[self.partner < 0]
        right = np.setdiff1d(np.arange(len(self.second.facets)), self.partner[self.partner >= 0])
        return left, self.second.facets[right]


def side_of(hull: Hull, name: str, facets: Ints) -> Side:
    """The side that these facets of a hull make."""
    sizes = np.diff(hull.offsets)[facets]
    starts = np.cumsum(sizes) - sizes
    corners = np.unique(hull.nodes[np.repeat(hull.offsets[facets] - starts, sizes) + np.arange(sizes.sum())])
    centre, normal, area = hull.centre[facets], hull.normal[facets], hull.area[facets]
    x = hull.x[corners]
    ahead = area @ normal
    length = float(np.linalg.norm(ahead))
    extent = float(np.linalg.norm(np.ptp(x, axis=0)))
    flatness = math.inf
    if length > 0.0 and extent > 0.0:
        flatness = float(np.ptp((x - x[0]) @ (ahead / length))) / extent
    size = np.sqrt(area) if hull.kind == "face" else area
    return Side(name, facets, corners, centre, normal, area, size, flatness, box_tree(centre, centre))


def pieces(hull: Hull, side: Side) -> list[Side]:
    """The parts of a side that lie apart or meet at an angle, largest first."""
    facets = side.facets
    sizes = np.diff(hull.offsets)[facets]
    starts = np.cumsum(sizes) - sizes
    corner = hull.nodes[np.repeat(hull.offsets[facets] - starts, sizes) + np.arange(sizes.sum())]
    of = np.repeat(np.arange(len(facets)), sizes)
    order = np.argsort(corner, kind="stable")
    corner, of = corner[order], of[order]
    joined = []
    for step in range(1, int(np.bincount(corner).max(initial=0))):  # all facets around a corner with each other
        a, b = of[:-step], of[step:]
        joined.append(np.stack([a, b])[:, corner[:-step] == corner[step:]])
    links = np.concatenate(joined, axis=1) if joined else np.empty((2, 0), np.int64)
    level = np.einsum("ij,ij->i", side.normal[links[0]], side.normal[links[1]]) > 0.5
    links = links[:, level]
    part = find_parts(links[0].astype(np.int32), links[1].astype(np.int32), len(facets))
    found = [side_of(hull, side.name, facets[part == k]) for k in range(int(part.max()) + 1)]
    return sorted(found, key=lambda piece: -piece.total)


def pair_up(hull: Hull, sides: list[Side]) -> tuple[list[Pair], list[Side]]:
    """(pairs, sides left over): the best matches first, then of what is left those alike in area."""
    scores = []
    for i, first in enumerate(sides):
        for j in range(i + 1, len(sides)):
            second = sides[j]
            if min(first.total, second.total) > 0.0 and abs(first.total / second.total - 1.0) <= _SAME_AREA:
                share, error, motion = _fit(hull, first, second)
                scores.append((-share, error, i, j, motion))
    scores.sort(key=lambda score: score[:4])
    taken: set[int] = set()
    pairs = []
    for _, _, i, j, motion in scores:
        if i not in taken and j not in taken:
            taken |= {i, j}
            pairs.append(_pair(hull, sides[i], sides[j], motion))
    return pairs, [side for i, side in enumerate(sides) if i not in taken]


def _fit(hull: Hull, first: Side, second: Side) -> tuple[float, float, Motion]:
    """(share of the first side's facets that find one of the second, mean error over their size, motion)."""
    chosen = np.unique(np.linspace(0, len(first.facets) - 1, min(_SEEN, len(first.facets))).astype(int))
    ways = guesses(
        (first.centre, second.centre),
        (first.area, second.area),
        (first.normal, second.normal),
        flat=hull.kind == "side",
    )
    best: tuple[float, float, Motion] | None = None
    for motion in ways:
        _, distance = nearest(motion(first.centre[chosen]), _REACH * first.size[chosen], *_arrays(second.tree))
        error = np.minimum(distance / first.size[chosen], _REACH)
        # sides that look at each other through the domain: normals turned along must be opposite
        apart = float(np.linalg.norm(motion.turn @ (first.area @ first.normal) + second.area @ second.normal))
        score = (float(np.mean(error <= MATCH)), float(error.mean()) + apart / second.total)
        if best is None or (-score[0], score[1]) < (-best[0], best[1] - 1e-9):
            best = (*score, motion)
    assert best is not None  # noqa: S101 - there is always the translation
    return best


def _arrays(tree: Tree) -> tuple[Ints, Floats, Floats]:
    return tree.order, tree.boxes, tree.nodes


def _pair(hull: Hull, first: Side, second: Side, motion: Motion) -> Pair:
    which, distance = nearest(motion(first.centre), _REACH * first.size, *_arrays(second.tree))
    close = np.flatnonzero(distance <= 0.05 * first.size)
    if len(close) >= 3 and len(close) > 0.5 * len(which):
        motion = _refined(hull, motion, first, second, close, which)
        which, distance = nearest(motion(first.centre), _REACH * first.size, *_arrays(second.tree))
    with np.errstate(divide="ignore", invalid="ignore"):
        error = distance / first.size
    partner = np.where(error <= MATCH, which, -1)
    _, once = np.unique(partner, return_index=True)
    single = np.zeros(len(partner), dtype=bool)
    single[once] = True
    partner = np.where(single, partner, -1)
    moved = motion(hull.x[first.corners])
    tree = box_tree(hull.x[second.corners], hull.x[second.corners])
    to, apart = nearest(moved, _REACH * hull.reach[first.corners], *_arrays(tree))
    found = to >= 0
    start, end = hull.x[first.corners[found]], hull.x[second.corners[to[found]]]
    return Pair(first, second, motion, partner, error, apart / hull.reach[first.corners], _spans(motion, start, end))


def _refined(hull: Hull, motion: Motion, first: Side, second: Side, close: Ints, which: Ints) -> Motion:
    """Least squares over the matched centres, twice: the second time without those far off, which pull at the rest."""
    start, end, weights = first.centre[close], second.centre[which[close]], first.area[close]
    keep = np.ones(len(close), dtype=bool)
    for _ in range(2):
        motion = _fitted(hull, motion, start[keep], end[keep], weights[keep])
        off = np.sqrt(((motion(start) - end) ** 2).sum(axis=1))
        keep = off <= 3.0 * np.median(off)
    return _fitted(hull, motion, start[keep], end[keep], weights[keep])


def _fitted(hull: Hull, motion: Motion, start: Floats, end: Floats, weights: Floats) -> Motion:
    """The best motion of the kind at hand; in the plane, and for points on a line, the rotation stays as guessed."""
    if motion.is_translation:
        return Motion(np.eye(3), np.median(end - start, axis=0))
    spread = np.linalg.svd(start - start.mean(axis=0), compute_uv=False)
    if hull.kind == "side" or not spread[1] > 1e-6 * spread[0]:
        return Motion(motion.turn, np.median(end - start @ motion.turn.T, axis=0))
    return best_fit(start, end, weights)


def _spans(motion: Motion, start: Floats, end: Floats) -> Floats:
    """Angle about the axis, or distance, between corners and their partners; those on the axis are left out."""
    if motion.is_translation:
        return np.sqrt(((end - start) ** 2).sum(axis=1))
    direction, point, _ = motion.axis()
    a, b = start - point, end - point
    a, b = a - np.outer(a @ direction, direction), b - np.outer(b @ direction, direction)
    size = np.sqrt((a * a).sum(axis=1))
    off = size > 1e-6 * size.max(initial=0.0)
    spans: Floats = np.arctan2(np.cross(a[off], b[off]) @ direction, (a[off] * b[off]).sum(axis=1))
    return spans
