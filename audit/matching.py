"""Two meshes against each other: which cells are the same, moved, new or gone. Places decide, not numbers.

1. Points at the same place, to the bit or within a tolerance, are one place. A mesh that is moved or scaled as a whole
   is brought back first, and that is said.
2. Cells of a type with the same set of places are the same; of several such cells each is matched once.
3. Of the others, cells that share all corners but those that are in one mesh alone, and have as many of these, have
   moved. So have those that join the points of the same numbers, where both meshes have as many points.
4. What is left was removed, or added.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import nodes_of_cells
from meshwright.audit.mesh import Mesh

__all__ = ["Match", "match_meshes"]

Floats = NDArray[np.float64]
Rows = NDArray[np.int64]
Keys = NDArray[np.uint64]

_RELATIVE = 1e-9
_MIX = (np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB))


@dataclass(frozen=True, eq=False)
class Match:
    """Rows of cells: same (n, 2) pairs, moved (m, 2) pairs, removed of the first mesh, added of the second.

    distance: (m,) how far the corners of moved cells have gone at most, in units of the second mesh.
    shift, scale: what brings the first mesh as a whole onto the second: places * scale + shift; (0, 0, 0) and 1 for
    nothing.  tolerance: distance up to which points are one place.
    """

    same: Rows
    moved: Rows
    removed: Rows
    added: Rows
    distance: Floats
    shift: tuple[float, float, float]
    scale: float
    tolerance: float


def match_meshes(a: Mesh, b: Mesh, tolerance: float | None = None) -> Match:
    """Match the cells of two meshes.

    tolerance: largest distance of points that are one place, in units of `b`; a billionth of the diagonal of its box
    when None.
    """
    sound = [np.asarray(np.isfinite(mesh.points).all(axis=1)) for mesh in (a, b)]
    box = b.points[sound[1]]
    diagonal = float(np.linalg.norm(np.ptp(box, axis=0))) if len(box) else 0.0
    reach = _RELATIVE * diagonal if tolerance is None else tolerance
    points = a.points
    shift, scale = np.zeros(3), 1.0
    places = _places(points, b.points, reach)
    if 2 * _common(places) < len(a.points):
        moved = _whole(a.points[sound[0]], box)
        if moved is not None:
            shift, scale = moved
            again = _places(a.points * scale + shift, b.points, max(reach, 4e-16 * float(np.abs(box).max())))
            if _common(again) > _common(places):
                places, points = again, a.points * scale + shift
            else:
                shift, scale = np.zeros(3), 1.0
    keys = [_cell_keys(mesh, of) for mesh, of in zip((a, b), places, strict=True)]
    same = _paired(*keys)
    left = [np.setdiff1d(np.arange(mesh.n_cells), same[:, k]) for k, mesh in enumerate((a, b))]
    pairs = _moved_by_corners(a, b, places, left)
    left = [np.setdiff1d(rows, pairs[:, k]) for k, rows in enumerate(left)]
    if len(a.points) == len(b.points):
        pairs = np.concatenate([pairs, _moved_by_numbers(a, b, left)])
        left = [np.setdiff1d(rows, pairs[:, k]) for k, rows in enumerate(left)]
    pairs = pairs[np.argsort(pairs[:, 1], kind="stable")]
    return Match(same, pairs, left[0], left[1], _distances(a, b, points, places, pairs),
                 (float(shift[0]), float(shift[1]), float(shift[2])), float(scale), reach)  # fmt: skip


def _hash(words: Keys) -> Keys:
    """Well mixed 64 bits of each word."""
    with np.errstate(over="ignore"):
        x = words + _MIX[0]
        x = (x ^ (x >> np.uint64(30))) * _MIX[1]
        x = (x ^ (x >> np.uint64(27))) * _MIX[2]
    return x ^ (x >> np.uint64(31))


def _places(a: Floats, b: Floats, reach: float) -> tuple[Rows, Rows]:
    """(n,) and (m,) number of the place of every point of two meshes; points of either may share one."""
    both = np.ascontiguousarray(np.concatenate([a, b]) + 0.0)  # -0.0 is 0.0
    bits = both.view(np.uint64)
    key = _hash(bits[:, 0]) ^ _hash(_hash(bits[:, 1]) + _MIX[1]) ^ _hash(_hash(bits[:, 2]) + _MIX[2])
    _, first, place = np.unique(key, return_index=True, return_inverse=True)
    if not np.array_equal(bits[first][place], bits):  # two places with one key: by the coordinates themselves
        _, first, place = np.unique(both, axis=0, return_index=True, return_inverse=True)
    place = place.astype(np.int64)
    if reach > 0:
        place = _joined(both, first, place, len(a), reach)
    return place[: len(a)], place[len(a) :]


def _joined(both: Floats, first: Rows, place: Rows, n: int, reach: float) -> Rows:
    """The places after those of one mesh alone have been joined with the nearest of the other within reach."""
    from scipy.spatial import cKDTree  # noqa: PLC0415 - slow to import, wanted where points differ

    in_a, in_b = np.zeros(len(first), bool), np.zeros(len(first), bool)
    in_a[place[:n]], in_b[place[n:]] = True, True
    finite = np.asarray(np.isfinite(both[first]).all(axis=1))
    only_a, only_b = np.flatnonzero(in_a & ~in_b & finite), np.flatnonzero(in_b & ~in_a & finite)
    if not len(only_a) or not len(only_b):
        return place
    distance, nearest = cKDTree(both[first[only_b]]).query(both[first[only_a]], distance_upper_bound=reach)
    found = np.isfinite(distance)
    target = np.arange(len(first))
    order = np.argsort(distance[found], kind="stable")
    sources, goals = only_a[found][order], only_b[nearest[found]][order]
    _, once = np.unique(goals, return_index=True)  # the nearest of those that want the same place
    target[sources[once]] = goals[once]
    joined: Rows = target[place]
    return joined


def _common(places: tuple[Rows, Rows]) -> int:
    """Points of the first mesh at a place that the second has too."""
    return int(np.count_nonzero(np.isin(places[0], places[1])))


def _whole(a: Floats, b: Floats) -> tuple[Floats, float] | None:
    """The shift and scale that bring the box of one mesh onto that of the other, None where a scale alone cannot."""
    if not len(a) or not len(b):
        return None
    low, size = a.min(axis=0), np.ptp(a, axis=0)
    low_b, size_b = b.min(axis=0), np.ptp(b, axis=0)
    real = size > 0
    if not real.any() or (size_b[~real] > 0).any() or not (size_b[real] > 0).all():
        return None
    ratios = size_b[real] / size[real]
    if np.ptp(ratios) > 1e-9 * ratios.max():
        return None
    scale = float(f"{ratios.mean():.9g}")
    return low_b - low * scale, scale


def _cell_keys(mesh: Mesh, place: Rows, among: Rows | None = None) -> Keys:
    """(n_cells,) a key of the type and the set of places of every cell; the order of corners does not matter.

    among: places that count, None for all; a cell's number of others counts as well.
    """
    offsets, nodes = nodes_of_cells(mesh)
    of_node = place[nodes]
    values = _hash(of_node.astype(np.uint64))
    kind = np.empty(mesh.n_cells, np.uint64)
    for block in mesh.blocks:
        kind[block.rows] = int.from_bytes(block.type.encode()[:8].ljust(8, b"\0"), "little")
    if among is not None:
        inside = np.isin(of_node, among)
        values = values * inside
        others: Keys = np.add.reduceat((~inside).astype(np.uint64), offsets[:-1])
        kind = kind + others * _MIX[0]
    with np.errstate(over="ignore"):
        found: Keys = _hash(np.add.reduceat(values, offsets[:-1]) + _hash(kind))
    return found


def _paired(a: Keys, b: Keys) -> Rows:
    """(n, 2) rows with the same key, each once, in the order of the rows of the second."""
    order_a, order_b = np.argsort(a, kind="stable"), np.argsort(b, kind="stable")
    sorted_a, sorted_b = a[order_a], b[order_b]
    rank_b = np.arange(len(b)) - np.searchsorted(sorted_b, sorted_b)  # the how-manieth of its key
    at = np.searchsorted(sorted_a, sorted_b) + rank_b
    inside = at < np.searchsorted(sorted_a, sorted_b, side="right")
    pairs = np.column_stack([order_a[at[inside]], order_b[inside]])
    return pairs[np.argsort(pairs[:, 1], kind="stable")].astype(np.int64)


def _moved_by_corners(a: Mesh, b: Mesh, places: tuple[Rows, Rows], left: list[Rows]) -> Rows:
    """Pairs of cells that share all corners but those that are in one mesh alone; ambiguous ones are left out."""
    if not len(left[0]) or not len(left[1]):
        return np.empty((0, 2), np.int64)
    common = np.intersect1d(*places)
    keys = []
    for mesh, place, rows in zip((a, b), places, left, strict=True):
        offsets, nodes = nodes_of_cells(mesh)
        shared = np.add.reduceat(np.isin(place[nodes], common).astype(np.int64), offsets[:-1])
        keep = rows[shared[rows] > 0]
        keys.append((keep, _cell_keys(mesh, place, common)[keep]))
    single = []
    for rows, key in keys:
        unique, first, counts = np.unique(key, return_index=True, return_counts=True)
        once = counts == 1
        single.append((unique[once], rows[first[once]]))
    (key_a, rows_a), (key_b, rows_b) = single
    at = np.searchsorted(key_a, key_b)
    at_safe = np.minimum(at, max(0, len(key_a) - 1))
    hit = (at < len(key_a)) & (key_a[at_safe] == key_b) if len(key_a) else np.zeros(len(key_b), bool)
    return np.column_stack([rows_a[at_safe[hit]], rows_b[hit]]).astype(np.int64).reshape(-1, 2)


def _moved_by_numbers(a: Mesh, b: Mesh, left: list[Rows]) -> Rows:
    """Pairs of cells that join the points of the same numbers."""
    if not len(left[0]) or not len(left[1]):
        return np.empty((0, 2), np.int64)
    same = np.arange(len(a.points))
    pairs = _paired(_cell_keys(a, same)[left[0]], _cell_keys(b, same)[left[1]])
    return np.column_stack([left[0][pairs[:, 0]], left[1][pairs[:, 1]]]).reshape(-1, 2)


def _distances(a: Mesh, b: Mesh, points: Floats, places: tuple[Rows, Rows], pairs: Rows) -> Floats:
    """(m,) the largest distance from a corner that is not in both cells to the nearest such corner of the other."""
    table_a, table_b = nodes_of_cells(a), nodes_of_cells(b)
    found = np.zeros(len(pairs))
    for k, (row_a, row_b) in enumerate(pairs.tolist()):
        nodes_a = table_a[1][table_a[0][row_a] : table_a[0][row_a + 1]]
        nodes_b = table_b[1][table_b[0][row_b] : table_b[0][row_b + 1]]
        lost = nodes_a[~np.isin(places[0][nodes_a], places[1][nodes_b])]
        new = nodes_b[~np.isin(places[1][nodes_b], places[0][nodes_a])]
        if len(lost) and len(new):
            with np.errstate(invalid="ignore"):
                apart = np.linalg.norm(points[lost][:, None] - b.points[new][None], axis=2)
            found[k] = max(float(apart.min(axis=1).max()), float(apart.min(axis=0).max()))
    return found
