"""OpenFOAM meshes: faces that look the wrong way, and polyMesh folders written from any solid mesh."""

import json
import os
import runpy
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from repair_meshes import box, hybrid_layers, in_two_zones, random_tets, solid
from scipy.spatial import Voronoi

from meshwright.audit import audit, read
from meshwright.audit.assembly import blocks_from_faces
from meshwright.audit.connectivity import faces
from meshwright.audit.errors import UsageError
from meshwright.audit.findings.signs.sides import face_sides
from meshwright.audit.geometry import cell_geometry
from meshwright.audit.mesh import NO_CELL, CellBlock, Faces, Mesh, Zone
from meshwright.repair import repair
from meshwright.repair.quality import standing
from meshwright.repair.writers import write
from meshwright.reports.cli import cli

HERE = Path(__file__).parent
foam = runpy.run_path(str(HERE / "foam_cases.py"))
hybrid_mesh = runpy.run_path(str(HERE / "hybrid.py"))["hybrid_mesh"]


def polyhedra(n=60, seed=3):
    """The bounded cells of a Voronoi diagram: every face looks from its owner to its neighbour."""
    seeds = np.random.default_rng(seed).random((n, 3))
    diagram = Voronoi(seeds)
    bounded = [c for c in range(n) if -1 not in diagram.regions[diagram.point_region[c]]]
    row = {c: r for r, c in enumerate(bounded)}
    points, loops, owner, neighbour = diagram.vertices, [], [], []
    for (a, b), loop in zip(diagram.ridge_points, diagram.ridge_vertices, strict=True):
        if a not in row and b not in row:
            continue
        own, other = (a, b) if a in row else (b, a)
        u, v = points[loop[1]] - points[loop[0]], points[loop[2]] - points[loop[0]]
        outward = np.dot(np.cross(u, v), seeds[other] - seeds[own]) > 0
        loops.append(loop if outward else loop[::-1])
        owner.append(row[own])
        neighbour.append(row.get(other, NO_CELL))
    used, nodes = np.unique(np.concatenate(loops), return_inverse=True)
    offsets = np.cumsum([0, *map(len, loops)])
    table = Faces(offsets, nodes, np.array(owner), np.array(neighbour))
    blocks = blocks_from_faces(offsets, nodes, np.array(owner), np.array(neighbour), len(bounded), 3)
    return Mesh(points[used], blocks, faces=table, dimension=3)


def with_reversed(mesh, rows):
    """The mesh with these faces run the other way round."""
    sides = mesh.faces
    nodes = np.array(sides.nodes)
    for f in rows:
        nodes[sides.offsets[f] : sides.offsets[f + 1]] = nodes[sides.offsets[f] : sides.offsets[f + 1]][::-1]
    return replace(mesh, faces=Faces(sides.offsets, nodes, sides.owner, sides.neighbour))


def loops(mesh):
    """{its nodes: the face as it runs, begun at its smallest node, with owner and neighbour}."""
    sides, out = faces(mesh), {}
    for f in range(len(sides)):
        loop = sides.nodes[sides.offsets[f] : sides.offsets[f + 1]].tolist()
        at = loop.index(min(loop))
        out[frozenset(loop)] = (tuple(loop[at:] + loop[:at]), int(sides.owner[f]), int(sides.neighbour[f]))
    return out


@pytest.mark.parametrize("count", [1, 25, 200])
def test_exactly_the_faces_that_were_turned_are_turned_back(count):
    mesh = polyhedra()
    assert not (face_sides(mesh).faults > 0).any()
    rows = np.random.default_rng(count).choice(len(mesh.faces), min(count, len(mesh.faces) // 3), replace=False)
    bad = with_reversed(mesh, rows)
    assert np.array_equal(np.flatnonzero(face_sides(bad).faults > 0), np.sort(rows))
    done = repair(bad, "orient")
    assert done.steps[0].state == "kept"
    assert done.steps[0].changed == len(rows)
    assert loops(done.after) == loops(mesh)
    assert not repair(done.after).changed
    assert np.array_equal(done.after.points, bad.points)


def test_a_mesh_that_is_inside_out_throughout_is_turned():
    mesh = polyhedra(40)
    done = repair(with_reversed(mesh, range(len(mesh.faces))), "orient")
    assert done.steps[0].changed == len(mesh.faces)
    assert loops(done.after) == loops(mesh)


def test_a_polyhedron_with_a_reflex_corner_is_not_called_degenerate():
    """Pushing one point of a face inward makes its corner there reflex: the skew is 1, the volume stays positive."""
    mesh = polyhedra(40)
    sides = mesh.faces
    f = int(np.argmax((np.diff(sides.offsets) >= 5) & (sides.neighbour == NO_CELL)))
    loop = sides.nodes[sides.offsets[f] : sides.offsets[f + 1]]
    points = np.array(mesh.points)
    points[loop[0]] += 1.2 * (points[loop].mean(axis=0) - points[loop[0]])
    dented = replace(mesh, points=points)
    assert audit(dented, "gambit.equiangle_skew").measured.values["gambit.equiangle_skew"]["polyhedron"].max() == 1.0
    assert standing(dented).bad == int((cell_geometry(dented).volume <= 0).sum()) == 0
    assert standing(with_reversed(mesh, range(len(sides)))).bad == mesh.n_cells


def test_faces_of_hexes_that_look_the_wrong_way_are_told_and_follow_from_the_cells():
    points, hexes = box(3)
    plain = solid(points, hex=hexes)
    sides = faces(plain)
    own = replace(plain, faces=Faces(sides.offsets, sides.nodes, sides.owner, sides.neighbour))
    done = repair(with_reversed(own, [3, 17]), "orient")
    assert any("2 faces looked into the cell" in note for note in done.notes)
    assert not (face_sides(done.after).faults > 0).any()


def written(mesh, folder):
    folder.mkdir()
    notes = write(mesh, folder / "case.foam")
    return notes, read(folder)


@pytest.mark.parametrize("make", [random_tets, hybrid_layers, polyhedra, lambda: hybrid_mesh(5)])
def test_what_is_written_is_the_same_mesh_in_openfoams_order(tmp_path, make):
    mesh = make()
    _, again = written(mesh, tmp_path / "case")
    assert np.array_equal(again.points, mesh.points)
    assert again.counts == mesh.counts
    mine, theirs = loops(mesh), loops(again)
    assert mine.keys() == theirs.keys()
    for nodes, (loop, owner, neighbour) in mine.items():
        swapped = (loop[0], *loop[:0:-1]), neighbour, owner
        assert theirs[nodes] == (swapped if 0 <= neighbour < owner else (loop, owner, neighbour))
    sides = again.faces
    inner = sides.neighbour != NO_CELL
    assert inner[: inner.sum()].all()
    assert (sides.owner[inner] < sides.neighbour[inner]).all()
    order = np.lexsort((sides.neighbour[inner], sides.owner[inner]))
    assert np.array_equal(order, np.arange(inner.sum()))


@pytest.mark.parametrize("make", [random_tets, polyhedra, lambda: hybrid_mesh(7)])
def test_checkmesh_has_no_complaint_about_the_topology(tmp_path, make):
    foam["tool"]("checkMesh", tmp_path, "-help")
    mesh = make()
    folder = tmp_path / "case"
    written(mesh, folder)
    foam["settle"](folder)
    report = foam["tool"]("checkMesh", folder, "-constant", "-allTopology")
    for line in ("Boundary definition OK.", "Point usage OK.", "Upper triangular ordering OK.", "Face vertices OK."):
        assert line in report
    assert f"cells:            {mesh.n_cells}" in report


def test_patches_and_zones_keep_name_type_and_members(tmp_path):
    points, hexes = box(2)
    mesh = solid(points, hex=hexes)
    sides = faces(mesh)
    outer = np.flatnonzero(sides.neighbour == NO_CELL)
    quads = sides.nodes.reshape(-1, 4)[outer]
    at = points[quads].mean(axis=1)
    low = np.flatnonzero(at[:, 2] < 1e-9)
    mesh = replace(
        mesh, boundary=(CellBlock("quad", np.arange(len(quads)), quads),),
        zones=(
            Zone("no slip/wall", "patch", "wall", "face", low),
            Zone("far", "patch", "velocity-inlet", "face", np.setdiff1d(np.arange(len(quads)), low)[:5]),
            Zone("core", "zone", "fluid", "cell", np.array([0, 3])),
        ),
    )  # fmt: skip
    notes, again = written(mesh, tmp_path / "case")
    assert any("velocity-inlet" in note for note in notes)
    assert any("defaultFaces" in note for note in notes)
    zones = {zone.name: zone for zone in again.zones}
    assert zones["no_slip_wall"].role == "wall"
    assert len(zones["no_slip_wall"].members) == len(low)
    rows = zones["no_slip_wall"].members
    nodes = again.faces.nodes.reshape(-1, 4)[rows]
    assert np.array_equal(np.unique(nodes), np.unique(quads[low]))
    assert len(zones["far"].members) == 5
    assert len(zones["defaultFaces"].members) == len(quads) - len(low) - 5
    assert np.array_equal(zones["core"].members, [0, 3])


def test_zones_inside_are_left_out_and_told(tmp_path):
    mesh = in_two_zones(random_tets(60))
    notes, again = written(mesh, tmp_path / "case")
    assert sorted(z.name for z in again.zones if z.entity == "cell") == sorted(z.name for z in mesh.cell_zones)
    assert not [note for note in notes if "defaultFaces" in note]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: solid(np.eye(3), tri=np.array([[0, 1, 2]])), "solid cells"),
        (lambda: solid(np.vstack([np.zeros(3), np.eye(3), np.ones((6, 3))]), tet10=np.arange(10)[None]), "linear"),
    ],
)
def test_what_openfoam_cannot_hold_is_refused_and_leaves_nothing(tmp_path, make, words):
    with pytest.raises(UsageError, match=words):
        write(make(), tmp_path / "case.foam")
    assert [p.name for p in tmp_path.rglob("*") if p.is_file()] == []


def test_a_folder_that_is_there_is_not_replaced(tmp_path):
    mesh = random_tets(20)
    write(mesh, tmp_path / "case.foam")
    before = (tmp_path / "constant/polyMesh/points").read_bytes()
    with pytest.raises(UsageError, match="it is there already"):
        write(random_tets(30), tmp_path / "case.foam")
    assert (tmp_path / "constant/polyMesh/points").read_bytes() == before
    assert sorted(p.name for p in (tmp_path / "constant").iterdir()) == ["polyMesh"]


KILLED = """
import os, signal, sys
from meshwright.repair.writers import openfoam, write
sys.path.insert(0, sys.argv[2])
from repair_meshes import random_tets
real = openfoam._write
def until(path, *rest):
    if path.name == "owner":
        os.kill(os.getpid(), signal.SIGKILL)
    real(path, *rest)
openfoam._write = until
write(random_tets(20), sys.argv[1])
"""


def test_a_kill_while_it_is_written_leaves_no_mesh(tmp_path):
    run = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path / "case.foam"), str(HERE)], env=os.environ)
    assert run.returncode == -signal.SIGKILL
    assert not (tmp_path / "constant/polyMesh").exists()
    assert not (tmp_path / "case.foam").exists()
    write(random_tets(20), tmp_path / "case.foam")
    assert len(read(tmp_path).points) == len(random_tets(20).points)


def test_the_command_mends_a_case_into_a_new_one(tmp_path):
    bad = with_reversed(polyhedra(), [4, 9])
    (tmp_path / "in").mkdir()
    write(bad, tmp_path / "in/in.foam")
    (tmp_path / "out").mkdir()
    arguments = ["repair", str(tmp_path / "in"), "-o", str(tmp_path / "out/out.foam"), "--quiet", "--format", "json"]
    run = CliRunner().invoke(cli, [*arguments, "--journal", str(tmp_path / "j")])
    assert run.exit_code == 2
    assert "a journal brings back one file" in run.output
    assert not (tmp_path / "out/constant").exists()
    run = CliRunner().invoke(cli, arguments)
    assert run.exit_code == 0, run.output
    receipt = json.loads(run.stdout)
    (step,) = receipt["steps"]
    assert step.items() >= {"pass": "orient", "state": "kept", "changed": 2}.items()
    ids = [finding.code for finding in audit(read(tmp_path / "out")).findings]
    assert "left-handed-faces" not in ids
    assert "left-handed-faces" in [finding.code for finding in audit(read(tmp_path / "in")).findings]
    run = CliRunner().invoke(cli, arguments)
    assert run.exit_code == 2
    assert "it is there already" in run.output


def test_polyhedra_of_a_vtu_file_look_outward_from_each_cell(tmp_path):
    mesh = polyhedra(40)
    write(mesh, tmp_path / "mesh.vtu")
    again = read(tmp_path / "mesh.vtu")
    assert again.counts == mesh.counts
    assert not (face_sides(again).faults > 0).any()
