"""Passes that close a triangle surface: flat triangles, T-junctions, fins, specks, holes. Weld first.

Each works on shells of triangles alone and leaves every other mesh as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.carrying import with_cells
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.patch import best_patch

__all__ = [
    "drop_fins",
    "drop_flat",
    "drop_specks",
    "fill_holes",
    "open_sides",
    "sides_of",
    "split_junctions",
    "triangles_of",
]

Mask = NDArray[np.bool_]

_DEFAULT = 1e-6
"""Part of the diagonal of the surface that counts as nothing where no tolerance is given."""
_SPECK = 0.01
"""Share of the area up to which a part that hangs on nothing is a speck."""
_FEW = 0.02
"""Share of the triangles above which small parts are no specks but the screws of a guitar, the bones of a foot."""
_SMALL_LOOP = 16
"""Edges up to which a hole gets one point in its middle; longer ones may be meant: they are closed on demand."""
_MOST_SPLITS = 8


def triangles_of(mesh: Mesh) -> Ints | None:
    """(m, 3) the triangles of a shell, by row; None for any other mesh."""
    if mesh.cell_dimension != 2 or mesh.dimension != 3 or mesh.faces is not None:
        return None
    if [block.type for block in mesh.blocks] != ["tri"]:
        return None
    return np.asarray(mesh.blocks[0].nodes, dtype=np.int64)


def _tolerance(mesh: Mesh, options: Options) -> float:
    if options.tolerance is not None:
        return options.tolerance
    return _DEFAULT * float(np.linalg.norm(np.ptp(mesh.points, axis=0)))


def _edges(tris: Ints) -> tuple[Ints, Ints]:
    """(use, edge): how many triangles have each side (m, 3), side k running from corner k; and its number."""
    low, high = np.minimum(tris, np.roll(tris, -1, axis=1)), np.maximum(tris, np.roll(tris, -1, axis=1))
    # one number for each pair of points: rows take numpy ten times as long to tell apart
    key = low.astype(np.int64) * (int(tris.max(initial=0)) + 1) + high
    _, edge, use = np.unique(key.ravel(), return_inverse=True, return_counts=True)
    edge = edge.reshape(-1, 3)
    return use[edge], edge


def sides_of(tris: Ints) -> Ints:
    """(m, 3) how many triangles have each side, that from corner k being side k."""
    return _edges(tris)[0]


def open_sides(tris: Ints) -> int:
    """How many sides of triangles (m, 3) have no other triangle, or more than one."""
    return int(np.count_nonzero(sides_of(tris) != 2))


def _kept(mesh: Mesh, tris: Ints, keep: Mask, note: str) -> Outcome:
    gone = int(np.count_nonzero(~keep))
    if not gone:
        return Outcome(mesh, 0)
    if gone == len(tris):
        return Outcome(mesh, 0, refused=("no triangle would be left",))
    rows = np.flatnonzero(keep)
    fresh, cells_from = with_cells(mesh, {"tri": (tris[rows], rows)})
    return Outcome(fresh, gone, note, cells_from=cells_from)


def drop_flat(mesh: Mesh, options: Options) -> Outcome:
    """Drop triangles lower than the tolerance: their longest side lies on their third corner."""
    tris = triangles_of(mesh)
    if tris is None:
        return Outcome(mesh, 0)
    x = mesh.points[tris]
    area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    longest = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).max(axis=1)
    return _kept(mesh, tris, area > _tolerance(mesh, options) * longest, "triangles without height dropped")


def split_junctions(mesh: Mesh, options: Options) -> Outcome:
    """Split the triangles at whose free side a point of another free side lies, within the tolerance."""
    tris = triangles_of(mesh)
    if tris is None:
        return Outcome(mesh, 0)
    tolerance = _tolerance(mesh, options)
    parent = np.arange(len(tris))
    splits = 0
    for _ in range(_MOST_SPLITS):
        at, side, point = _junctions(mesh.points, tris, tolerance)
        if not len(at):
            break
        _, first = np.unique(at, return_index=True)  # one split of a triangle at a time
        at, side, point = at[first], side[first], point[first]
        a, b, c = (tris[at, (side + k) % 3] for k in range(3))
        tris = np.array(tris)
        tris[at] = np.stack([a, point, c], axis=1)
        tris = np.vstack([tris, np.stack([point, b, c], axis=1)])
        parent = np.concatenate([parent, parent[at]])
        splits += len(at)
    if not splits:
        return Outcome(mesh, 0)
    fresh, cells_from = with_cells(mesh, {"tri": (tris, parent)})
    return Outcome(fresh, splits, "T-junctions split", cells_from=cells_from)


def _junctions(points: Floats, tris: Ints, tolerance: float) -> tuple[Ints, Ints, Ints]:
    """(triangle, side, point) of every free side with a free point on it, the point nearest to its middle."""
    use, _ = _edges(tris)
    at, side = np.nonzero(use == 1)
    a, b = tris[at, side], tris[at, (side + 1) % 3]
    rim = np.unique(np.concatenate([a, b]))
    found: list[tuple[int, int, int]] = []
    if len(rim):
        tree = cKDTree(points[rim])
        middle, along = 0.5 * (points[a] + points[b]), points[b] - points[a]
        length = np.linalg.norm(along, axis=1)
        near = tree.query_ball_point(middle, 0.5 * length)
        for i, candidates in enumerate(near):
            best, where = np.inf, -1
            for j in candidates:
                p = int(rim[j])
                if p in (int(a[i]), int(b[i]), int(tris[at[i], (side[i] + 2) % 3])):
                    continue
                t = float((points[p] - points[a[i]]) @ along[i]) / float(length[i] ** 2)
                off = float(np.linalg.norm(points[p] - points[a[i]] - t * along[i]))
                if off <= tolerance < min(t, 1.0 - t) * length[i] and abs(t - 0.5) < best:
                    best, where = abs(t - 0.5), p
            if where >= 0:
                found.append((int(at[i]), int(side[i]), where))
    table = np.array(found, np.int64).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def drop_fins(mesh: Mesh, options: Options) -> Outcome:
    """Drop triangles that stand on an edge of three or more and have free sides, those with two of them first."""
    tris = triangles_of(mesh)
    if tris is None:
        return Outcome(mesh, 0)
    rows = np.arange(len(tris))
    while len(rows):
        use, _ = _edges(tris[rows])
        free = (use == 1).sum(axis=1)
        fin = (use > 2).any(axis=1) & (free > 0)
        if not fin.any():
            break
        rows = rows[~(fin & (free == free[fin].max()))]
    keep = np.zeros(len(tris), bool)
    keep[rows] = True
    return _kept(mesh, tris, keep, "fins dropped")


def drop_specks(mesh: Mesh, options: Options) -> Outcome:
    """Drop parts that share no edge with the rest and have less than 1 % of the area each.

    Where together they are more than 2 % of the triangles, they are taken for parts that are meant, and told of.
    """
    tris = triangles_of(mesh)
    if tris is None:
        return Outcome(mesh, 0)
    _, edge = _edges(tris)
    m = len(tris)
    links = coo_array(
        (np.ones(3 * m, np.int8), (np.repeat(np.arange(m), 3), m + edge.ravel())), shape=(m + int(edge.max()) + 1,) * 2
    )
    label = connected_components(links, directed=False)[1][:m]
    x = mesh.points[tris]
    area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    share = np.bincount(label, area) / max(float(area.sum()), 1e-300)
    small = share < _SPECK
    if small.all():
        return Outcome(mesh, 0)
    if small[label].mean() > _FEW:
        told = (
            f"{int(small.sum())} parts of less than 1 % of the area each are kept: with {small[label].mean():.0%} of "
        )
        return Outcome(mesh, 0, refused=(told + "the triangles they look meant",))
    return _kept(mesh, tris, ~small[label], "triangles of specks dropped")


def fill_holes(mesh: Mesh, options: Options) -> Outcome:
    """Close small holes by one point each, put on the curved surface that the points around the hole lie on.

    Larger ones, up to `max_hole` edges, get the triangles between their own points that bend least. A single sheet's
    outer border is a hole too, as far as edges tell.
    """
    tris = triangles_of(mesh)
    if tris is None:
        return Outcome(mesh, 0)
    loops, refused = _loops(tris)
    points: list[Floats] = [mesh.points]
    new: list[Ints] = [tris]
    parent: list[Ints] = [np.arange(len(tris))]
    at, closed = len(mesh.points), 0
    begin, around = _neighbours(tris, len(mesh.points))
    for nodes, owners in loops:
        if len(nodes) > max(_SMALL_LOOP, options.max_hole):
            refused.append(
                f"a hole of {len(nodes)} edges at {_place(mesh.points[nodes])} is left open; --max-hole {len(nodes)} "
                "closes it"
            )
            continue
        closed += 1
        if len(nodes) > _SMALL_LOOP:
            corners = tris[owners]
            third = corners.sum(axis=1) - nodes - np.roll(nodes, -1)
            patch = best_patch(mesh.points[nodes], mesh.points[third])
            new.append(nodes[patch][:, ::-1])
            parent.append(owners[patch[:, 0]])
            continue
        if len(nodes) == 3:
            new.append(nodes[None, ::-1])
            parent.append(owners[:1])
            continue
        points.append(_middle(mesh.points, nodes, begin, around)[None])
        new.append(np.stack([np.roll(nodes, -1), nodes, np.full(len(nodes), at)], axis=1))
        parent.append(owners)
        at += 1
    if not closed:
        return Outcome(mesh, 0, refused=tuple(refused))
    n_old = len(mesh.points)
    points_from = np.concatenate([np.arange(n_old), np.full(at - n_old, -1)])
    ids = mesh.point_ids
    if ids is not None:
        ids = np.concatenate([ids.astype(np.int64), int(ids.max()) + 1 + np.arange(at - n_old)])
    wider = replace(mesh, points=np.vstack(points), point_ids=ids)
    fresh, cells_from = with_cells(wider, {"tri": (np.vstack(new), np.concatenate(parent))})
    note = f"holes closed with {fresh.n_cells - mesh.n_cells} triangles"
    return Outcome(fresh, closed, note, points_from=points_from, cells_from=cells_from, refused=tuple(refused))


def _place(points: Floats) -> str:
    x, y, z = points.mean(axis=0)
    return f"({x:.4g}, {y:.4g}, {z:.4g})"


def _loops(tris: Ints) -> tuple[list[tuple[Ints, Ints]], list[str]]:
    """(loops, refused): the points around each hole as its triangles walk, with the triangle of each edge."""
    use, _ = _edges(tris)
    at, side = np.nonzero(use == 1)
    a, b = tris[at, side], tris[at, (side + 1) % 3]
    refused: list[str] = []
    starts, count = np.unique(a, return_counts=True)
    if (count > 1).any():
        refused.append(f"{int((count > 1).sum())} points where two holes meet: their holes are left open")
    follow = {int(p): (int(q), int(t)) for p, q, t in zip(a, b, at, strict=True)}
    crossed = set(starts[count > 1].tolist())
    loops = []
    left = set(follow)
    for start in a.tolist():
        if start not in left:
            continue
        nodes, owners, p = [], [], start
        while p in left:
            left.discard(p)
            nodes.append(p)
            q, t = follow[p]
            owners.append(t)
            p = q
        if p == start and not crossed & set(nodes) and len(nodes) > 2:
            loops.append((np.array(nodes), np.array(owners)))
    return loops, refused


def _neighbours(tris: Ints, n: int) -> tuple[Ints, Ints]:
    """(begin, points): the points joined to each by an edge."""
    one, two = tris.astype(np.int64).ravel(), np.roll(tris, -1, axis=1).ravel()
    keys = np.unique(np.concatenate([one * n + two, two * n + one]))
    return np.searchsorted(keys, np.arange(n + 1) * n), keys % n


def _middle(points: Floats, loop: Ints, begin: Ints, around: Ints) -> Floats:
    """The point over the middle of a hole on the paraboloid that fits the points around it, by least squares."""
    near = set(loop.tolist())
    for _ in range(2):
        near |= {int(q) for p in near for q in around[begin[p] : begin[p + 1]]}
    centre = points[loop].mean(axis=0)
    ring = points[loop] - centre
    normal = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    size = float(np.linalg.norm(normal))
    if not size > 0.0:
        return centre
    normal /= size
    u = np.cross(normal, [1.0, 0.0, 0.0] if abs(normal[0]) < 0.7 else [0.0, 1.0, 0.0])
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    place = points[sorted(near)] - centre
    s, t, h = place @ u, place @ v, place @ normal
    reach = float(np.abs(ring).max())
    s, t = s / reach, t / reach
    weight = np.exp(-0.25 * (s * s + t * t))
    table = np.stack([np.ones_like(s), s, t, s * s, s * t, t * t], axis=1)
    found, *_ = np.linalg.lstsq(table * weight[:, None], h * weight, rcond=1e-9)
    lift = float(found[0])
    return centre + normal * (lift if abs(lift) < reach else 0.0)
