"""Checks on surfaces that should be one: interfaces, parts that were never merged, branch cuts."""

from __future__ import annotations

from typing import Any

import numpy as np

from meshwright.audit.findings.facts import Facts
from meshwright.audit.findings.finding import Check, Found, counted
from meshwright.audit.findings.hulls.contacts import TIGHT, Contact, mesh_contacts
from meshwright.audit.findings.hulls.hull import Hull
from meshwright.audit.findings.hulls.membership import Membership
from meshwright.audit.findings.hulls.rings import closing_rings
from meshwright.audit.places import plain, text

__all__ = ["INTERFACES", "ROWS"]

INTERFACES = frozenset(("interface", "cyclicAMI", "cyclicACMI", "cyclicPeriodicAMI", "mappedWall", "mapped", "overset"))
"""Roles of zones that a solver couples across faces that do not match: Fluent's and OpenFOAM's words."""

_MOST_LISTED = 50
_DECLARED = 0.9
"""Share of the facets in interface zones from which on a place counts as one: neighbours at its edge may touch too."""
_CLOSE = 0.02
"""Share of the facets' size up to which a gap is one of rounding or of curvature, and not one between bodies."""


def nonconformal_interface(facts: Facts) -> Found | None:
    """Facets of two sides that lie on each other and do not match."""
    contacts = mesh_contacts(facts.mesh)
    places = contacts.of("nonconformal")
    if not places:
        return _lonely(facts)
    hull = contacts.hull
    membership = Membership(facts.mesh)
    coupled = membership.holding(INTERFACES)
    facets = np.flatnonzero(contacts.facets("nonconformal"))
    listed: list[dict[str, Any]] = []
    open_ = plain_ = 0
    for place in places:
        undeclared = bool(np.mean(coupled[hull.rows[place.all_facets]]) < _DECLARED)
        open_ += undeclared
        plain_ += undeclared and bool((place.gap <= _CLOSE * _sizes(hull, place)).all())
        if len(listed) < _MOST_LISTED:
            listed.append(_figures(hull, membership, place) | {"declared": not undeclared})
    message = (
        f"{counted(len(places), 'interface')} of {counted(len(facets), *hull.words)} where parts lie on each other and "
        f"their {hull.words[1]} do not match ({_first(listed[0])}): "
    )
    if open_:
        message += "the solver sees two walls; declare them an interface or mesh both sides alike"
    else:
        message += "their zones say interface; check that the case pairs them"
    return Found(
        hull.rows[facets],
        message,
        entity=_entity(hull),
        severity="warning" if plain_ else "info",
        detail={"interfaces": listed, "count": len(places)},
    )


def _lonely(facts: Facts) -> Found | None:
    """Zones that say interface where nothing lies on them: the other side is missing, turned away or periodic."""
    mesh = facts.mesh
    zones = [i for i, zone in enumerate(mesh.zones) if zone.role == "interface" and zone.entity == "face"]
    zones = [i for i in zones if len(mesh.zones[i].members)]
    if not zones:
        return None
    membership = Membership(mesh)
    contacts = mesh_contacts(mesh)
    met = np.zeros(len(membership.holding(frozenset())), dtype=bool)
    met[contacts.hull.rows[contacts.facets("unmerged", "cut", "hanging")]] = True
    zones = [i for i in zones if not met[membership.rows(mesh.zones[i])].any()]
    if not zones:
        return None
    names = [text(mesh.zones[i].name) for i in zones]
    return Found(
        zones,
        f"{counted(len(zones), 'interface zone')} with no other surface against it ({', '.join(names[:5])}): right for "
        "a periodic or a moved interface; otherwise the other side is missing",
        entity="zone",
        severity="info",
        detail={"interfaces": [], "count": 0, "zones_without_partner": names},
    )


def unmerged_interface(facts: Facts) -> Found | None:
    """Facets of two parts that match corner for corner and are not merged."""
    contacts = mesh_contacts(facts.mesh)
    places = contacts.of("unmerged", _MOST_LISTED)
    count = contacts.count("unmerged")
    if not places:
        return None
    hull = contacts.hull
    membership = Membership(facts.mesh)
    facets = np.flatnonzero(contacts.facets("unmerged"))
    listed = [_figures(hull, membership, place) for place in places]
    return Found(
        hull.rows[facets],
        f"{counted(count, 'interface')} of {counted(len(facets), *hull.words)} where two parts match corner for "
        f"corner but share no points ({_first(listed[0])}): merge the points, unless the parts are to stay apart",
        entity=_entity(hull),
        detail={"interfaces": listed, "count": count},
    )


def branch_cut(facts: Facts) -> Found | None:
    """Facets of one part that match corner for corner and are not merged."""
    contacts = mesh_contacts(facts.mesh)
    places = contacts.of("cut", _MOST_LISTED)
    count = contacts.count("cut")
    if not places:
        return None
    hull = contacts.hull
    membership = Membership(facts.mesh)
    facets = np.flatnonzero(contacts.facets("cut"))
    listed: list[dict[str, Any]] = []
    for place in places:
        rings = closing_rings(facts.mesh, hull.rows[place.first], hull.rows[place.second])
        pairs = _shared_points(hull, place)
        listed.append(_figures(hull, membership, place) | {"points_in_common": pairs, **rings})
    around = [figures["cells_around"] for figures in listed if figures["cells_around"] is not None]
    if around:
        kind = f"the two ends of an O-grid that closes after {around[0]:,} cells"
    else:
        kind = "the cut of a C-grid, or a slit: no index line across it closes"
    return Found(
        hull.rows[facets],
        f"{counted(len(facets), *hull.words)} on {counted(count, 'branch cut')}, where one part meets itself "
        f"without sharing its points ({kind}): merge the points, unless the solver wants the cut or the slit is meant",
        entity=_entity(hull),
        detail={"cuts": listed, "count": count},
    )


def _entity(hull: Hull) -> Any:
    return "face" if hull.kind == "face" else "edge"


def _sizes(hull: Hull, place: Contact) -> Any:
    return np.minimum(hull.size[place.first], hull.size[place.second])


def _shared_points(hull: Hull, place: Contact) -> int:
    """Corners that both sides of a contact use: the ends of a slit."""

    common = [
        np.intersect1d(
            hull.nodes[hull.offsets[f] : hull.offsets[f + 1]], hull.nodes[hull.offsets[g] : hull.offsets[g + 1]]
        )
        for f, g in zip(place.first.tolist(), place.second.tolist(), strict=True)
    ]
    return len(np.unique(np.concatenate(common)))


def _first(figures: dict[str, Any]) -> str:
    """The largest place in a few words."""
    zones = [side["face_zones"] or side["cell_zones"] for side in figures["sides"]]
    names = " against ".join(names[0] for names in zones if names) if all(zones) else ""
    overlap = figures["overlap"]
    share = "" if overlap is None else f"overlap {100 * overlap:.3g} %"
    return ", ".join(word for word in (names, share) if word)


def _figures(hull: Hull, membership: Membership, place: Contact) -> dict[str, Any]:
    """What a report says of one place of contact."""
    of_area = hull.unit if hull.kind != "face" else hull.unit * hull.unit
    covered = np.zeros(len(hull))
    np.add.at(covered, place.first, place.overlap)
    np.add.at(covered, place.second, place.overlap)
    matched = np.zeros(len(hull), dtype=bool)
    matched[place.first[place.matched]] = True
    matched[place.second[place.matched]] = True
    sides = []
    two = place.parts[0] != place.parts[1]
    for facets in (np.unique(place.first), np.unique(place.second)) if two else (place.all_facets,):
        area, over = float(hull.area[facets].sum()), float(np.minimum(covered[facets], hull.area[facets]).sum())
        sides.append(
            {
                **membership.names(hull.rows[facets]),
                "facets": len(facets),
                "area": plain(area * of_area),
                "overlap": plain(over / area) if area > 0.0 else None,
            }
        )
    every = place.all_facets
    matched_facets = int(np.count_nonzero(matched[every]))
    shares = [side["overlap"] for side in sides if isinstance(side["overlap"], float)]
    gap = place.gap * hull.unit
    return {
        "sides": sides,
        "facets": len(every),
        "matched_facets": matched_facets,
        "matched_ratio": matched_facets / len(every),
        "overlap": max(shares) if shares else None,
        "overlap_area": plain(float(place.overlap.sum()) * of_area),
        "gap_max": plain(float(gap.max())),
        "gap_mean": plain(float(gap.mean())),
        "coincident": bool((place.gap <= TIGHT * _sizes(hull, place)).all()),
    }


ROWS = (
    Check(
        "nonconformal-interface", "warning", "Interfaces whose faces do not match", "face",
        "nothing passes between the sides unless the solver is told to couple them; no more than told where the zones "
        "say interface or bodies stand apart by a gap",
        nonconformal_interface,
    ),
    Check(
        "unmerged-interface", "info", "Parts that match but are not merged", "face",
        "contact, baffles and multi-region meshes are made this way; duplicate-points warns of the points",
        unmerged_interface,
    ),
    Check(
        "branch-cut", "info", "Branch cuts of O- and C-grids", "face",
        "how structured grids are stored; solvers that read structured blocks expect it", branch_cut,
    ),
)  # fmt: skip
