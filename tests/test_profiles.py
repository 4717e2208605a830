"""Profiles: their data, and the truth table of their rules."""

import csv
import io
import json
import math
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner

from meshwright.audit.errors import UsageError
from meshwright.audit.findings import CHECKS
from meshwright.audit.measurement import Measured, measure
from meshwright.audit.mesh import CellBlock, Faces, Mesh, Zone
from meshwright.audit.metrics import METRICS
from meshwright.audit.places import Places
from meshwright.audit.profiles.evaluate import evaluate
from meshwright.audit.profiles.loading import PROFILES, check, profile_from_toml, read_profile
from meshwright.audit.profiles.model import CELLS, Limit, Profile
from meshwright.audit.profiles.quantities import QUANTITIES
from meshwright.audit.profiles.rule import NotApplicable, judge
from meshwright.audit.profiles.sampling import samples
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.cli import cli
from meshwright.reports.job import Job
from meshwright.reports.limits import beside
from meshwright.reports.plan import make_plan
from meshwright.reports.registry_text import explain

SCHEMA = json.loads((Path(__file__).parent.parent / "reports" / "schema" / "audit-1.schema.json").read_text())
SKEW, MIRROR, ASPECT = "gambit.equiangle_skew", "icem.equiangle_skewness", "gambit.aspect_ratio"
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)

SYSTEMS = {
    "ICEM CFD": "icem",
    "GAMBIT": "gambit",
    "Fluent": "fluent",
    "Fluent Meshing/TGrid": "fluent",
    "ANSYS MAPDL": "ansys",
    "ANSYS Discovery/Mechanical": "ansys",
    "Ansys Icepak": "ansys",
    "HyperMesh QI 2-D (element size 10)": "hypermesh",
    "HyperMesh": "hypermesh",
    "HyperMesh shape check": "hypermesh",
    "HyperMesh aerospace global FE (Nastran)": "hypermesh",
    "OptiStruct ELEMQUAL": "optistruct",
    "Autodesk Nastran GEOMCHECK": "nastran",
    "FEMAP": "femap",
    "CFX": "cfx",
    "Patran": "patran",
    "OpenFOAM checkMesh": "openfoam",
    "Pointwise": "pointwise",
    "Pointwise smoother": "pointwise",
    "Cubit": "cubit",
    "Verdict/VTK/PyVista": "verdict",
}
"""Profile that a collection of published limits belongs to, by its name of the system."""

OTHER_CRITERIA = ("HyperMesh shape check", "HyperMesh aerospace global FE (Nastran)")
"""Collections that a profile leaves out in favour of another of the same system."""


def cubes(n, zones=(), **options):
    """n separate unit cubes in a row."""
    points = np.concatenate([CUBE + (3 * k, 0, 0) for k in range(n)])
    blocks = (CellBlock("hex", np.arange(n), np.arange(8 * n).reshape(n, 8)),)
    return Mesh(points, blocks, zones=zones, **options)


def measured(values, metric=SKEW, **options):
    """A mesh of cubes whose metric has these values."""
    mesh = cubes(len(values), **options)
    return Measured(mesh, (METRICS[metric],), {metric: {"hex": np.array(values, float)}})


def limit(stat="max", metric=SKEW, **options):
    return Limit("it", "It", stat, "a book", True, metric, **options)


def judged(found, *limits, **options):
    return evaluate(found, Profile("p", "P", "", limits=limits), **options)


def rule(found, stat="max", **options):
    where = {key: options.pop(key) for key in ("findings", "chosen") if key in options}
    (only,) = judged(found, limit(stat, **options), **where).rules
    return only


NEXT = math.nextafter(0.8, 1)


@pytest.mark.parametrize(
    ("value", "warn", "fail", "sense", "inclusive", "state"),
    [
        (0.79, 0.8, 0.9, "above", False, "pass"),
        (0.8, 0.8, 0.9, "above", False, "pass"),
        (NEXT, 0.8, 0.9, "above", False, "warn"),
        (0.9, 0.8, 0.9, "above", False, "warn"),
        (math.nextafter(0.9, 1), 0.8, 0.9, "above", False, "fail"),
        (0.8, 0.8, 0.9, "above", True, "warn"),
        (0.9, 0.8, 0.9, "above", True, "fail"),
        (math.inf, 0.8, 0.9, "above", False, "fail"),
        (0.3, 0.3, 0.0, "below", False, "pass"),
        (math.nextafter(0.3, 0), 0.3, 0.0, "below", False, "warn"),
        (0.0, 0.3, 0.0, "below", False, "warn"),
        (0.0, 0.3, 0.0, "below", True, "fail"),
        (-0.0, 0.3, 0.0, "below", False, "warn"),
        (-math.inf, 0.3, 0.0, "below", False, "fail"),
        (5.0, None, 1.0, "above", False, "fail"),
        (5.0, 1.0, None, "above", False, "warn"),
    ],
)
def test_a_value_is_beyond_a_limit_strictly_unless_the_limit_is_inclusive(value, warn, fail, sense, inclusive, state):
    of = limit("max" if sense == "above" else "min", warn=warn, fail=fail, inclusive=inclusive)
    assert judge(value, value, of, sense) == state


@pytest.mark.parametrize(
    ("low", "high", "state"),
    [(2, 3, "pass"), (2, 6, "incomplete"), (2, 11, "incomplete"), (6, 8, "warn"), (6, 11, "incomplete"),
     (11, 20, "fail"), (5, 5, "pass")],
)  # fmt: skip
def test_a_count_known_within_bounds_fails_by_its_lower_and_passes_by_its_upper_one(low, high, state):
    assert judge(low, high, limit("count", warn=5, fail=10, beyond=0.5), "above") == state


@pytest.mark.parametrize(
    ("values", "state", "failed", "undefined"),
    [
        ([0.1, 0.2], "pass", 0, 0),
        ([0.1, 0.85], "warn", 0, 0),
        ([0.1, 0.95, 0.99], "fail", 2, 0),
        ([0.1, math.nan], "incomplete", 0, 1),
        ([0.85, math.nan], "incomplete", 0, 1),
        ([0.95, math.nan], "fail", 1, 1),
        ([math.nan, math.nan], "incomplete", 0, 2),
    ],
)
def test_what_is_not_known_does_not_pass_and_what_is_known_to_fail_fails(values, state, failed, undefined):
    found = rule(measured(values), warn=0.8, fail=0.9)
    assert (found.state, found.failed, found.undefined, found.count) == (state, failed, undefined, len(values))


def test_the_smallest_double_beyond_a_limit_is_found_and_shown_as_beyond():
    found = rule(measured([0.1, math.nextafter(0.95, 1)]), fail=0.95)
    assert (found.state, found.failed, found.measured) == ("fail", 1, math.nextafter(0.95, 1))
    assert float(beside(found.measured, 0.95)) > 0.95
    assert rule(measured([0.95]), fail=0.95).state == "pass"
    assert beside(0.95, 0.95) == "0.950"
    assert beside(94.99999, 95.0) == "94.99999"


def test_a_limit_on_the_mean_counts_every_cell():
    assert rule(measured([0.25, 0.5]), "mean", fail=0.375).state == "pass"  # (1/4 + 1/2)/2 = 3/8 and no more
    assert rule(measured([0.25, 0.75]), "mean", fail=0.375).state == "fail"
    assert rule(measured([0.25, 0.5]), "mean", fail=0.375).failed == 0
    assert rule(measured([0.25, 0.75]), "mean", fail=0.375).failed == 1
    assert rule(measured([0.9, 0.9, math.nan]), "mean", fail=0.3).state == "incomplete"
    assert rule(measured([1.0, math.inf], ASPECT), "mean", metric=ASPECT, fail=9).state == "fail"


def test_a_share_counts_cells_beyond_a_value():
    values = [0.1] * 90 + [0.85] * 10
    found = rule(measured(values), "share", beyond=0.8, warn=0.05, fail=0.2)
    assert (found.state, found.measured, found.warned, found.failed) == ("warn", 0.1, 10, 0)
    assert rule(measured(values), "share", beyond=0.85, fail=0.0).state == "pass"
    assert rule(measured(values), "count", beyond=0.8, fail=9).state == "fail"
    assert rule(measured(values), "count", beyond=0.8, fail=10).state == "pass"
    some = rule(measured([*values, math.nan]), "count", beyond=0.8, fail=10)
    assert (some.state, some.measured) == ("incomplete", 10)


def test_a_metric_that_was_not_measured_leaves_a_rule_undecided():
    found = rule(measured([0.1]), metric=ASPECT, fail=5)
    assert (found.state, found.measured) == ("incomplete", None)
    assert "was not measured" in found.reason


def test_a_limit_on_what_the_mesh_does_not_have_is_no_rule():
    judgement = judged(measured([0.1]), limit(types=("tet",), fail=0.5), limit(order=2, fail=0.5))
    assert judgement.rules == ()
    assert [skipped.reason for skipped in judgement.not_applicable] == [
        "the mesh has no tet cells",
        "the mesh has no second-order cells it is defined on",
    ]
    assert judgement.state == "incomplete"  # nothing was judged


def test_a_first_order_type_stands_for_its_second_order_kin_unless_the_order_is_named():
    middle = [(CUBE[a] + CUBE[b]) / 2 for a, b in [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
                                                   (0, 4), (1, 5), (2, 6), (3, 7)]]  # fmt: skip
    mesh = Mesh(np.concatenate([CUBE, middle]), (CellBlock("hex20", [0], [np.arange(20)]),))
    found = measure(mesh, [SKEW])
    assert len(judged(found, limit(types=("hex",), fail=0.5)).rules) == 1
    assert len(judged(found, limit(types=("hex",), order=2, fail=0.5)).rules) == 1
    assert len(judged(found, limit(types=("hex",), order=1, fail=0.5)).rules) == 0


def test_the_worst_cell_of_all_types_is_named_with_its_zone():
    points = np.concatenate([CUBE, CUBE[:4] + (5, 0, 0)])
    blocks = (CellBlock("hex", [0], [np.arange(8)]), CellBlock("tet", [1], [[8, 9, 10, 11]]))
    mesh = Mesh(points, blocks, cell_ids=[7, 40], zones=(Zone("wing", "part", "", "cell", [1]),))
    found = Measured(mesh, (METRICS[SKEW],), {SKEW: {"hex": np.array([0.2]), "tet": np.array([0.9])}})
    worst = rule(found, fail=0.5).worst
    assert (worst["type"], worst["cell"], worst["zone"], worst["value"]) == ("tet", 40, "wing", 0.9)


def test_only_the_chosen_cells_are_judged():
    found = measured([0.1, 0.99, 0.2])
    assert rule(found, fail=0.5).state == "fail"
    left = rule(found, fail=0.5, chosen=np.array([True, False, True]))
    assert (left.state, left.count) == ("pass", 2)


def test_interior_and_boundary_faces_have_limits_of_their_own():
    block = CellBlock("hex", [0, 1], [np.arange(8), [1, 8, 9, 2, 5, 10, 11, 6]])
    mesh = Mesh(np.concatenate([CUBE, [(2, 0, 0), (2, 1, 0), (2, 0, 1), (2, 1, 1)]]), (block,))
    found = measure(mesh, ["face.area"])
    inside = rule(found, "min", metric="face.area", faces="interior", fail=0.5)
    outside = rule(found, "min", metric="face.area", faces="boundary", fail=2.0)
    assert (inside.state, inside.count) == ("pass", 1)
    assert (outside.state, outside.count, outside.failed) == ("fail", 10, 10)


def test_the_share_of_a_type_is_one_of_the_cells_of_its_dimension():
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0)], float)
    blocks = (CellBlock("quad", [0], [[0, 1, 2, 3]]), CellBlock("tri", [1], [[1, 4, 2]]))
    found = Measured(Mesh(points, blocks), (), {})
    share = Limit("t", "% of trias", "share", "", True, CELLS, types=("tri",), warn=0.1, fail=0.5)
    (only,) = judged(found, share).rules
    assert (only.measured, only.state, only.count) == (0.5, "warn", 2)
    (absent,) = judged(measured([0.1]), share).not_applicable
    assert isinstance(absent, NotApplicable)


def test_a_limit_on_a_finding_counts_what_the_check_reports():
    handed = Limit("h", "Face handedness", "count", "", True, finding="left-handed-faces", fail=0)
    assert judged(measured([0.1]), handed).rules[0].state == "pass"
    (only,) = judged(measured([0.1]), handed, findings={"left-handed-faces": 3}).rules
    assert (only.state, only.measured, only.failed) == ("fail", 3, 3)


def test_a_rule_judges_values_clamped_to_the_range_of_the_metric():
    assert rule(measured([1.4]), fail=1.0).state == "pass"  # 1 is all there is


# ---- two scales ----

SKEWS = [0.0, 0.1, 0.2, 0.3, 0.7, 0.7999999999999999, 0.8, NEXT, 0.9, 0.95, 1.0]


@pytest.mark.parametrize("skew", SKEWS)
def test_fluent_and_icem_agree_about_every_cell(skew):
    found = Measured(
        cubes(1),
        (METRICS[SKEW], METRICS[MIRROR]),
        {SKEW: {"hex": np.array([skew])}, MIRROR: {"hex": np.array([1 - skew])}},
    )
    fluent = rule(found, warn=0.8)
    icem = rule(found, "min", metric=MIRROR, warn=0.2)
    assert fluent.state == icem.state == ("warn" if skew > 0.8 else "pass")
    assert (fluent.warned, icem.warned) == ((1, 1) if skew > 0.8 else (0, 0))
    assert icem.measured == pytest.approx(1 - skew, abs=1e-15)
    assert (icem.measured < 0.2) == (icem.state == "warn")  # 1 - 0.8 is less than 0.2 in doubles


def test_fluent_and_icem_count_the_same_share_of_bad_cells():
    found = Measured(
        cubes(len(SKEWS)),
        (METRICS[SKEW], METRICS[MIRROR]),
        {SKEW: {"hex": np.array(SKEWS)}, MIRROR: {"hex": 1 - np.array(SKEWS)}},
    )
    fluent = rule(found, "count", beyond=0.8, fail=0)
    icem = rule(found, "count", metric=MIRROR, beyond=0.2, fail=0)
    assert fluent.measured == icem.measured == 4
    assert (icem.worst["value"], fluent.worst["value"]) == (0.0, 1.0)


def test_a_sheared_cube_is_a_third_skew_on_every_scale():
    # a rhombus of 60 and 120 degrees: (120 - 90)/90 = (90 - 60)/90 = 1/3
    points = CUBE.copy()
    points[[2, 3, 6, 7], 0] += 0.5
    points[:, 1] *= math.sqrt(3) / 2
    found = measure(Mesh(points, (CellBlock("hex", [0], [np.arange(8)]),)), [SKEW, MIRROR])
    assert rule(found, warn=0.33).measured == pytest.approx(1 / 3, rel=1e-12)
    assert rule(found, "min", metric=MIRROR, warn=0.67).measured == pytest.approx(2 / 3, rel=1e-12)
    assert rule(found, warn=0.33).state == rule(found, "min", metric=MIRROR, warn=0.67).state == "warn"


# ---- the data ----


@pytest.mark.parametrize("name", PROFILES)
def test_every_limit_has_a_source_and_says_whether_it_is_verified(name):
    profile = read_profile(name)
    assert profile.limits
    assert profile.title
    assert profile.description
    for entry in profile.limits:
        assert len(entry.source) > 10
        assert entry.verified in (True, False)
        assert entry.verified or "handed down" not in entry.source or entry.source
    unread = [entry.source for entry in profile.limits if entry.verified]
    assert not [source for source in unread if "handed down" in source or "from memory" in source]


@pytest.mark.parametrize("name", PROFILES)
def test_every_metric_and_check_that_a_profile_names_is_one_of_this_build(name):
    profile = read_profile(name)
    unknown = {id_ for id_ in profile.metrics if id_ not in METRICS and id_ not in QUANTITIES}
    unknown |= {entry.finding for entry in profile.limits if entry.finding and entry.finding not in CHECKS}
    assert unknown == set()
    check(profile)


@pytest.mark.parametrize("name", PROFILES)
def test_limits_on_metrics_of_this_build_look_at_the_bad_end_of_their_scale(name):
    for entry in read_profile(name).limits:
        if entry.metric in METRICS or entry.metric in QUANTITIES:
            check(Profile("p", "P", "", limits=(entry,)))


def test_no_published_limit_is_forgotten(shared):
    rows = json.loads((shared / "reference" / "profiles.json").read_text())["rows"]
    for row in rows:
        if row["system"] not in SYSTEMS:
            continue
        profile = read_profile(SYSTEMS[row["system"]])
        known = {entry.name for entry in profile.limits} | {entry.what for entry in profile.left_out}
        known |= {entry.name for entry in profile.measures}
        assert row["metric"] in known, (row["system"], row["metric"])


def test_published_figures_are_those_of_the_profiles(shared):
    """Every number of the profiles that stands for a published one on the same scale."""
    rows = json.loads((shared / "reference" / "profiles.json").read_text())["rows"]
    checked = 0
    for row in rows:
        profile = SYSTEMS.get(row["system"])
        if profile is None or row["system"] in OTHER_CRITERIA or not isinstance(row["fail"], int | float):
            continue
        mine = [entry for entry in read_profile(profile).limits if entry.name == row["metric"]]
        shares = [entry.metric == CELLS for entry in mine]
        levels = {x for entry in mine for x in (entry.warn, entry.fail)}
        wanted = row["fail"] / 100 if any(shares) else row["fail"]
        if mine and wanted not in levels:
            assert row["metric"] in ("Nodes below axis", "Face handedness", "Jacobian ratio (h-elements)"), row
        checked += bool(mine)
    assert checked > 30


GOOD = """title = "T"
[[limit]]
id = "skew"
name = "Skew"
metric = "gambit.equiangle_skew"
stat = "max"
fail = 0.9
source = "a book"
verified = true
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('title = "T"', 'titel = "T"', "key 'title'"),
        ('title = "T"', 'title = "T"\nlimits = 3', "key 'limits': expected no such key"),
        ("fail = 0.9", "lee = 0.9", "limit 1, key 'lee'"),
        ("fail = 0.9", 'fail = "0.9"', "expected a finite number"),
        ("fail = 0.9", "fail = inf", "expected a finite number"),
        ("fail = 0.9", "fail = nan", "expected a finite number"),
        ("fail = 0.9", "fail = true", "expected a finite number"),
        ("fail = 0.9", "", "neither"),
        ('stat = "max"', 'stat = "p99"', "max, min, mean, share, count"),
        ('stat = "max"', 'stat = "share"', "key 'beyond'"),
        ('stat = "max"', 'stat = "max"\nbeyond = 0.8', "key 'beyond'"),
        ('stat = "max"', 'stat = "max"\nsense = "below"', "key 'sense'"),
        ('stat = "max"', 'stat = "max"\norder = 3', "1 or 2"),
        ('stat = "max"', 'stat = "max"\ntypes = ["cube"]', "key 'types'"),
        ('source = "a book"', 'source = " "', "where the limit stands"),
        ("verified = true", "", "key 'verified'"),
        ("verified = true", "verified = 1", "true or false"),
        ('id = "skew"', 'id = "Skew!"', "small letters"),
        ('metric = "gambit.equiangle_skew"', "", "neither"),
        ('metric = "gambit.equiangle_skew"', 'metric = "a.b"\nfinding = "c"', "both"),
        ("[[limit]]", "[limit]", "an array of tables"),
        ('name = "Skew"', 'name = "Skew', "expected TOML"),
        ("verified = true", "verified = true\n" + GOOD.split("\n", 1)[1], "ids that differ"),
    ],
)
def test_toml_that_says_what_nobody_asked_for_is_refused_with_file_and_key(old, new, words):
    assert profile_from_toml(GOOD, "f.toml", "p").limits[0].fail == 0.9
    with pytest.raises(UsageError) as caught:
        profile_from_toml(GOOD.replace(old, new, 1), "f.toml", "p")
    assert words in str(caught.value)
    assert str(caught.value).startswith("f.toml: ")


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (limit(metric="gambit.equiangel", fail=1), "not one of this build"),
        (Limit("it", "It", "count", "", True, finding="no-such-check", fail=1), "not a check of this build"),
        (limit("min", fail=0.5), "its good end"),
        (limit(warn=0.9, fail=0.8), "before it warns"),
        (limit(fail=1.5), "outside the range"),
        (limit(metric="gambit.taper", types=("tet",), fail=0.5), "not defined on tet"),
        (limit(faces="interior", fail=0.5), "not a value of faces"),
        (limit(metric="fluent.face_squish", faces="boundary", fail=0.5), "not defined on boundary"),
        (limit(metric="fluent.face_squish", types=("hex",), fail=0.5), "not of cells"),
    ],
)
def test_a_limit_that_a_metric_cannot_have_is_refused_before_a_mesh_is_read(entry, words):
    with pytest.raises(UsageError, match=r"limit it|metric") as caught:
        check(Profile("p", "P", "", limits=(entry,)))
    assert words in str(caught.value)


def test_samples_are_what_the_rules_see():
    found = measured([0.1, 0.2, 0.3])
    (only,) = samples(found, Places(found.mesh, np.array([True, False, True])), limit(fail=1))
    assert only.values.tolist() == [0.1, 0.3]
    assert only.row(1) == 2


# ---- the document and the command line ----


def box(jitter=0.0, names=("left", "right"), stretch=1.0):
    """A Gmsh 2.2 text of 2 x 1 x 1 hexes in two named volumes."""
    rng = np.random.default_rng(3)
    grid = np.stack(np.meshgrid(np.arange(3), np.arange(2), np.arange(2), indexing="ij"), -1).reshape(-1, 3)
    points = grid * (1, stretch, 1) + rng.uniform(-jitter, jitter, grid.shape)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "2"]
    lines += [f'3 {k + 1} "{name}"' for k, name in enumerate(names)]
    lines += ["$EndPhysicalNames", "$Nodes", "12", *(f"{i + 1} {x!r} {y!r} {z!r}" for i, (x, y, z) in
                                                     enumerate(points.tolist()))]  # fmt: skip
    lines += ["$EndNodes", "$Elements", "2", "1 5 2 1 1 1 5 7 3 2 6 8 4", "2 5 2 2 2 5 9 11 7 6 10 12 8"]
    return "\n".join([*lines, "$EndElements", ""])


@pytest.fixture
def at_home(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    (tmp_path / "box.msh").write_text(box())
    (tmp_path / "bent.msh").write_text(box(jitter=0.25))
    return tmp_path


def run(*args):
    return CliRunner().invoke(cli, [str(a) for a in args])


def audited(*args):
    result = run("audit", *args, "--format", "json", "--quiet")
    assert result.exit_code in (0, 1, 3), result.output
    document = json.loads(result.stdout)
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    return document


def gate(**levels):
    text = "".join(f"{key} = {value}\n" for key, value in levels.items())
    return GOOD.replace("fail = 0.9\n", text)


@pytest.mark.parametrize(
    ("levels", "state", "status"),
    [({"fail": 0.9}, "pass", 0), ({"warn": 0.01}, "warn", 0), ({"fail": 0.01}, "fail", 1)],
)
def test_the_exit_status_is_that_of_the_worst_rule(at_home, levels, state, status):
    (at_home / "g.toml").write_text(gate(**levels))
    result = run("audit", "bent.msh", "--gate", "g.toml", "--format", "json", "--quiet")
    assert result.exit_code == status
    found = json.loads(result.stdout)["gate"]
    assert (found["verdict"], found["rules"][0]["state"], found["file"], found["profile"]) == (
        state, state, "g.toml", None,
    )  # fmt: skip


def test_a_gate_that_judges_nothing_is_incomplete_with_status_3(at_home):
    (at_home / "g.toml").write_text(gate(fail=0.9).replace('stat = "max"', 'stat = "max"\ntypes = ["tet"]'))
    document = audited("box.msh", "--gate", "g.toml")
    assert run("audit", "box.msh", "--gate", "g.toml").exit_code == 3
    assert document["gate"]["verdict"] == "incomplete"
    assert document["gate"]["not_applicable"] == [{"id": "gate.skew", "reason": "the mesh has no tet cells"}]
    assert document["gate"]["reasons"] == ["no limit of gate applies to this mesh"]


def test_a_profile_fills_the_gate_and_measures_what_it_needs(at_home):
    document = audited("bent.msh", "--profile", "gambit", "--metrics", "volume")
    found = document["gate"]
    assert found["profile"] == "gambit"
    assert {entry["id"] for entry in found["rules"]} == {"gambit.equiangle-skew", "gambit.volume"}
    skew = found["rules"][0]
    assert set(skew) >= {"id", "metric", "stat", "limit", "measured", "state"}
    assert skew["measured"] == document["metrics"][SKEW]["hex"]["max"]
    assert skew["worst"]["cell"] == document["metrics"][SKEW]["hex"]["worst"][0]["cell"]
    assert set(document["metrics"]) >= {"volume", SKEW, "gambit.taper"}
    assert found["dialect"]["zone"] == "continuum zone"


def test_without_a_profile_nothing_is_judged_but_the_findings(at_home):
    document = audited("box.msh")
    assert (document["gate"]["profile"], document["gate"]["rules"], document["gate"]["verdict"]) == (None, [], "pass")
    assert document["gate"]["dialect"] is None
    assert "rosetta" not in document


def test_a_profile_and_a_gate_file_both_count(at_home):
    (at_home / "g.toml").write_text(gate(fail=0.01))
    found = audited("bent.msh", "--profile", "gambit", "--gate", "g.toml")["gate"]
    assert [entry["id"] for entry in found["rules"]][-1] == "gate.skew"
    assert (found["profile"], found["file"], found["verdict"]) == ("gambit", "g.toml", "fail")


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["--profile", "fluint"], "profiles: fluent, icem"),
        (["--gate", "missing.toml"], "No such file"),
        (["--gate", "box.msh"], "an OpenFOAM meshQualityDict"),
        (["--unit", "furlong"], "mm, cm, m, in"),
        (["--unit", "-1"], "mm, cm, m, in"),
        (["--sizes", "missing.toml"], "No such file"),
        (["--gate", "g.toml", "-o", "g.toml"], "also an input"),
        (["--axis", "z"], "'z' is not one of"),
        (["--discipline", "art"], "'art' is not one of"),
    ],
)
def test_wrong_options_are_status_2_before_a_mesh_is_read(at_home, args, words):
    (at_home / "g.toml").write_text(GOOD)
    result = run("audit", "no-such-mesh.msh" if "-o" not in args else "box.msh", *args, "--quiet")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert words in result.stderr


def test_the_page_speaks_the_dialect_of_the_profile(at_home):
    for name, words in (("icem", "Parts"), ("gambit", "Zones"), ("hypermesh", "Components"), ("cfx", "Domains")):
        text = run("audit", "bent.msh", "--profile", name, "--quiet").stdout
        assert f"\n{words}" in text
        assert f"\nGate {name}" in text


def test_markdown_and_csv_hold_the_rules(at_home):
    text = run("audit", "bent.msh", "--profile", "gambit", "--format", "md", "--quiet").stdout
    assert "### Gate gambit" in text
    assert "| pass | EquiAngle Skew | all | ≤ 0.75 |" in text
    rows = list(csv.DictReader(io.StringIO(run("audit", "bent.msh", "--profile", "gambit", "--format", "csv").stdout)))
    mine = {row["item"]: row["value"] for row in rows if row["table"] == "rule" and row["zone"] == "gambit.volume"}
    assert (mine["state"], mine["limit"], mine["verified"]) == ("pass", "0.0", "true")


def test_hostile_names_stay_text_in_every_output(at_home):
    bad = "=evil|`\\u001b[31m<b>"
    (at_home / "odd.msh").write_text(box(jitter=0.25, names=("=a|b\x1b[31m<i>", "right")))
    (at_home / "g.toml").write_text(gate(fail=0.01).replace('"Skew"', f'"{bad}"').replace('"a book"', f'"{bad}"'))
    for form in ("text", "md", "csv"):
        text = run("audit", "odd.msh", "--gate", "g.toml", "--format", form, "--quiet").stdout
        assert "\x1b" not in text
        assert "evil" in text
        if form == "md":
            assert "<b>" not in text
            assert "<i>" not in text
        if form == "csv":
            assert ",=evil" not in text
    document = audited("odd.msh", "--gate", "g.toml")
    assert document["gate"]["rules"][0]["name"] == json.loads(f'"{bad}"')


def test_sizes_units_axis_and_discipline_reach_the_checks(at_home):
    (at_home / "s.toml").write_text(
        '[[region]]\nname = "all"\nsize = 2\n[[region]]\nname = "w"\nsize = 1\nshape = "zone"\nzone = "wing*"\n'
        '[[region]]\nname = "b"\nsize = 0.5\nshape = "box"\nlow = [0, 0, 0]\nhigh = [1, 2, 3]\n'
        '[[region]]\nname = "c"\nsize = 0.5\nshape = "cylinder"\nstart = [0, 0, 0]\nend = [1, 0, 0]\nradius = 0.25\n'
        '[[region]]\nname = "s"\nsize = 0.5\nshape = "sphere"\ncentre = [0, 0, 0]\nradius = 3\n'
    )
    options = make_plan(Job(("a",), unit="in", axis="x", sizes="s.toml", feature_angle=25.0)).options
    assert (options.unit, options.axis, options.feature_angle, options.discipline) == (25.4, "x", 25.0, "")
    assert [(r.shape, r.zone, r.place) for r in options.sizes] == [
        ("global", "*", ()),
        ("zone", "wing*", ()),
        ("box", "*", (0, 0, 0, 1, 2, 3)),
        ("cylinder", "*", (0, 0, 0, 1, 0, 0, 0.25)),
        ("sphere", "*", (0, 0, 0, 3)),
    ]
    assert make_plan(Job(("a",), profile="gambit")).options.discipline == "cfd"
    assert make_plan(Job(("a",), profile="gambit", discipline="fea")).options.discipline == "fea"
    assert make_plan(Job(("a",), unit="0.5")).options.unit == 0.5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "at least one [[region]]"),
        ('[[region]]\nname = "a"\nsize = 0', "a number above 0"),
        ('[[region]]\nname = "a"\nsize = 1\nshape = "cube"', "global, zone, box"),
        ('[[region]]\nname = "a"\nsize = 1\nradius = 2', "no such key"),
        ('[[region]]\nname = "a"\nsize = 1\nshape = "box"\nlow = [0, 0, 0]\nhigh = [1, 0, 1]', "more than low"),
        ('[[region]]\nname = "a"\nsize = 1\nshape = "sphere"\ncentre = [0, 0]\nradius = 1', "3 finite numbers"),
        ('[[region]]\nname = "a"\nsize = 1\nshape = "cylinder"\nstart=[0,0,0]\nend=[0,0,0]\nradius=1', "another point"),
    ],
)
def test_a_wrong_file_of_sizes_is_told_by_region_and_key(at_home, text, words):
    (at_home / "s.toml").write_text(text)
    with pytest.raises(UsageError) as caught:
        make_plan(Job(("a",), sizes="s.toml"))
    assert words in str(caught.value)
    assert "s.toml" in str(caught.value)


def test_profiles_are_listed_and_shown_with_sources(at_home):
    listed = run("profiles").stdout
    for name in PROFILES:
        assert f"\n{name} " in f"\n{listed}"
        text = run("profiles", "show", name).stdout
        assert read_profile(name).title in text
        shown = json.loads(run("profiles", "show", name, "--format", "json").stdout)
        assert [entry["id"] for entry in shown["limits"]] == [entry.id for entry in read_profile(name).limits]
        assert all(entry["source"] for entry in shown["limits"])
    assert "unverified" in run("profiles", "show", "cfx").stdout
    assert "no warning" in run("profiles", "show", "cfx").stdout
    assert [row["name"] for row in json.loads(run("profiles", "--format", "json").stdout)] == list(PROFILES)
    wrong = run("profiles", "show", "nobody")
    assert (wrong.exit_code, wrong.stdout) == (2, "")


@pytest.mark.parametrize("id_", [*METRICS, *QUANTITIES])
def test_every_metric_is_explained_with_its_limits(id_):
    text = explain(id_)
    assert id_ in text
    assert "limits" in text


def test_explain_tells_who_limits_a_metric():
    text = " ".join(explain(SKEW).split())
    assert "fluent: Cell equiangle skew warns unless ≤ 0.8, fails unless ≤ 0.95" in text
    assert "unverified" in text


def test_help_on_profiles_needs_no_more_than_click():
    code = (
        "import sys\nfrom meshwright.reports.cli import cli\n"
        "for args in (['profiles'], ['profiles', 'show'], ['profiles', 'export']):\n"
        "    try: cli.main([*args, '--help'])\n"
        "    except SystemExit as end: assert not end.code\n"
        "assert not {'numpy', 'numba', 'rich'} & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_an_inverted_cell_fails_whatever_the_rules_say():
    mesh = Mesh(CUBE, (CellBlock("hex", [0], [[4, 5, 6, 7, 0, 1, 2, 3]]),))
    found = audit(mesh)
    profile = Profile("p", "P", "", limits=(limit(fail=0.9),))
    document = summarise(found, profiles=[profile])
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    assert document["gate"]["rules"][0]["state"] == "pass"
    assert document["gate"]["verdict"] == "fail"


def test_a_coordinate_that_is_not_finite_leaves_every_verdict_open():
    points = CUBE.copy()
    points[0, 0] = math.nan
    found = audit(Mesh(points, (CellBlock("hex", [0], [np.arange(8)]),)))
    document = summarise(found, profiles=[Profile("p", "P", "", limits=(limit(fail=0.9),))])
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    assert (document["gate"]["verdict"], document["gate"]["rules"][0]["state"]) == ("incomplete", "incomplete")


def test_faces_of_a_face_based_mesh_are_named_by_the_files_own_numbers():
    quads = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
    faces = Faces(np.arange(0, 25, 4), quads.reshape(-1), [0] * 6, [-1] * 6, ids=np.arange(100, 106))
    mesh = Mesh(CUBE * (1, 1, 3), (CellBlock("polyhedron", [0], offsets=[0, 6], items=np.arange(6)),), faces=faces)
    found = rule(measure(mesh, ["face.area"]), "min", metric="face.area", fail=2.0)
    assert (found.failed, found.worst["face"], found.worst["type"]) == (2, 100, "face")
