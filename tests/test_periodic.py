"""Periodic zones: sectors and slabs in closed form, what a mismatch says, and a compressor stage from the wild."""

import dataclasses
import math

import numpy as np
import pytest

from meshwright.audit.connectivity import faces
from meshwright.audit.findings import run_checks
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.readers import read

SECTOR = math.radians(30.0)


def block(n):
    """(indices (points, 3) from 0 to n, hexes)."""
    points = np.stack(np.meshgrid(*(np.arange(k + 1.0) for k in n), indexing="ij"), -1).reshape(-1, 3)
    row = np.arange(len(points)).reshape(np.array(n) + 1)
    p, q = slice(None, -1), slice(1, None)
    order = [(p, p, p), (q, p, p), (q, q, p), (p, q, p), (p, p, q), (q, p, q), (q, q, q), (p, q, q)]
    return points, np.stack([row[c].ravel() for c in order], axis=1)


def zoned(points, name, nodes, zones, **more):
    """A face-based mesh with zones of boundary faces; zones: name -> (role, picks by the centre of a face)."""
    mesh = Mesh(points, (CellBlock(name, np.arange(len(nodes)), nodes),), **more)
    f = faces(mesh)
    corners = [f.nodes[a:b] for a, b in zip(f.offsets[:-1], f.offsets[1:], strict=True)]
    made = []
    for zone, (role, pick) in zones.items():
        rows = [i for i, c in enumerate(corners) if f.neighbour[i] < 0 and all(pick(p) for p in c.tolist())]
        made.append(Zone(zone, "zone", role, "face", rows))
    own = Faces(f.offsets, f.nodes, f.owner, f.neighbour)
    return Mesh(points, mesh.blocks, faces=own, zones=tuple(made), **more)


def sector(n=(4, 6, 3), warp=0.0, role="periodic", turn=None, shift=0.0):
    """30 degrees of a thick ring about z; warp: how far the sides bend away from planes. Sides at j = 0 and j = n."""
    index, nodes = block(n)
    radius = 1.0 + index[:, 0] / n[0]
    angle = SECTOR * index[:, 1] / n[1] + warp * np.sin(2.0 * radius) * (1 + index[:, 2] / n[2])
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), index[:, 2] / n[2]])
    if turn is not None:
        points = points @ turn.T
    points = points + shift
    low, high = index[:, 1] == 0, index[:, 1] == n[1]
    return zoned(points, "hex", nodes, {"low": (role, low.__getitem__), "high": (role, high.__getitem__)})


def slab(n=(3, 4, 5), role="cyclic"):
    index, nodes = block(n)
    zones = {"left": (role, (index[:, 0] == 0).__getitem__), "right": (role, (index[:, 0] == n[0]).__getitem__)}
    return zoned(index / 2.0, "hex", nodes, zones)


def found(mesh):
    return {f.code: f for f in run_checks(mesh) if f.code.startswith("periodic")}


def match(mesh):
    findings = found(mesh)
    assert list(findings) == ["periodic-zones"]
    assert findings["periodic-zones"].severity == "info"
    return findings["periodic-zones"]


def mismatch(mesh):
    findings = found(mesh)
    assert list(findings) == ["periodic-mismatch"]
    return findings["periodic-mismatch"]


@pytest.mark.parametrize("role", ["periodic", "cyclic", "cyclicAMI"])
def test_two_faces_of_a_box_are_a_pair_by_translation(role):
    finding = match(slab(role=role))
    (pair,) = finding.detail["pairs"]
    assert (pair["kind"], pair["vector"], pair["matched_facets"]) == ("translation", [1.5, 0, 0], 20)
    assert (pair["distance_min"], pair["distance_max"], pair["distance_mean"]) == (1.5, 1.5, 1.5)
    assert pair["error_max"] == 0.0
    assert [side["zone"] for side in pair["sides"]] == ["left", "right"]
    assert finding.count == 2


@pytest.mark.parametrize("warp", [0.0, 0.08])
def test_a_sector_of_30_degrees_is_a_pair_by_rotation_planar_or_warped(warp):
    (pair,) = match(sector(warp=warp)).detail["pairs"]
    assert pair["kind"] == "rotation"
    for key in ("degrees", "angle_min", "angle_max", "angle_mean"):
        assert pair[key] == pytest.approx(30.0, abs=1e-9)
    assert pair["axis"] == pytest.approx([0, 0, 1], abs=1e-9)
    assert pair["axis_point"] == pytest.approx([0, 0, 0], abs=1e-9)
    assert pair["shift_along_axis"] == pytest.approx(0.0, abs=1e-9)
    assert (pair["matched_facets"], pair["matched_points"], pair["points"]) == (12, 20, 20)
    assert pair["nonconformal_possible"] == (warp == 0.0)
    assert [side["planar"] for side in pair["sides"]] == [warp == 0.0] * 2


@pytest.mark.parametrize("warp", [0.0, 0.08])
@pytest.mark.parametrize("seed", range(4))
def test_the_axis_is_found_wherever_it_stands(seed, warp):
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    shift = rng.uniform(-5, 5, 3)
    (pair,) = match(sector(warp=warp, turn=turn, shift=shift)).detail["pairs"]
    axis = np.array(pair["axis"])
    assert abs(axis @ turn[:, 2]) == pytest.approx(1.0, abs=1e-9)
    off = np.array(pair["axis_point"]) - shift
    assert off - (off @ axis) * axis == pytest.approx(np.zeros(3), abs=1e-8)
    assert abs(pair["degrees"]) == pytest.approx(30.0, abs=1e-8)


def test_a_sector_in_the_plane_turns_about_z():
    i, j = np.meshgrid(np.arange(5), np.arange(7), indexing="ij")
    radius, angle = 1 + i.ravel() / 4, SECTOR * j.ravel() / 6 + 0.1 * np.sin(3 * i.ravel())
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * radius]) + [3.0, 1.0, 0.0]
    at = np.arange(35).reshape(5, 7)
    nodes = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    low, high = j.ravel() == 0, j.ravel() == 6
    zones = {"low": ("periodic", low.__getitem__), "high": ("periodic", high.__getitem__)}
    (pair,) = match(zoned(points, "quad", nodes, zones, dimension=2)).detail["pairs"]
    assert pair["degrees"] == pytest.approx(30.0, abs=1e-9)
    assert pair["axis_point"] == pytest.approx([3.0, 1.0, 0.0], abs=1e-9)


def test_one_zone_that_holds_both_sides_is_split_even_where_they_meet_at_the_axis():
    mesh = slab()
    both = Zone("pair", "patch", "cyclic", "face", np.concatenate([zone.members for zone in mesh.zones]))
    (pair,) = match(dataclasses.replace(mesh, zones=(both,))).detail["pairs"]
    assert pair["kind"] == "translation"
    assert [side["zone"] for side in pair["sides"]] == ["pair", "pair"]
    # wedges around the axis: the sides share the points on it
    n = 5
    angles = np.radians([0.0, 60.0, 120.0])
    ring = np.array([(r * math.cos(a), r * math.sin(a)) for a in angles for r in np.arange(1.0, n)])
    flat = np.concatenate([[[0.0, 0.0]], ring])
    points = np.concatenate([np.column_stack([flat, np.full(len(flat), float(z))]) for z in (0, 1)])
    m = n - 1
    wedges = [[0, 1 + k * m, 1 + (k + 1) * m] for k in range(2)]
    quads = [
        [1 + k * m + i, 2 + k * m + i, 2 + (k + 1) * m + i, 1 + (k + 1) * m + i] for k in range(2) for i in range(m - 1)
    ]
    top = len(flat)
    blocks = (
        CellBlock("wedge", np.arange(2), np.array([[*w, *(np.array(w) + top)] for w in wedges])),
        CellBlock("hex", np.arange(2, 2 + len(quads)), np.array([[*q, *(np.array(q) + top)] for q in quads])),
    )
    plain = Mesh(points, blocks)
    f = faces(plain)
    rows = []
    for i in np.flatnonzero(f.neighbour < 0):
        x, y = points[f.nodes[f.offsets[i] : f.offsets[i + 1]]][:, :2].T
        if np.all(np.abs(y) < 1e-9) or np.all(np.abs(x * math.sin(angles[2]) - y * math.cos(angles[2])) < 1e-9):
            rows.append(i)
    own = Faces(f.offsets, f.nodes, f.owner, f.neighbour)
    wedge = Mesh(points, blocks, faces=own, zones=(Zone("sides", "zone", "periodic", "face", rows),))
    (pair,) = match(wedge).detail["pairs"]
    assert pair["degrees"] == pytest.approx(120.0, abs=1e-9)


def test_two_pairs_at_right_angles_are_told_apart():
    index, nodes = block((4, 4, 4))
    picks = {f"{axis}{side}": (index[:, k] == 4 * (side == "+")) for k, axis in enumerate("xy") for side in "-+"}
    mesh = zoned(index, "hex", nodes, {name: ("cyclic", pick.__getitem__) for name, pick in picks.items()})
    pairs = match(mesh).detail["pairs"]
    assert sorted(tuple(side["zone"] for side in pair["sides"]) for pair in pairs) == [("x-", "x+"), ("y-", "y+")]
    assert sorted(pair["vector"] for pair in pairs) == [[0, 4, 0], [4, 0, 0]]


def uneven(warp=0.0, role="periodic"):
    """The sector with the points of its upper side moved along it: the sides cover each other and do not match."""
    mesh = sector(warp=warp, role=role)
    points = mesh.points.copy()
    upper = np.unique(np.concatenate([mesh.faces.nodes[4 * i : 4 * i + 4] for i in mesh.zones[1].members]))
    radius = np.hypot(points[upper, 0], points[upper, 1])
    stretched = 1.0 + (radius - 1.0) ** 1.3
    angle = np.arctan2(points[upper, 1], points[upper, 0])
    if warp:
        angle += warp * (1 + points[upper, 2]) * (np.sin(2 * stretched) - np.sin(2 * radius))
    points[upper, 0], points[upper, 1] = stretched * np.cos(angle), stretched * np.sin(angle)
    return dataclasses.replace(mesh, points=points)


def test_sides_that_do_not_match_are_a_warning_and_planar_ones_may_be_joined_without_matching():
    finding = mismatch(uneven())
    assert (finding.severity, finding.entity, finding.count) == ("warning", "face", 24)
    (pair,) = finding.detail["pairs"]
    assert (pair["matched_facets"], pair["nonconformal_possible"]) == (0, True)
    assert pair["degrees"] == pytest.approx(30.0, abs=0.5)
    assert "both are planar, so a non-conformal periodic is possible" in finding.message


def test_a_warped_side_that_does_not_match_is_refused_a_nonconformal_periodic():
    finding = mismatch(uneven(warp=0.08))
    (pair,) = finding.detail["pairs"]
    assert not pair["nonconformal_possible"]
    assert "not planar, so a non-conformal periodic will not do" in finding.message


def test_an_arbitrary_mesh_interface_that_does_not_match_is_no_more_than_told():
    assert mismatch(uneven(role="cyclicAMI")).severity == "info"


def test_one_moved_face_is_the_one_without_a_partner():
    mesh = slab()
    points = mesh.points.copy()
    corner = int(np.flatnonzero((points == [1.5, 1.0, 1.0]).all(axis=1))[0])
    points[corner, 1] += 0.01  # its four faces shift by 0.0025, over 0.5
    finding = mismatch(dataclasses.replace(mesh, points=points))
    assert finding.count == 8
    (pair,) = finding.detail["pairs"]
    assert pair["matched_facets"] == 16
    assert pair["error_max"] == pytest.approx(0.0025 / 0.5, rel=0.1)


def test_a_zone_without_its_other_side_is_a_mismatch():
    mesh = slab()
    finding = mismatch(dataclasses.replace(mesh, zones=mesh.zones[:1]))
    assert (finding.severity, finding.count) == ("warning", 20)
    assert finding.detail["without_another_side"][0]["zone"] == "left"
    assert "missing" in finding.message


def test_meshes_without_periodic_zones_and_with_empty_ones_get_no_finding():
    mesh = slab(role="wall")
    assert found(mesh) == {}
    empty = tuple(Zone(z.name, z.kind, "periodic", "face", []) for z in mesh.zones)
    assert found(dataclasses.replace(mesh, zones=empty)) == {}


def test_boundary_elements_of_a_cell_based_mesh_are_audited_too():
    index, nodes = block((2, 3, 3))
    row = np.arange(len(index)).reshape(3, 4, 4)
    sides = [
        np.stack([s[:-1, :-1], s[1:, :-1], s[1:, 1:], s[:-1, 1:]], axis=-1).reshape(-1, 4) for s in (row[0], row[-1])
    ]
    zones = tuple(
        Zone(name, "physical group", "periodic", "face", np.arange(9) + k) for name, k in (("left", 0), ("right", 9))
    )
    boundary = (CellBlock("quad", np.arange(18), np.concatenate(sides)),)
    mesh = Mesh(index, (CellBlock("hex", np.arange(len(nodes)), nodes),), boundary=boundary, zones=zones)
    (pair,) = match(mesh).detail["pairs"]
    assert pair["vector"] == [2, 0, 0]


@pytest.mark.parametrize("scale", [1e-200, 1e-6, 1e6, 1e150])
def test_pairs_do_not_depend_on_the_unit(scale):
    mesh = sector(warp=0.08)
    (pair,) = match(dataclasses.replace(mesh, points=mesh.points * scale)).detail["pairs"]
    assert pair["degrees"] == pytest.approx(30.0, abs=1e-8)


def test_points_without_a_place_in_a_periodic_zone_stop_nothing():
    mesh = slab()
    for rows in ([0], range(30), range(len(mesh.points))):
        points = mesh.points.copy()
        points[list(rows)] = np.nan
        codes = {f.code for f in run_checks(dataclasses.replace(mesh, points=points))}
        assert "nonfinite-points" in codes


def test_the_sides_of_a_compressor_stage_are_pairs_of_22_5_degrees(shared):
    mesh = read(shared / "meshes" / "fluent_legacy" / "axial_comp.msh")
    # the file still calls them walls: 16 passages, per-1 against per-3, per-2 against per-4, in rotor and stator
    zones = tuple(dataclasses.replace(z, role="periodic") if "-per-" in z.name else z for z in mesh.zones)
    pairs = match(dataclasses.replace(mesh, zones=zones)).detail["pairs"]
    assert len(pairs) == 4
    for pair in pairs:
        first, second = sorted(side["zone"] for side in pair["sides"])
        assert (first[:-1], int(second[-1]) - int(first[-1])) == (second[:-1], 2)
        assert abs(pair["degrees"]) == pytest.approx(360.0 / 16, abs=1e-4)
        assert abs(pair["axis"][2]) == pytest.approx(1.0, abs=1e-9)
