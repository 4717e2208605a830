"""`Contacts`: where facets of a hull lie on each other without being one face, and what that means.

Four kinds. "cut": both sides belong to one connected part and match corner for corner, as where the two ends of an
O- or C-grid meet. "unmerged": the same between two parts. "hanging": the sides have corners in common, and others of
one side lie inside edges or faces of the other: refinement. "nonconformal": they have no corner in common, or all of
them and yet other faces: a quadrilateral against two triangles.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.csr import take, uniform_offsets
from meshwright.audit.findings.hulls.collect import collected
from meshwright.audit.findings.hulls.hull import Hull, mesh_hull
from meshwright.audit.findings.hulls.overlaps import find_overlaps
from meshwright.audit.findings.hulls.touching import MOST, ROUNDING, TIGHT, compare, find_touches, seeds
from meshwright.audit.findings.signs.shapes import cell_shapes
from meshwright.audit.mesh import Ints, Mesh, index_array
from meshwright.audit.sets import find_parts, hash_rows

__all__ = ["KINDS", "LOOSE", "TIGHT", "Contact", "Contacts", "mesh_contacts"]

LOOSE = 0.1
"""Facets of two parts: sides of a curved interface, meshed apart, leave gaps of h**2 / 8 R, 0.04 h at 20 a turn."""

_LEAST = 1e-3
"""Share of the smaller facet that an overlap covers at least; neighbours of a match overlap by rounding."""

Floats = NDArray[np.float64]


def _no_rows() -> Ints:
    return np.empty(0, np.int64)


KINDS = ("cut", "unmerged", "hanging", "nonconformal")


@dataclass(frozen=True, eq=False)
class Contact:
    """One connected place of contact.

    parts: of the mesh, on the two sides.  first, second: facets of the hull, pair by pair; first belongs to parts[0].
    overlap, gap: of each pair, in units of the hull.  matched: whether the pair agrees corner for corner.
    """

    parts: tuple[int, int]
    first: Ints
    second: Ints
    overlap: Floats
    gap: Floats
    matched: NDArray[np.bool_]

    @property
    def all_facets(self) -> Ints:
        """Facets of both sides, ascending."""
        return np.union1d(self.first, self.second)


@dataclass(frozen=True, eq=False)
class Contacts:
    """All contacts of a hull.

    first, second, overlap, gap, matched (n,): of every pair of facets, as in `Contact`.  order (n,), stops (k + 1,):
    the pairs of each place, places with most pairs first.  kinds (k,): of the places, indices into `KINDS`.
    inside: (points, facets): hull points inside an edge or face of a facet that is not theirs.
    """

    hull: Hull
    first: Ints = field(default_factory=_no_rows)
    second: Ints = field(default_factory=_no_rows)
    overlap: Floats = field(default_factory=lambda: np.empty(0))
    gap: Floats = field(default_factory=lambda: np.empty(0))
    matched: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=bool))
    order: Ints = field(default_factory=_no_rows)
    stops: Ints = field(default_factory=lambda: np.zeros(1, np.int64))
    kinds: Ints = field(default_factory=_no_rows)
    inside: tuple[Ints, Ints] = field(default_factory=lambda: (_no_rows(), _no_rows()))

    def count(self, kind: str) -> int:
        """How many places there are of a kind."""
        return int(np.count_nonzero(self.kinds == KINDS.index(kind)))

    def of(self, kind: str, most: int | None = None) -> list[Contact]:
        """The places of one kind, largest first, no more than `most`."""
        return [self._place(k) for k in np.flatnonzero(self.kinds == KINDS.index(kind))[:most].tolist()]

    def _place(self, k: int) -> Contact:
        rows = self.order[self.stops[k] : self.stops[k + 1]]
        part = self.hull.part
        parts = int(part[self.first[rows[0]]]), int(part[self.second[rows[0]]])
        return Contact(
            parts, self.first[rows], self.second[rows], self.overlap[rows], self.gap[rows], self.matched[rows]
        )

    def facets(self, *kinds: str) -> NDArray[np.bool_]:
        """(m,) facets of the hull in a place of one of these kinds."""
        mask = np.zeros(len(self.hull), dtype=bool)
        wanted = np.isin(self.kinds, [KINDS.index(kind) for kind in kinds])
        rows = self.order[np.repeat(wanted, np.diff(self.stops))]
        mask[self.first[rows]] = True
        mask[self.second[rows]] = True
        return mask

    @property
    def hanging_points(self) -> Ints:
        """Hull points that hang on a facet, ascending."""
        points, facets = self.inside
        return np.unique(points[self.facets("hanging")[facets]])


_one_at_a_time = threading.Lock()


def mesh_contacts(mesh: Mesh) -> Contacts:
    """The contacts of a mesh: checks that run side by side wait for the first of them to find out."""
    with _one_at_a_time:
        return _contacts(mesh)


@once_per_mesh
def _contacts(mesh: Mesh) -> Contacts:
    hull = mesh_hull(mesh)
    if not len(hull):
        return Contacts(hull)
    rim = hull.kind == "rim"
    shape = hull.x, hull.offsets, hull.nodes
    tree = hull.tree
    ordered = tree.order, tree.boxes, tree.nodes
    most = MOST if rim else LOOSE
    measured = hull.offsets, hull.nodes, hull.centre, hull.normal, hull.size, *hull.around
    near = partial(find_touches, hull.x, hull.reach, hull.point_tree.order, *measured, *ordered, rim, most)
    touches = collected(near, np.int32, np.int32, np.float64)
    chosen = _split_quads(hull)
    if len(touches[0]):
        sides = hull.offsets, hull.nodes, hull.normal, hull.size, *hull.around
        chosen |= seeds(*touches, hull.x, hull.reach, *sides, hull.part, rim)
    if not chosen.any():
        return Contacts(hull)
    sized = hull.centre, hull.normal, hull.area, hull.size
    over = partial(find_overlaps, chosen, *shape, *sized, *ordered, rim, most, _LEAST)
    first, second, overlap, gap = collected(over, np.int32, np.int32, np.float64, np.float64)
    first, second, overlap, gap = _between_cells(hull, first, second, overlap, gap)
    swap = hull.part[first] > hull.part[second]
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    order = np.lexsort((second, first))
    first, second, overlap, gap = first[order], second[order], overlap[order], gap[order]
    size = np.minimum(hull.size[first], hull.size[second])
    one = (hull.part[first] == hull.part[second]) | rim
    within = np.where(one, np.minimum(MOST * size, np.maximum(TIGHT * size, ROUNDING)), LOOSE * size)
    same, sharing = np.zeros(len(first), dtype=bool), np.zeros(len(first), dtype=bool)
    agree = partial(compare, first, second, *shape, hull.centre, within, same, sharing)
    points, facets = collected(agree, np.int32, np.int32)
    settled = np.zeros(len(hull), dtype=bool)
    settled[first[same]] = True
    settled[second[same]] = True
    keep = same | ~(settled[first] & settled[second])  # two facets that each have their own twin are only neighbours
    columns = (first[keep], second[keep], overlap[keep], gap[keep], same[keep])
    return Contacts(hull, *columns, *_places(hull, columns, sharing[keep], facets), (points, facets))


def _split_quads(hull: Hull) -> NDArray[np.bool_]:
    """(m,) quadrilaterals that have all corners of a triangle, and such triangles: they share all and touch nothing."""
    chosen = np.zeros(len(hull), dtype=bool)
    widths = np.diff(hull.offsets)
    triangles, quads = np.flatnonzero(widths == 3), np.flatnonzero(widths == 4)
    if not len(triangles) or not len(quads):
        return chosen
    keys = hash_rows(*take(hull.offsets, hull.nodes, index_array(triangles)))
    corners = hull.nodes[hull.offsets[quads][:, None] + np.arange(4)]
    for left_out in range(4):
        three = index_array(np.delete(corners, left_out, axis=1).ravel())
        own = hash_rows(uniform_offsets(len(quads), 3), three)
        chosen[quads[np.isin(own, keys)]] = True
        chosen[triangles[np.isin(keys, own)]] = True
    return chosen


def _between_cells(
    hull: Hull, first: Ints, second: Ints, overlap: Floats, gap: Floats
) -> tuple[Ints, Ints, Floats, Floats]:
    """Without the facets of one cell, folded flat, and those of cells of which one is inside out."""
    a, b = hull.owner[first], hull.owner[second]
    keep = a != b
    if hull.kind != "rim":
        negative = cell_shapes(hull.mesh).negative
        keep &= negative[a] == negative[b]
    return first[keep], second[keep], overlap[keep], gap[keep]


def _places(
    hull: Hull,
    columns: tuple[Ints, Ints, Floats, Floats, NDArray[np.bool_]],
    sharing: NDArray[np.bool_],
    touched: Ints,
) -> tuple[Ints, Ints, Ints]:
    """(order, stops, kinds) of `Contacts`: pairs joined by a facet or a corner, between the same two parts."""
    first, second, _, _, same = columns
    if not len(first):
        return _no_rows(), np.zeros(1, np.int64), _no_rows()
    a, b = hull.part[first].astype(np.int64), hull.part[second].astype(np.int64)
    key = np.unique(a * (int(b.max()) + 1) + b, return_inverse=True)[1]
    place = _joined(hull, first, second, key)
    sizes = np.bincount(place)
    matched = np.bincount(place, weights=same) == sizes
    hung = np.zeros(len(hull), dtype=bool)
    hung[touched] = True
    shared = np.bincount(place[sharing], minlength=len(sizes)) > 0
    shared &= np.bincount(place[hung[first] | hung[second]], minlength=len(sizes)) > 0
    one = np.zeros(len(sizes), dtype=bool)
    one[place] = a == b
    kinds = np.where(
        matched,
        np.where(one, KINDS.index("cut"), KINDS.index("unmerged")),
        np.where(shared, KINDS.index("hanging"), KINDS.index("nonconformal")),
    )
    rank = np.argsort(-sizes, kind="stable")
    new = np.empty(len(sizes), np.int64)
    new[rank] = np.arange(len(sizes))
    order = np.argsort(new[place], kind="stable")
    return order, np.concatenate([[0], np.cumsum(sizes[rank])]), kinds[rank]


def _joined(hull: Hull, first: Ints, second: Ints, key: Ints) -> Ints:
    """(n,) number of the place of each pair: those that have a corner in common, between the same parts, are one."""
    n = len(first)
    pairs, corners = [], []
    for side in (first, second):
        sizes = np.diff(hull.offsets)[side]
        starts = np.cumsum(sizes) - sizes
        pair = np.repeat(np.arange(n), sizes)
        pairs.append(pair)
        corners.append(hull.nodes[np.repeat(hull.offsets[side] - starts, sizes) + np.arange(len(pair))])
    pair = np.concatenate(pairs)
    token = np.concatenate(corners) + key[pair] * len(hull.points)
    _, lead, group = np.unique(token, return_index=True, return_inverse=True)
    return find_parts(pair.astype(np.int32), pair[lead][group].astype(np.int32), n)
