"""One mesh under every convention: verdicts of all systems, and each quantity as each of them spells it."""

import csv
import io
import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.evaluate import evaluate
from meshwright.audit.profiles.loading import PROFILES, read_profile
from meshwright.audit.profiles.model import Limit, Profile
from meshwright.audit.profiles.rosetta import families, rosetta
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.cli import cli
from meshwright.reports.outputs import Batch, Page, render

SCHEMA = json.loads((Path(__file__).parent.parent / "reports" / "schema" / "audit-1.schema.json").read_text())
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
MEASURED = sorted({m.metric for f in families() for m in f.members if m.metric in METRICS})


def box(*edges):
    return Mesh(CUBE * edges, (CellBlock("hex", [0], [np.arange(8)]),))


def table(mesh, profiles=(), **options):
    found = measure(mesh, MEASURED)
    return rosetta(found, [evaluate(found, profile) for profile in profiles], **options)


def member(found, family, system, name):
    members = next(f["members"] for f in found["families"] if f["id"] == family)
    return next(m for m in members if (m["system"], m["name"]) == (system, name))


def test_every_member_is_made_of_a_metric_of_this_build_and_defined_where_it_says():
    for family in families():
        assert family.members
        for m in family.members:
            assert m.metric in METRICS, m.metric
            assert m.profile == "" or m.profile in PROFILES
            on = METRICS[m.metric].on
            assert all(kind in on or CELL_TYPES[kind].corners in on for kind in m.types), m


def test_a_box_of_1_2_4_has_its_closed_forms_under_every_convention():
    found = table(box(1, 2, 4))
    expected = {
        ("aspect-ratio", "GAMBIT", "Aspect Ratio"): 4.0,
        ("aspect-ratio", "CFDyna", "Aspect ratio on ICEM's scale"): 0.25,
        ("aspect-ratio", "ICEM CFD", "Aspect ratio"): 0.25,
        ("aspect-ratio", "Nastran", "Aspect ratio"): 4.0,
        ("skewness", "GAMBIT", "EquiAngle Skew"): 0.0,
        ("skewness", "ICEM CFD", "Equiangle skewness"): 1.0,
        ("taper", "GAMBIT", "Stretch"): 1 - math.sqrt(3) / math.sqrt(21),
        ("taper", "Cubit", "Stretch"): math.sqrt(3) / math.sqrt(21),
        ("taper", "Cubit", "Diagonal Ratio"): 1.0,
        ("jacobian", "ICEM CFD", "Determinant 2x2x2"): 1.0,
        ("size", "all", "Volume"): 8.0,
    }
    for (family, system, name), value in expected.items():
        row = member(found, family, system, name)
        assert row["worst"] == pytest.approx(value, rel=1e-12, abs=1e-12), name
        assert row["mean"] == pytest.approx(value, rel=1e-12, abs=1e-12), name
        assert (row["count"], row["worst_at"]["cell"], row["worst_at"]["type"]) == (1, 0, "hex")


def test_the_mean_on_a_turned_scale_is_the_mean_of_turned_values():
    points = np.concatenate([CUBE, CUBE * (4, 1, 1) + (9, 0, 0)])
    mesh = Mesh(points, (CellBlock("hex", [0, 1], np.arange(16).reshape(2, 8)),))
    row = member(table(mesh), "aspect-ratio", "CFDyna", "Aspect ratio on ICEM's scale")
    assert row["mean"] == pytest.approx((1 + 1 / 4) / 2, rel=1e-12)  # not 1 / ((1 + 4)/2)
    assert row["worst"] == pytest.approx(1 / 4, rel=1e-12)


def test_a_triangle_has_another_aspect_ratio_in_icem_than_the_reciprocal_of_gambits():
    mesh = Mesh(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], float), (CellBlock("tri", [0], [[0, 1, 2]]),), dimension=2)
    found = table(mesh)
    assert member(found, "aspect-ratio", "GAMBIT", "Aspect Ratio")["worst"] == pytest.approx((1 + math.sqrt(2)) / 2)
    assert member(found, "aspect-ratio", "Gmsh", "gamma")["worst"] == pytest.approx(2 / (1 + math.sqrt(2)))
    assert member(found, "aspect-ratio", "ICEM CFD", "Aspect ratio")["worst"] == pytest.approx(1 / math.sqrt(3))


def test_limits_stand_on_the_scale_of_the_member():
    one = Limit("s", "Stretch", "max", "a book", True, "gambit.stretch", types=("hex",), warn=0.5)
    found = table(box(1, 2, 4), [Profile("cubit", "Cubit", "", limits=(one,))])
    row = member(found, "taper", "Cubit", "Stretch")
    assert (row["limit"], row["state"]) == (0.5, "warn")  # 0.378 is below 1 - 0.5
    ratio = Limit("d", "Diagonal", "max", "a book", True, "gambit.diagonal_ratio", types=("hex",), fail=2.0)
    found = table(box(1, 2, 4), [Profile("cubit", "Cubit", "", limits=(ratio,))])
    row = member(found, "taper", "Cubit", "Diagonal Ratio")
    assert (row["limit"], row["state"]) == (0.5, "pass")  # at least 1/2


def test_a_system_accepts_refuses_or_cannot_tell():
    def of(name, **levels):
        return Profile(
            name, name, "", limits=(Limit("a", "Aspect", "max", "b", True, "gambit.aspect_ratio", **levels),)
        )

    unknown = Profile("u", "u", "", limits=(Limit("x", "X", "max", "b", True, "hm.nothing", fail=1),))
    nothing = of("n", types=("tet",), fail=1)
    found = table(box(1, 2, 4), [of("a", fail=5), of("w", warn=3), of("r", fail=3), unknown, nothing])
    verdicts = {system["profile"]: system["verdict"] for system in found["systems"]}
    assert verdicts == {"a": "pass", "w": "warn", "r": "fail", "u": "incomplete", "n": "incomplete"}
    refused = found["systems"][2]
    assert (refused["against"], refused["rules"]) == (1, 1)
    assert (refused["because"][0]["measured"], refused["because"][0]["limit"]) == (4.0, 3)


def test_no_system_takes_a_mesh_with_an_error():
    found = table(box(1, 1, 1), [read_profile("gambit")], errors=["inverted-cells"])
    assert (found["systems"][0]["verdict"], found["systems"][0]["errors"]) == ("fail", ["inverted-cells"])


@pytest.fixture
def compared():
    """The document of a box under all profiles."""
    found = audit(box(1, 2, 4), "default", also=MEASURED)
    document = summarise(found, compare=[read_profile(name) for name in PROFILES])
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    return document


def test_a_comparison_judges_nothing(compared):
    assert (compared["gate"]["profile"], compared["gate"]["rules"], compared["gate"]["verdict"]) == (None, [], "pass")
    assert [system["profile"] for system in compared["rosetta"]["systems"]] == list(PROFILES)
    assert json.loads(render("json", Batch([compared]), Page())) == compared


def test_a_comparison_is_in_text_markdown_and_csv(compared):
    text = render("text", Batch([compared]), Page())
    assert "\nSystems  which would accept this mesh\n" in text
    assert "\nAspect ratio  as each system spells it\n" in text
    assert max(map(len, text.splitlines())) <= 130
    page = render("md", Batch([compared]), Page())
    assert "### Systems" in page
    assert "| GAMBIT | Aspect Ratio | 4.000 |" in page
    rows = list(csv.DictReader(io.StringIO(render("csv", Batch([compared]), Page()))))
    systems = {row["zone"]: row["value"] for row in rows if row["table"] == "system" and row["item"] == "verdict"}
    assert set(systems) == set(PROFILES)
    assert systems["gambit"] == "pass"


def test_profile_all_compares_on_the_command_line(tmp_path):
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", "8"]
    lines += [f"{i + 1} {x} {y} {z}" for i, (x, y, z) in enumerate((CUBE * (1, 2, 4)).tolist())]
    lines += ["$EndNodes", "$Elements", "1", "1 5 2 0 1 1 2 3 4 5 6 7 8", "$EndElements", ""]
    (tmp_path / "box.msh").write_text("\n".join(lines))
    result = CliRunner().invoke(
        cli, ["audit", str(tmp_path / "box.msh"), "--profile", "all", "--format", "json", "--quiet"]
    )
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    assert len(document["rosetta"]["systems"]) == len(PROFILES)
    gambit = next(system for system in document["rosetta"]["systems"] if system["profile"] == "gambit")
    assert gambit["verdict"] == "pass"
    # metrics measured for the comparison alone do not swell the tables
    assert "face.area" not in document["metrics"]
