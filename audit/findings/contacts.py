"""`Contacts`: where facets of a hull lie on each other without being one face, and what that means.

Four kinds. "cut": both sides belong to one connected part and match corner for corner, as where the two ends of an
O- or C-grid meet. "unmerged": the same between two parts. "hanging": the sides have corners in common, and others of
one side lie inside edges or faces of the other: refinement. "nonconformal": they have no corner in common.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.findings.hull import Hull, mesh_hull
from meshwright.audit.findings.overlaps import find_overlaps
from meshwright.audit.findings.shapes import cell_shapes
from meshwright.audit.findings.touching import MOST, ROUNDING, TIGHT, compare, find_touches, seeds
from meshwright.audit.mesh import Ints, Mesh
from meshwright.audit.sets import find_parts

__all__ = ["LOOSE", "TIGHT", "Contact", "Contacts", "mesh_contacts"]

LOOSE = 0.1
"""Facets of two parts: sides of a curved interface, meshed apart, leave gaps of h**2 / 8 R, 0.04 h at 20 a turn."""

_LEAST = 1e-3
"""Share of the smaller facet that an overlap covers at least; neighbours of a match overlap by rounding."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Contact:
    """One connected place of contact.

    kind: see above.  parts: of the mesh, on the two sides.  first, second: facets of the hull, pair by pair; first
    belongs to parts[0].  overlap, gap: of each pair, in units of the hull.  matched: whether the pair agrees corner
    for corner.  points, facets: hull points inside an edge or face of a facet that is not theirs.
    """

    kind: str
    parts: tuple[int, int]
    first: Ints
    second: Ints
    overlap: Floats
    gap: Floats
    matched: NDArray[np.bool_]
    points: Ints
    facets: Ints

    @property
    def all_facets(self) -> Ints:
        """Facets of both sides, ascending."""
        return np.union1d(self.first, self.second)


@dataclass(frozen=True, eq=False)
class Contacts:
    """All places of contact, largest first."""

    hull: Hull
    places: tuple[Contact, ...]

    def of(self, kind: str) -> tuple[Contact, ...]:
        """The places of one kind."""
        return tuple(place for place in self.places if place.kind == kind)

    def facets(self, *kinds: str) -> NDArray[np.bool_]:
        """(m,) facets of the hull in a place of one of these kinds."""
        mask = np.zeros(len(self.hull), dtype=bool)
        for place in self.places:
            if place.kind in kinds:
                mask[place.first] = True
                mask[place.second] = True
        return mask


_one_at_a_time = threading.Lock()


def mesh_contacts(mesh: Mesh) -> Contacts:
    """The contacts of a mesh: checks that run side by side wait for the first of them to find out."""
    with _one_at_a_time:
        return _contacts(mesh)


@once_per_mesh
def _contacts(mesh: Mesh) -> Contacts:
    hull = mesh_hull(mesh)
    if not len(hull):
        return Contacts(hull, ())
    rim = hull.kind == "rim"
    shape = hull.x, hull.offsets, hull.nodes
    tree = hull.tree
    ordered = tree.order, tree.boxes, tree.nodes
    most = MOST if rim else LOOSE
    touches = find_touches(
        hull.x,
        hull.reach,
        hull.offsets,
        hull.nodes,
        hull.centre,
        hull.normal,
        hull.size,
        *hull.around,
        *ordered,
        rim,
        most,
    )
    if not len(touches[0]):
        return Contacts(hull, ())
    chosen = seeds(
        *touches,
        hull.x,
        hull.reach,
        hull.offsets,
        hull.nodes,
        hull.normal,
        hull.size,
        *hull.around,
        hull.part,
        rim,
    )
    if not chosen.any():
        return Contacts(hull, ())
    first, second, overlap, gap = find_overlaps(
        chosen, *shape, hull.centre, hull.normal, hull.area, hull.size, *ordered, rim, most, _LEAST
    )
    first, second, overlap, gap = _between_cells(hull, first, second, overlap, gap)
    swap = hull.part[first] > hull.part[second]
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    order = np.lexsort((second, first))
    first, second, overlap, gap = first[order], second[order], overlap[order], gap[order]
    size = np.minimum(hull.size[first], hull.size[second])
    one = (hull.part[first] == hull.part[second]) | rim
    within = np.where(one, np.minimum(MOST * size, np.maximum(TIGHT * size, ROUNDING)), LOOSE * size)
    same, sharing = np.zeros(len(first), dtype=bool), np.zeros(len(first), dtype=bool)
    inside = compare(first, second, *shape, hull.centre, within, same, sharing)
    settled = np.zeros(len(hull), dtype=bool)
    settled[first[same]] = True
    settled[second[same]] = True
    keep = same | ~(settled[first] & settled[second])  # two facets that each have their own twin are only neighbours
    columns = (first[keep], second[keep], overlap[keep], gap[keep], same[keep])
    return Contacts(hull, _places(hull, columns, sharing[keep], inside))


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
    inside: tuple[Ints, Ints],
) -> tuple[Contact, ...]:
    """The pairs by connected place: joined by a facet or a corner, between the same two parts."""
    first, second, _, _, same = columns
    n = len(first)
    if not n:
        return ()
    parts = np.stack([hull.part[first], hull.part[second]], axis=1)
    key = np.unique(parts, axis=0, return_inverse=True)[1].ravel()
    place = _joined(hull, first, second, key)
    count = int(place.max()) + 1
    order = np.argsort(place, kind="stable")
    stops = np.searchsorted(place[order], np.arange(count + 1))
    unmatched = np.bincount(place[~same], minlength=count)
    shared = np.bincount(place[sharing], minlength=count)
    points, facets = inside
    in_place = np.full(len(hull), -1)
    found = []
    for k in range(count):
        rows = order[stops[k] : stops[k + 1]]
        one = parts[rows[0], 0] == parts[rows[0], 1]
        kind = _kind(matched=not unmatched[k], shared=bool(shared[k]), one=bool(one))
        hung = np.empty(0, np.int64)
        if len(points) and unmatched[k]:
            in_place[first[rows]] = in_place[second[rows]] = k
            hung = np.flatnonzero(in_place[facets] == k)
        found.append(
            Contact(
                kind,
                (int(parts[rows[0], 0]), int(parts[rows[0], 1])),
                *(column[rows] for column in columns),
                points[hung],
                facets[hung],
            )
        )
    found.sort(key=lambda contact: -len(contact.first))
    return tuple(found)


def _kind(*, matched: bool, shared: bool, one: bool) -> str:
    if matched:
        return "cut" if one else "unmerged"
    return "hanging" if shared else "nonconformal"


def _joined(hull: Hull, first: Ints, second: Ints, key: Ints) -> Ints:
    """(n,) number of the place of each pair."""
    n = len(first)
    pairs, tokens = [], []
    for side in (first, second):
        sizes = np.diff(hull.offsets)[side]
        starts = np.cumsum(sizes) - sizes
        pair = np.repeat(np.arange(n), sizes)
        corner = hull.nodes[np.repeat(hull.offsets[side] - starts, sizes) + np.arange(len(pair))]
        pairs += [np.arange(n), pair]
        tokens += [side.astype(np.int64), len(hull) + corner.astype(np.int64)]
    pair, token = np.concatenate(pairs), np.concatenate(tokens)
    token += key[pair] * (len(hull) + len(hull.points))
    _, lead, group = np.unique(token, return_index=True, return_inverse=True)
    return find_parts(pair.astype(np.int32), pair[lead][group].astype(np.int32), n)
