"""Checks on periodic zones: whether their two sides are the same under a translation or a rotation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.hulls.contacts import mesh_contacts
from meshwright.audit.findings.hulls.hull import Hull, mesh_hull
from meshwright.audit.findings.hulls.membership import Membership
from meshwright.audit.findings.hulls.sectors import MATCH, PLANAR, Pair, Side, pair_up, pieces, side_of
from meshwright.audit.mesh import Mesh, Zone
from meshwright.audit.places import plain, text

__all__ = ["MATCHING", "OVERLAPPING", "ROWS"]

MATCHING = frozenset(("periodic", "cyclic", "cyclicSlip"))
"""Roles of zones whose two sides must match face for face."""
OVERLAPPING = frozenset(("cyclicAMI", "cyclicACMI", "cyclicPeriodicAMI"))
"""Roles of zones whose two sides need only cover each other: OpenFOAM's arbitrary mesh interfaces."""


def periodic_mismatch(facts: Facts) -> Found | None:
    """Faces of periodic zones without a partner, or zones without another side."""
    hull = mesh_hull(facts.mesh)
    pairs, alone = _pairs(facts.mesh)
    bad = [pair for pair in pairs if any(map(len, pair.unmatched))]
    if not bad and not alone:
        return None
    missing = [side for pair in bad for side in pair.unmatched] + [side.facets for side in alone]
    words = [_advice(pair) for pair in bad[:3]]
    if alone:
        names = ", ".join(sorted({side.name for side in alone})[:5])
        words.append(f"no other side of the same area for {names}: it is missing, or in a zone of another role")
    strict = bool(alone) or any(_strict(facts.mesh, pair) for pair in bad)
    rows = np.unique(hull.rows[np.concatenate(missing)])
    return Found(
        rows,
        f"{counted(len(rows), *hull.words)} of periodic zones without a partner; {'; '.join(words)}",
        entity="face" if hull.kind == "face" else "edge",
        severity="warning" if strict else "info",
        detail={
            "pairs": [_figures(hull, pair) for pair in bad],
            "without_another_side": [_side(hull, side) for side in alone],
        },
    )


def periodic_zones(facts: Facts) -> Found | None:
    """The periodic zones that match, with the motion between them."""
    mesh = facts.mesh
    hull = mesh_hull(mesh)
    pairs = [pair for pair in _pairs(mesh)[0] if not any(map(len, pair.unmatched))]
    if not pairs:
        return None
    names = {name for pair in pairs for name in (pair.first.name, pair.second.name)}
    rows = [i for i, zone in enumerate(mesh.zones) if _is_periodic(zone) and text(zone.name) in names]
    return Found(
        rows,
        f"{counted(len(pairs), 'periodic pair')} matching face for face: {'; '.join(_motion(p) for p in pairs[:3])}; "
        "check that the case uses the same motion",
        detail={"pairs": [_figures(hull, pair) for pair in pairs]},
    )


def _is_periodic(zone: Zone) -> bool:
    return zone.entity == "face" and zone.role in MATCHING | OVERLAPPING and bool(len(zone.members))


def _strict(mesh: Mesh, pair: Pair) -> bool:
    """Whether a zone of the pair must match face for face."""
    names = (pair.first.name, pair.second.name)
    return any(text(zone.name) in names and zone.role in MATCHING for zone in mesh.zones)


@once_per_mesh
def _pairs(mesh: Mesh) -> tuple[list[Pair], list[Side]]:
    """(pairs, sides without another): whole zones first, then the pieces of those that found no partner."""
    zones = [zone for zone in mesh.zones if _is_periodic(zone)]
    if not zones:
        return [], []
    hull = mesh_hull(mesh)
    membership = Membership(mesh)
    place = np.full(int(hull.rows.max(initial=0)) + 2, -1)
    place[hull.rows] = np.arange(len(hull))
    touching = mesh_contacts(mesh).facets("nonconformal", "unmerged", "cut")
    sides = []
    for zone in zones:
        rows = membership.rows(zone)
        facets = place[rows[rows < len(place)]]
        facets = np.unique(facets[facets >= 0])
        # an interface of two sides that lie on each other is no pair of places apart
        if zone.role in OVERLAPPING and len(facets) and touching[facets].mean() > 0.5:
            continue
        if len(facets) and hull.area[facets].sum() > 0.0:
            sides.append(side_of(hull, text(zone.name), facets))
    pairs, left = pair_up(hull, sides)
    if not left:
        return pairs, []
    parts = [piece for side in left for piece in pieces(hull, side)]
    more, alone = pair_up(hull, parts)
    return pairs + more, alone


def _names(pair: Pair) -> str:
    if pair.first.name == pair.second.name:
        return f"the two sides of {pair.first.name}"
    return f"{pair.first.name} and {pair.second.name}"


def _motion(pair: Pair) -> str:
    if pair.motion.is_translation:
        return f"{_names(pair)} by a translation"
    return f"{_names(pair)} by {math.degrees(pair.motion.angle):.6g} degrees"


def _advice(pair: Pair) -> str:
    matched = int(np.count_nonzero(pair.partner >= 0))
    of = f"{_names(pair)} match in {matched:,} of {len(pair.first.facets):,} and {len(pair.second.facets):,} faces"
    if pair.first.planar and pair.second.planar:
        return f"{of}: both are planar, so a non-conformal periodic is possible; otherwise mesh one side as a copy"
    return f"{of}: not planar, so a non-conformal periodic will not do; mesh one side as a copy of the other"


def _side(hull: Hull, side: Side) -> dict[str, Any]:
    of_area = hull.unit * hull.unit if hull.kind == "face" else hull.unit
    return {
        "zone": side.name,
        "facets": len(side.facets),
        "area": plain(side.total * of_area),
        "planar": side.planar,
        "flatness": plain(side.flatness),
    }


def _figures(hull: Hull, pair: Pair) -> dict[str, Any]:
    """What a report says of a pair."""
    finite = pair.error[np.isfinite(pair.error)]
    points = pair.point_error[np.isfinite(pair.point_error)]
    found: dict[str, Any] = {
        "sides": [_side(hull, pair.first), _side(hull, pair.second)],
        "matched_facets": int(np.count_nonzero(pair.partner >= 0)),
        "tolerance": MATCH,
        "error_max": plain(float(finite.max())) if len(finite) else None,
        "error_mean": plain(float(finite.mean())) if len(finite) else None,
        "points": len(pair.first.corners),
        "matched_points": len(points),
        "point_error_max": plain(float(points.max())) if len(points) else None,
        "planar_within": PLANAR,
        "nonconformal_possible": pair.first.planar and pair.second.planar,
    }
    motion = pair.motion
    if motion.is_translation:
        spans, key = pair.spans * hull.unit, "distance"
        found["kind"] = "translation"
        found["vector"] = [plain(float(x)) for x in motion.shift * hull.unit]
    else:
        spans, key = np.degrees(pair.spans), "angle"
        direction, point, along = motion.axis()
        lead = int(np.argmax(np.abs(direction)))
        sign = -1.0 if direction[lead] < 0.0 else 1.0  # the axis of a report points along a coordinate
        place = point * hull.unit + hull.origin
        direction = direction * sign
        found["kind"] = "rotation"
        found["degrees"] = plain(math.degrees(motion.angle) * sign)
        found["axis"] = [plain(float(x)) for x in direction]
        found["axis_point"] = [plain(float(x)) for x in place - (place @ direction) * direction]
        found["shift_along_axis"] = plain(along * sign * hull.unit)
        spans = spans * sign
    if len(spans):
        found |= {
            f"{key}_min": plain(float(spans.min())),
            f"{key}_max": plain(float(spans.max())),
            f"{key}_mean": plain(float(spans.mean())),
        }
    return found


ROWS = (
    Check(
        "periodic-mismatch", "warning", "Periodic zones that do not match", "face",
        "solvers refuse such a pair, or read the wrong values across it; a zone that couples by overlap may differ",
        periodic_mismatch, ("face zones",),
    ),
    Check(
        "periodic-zones", "info", "Periodic zones that match", "zone",
        "nothing is wrong; the motion is worth comparing with the one in the case", periodic_zones, ("face zones",),
    ),
)  # fmt: skip
