"""The JSON document: its schema, its verdict, and its numbers against independent ones."""

import copy
import dataclasses
import hashlib
import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from meshwright.audit.errors import UsageError
from meshwright.audit.findings import Finding
from meshwright.audit.fingerprint import fingerprint
from meshwright.audit.measurement import Measured, measure
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.metrics import METRICS
from meshwright.audit.parallel import limited_to
from meshwright.audit.profiles import PROFILES, read_profile
from meshwright.audit.readers import read
from meshwright.audit.run import Audit, audit
from meshwright.audit.summary import summarise
from meshwright.audit.surface import boundary_mesh
from meshwright.audit.tables import ASPECT, SKEW
from meshwright.reports.outputs import Batch, Page, render

SCHEMA = json.loads((Path(__file__).parent.parent / "reports" / "schema" / "audit-1.schema.json").read_text())
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
TET = np.array([(5, 0, 0), (6, 0, 0), (5, 1, 0), (5, 0, 1)], float)


def valid(document):
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    return document


def cube_and_tet(**options):
    blocks = (CellBlock("hex", [0], [np.arange(8)]), CellBlock("tet", [1], [[8, 9, 10, 11]]))
    return Mesh(np.concatenate([CUBE, TET]), blocks, cell_ids=[7, 40], **options)


def finding(severity, rows=(0,)):
    return Finding("inverted-cells", severity, "cell", np.array(rows), "look at it")


def judged(mesh, *findings, metrics=(SKEW, ASPECT)):
    return valid(summarise(Audit(mesh, measure(mesh, metrics), findings, tuple(metrics))))


def test_the_published_schema_is_a_valid_schema():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


def test_a_document_meets_the_schema_and_survives_json():
    document = valid(summarise(audit(cube_and_tet(zones=(Zone("z", "part", "", "cell", [1]),)), "all")))
    text = render("json", Batch([document]), Page())
    assert json.loads(text) == document


@pytest.mark.parametrize(
    "spoil",
    [
        lambda d: d.pop("gate"),
        lambda d: d["gate"].update(verdict="ok"),
        lambda d: d["mesh"]["cells"].update(cube=1),
        lambda d: d["distributions"]["equiangle_skew"]["counts"]["hex"].pop(),
        lambda d: d["metrics"][SKEW]["hex"].update(max="infinite"),
    ],
)
def test_the_schema_refuses_a_wrong_document(spoil):
    document = copy.deepcopy(judged(cube_and_tet()))
    spoil(document)
    with pytest.raises(jsonschema.ValidationError):
        valid(document)


def test_a_cube_and_a_corner_tet_have_their_closed_form_figures():
    document = judged(cube_and_tet())
    assert document["schema"] == "meshwright.audit/1"
    hexes, tets = document["quality"]
    assert (hexes["type"], hexes["count"], hexes["worst_equiangle_skew"], hexes["share_over_0_8"]) == ("hex", 1, 0, 0)
    assert tets["worst_equiangle_skew"] == pytest.approx(0.25, abs=1e-12)  # a right isosceles face
    corner = math.sqrt(3) * (3 + math.sqrt(3)) / 6
    assert document["metrics"][ASPECT]["tet"]["mean"] == pytest.approx(corner, rel=1e-12)
    assert document["distributions"]["aspect_ratio"]["counts"] == {
        "hex": [1] + [0] * 9,
        "tet": [0, 0, 1] + [0] * 7,
    }
    assert document["mesh"]["bounds"] == [[0, 0, 0], [6, 1, 1]]


def test_worst_cells_carry_the_files_number_zone_and_centroid():
    mesh = cube_and_tet(zones=(Zone("solid", "part", "solid", "cell", [1]),))
    worst = judged(mesh)["metrics"][SKEW]["tet"]["worst"]
    assert [w["cell"] for w in worst] == [40]
    assert worst[0]["zone"] == "solid"
    assert worst[0]["centroid"] == TET.mean(axis=0).tolist()
    assert judged(mesh)["metrics"][SKEW]["hex"]["worst"][0]["zone"] is None


def test_infinite_and_undefined_values_are_strings():
    flat = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.25, 0.5, 0)], float)
    document = judged(Mesh(flat, (CellBlock("tet", [0], [[0, 1, 2, 3]]),)))
    assert document["metrics"][ASPECT]["tet"]["max"] == "inf"
    broken = flat.copy()
    broken[0, 0] = math.nan
    document = judged(Mesh(broken, (CellBlock("tet", [0], [[0, 1, 2, 3]]),)))
    figures = document["metrics"][ASPECT]["tet"]
    assert (figures["count"], figures["undefined"], figures["mean"], figures["worst"]) == (0, 1, "nan", [])
    assert document["quality"][0]["worst_equiangle_skew"] is None
    assert document["mesh"]["bounds"] == [[0, 0, 0], [1, 1, 0]]


def test_values_are_clamped_in_the_document_and_raw_in_the_audit():
    mesh = cube_and_tet()
    measured = Measured(mesh, (METRICS[SKEW],), {SKEW: {"hex": np.array([1.4]), "tet": np.array([0.2])}, ASPECT: {}})
    document = valid(summarise(Audit(mesh, measured, (), (SKEW,))))
    assert document["metrics"][SKEW]["hex"]["max"] == 1.0
    assert measured.values[SKEW]["hex"][0] == 1.4


@pytest.mark.parametrize(
    ("severities", "verdict"),
    [((), "pass"), (("info",), "pass"), (("warning",), "warn"), (("warning", "error"), "fail")],
)
def test_the_verdict_follows_the_findings(severities, verdict):
    document = judged(cube_and_tet(), *(finding(s) for s in severities))
    assert document["gate"]["verdict"] == verdict
    assert [f["severity"] for f in document["findings"]] == list(severities)


def test_a_type_that_no_metric_covers_makes_the_audit_incomplete_and_says_so():
    document = judged(cube_and_tet(), metrics=("gambit.stretch",))
    assert document["gate"]["verdict"] == "incomplete"
    assert "tetrahedron" in document["gate"]["reasons"][0]


def test_a_coordinate_that_is_not_finite_makes_the_audit_incomplete_whatever_else_was_found():
    points = TET.copy()
    points[0] = math.nan
    mesh = Mesh(points, (CellBlock("tet", [0], [[0, 1, 2, 3]]),))
    assert judged(mesh)["gate"]["verdict"] == "incomplete"
    assert judged(mesh, finding("error"))["gate"]["verdict"] == "incomplete"


def test_a_value_that_is_undefined_is_a_warning_that_says_how_many():
    collapsed = Mesh(TET, (CellBlock("tet", [0], [[0, 1, 2, 2]]),))
    gate = judged(collapsed, metrics=tuple(METRICS))["gate"]
    assert gate["verdict"] == "warn"
    assert "angle.min has no value on 1 cell" in gate["reasons"]


def test_finding_ids_are_the_files_and_at_most_a_hundred():
    points = np.tile(TET, (150, 1))
    mesh = Mesh(
        points, (CellBlock("tet", np.arange(150), np.arange(600).reshape(-1, 4)),), cell_ids=np.arange(1000, 1150)
    )
    document = judged(mesh, finding("error", range(150)))
    assert document["findings"][0]["ids"] == list(range(1000, 1100))
    assert document["findings"][0]["count"] == 150


def two_zones():
    zones = (Zone("fluid-1", "zone", "fluid", "cell", [0]), Zone("solid", "zone", "solid", "cell", [1]))
    return cube_and_tet(zones=zones)


def test_a_zone_pattern_restricts_the_tables_and_keeps_the_mesh():
    mesh = two_zones()
    audited = Audit(mesh, measure(mesh), (finding("error", [1]), finding("warning", [0])), (SKEW,))
    document = valid(summarise(audited, zone="fluid*"))
    assert document["selection"] == {"zone": "fluid*", "cells": 1}
    assert [row["type"] for row in document["quality"]] == ["hex"]
    assert list(document["metrics"][SKEW]) == ["hex"]
    assert document["mesh"]["cells"] == {"hex": 1, "tet": 1}
    assert [f["severity"] for f in document["findings"]] == ["warning"]


def test_a_zone_with_brackets_in_its_name_is_found_by_its_name():
    zones = (Zone("[fluid]", "zone", "fluid", "cell", [0]), Zone("f", "zone", "fluid", "cell", [1]))
    mesh = cube_and_tet(zones=zones)
    for pattern, kinds in (("[fluid]", ["hex"]), ("[f-g]", ["tet"]), ("*", ["hex", "tet"])):
        document = summarise(Audit(mesh, measure(mesh), (), (SKEW,)), zone=pattern)
        assert [row["type"] for row in document["quality"]] == kinds


def test_an_unknown_zone_is_refused_with_the_names_there_are():
    mesh = two_zones()
    with pytest.raises(UsageError, match=r"no cell zone matches 'water'.*fluid-1, solid"):
        summarise(Audit(mesh, measure(mesh), (), (SKEW,)), zone="water")


def test_zone_tables_add_up_to_the_whole():
    document = judged(two_zones())
    assert [t["zone"] for t in document["zone_tables"]] == ["fluid-1", "solid"]
    for kind, counts in document["distributions"]["equiangle_skew"]["counts"].items():
        parts = [t["distributions"]["equiangle_skew"]["counts"].get(kind, [0] * 10) for t in document["zone_tables"]]
        assert np.sum(parts, axis=0).tolist() == counts


def test_statistics_agree_with_numpy_on_the_raw_values():
    rng = np.random.default_rng(5)
    points = (CUBE + rng.uniform(-0.2, 0.2, (400, 8, 3))).reshape(-1, 3)
    mesh = Mesh(points, (CellBlock("hex", np.arange(400), np.arange(3200).reshape(-1, 8)),))
    measured = measure(mesh, [SKEW])
    values = np.clip(measured.values[SKEW]["hex"], 0, 1)
    figures = valid(summarise(Audit(mesh, measured, (), (SKEW,)), worst=7))["metrics"][SKEW]["hex"]
    expected = [values.min(), values.max(), values.mean(), *np.percentile(values, [50, 95, 99])]
    assert [figures[k] for k in ("min", "max", "mean", "p50", "p95", "p99")] == pytest.approx(expected, rel=1e-12)
    order = np.argsort(-values, kind="stable")[:7]
    assert [w["cell"] for w in figures["worst"]] == order.tolist()
    assert figures["worst"][3]["centroid"] == pytest.approx(points.reshape(-1, 8, 3)[order[3]].mean(axis=0))


def test_the_audit_always_measures_what_the_tables_need():
    document = valid(summarise(audit(cube_and_tet(), "volume")))
    assert list(document["metrics"]) == ["volume"]
    assert document["quality"][0]["worst_equiangle_skew"] == 0
    assert document["metrics"]["volume"]["tet"]["mean"] == pytest.approx(1 / 6)


def test_stages_are_timed_and_announced():
    told = []
    found = audit(cube_and_tet(), progress=lambda *what: told.append(what))
    assert list(dict.fromkeys(stage for stage, _, _ in told)) == ["metrics", "checks"]
    assert ("metrics", 2, 2) in told
    assert set(found.seconds) == {"metrics", "checks"}


def test_listed_surface_elements_are_measured_as_a_shell():
    boundary = (
        CellBlock("line", [0], [[0, 1]]),
        CellBlock("quad", [1, 3], [[0, 1, 2, 3], [4, 5, 6, 7]]),
        CellBlock("tri", [2], [[8, 9, 10]]),
    )
    zones = (Zone("wall", "patch", "wall", "face", [0, 3]),)
    mesh = cube_and_tet(boundary=boundary, boundary_ids=[10, 20, 30, 40], zones=zones)
    shell = boundary_mesh(mesh)
    assert shell.counts == {"quad": 2, "tri": 1}
    assert shell.ids_of_cells([0, 1, 2]).tolist() == [20, 30, 40]
    assert [(z.name, z.entity, z.members.tolist()) for z in shell.zones] == [("wall", "cell", [2])]
    document = valid(summarise(audit(mesh, surfaces=True)))
    assert document["surface"]["cells"] == {"quad": 2, "tri": 1}
    triangle = document["surface"]["metrics"][SKEW]["tri"]
    assert triangle["max"] == pytest.approx(0.25)
    assert triangle["worst"][0]["cell"] == 30
    assert "surface" not in judged(mesh)


def test_a_face_based_mesh_gives_its_boundary_faces():
    # Two cubes side by side: eleven quads, the first of them between the cells; one boundary quad split in two.
    top = CUBE + (0, 0, 1)
    points = np.concatenate([CUBE, top[4:]])
    quads = [(4, 5, 6, 7), (0, 3, 2, 1), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    upper = [(8, 9, 10, 11), (4, 5, 9, 8), (5, 6, 10, 9), (6, 7, 11, 10), (7, 4, 8), (7, 8, 11)]
    faces = quads + upper
    owner = [0] * 6 + [1] * 6
    mesh = Mesh(
        points,
        (CellBlock("hex", [0, 1], [[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]]),),
        faces=Faces(np.cumsum([0, *map(len, faces)]), np.concatenate(faces), owner, [1] + [-1] * 11),
        zones=(Zone("lid", "patch", "wall", "face", [6]), Zone("inside", "faceZone", "", "face", [0])),
    )
    shell = boundary_mesh(mesh)
    assert shell.counts == {"tri": 2, "quad": 9}
    assert sorted(shell.cell_ids.tolist()) == list(range(1, 12))
    assert [(z.name, shell.ids_of_cells(z.members).tolist()) for z in shell.zones] == [("lid", [6])]
    lid = shell.block("quad").nodes[np.flatnonzero(shell.cell_ids[shell.block("quad").rows] == 6)[0]]
    assert lid.tolist() == [8, 9, 10, 11]


def test_a_wall_between_two_cells_belongs_to_the_surface_and_an_inner_face_does_not():
    def shell(role):
        points = np.concatenate([CUBE, CUBE[4:] + (0, 0, 1)])
        sides = [(4, 5, 6, 7), (0, 3, 2, 1), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
        sides += [(8, 9, 10, 11), (4, 5, 9, 8), (5, 6, 10, 9), (6, 7, 11, 10), (7, 4, 8, 11)]
        faces = Faces(np.arange(0, 45, 4), np.ravel(sides), [0] * 6 + [1] * 5, [1] + [-1] * 10)
        zones = (Zone("between", "zone", role, "face", [0]),)
        blocks = (CellBlock("hex", [0, 1], [range(8), range(4, 12)]),)
        return boundary_mesh(Mesh(points, blocks, faces=faces, zones=zones))

    assert shell("interior").counts == {"quad": 10}
    assert shell("wall").counts == {"quad": 11}
    assert [(z.name, shell("wall").ids_of_cells(z.members).tolist()) for z in shell("wall").zones] == [("between", [0])]


def test_a_mesh_that_lists_no_surface_is_measured_on_the_faces_that_one_cell_has():
    two_cubes = np.array([(x, y, z) for x in (0, 1, 2) for y in (0, 1) for z in (0, 1)], dtype=float)
    hexes = [[0, 4, 6, 2, 1, 5, 7, 3], [4, 8, 10, 6, 5, 9, 11, 7]]
    shell = boundary_mesh(Mesh(two_cubes, (CellBlock("hex", [0, 1], hexes),)))
    assert shell.counts == {"quad": 10}
    assert measure(shell, ["area"]).values["area"]["quad"].tolist() == [1.0] * 10


def test_a_flat_mesh_has_no_surface_to_measure():
    mesh = Mesh(CUBE[:4], (CellBlock("quad", [0], [[0, 1, 2, 3]]),), dimension=2)
    assert boundary_mesh(mesh) is None
    assert "surface" not in valid(summarise(audit(mesh, surfaces=True)))


def test_the_fingerprint_of_a_file_is_its_sha256(tmp_path):
    (tmp_path / "a.msh").write_bytes(b"abc" * 1_000_000)
    assert fingerprint(tmp_path / "a.msh") == hashlib.sha256(b"abc" * 1_000_000).hexdigest()


def test_the_fingerprint_of_a_case_is_that_of_a_checksum_list(tmp_path):
    folder = tmp_path / "constant" / "polyMesh"
    folder.mkdir(parents=True)
    content = {"faces": b"1", "points": b"2", "owner": b"3"}
    for name, data in content.items():
        (folder / name).write_bytes(data)
    lines = "".join(f"{hashlib.sha256(content[n]).hexdigest()}  {n}\n" for n in sorted(content))
    expected = hashlib.sha256(lines.encode()).hexdigest()
    (tmp_path / "case.foam").touch()
    assert fingerprint(tmp_path) == fingerprint(tmp_path / "case.foam") == fingerprint(folder) == expected
    (folder / "points").write_bytes(b"changed")
    assert fingerprint(tmp_path) != expected
    assert fingerprint(tmp_path / "nothing") is None


def test_public_names_are_what_they_say_whatever_was_imported_before():

    import meshwright.audit as package

    assert callable(package.measure)
    assert callable(package.audit)
    assert package.measure is measure
    assert package.Mesh is Mesh
    assert package.METRICS is METRICS
    for name in package.__all__:
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError):
        _ = package.nothing


def test_one_and_two_threads_give_the_same_document_to_the_byte():
    mesh = read(str(Path(__file__).parent.parent / "samples" / "hybrid" / "hybrid.fluent.msh.gz"))
    profiles = [read_profile(name) for name in PROFILES]
    also = [id_ for profile in profiles for id_ in profile.metrics if id_ in METRICS]
    texts = set()
    for threads in (1, 2, 3):
        again = dataclasses.replace(mesh)  # nothing computed before is reused
        found = audit(again, "all", also=also, threads=threads)
        with limited_to(threads):
            texts.add(json.dumps(summarise(found, sha256="0" * 64, compare=profiles)))
    assert len(texts) == 1


def test_degenerate_values_are_counted_apart_and_never_averaged_in():
    box = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    cells = [box, box + (2, 0, 0), box * (1, 1, 4) + (4, 0, 0), box * (1, 1, 0) + (6, 0, 0)]  # the last one is flat
    points = np.concatenate(cells)
    mesh = Mesh(points, (CellBlock("hex", np.arange(4), np.arange(32).reshape(4, 8)),))
    metrics = summarise(audit(mesh, "gambit.aspect_ratio,gambit.equiangle_skew,icem.determinant,gambit.warpage"))[
        "metrics"
    ]
    aspect = metrics["gambit.aspect_ratio"]["hex"]
    assert (aspect["count"], aspect["degenerate"], aspect["undefined"]) == (4, 1, 0)
    assert aspect["mean"] == pytest.approx((1 + 1 + 4) / 3)
    assert (aspect["max"], aspect["worst"][0]["cell"]) == ("inf", 3)
    determinant = metrics["icem.determinant"]["hex"]
    assert (determinant["count"], determinant["degenerate"], determinant["mean"], determinant["min"]) == (
        4,
        1,
        1.0,
        0.0,
    )
    warpage = metrics["gambit.warpage"]["hex"]
    assert (warpage["count"], warpage["undefined"]) == (3, 1)  # the faces of the flat one that are lines have no normal
