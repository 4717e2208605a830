"""How far the edges of a curved boundary lie inside it: chordal deviation and the angle each edge spans.

A mesh file has no geometry, so the surface is taken from the mesh itself. Along a curve it is the circle through
three consecutive points; on a surface the circle with the mean normals of the two ends. An edge of length L on a
circle of radius R lies R - sqrt(R**2 - L**2 / 4) off it and spans 2 asin(L / 2R); for n equal segments of a circle
that is R (1 - cos(pi / n)) and 360 / n degrees.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces, nodes_of_cells
from meshwright.audit.csr import take
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.features import features_of, inner_surface
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.geometry import in_safe_units
from meshwright.audit.mesh import Ints, Mesh
from meshwright.audit.node_classes import Features, features
from meshwright.audit.places import plain

__all__ = ["ROWS", "curvatures"]

SMOOTH = 30.0
"""Degrees up to which a bend counts as part of a curved boundary, unless the feature angle is larger."""

_STRAIGHT = 0.01
"""Degrees below which an edge counts as straight."""

_CLASSES = (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 180.0)

Floats = NDArray[np.float64]


def curvatures(mesh: Mesh, found: Features, points: Floats) -> Floats:
    """(m,) curvature 1 / R along each of `found.edges`, 0 where it is straight, nan where it is unknown.

    points (n, 3): those of the mesh in any unit, which is that of R too.
    """
    with np.errstate(all="ignore"):
        out = np.full(len(found.edges), np.nan)
        out[found.sharp] = _along_curves(points, found)
        if mesh.dimension == 3:
            out[~found.sharp] = _on_surfaces(mesh, points, found)
    return out


def _along_curves(points: Floats, found: Features) -> Floats:
    """Curvature of the feature edges; from the end with less, 0 where the ends bend different ways."""
    pairs = found.edges[found.sharp].astype(np.int64)
    n = len(pairs)
    start, end = np.concatenate([pairs, pairs[:, ::-1]]).T
    order = np.lexsort((end, found.curve[found.sharp][np.tile(np.arange(n), 2)], start))
    p, of = start[order], np.tile(found.curve[found.sharp], 2)[order]
    two = np.flatnonzero((p[1:] == p[:-1]) & (of[1:] == of[:-1]) & (found.classes[p[1:]] == 1))
    i, j = order[two], order[two + 1]
    a, b, c = points[end[i]], points[start[i]], points[end[j]]
    u, v, w = b - a, c - b, c - a
    sides = [np.sqrt((x * x).sum(axis=1)) for x in (u, v, w)]
    cross = np.cross(u, v)
    bend = np.zeros((2 * n, 3))
    known = np.zeros(2 * n, dtype=bool)
    towards = v / sides[1][:, None] - u / sides[0][:, None]
    size = np.sqrt((towards * towards).sum(axis=1))
    kappa = 2.0 * np.sqrt((cross * cross).sum(axis=1)) / (sides[0] * sides[1] * sides[2])
    vector = np.where(size[:, None] > 0.0, towards / size[:, None] * kappa[:, None], 0.0)
    for side in (i, j):
        bend[side], known[side] = vector, True
    first, last = bend[:n], bend[n:]
    least = np.minimum(*(np.sqrt((x * x).sum(axis=1)) for x in (first, last)))
    both = np.where((first * last).sum(axis=1) > 0.0, least, 0.0)
    one = np.sqrt(((first + last) ** 2).sum(axis=1))
    return np.where(known[:n] & known[n:], both, np.where(known[:n] | known[n:], one, np.nan))


def _on_surfaces(mesh: Mesh, points: Floats, found: Features) -> Floats:
    """Curvature of the smooth edges of a surface from the normals at their ends, each the mean over its surface."""
    offsets, nodes = _loops(mesh, found)
    sizes = np.diff(offsets)
    of = np.repeat(np.arange(len(sizes)), sizes)
    before, after = np.roll(nodes, 1), np.roll(nodes, -1)
    before[offsets[:-1]] = nodes[offsets[1:] - 1]
    after[offsets[1:] - 1] = nodes[offsets[:-1]]
    at = points[nodes]
    u, v = points[after] - at, points[before] - at
    corner = np.cross(u, v)
    whole = np.add.reduceat(corner, offsets[:-1], axis=0)
    whole = whole / np.sqrt((whole * whole).sum(axis=1))[:, None]
    weight = np.arctan2(np.sqrt((corner * corner).sum(axis=1)), (u * v).sum(axis=1))
    keys, group = np.unique(nodes.astype(np.int64) * max(found.n_surfaces, 1) + found.surface[of], return_inverse=True)
    normal = np.stack([np.bincount(group, weight * whole[of, d], len(keys)) for d in range(3)], axis=1)
    normal = normal / np.sqrt((normal * normal).sum(axis=1))[:, None]
    smooth = ~found.sharp
    ends, patch = found.edges[smooth].astype(np.int64), found.surface[found.sides[smooth, 0]]
    first, last = (normal[np.searchsorted(keys, ends[:, k] * max(found.n_surfaces, 1) + patch)] for k in range(2))
    step = points[ends[:, 1]] - points[ends[:, 0]]
    return np.abs(((last - first) * step).sum(axis=1)) / (step * step).sum(axis=1)


def _loops(mesh: Mesh, found: Features) -> tuple[Ints, Ints]:
    return (
        take(faces(mesh).offsets, faces(mesh).nodes, found.faces) if mesh.cell_dimension == 3 else nodes_of_cells(mesh)
    )


def chordal_deviation(facts: Facts) -> Found | None:
    """Points of curved boundary edges."""
    mesh = facts.mesh
    if mesh.order == 2:
        return None  # edges with a node in their middle are not chords
    found = features_of(facts)
    smooth = max(facts.options.feature_angle, SMOOTH) * (1.0 + 1e-9)
    bends = (found.angle > _STRAIGHT) & (found.angle <= smooth)
    if not bends.any() and not _curves_bend(mesh, found):
        return None
    if smooth > facts.options.feature_angle:
        found = features(mesh, smooth, inner_surface)
    safe, unit = in_safe_units(mesh)
    with np.errstate(all="ignore"):
        kappa = curvatures(mesh, found, safe.points)
        step = safe.points[found.edges[:, 1]] - safe.points[found.edges[:, 0]]
        length = np.sqrt((step * step).sum(axis=1))
        half = np.minimum(0.5 * length * kappa, 1.0)
        angle = 2.0 * np.degrees(np.arcsin(half))
        # (1 - sqrt(1 - h h)) / kappa without cancellation
        deviation = 0.5 * length * half / (1.0 + np.sqrt(1.0 - half * half)) * unit
        length = length * unit
    curved = np.flatnonzero(angle > _STRAIGHT)
    if not len(curved):
        return None
    angle, deviation, length = angle[curved], deviation[curved], length[curved]
    worst = int(np.argmax(deviation))
    detail: dict[str, Any] = {
        "surface": "circles through neighbouring points of the mesh",
        "edges": len(curved),
        "max_deviation": plain(float(deviation[worst])),
        "mean_deviation": plain(float(deviation.mean())),
        "max_deviation_over_length": plain(float((deviation / length).max())),
        "max_angle": float(angle.max()),
        "mean_angle": float(angle.mean()),
        "angle_classes": list(_CLASSES),
        "angle_counts": np.histogram(angle, _CLASSES)[0].tolist(),
    }
    return Found(
        np.unique(found.edges[curved]),
        f"{counted(len(curved), 'boundary edge')} of curves and surfaces that bend: they lie up to "
        f"{deviation[worst]:.4g} off the arc (circles through neighbouring points) and span up to {angle.max():.4g} "
        "degrees; refine where that is more than the geometry allows",
        detail=detail,
    )


def _curves_bend(mesh: Mesh, found: Features) -> bool:
    """Whether any curve turns at all at a point that is no corner, up to the angle that counts as smooth."""
    ends = found.edges[found.sharp].ravel()
    if not len(ends):
        return False
    with np.errstate(all="ignore"):
        pairs = found.edges[found.sharp].astype(np.int64)
        step = mesh.points[pairs[:, 1]] - mesh.points[pairs[:, 0]]
        step = step / np.abs(step).max(axis=1)[:, None]
        step = step / np.sqrt((step * step).sum(axis=1))[:, None]
        start = pairs.T.ravel()
        out = np.concatenate([step, -step])
        order = np.argsort(start, kind="stable")
        same = np.flatnonzero(start[order[1:]] == start[order[:-1]])
        u, v = out[order[same]], -out[order[same + 1]]
        cross = np.cross(u, v)
        turn = np.degrees(np.arctan2(np.sqrt((cross * cross).sum(axis=1)), (u * v).sum(axis=1)))
    return bool(np.any((turn > _STRAIGHT) & (turn < 90.0)))


ROWS = (
    Check(
        "chordal-deviation", "info", "Chordal deviation", "point",
        "a figure to judge by: how much is allowed depends on the geometry", chordal_deviation,
    ),
)  # fmt: skip
