"""A repair for a profile: it does what the profile calls for, no more, and says what is left and what holds it."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from repair_meshes import box, hybrid_layers, random_tets, solid, with_reversed

from meshwright.audit.errors import UsageError
from meshwright.audit.gate.files import read_gate_file
from meshwright.audit.mesh import Mesh, Zone
from meshwright.audit.profiles import load
from meshwright.audit.readers import read
from meshwright.repair import repair, write
from meshwright.reports.cli import cli


@pytest.fixture
def gate(tmp_path):
    """A gate file with one rule, as a profile."""

    def make(rule):
        path = tmp_path / "meshgate.toml"
        path.write_text(f'[[rule]]\nid = "r"\n{rule}\n')
        return read_gate_file(path)

    return make


def test_a_mesh_that_keeps_the_profile_is_left_alone():
    points, hexes = box(4)
    done = repair(solid(points, hex=hexes), target=load("cfd"))
    assert not done.changed
    assert done.aim.plan == ()
    assert done.aim.last.judgement.state == "pass"


def test_what_the_audit_finds_is_mended_and_nothing_else():
    points, hexes = box(4)
    done = repair(solid(points, hex=with_reversed(hexes, "hex", [3, 17])), target=load("cfd"))
    assert [(s.name, s.changed) for s in done.steps if s.state == "kept"] == [("orient", 2)]
    assert any("inverted-cells" in reason for step in done.aim.plan for reason in step.because)
    assert done.aim.last.judgement.state == "pass"


def test_the_repair_stops_where_the_target_is_reached():
    mesh = random_tets()
    for_cfd, whole = repair(mesh, target=load("cfd")), repair(mesh)
    assert for_cfd.aim.first.judgement.state == "fail"
    assert for_cfd.aim.last.judgement.state == "pass"
    assert len(for_cfd.steps) < len(whole.steps)
    assert not repair(for_cfd.after, target=load("cfd")).changed


def test_cells_that_cannot_be_mended_are_told_with_what_holds_them(gate):
    mesh = random_tets()
    zones = (Zone("left wall", "z", "", "point", np.flatnonzero(mesh.points[:, 0] == 0.0)),)
    mesh = Mesh(mesh.points, mesh.blocks, zones=zones)
    done = repair(mesh, target=gate('metric = "dihedral.min"\nstat = "min"\nge = 45'))
    (left,) = done.aim.left
    counted = done.aim.last.found.measured.values["dihedral.min"]["tet"]
    assert left.count == int(np.sum(counted < 45.0))
    assert 0 < left.stuck + left.held <= left.count
    assert left.by[0][0] == "the boundary"
    assert [cell["value"] for cell in left.cells] == sorted(cell["value"] for cell in left.cells), (
        "the worst come first"
    )
    for cell in left.cells:
        row = cell["cell"]
        at = done.after.points[done.after.block("tet").nodes[row]]
        outside = ((at <= 0.0) | (at >= 1.0)).any(axis=1)
        assert cell["value"] == counted[row]
        assert cell["points_held"] == outside.sum()
        assert ("the boundary" in cell["held_by"]) == outside.any()
        assert ("left wall" in cell["held_in_zones"]) == bool((at[:, 0] == 0.0).any())


def test_layers_are_named_as_what_holds_a_wedge(gate):
    done = repair(
        hybrid_layers(), target=gate('metric = "angle.min"\nstat = "min"\nwhere = { type = "wedge" }\nge = 60')
    )
    assert done.aim.plan == ()
    (left,) = done.aim.left
    assert left.stuck == left.count
    assert "layers of wedges" in dict(left.by)
    assert "no point that may move" in left.words


def test_limits_on_faces_and_shares_name_the_cells_at_them(gate):
    mesh = random_tets()
    for rule in (
        'metric = "openfoam.non_orthogonality_deg"\nstat = "max"\nle = 30',
        'metric = "gambit.equiangle_skew"\nstat = "share"\nbeyond = 0.3\nle = 0.01',
    ):
        done = repair(mesh, target=gate(rule))
        (left,) = done.aim.left
        assert left.count > 0
        assert all(0 <= cell["cell"] < done.after.n_cells for cell in left.cells)


def test_passes_and_a_target_exclude_each_other():
    with pytest.raises(UsageError, match="exclude each other"):
        repair(random_tets(20), "orient", target=load("cfd"))


def test_the_command_tells_plan_verdict_and_rest(tmp_path):
    source, out = tmp_path / "a.vtu", tmp_path / "b.vtu"
    write(random_tets(), source)
    run = CliRunner().invoke(cli, ["repair", str(source), "-o", str(out), "--target", "cfd", "--quiet"])
    assert run.exit_code == 0, run.output
    assert "target cfd: fail > pass" in run.stdout
    assert "improve, for" in run.stdout
    again = CliRunner().invoke(cli, ["repair", str(out), "--dry-run", "--target", "cfd", "--quiet", "--format", "json"])
    document = json.loads(again.stdout)
    assert document["target"]["verdict"] == ["pass", "pass"]
    assert document["target"]["plan"] == []
    assert not [step for step in document["steps"] if step["state"] == "kept"]


def test_a_target_that_still_fails_has_status_1_and_names_the_cells(tmp_path):
    source, gate = tmp_path / "a.vtu", tmp_path / "strict.toml"
    write(random_tets(), source)
    gate.write_text('[[rule]]\nid = "r"\nmetric = "dihedral.min"\nstat = "min"\nge = 60\n')
    run = CliRunner().invoke(
        cli, ["repair", str(source), "-o", str(tmp_path / "b.vtu"), "--target", str(gate), "--quiet"]
    )
    assert run.exit_code == 1
    assert "cells are left beyond 60" in run.stdout
    assert read(tmp_path / "b.vtu").n_cells, "it is written all the same"
    wrong = CliRunner().invoke(cli, ["repair", str(source), "--dry-run", "--target", "nosuch"])
    assert wrong.exit_code == 2
    assert "nosuch" in wrong.output
