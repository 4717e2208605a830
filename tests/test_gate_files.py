"""Files of limits of other programs: OpenFOAM's meshQualityDict, HyperMesh criteria, and TOML."""

import math
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from meshwright.audit.errors import UsageError
from meshwright.audit.gate.files import EXPORTS, read_gate_file
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles.evaluate import evaluate
from meshwright.audit.profiles.hypermesh_criteria import CRITERIA, read_hypermesh, write_hypermesh
from meshwright.audit.profiles.loading import PROFILES, profile_from_toml, read_profile
from meshwright.audit.profiles.mesh_quality_dict import KEYS, read_mesh_quality_dict, write_mesh_quality_dict
from meshwright.audit.profiles.model import Profile
from meshwright.audit.profiles.quantities import QUANTITIES
from meshwright.audit.readers.openfoam.reader import read_openfoam
from meshwright.reports.cli import cli

DICT = """/*----*\\ a banner \\*----*/
FoamFile { version 2.0; format ascii; class dictionary; object meshQualityDict; }
maxNonOrtho 65;             // degrees
maxBoundarySkewness 20; maxInternalSkewness 4;
maxConcave 80;
minVol 1e-13;
minTetQuality -1e30;        /* off
                               really */
minArea -1;
minTwist 0.02;
minDeterminant 0.001;
minFaceWeight 0.05;
minVolRatio 0.01;
minTriangleTwist -1;
minFlatness 0.5;
nSmoothScale 4;
errorReduction 0.75;
relaxed { maxNonOrtho 75; }
"""

RECORDED = """*begin "version 2023.1.0.22"
*createstringarray 20 "  0 penalty value              0.00    0.00    0.80    1.00   10.00" \\
  "  1 min length        1 1.0  10.000   9.000   4.000   2.000   1.000    1   59    0" \\
  "  2 max length        0 1.0  10.000  12.000  15.000  20.000  30.000    0   39    1" \\
  "  3 aspect ratio      1 1.0   1.000   2.000   4.400   5.000  10.000    0   41    2" \\
  "  4 warpage           1 1.0   0.000   5.000  13.000  15.000  30.000    0   56    3" \\
  "  5 max angle quad    1 1.0  90.000 110.000 134.000 140.000 160.000    0   28    4" \\
  "  6 min angle quad    1 1.0  90.000  70.000  46.000  40.000  20.000    0   61    5" \\
  "  8 min angle tria    1 1.0  60.000  50.000  34.000  30.000  15.000    0   22    7" \\
  " 11 chordal dev       0 1.0   0.000   0.300   0.800   1.000   2.000    0   29   10" \\
  " 13 % of trias        1 1.0   0.000   6.000  10.000  15.000  20.000    0    0   -1" \\
  " 14 QI color legend            32      32       7       6       3           3   -1" \\
  " 16 area_skew         0      10.000                   0.500            0   39   13" \\
  " 18 equi_skew         1      10.000                   0.600            0   34   15" \\
  "   Global_solver -1"
*setqualitycriteria 1 20 0
*viewset 1 0 0 0
"""


def levels(profile):
    return {x.name: (x.metric, x.stat, x.faces, x.warn, x.fail) for x in profile.limits}


def test_a_mesh_quality_dict_is_read_entry_by_entry():
    profile = read_mesh_quality_dict(DICT, "d")
    assert levels(profile) == {
        "maxNonOrtho": ("openfoam.non_orthogonality_deg", "max", "", None, 65),
        "maxBoundarySkewness": ("openfoam.skewness", "max", "boundary", None, 20),
        "maxInternalSkewness": ("openfoam.skewness", "max", "interior", None, 4),
        "maxConcave": ("openfoam.face_concavity_deg", "max", "", None, 80),
        "minVol": ("openfoam.face_pyramid", "min", "", None, 1e-13),
        "minTwist": ("openfoam.face_twist", "min", "", None, 0.02),
        "minDeterminant": ("openfoam.smoother_determinant", "min", "", None, 0.001),
        "minFaceWeight": ("openfoam.face_weight", "min", "", None, 0.05),
        "minVolRatio": ("openfoam.volume_ratio", "min", "", None, 0.01),
        "minFaceFlatness": ("openfoam.flatness", "min", "", None, 0.5),
    }
    assert not profile.unmeasurable
    assert [x.source for x in profile.limits][:3] == ["line 3", "line 4", "line 4"]
    notes = " ".join(profile.notes)
    assert "off in this file: minTetQuality, minArea, minTriangleTwist" in notes
    assert "relaxed is left aside" in notes
    assert "nSmoothScale" in notes


@pytest.mark.parametrize(
    ("key", "value", "on"),
    [
        ("maxNonOrtho", "180", False), ("maxNonOrtho", "179", True), ("maxConcave", "180", False),
        ("maxInternalSkewness", "-1", False), ("maxInternalSkewness", "0", False), ("maxInternalSkewness", "0.1", True),
        ("minVol", "-1e30", False), ("minVol", "-1e-20", True), ("minVol", "0", True),
        ("minTetQuality", "-1e30", False), ("minTetQuality", "-0.5", True),
        ("minArea", "-1", False), ("minArea", "0", True), ("minTwist", "-2", False), ("minTwist", "-0.5", True),
        ("minTriangleTwist", "-1", False), ("minTriangleTwist", "0", True), ("minDeterminant", "-1", False),
        ("minDeterminant", "0", True), ("minFaceWeight", "-1", False), ("minFaceWeight", "0", True),
        ("minVolRatio", "-0.1", False), ("minVolRatio", "0", True), ("minFaceFlatness", "-1", False),
    ],
)  # fmt: skip
def test_an_entry_is_off_where_openfoam_says_so(key, value, on):
    other = "maxNonOrtho" if key != "maxNonOrtho" else "minArea"
    profile = read_mesh_quality_dict(f"{other} 1; {key} {value};", "d")
    assert (key in levels(profile)) == on


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("maxNonOrtho 65", 1, "a semicolon after maxNonOrtho"),
        ("maxNonOrtho 65;\nmaxNonOrto 60;", 2, "one of maxNonOrtho"),
        ("maxNonOrtho 65;\nmaxNonOrtho 60;", 2, "each key once"),
        ("maxNonOrtho ;", 1, "one number after maxNonOrtho"),
        ("maxNonOrtho 6 5;", 1, "one number after maxNonOrtho"),
        ("maxNonOrtho 1_000;", 1, "one number"),
        ("maxNonOrtho nan;", 1, "one number"),
        ("maxNonOrtho inf;", 1, "one number"),
        ("\nmaxNonOrtho $limit;", 2, "one number"),
        ('\n\n#includeEtc "caseDicts/meshQualityDict"\n', 3, "entries written out"),
        ("maxNonOrtho 65;\nrelaxed { maxNonOrtho 75;", 2, "a closing brace"),
        ("maxNonOrtho 65;\ncontrols { maxNonOrtho 75; }", 2, "an entry of a meshQualityDict"),
        ("maxNonOrtho 65;\n}", 2, "a key"),
        ("maxConcave 200;", 1, "at least one limit that is on"),
        ("minTwist 2;", 1, "minTwist from -1e+300 to 1"),
        ("maxConcave -5;", 1, "maxConcave from 0 to 180"),
        ("minArea -1;", 1, "at least one limit that is on"),
        ("maxNonOrtho 65; /* never closed", 1, ""),
    ],
)
def test_a_wrong_mesh_quality_dict_is_told_by_file_and_line(tmp_path, text, line, words):
    (tmp_path / "d").write_text(text)
    if not words:
        assert read_gate_file(tmp_path / "d").limits[0].fail == 65
        return
    with pytest.raises(UsageError) as caught:
        read_gate_file(tmp_path / "d")
    assert f"d: line {line}: expected " in str(caught.value)
    assert words in str(caught.value)
    assert ", found " in str(caught.value)


def test_recorded_hypermesh_criteria_are_read_line_by_line():
    profile = read_hypermesh(RECORDED, "c.tcl")
    assert levels(profile) == {
        "min length": ("edge.min", "min", "", 4, 2),
        "aspect ratio": ("hm.aspect", "max", "", 4.4, 5),
        "warpage": ("icem.max_warp", "max", "", 13, 15),
        "max angle quad": ("angle.max", "max", "", 134, 140),
        "min angle quad": ("angle.min", "min", "", 46, 40),
        "min angle tria": ("angle.min", "min", "", 34, 30),
        "% of trias": ("cells", "share", "", 0.1, 0.15),
        "equi_skew": ("gambit.equiangle_skew", "max", "", None, 0.6),
    }
    angle = next(x for x in profile.limits if x.name == "min angle quad")
    assert (angle.types, angle.ideal, angle.good, angle.worst, angle.weight) == (("quad",), 90, 70, 20, 1)
    assert angle.source == "line 8"
    assert profile.notes == ("off in this file: max length, chordal dev, area_skew",)
    assert [x.verified for x in profile.limits if x.name == "equi_skew"] == [False]  # its form is inferred


def test_criteria_may_stand_alone_and_the_last_of_several_sets_holds():
    alone = "# ours\n3 aspect ratio 1 1.0 1 2 4.4 5 10\n"
    assert levels(read_hypermesh(alone, "c")) == {"aspect ratio": ("hm.aspect", "max", "", 4.4, 5)}
    twice = RECORDED + RECORDED.replace("4.400   5.000", "4.400   6.000")
    profile = read_hypermesh(twice, "c")
    assert levels(profile)["aspect ratio"][4] == 6
    assert profile.notes[0] == "of 2 sets of criteria the last is taken"


def test_a_criterion_that_nothing_measures_is_a_demand_that_no_mesh_passes():
    profile = read_hypermesh("11 chordal dev 1 1.0 0 0.3 0.8 1 2\n13 % of trias 1 1.0 0 6 10 15 20\n", "c")
    assert [(x.name, x.reason) for x in profile.unmeasurable] == [("chordal dev", "it needs the geometry")]
    quad = Mesh(
        np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float), (CellBlock("quad", [0], [[0, 1, 2, 3]]),)
    )
    judgement = evaluate(measure(quad, []), profile)
    assert [(rule.id, rule.state) for rule in judgement.rules] == [
        ("hypermesh-criteria.share-of-trias", "pass"),
        ("hypermesh-criteria.chordal-dev", "incomplete"),
    ]
    assert judgement.state == "incomplete"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("aspect ratio      1", "aspect rate       1", "one of min length"),
        ("aspect ratio      1", "aspect ratio      2", "0 or 1"),
        ("2.000   4.400   5.000  10.000", "2.000   4.400   5.000", "7 figures"),
        ("2.000   4.400   5.000  10.000", "2.000   5.400   5.000  10.000", "rise from ideal to worst"),
        ("70.000  46.000  40.000", "70.000  36.000  40.000", "fall from ideal to worst"),
        ("4.400", "4,400", "figures of a criterion"),
        ("4.400", "4.4.0", "figures after 'aspect ratio'"),
        ("  4 warpage           1", "  4 aspect ratio      1", "each criterion once"),
    ],
)
def test_wrong_criteria_are_told_by_file_and_line(tmp_path, old, new, words):
    (tmp_path / "c.tcl").write_text(RECORDED.replace(old, new, 1))
    with pytest.raises(UsageError) as caught:
        read_gate_file(tmp_path / "c.tcl")
    assert re.search(r"c\.tcl: line \d+: expected ", str(caught.value))
    assert words in str(caught.value)


@pytest.mark.parametrize("text", ["", "hello", "a = 1\n", "\x00\x01", "[[limits]]\n", "<xml/>"])
def test_what_is_no_file_of_limits_is_refused(tmp_path, text):
    (tmp_path / "g").write_text(text)
    with pytest.raises(UsageError, match="an OpenFOAM meshQualityDict, HyperMesh quality criteria or TOML"):
        read_gate_file(tmp_path / "g")


def test_bytes_that_are_no_text_are_refused(tmp_path):
    (tmp_path / "g").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match="expected UTF-8"):
        read_gate_file(tmp_path / "g")


# ---- writing ----


@pytest.mark.parametrize("name", PROFILES)
def test_toml_brings_a_profile_back_whole(name):
    profile = read_profile(name)
    text, lost = EXPORTS["toml"](profile)
    assert lost == []
    assert replace(profile_from_toml(text, "f", name), sha256=profile.sha256) == profile


def test_toml_bears_any_text(tmp_path):
    odd = 'a "quoted" \\ name\nwith [[limit]] \x7f \x01 ü 漢'
    profile = read_profile("gambit")
    profile = replace(profile, title=odd, limits=(replace(profile.limits[0], name=odd, note=odd),))
    text, _ = EXPORTS["toml"](profile)
    assert replace(profile_from_toml(text, "f", "gambit"), sha256=profile.sha256) == profile


@pytest.mark.parametrize("name", PROFILES)
def test_a_mesh_quality_dict_brings_back_what_it_can_hold(name):
    profile = read_profile(name)
    text, lost = write_mesh_quality_dict(profile)
    held = [x for x in profile.limits if any(x.metric in k.metrics and x.stat == k.stat for k in KEYS.values())]
    if not held:
        assert len(lost) >= len(profile.limits)
        return
    back = levels(read_mesh_quality_dict(text, "d"))
    for key, (metric, stat, faces, warn, fail) in back.items():
        mine = [x for x in held if x.metric in KEYS[key].metrics and x.faces in ("", faces)]
        assert fail in {x.warn if x.fail is None else x.fail for x in mine}
        assert (metric, stat, warn) == (KEYS[key].metrics[0], KEYS[key].stat, None)
    for line in lost:
        assert line.replace("\\", "/") in text  # what is lost is said in the file


def test_one_skewness_of_two_does_not_fail_every_face_of_the_other():
    skew = [x for x in read_profile("cfd").limits if x.faces == "interior"]
    text, _ = write_mesh_quality_dict(Profile("p", "P", "", limits=tuple(skew)))
    assert "maxInternalSkewness  4.0;" in text
    assert "maxBoundarySkewness  1e30;" in text


def test_hypermesh_criteria_bring_back_the_shell_limits_of_their_profile():
    profile = read_profile("hypermesh")
    text, lost = write_hypermesh(profile)
    back = {x.name: x for x in read_hypermesh(text, "c").limits}
    mine = {x.name: x for x in profile.limits if x.name in CRITERIA}
    assert set(back) == set(mine)
    for name, entry in mine.items():
        same = replace(back[name], id=entry.id, source=entry.source, note=entry.note)
        assert same == entry, name
    assert len(lost) == len(profile.limits) - len(mine)
    assert all(f"#   {line}" in text for line in lost)


def test_levels_that_a_profile_does_not_know_are_not_invented():
    text, lost = write_hypermesh(read_profile("fea"))
    back = {x.name: x for x in read_hypermesh(text, "c").limits}
    angle = back["min angle quad"]
    assert (angle.good, angle.warn, angle.fail, angle.worst) == (40, 40, 15, 15)
    assert any("good and worst are not known" in line for line in lost)


@pytest.mark.parametrize("kind", EXPORTS)
def test_export_writes_the_file_whole_and_tells_what_is_lost_on_stderr(kind, tmp_path):
    path = tmp_path / "out"
    result = CliRunner().invoke(cli, ["profiles", "export", "openfoam", "--as", kind, "-o", str(path)])
    assert result.exit_code == 0
    assert result.stdout == ""
    _, lost = EXPORTS[kind](read_profile("openfoam"))
    assert result.stderr.splitlines() == [f"meshwright: left out: {line}" for line in lost]
    printed = CliRunner().invoke(cli, ["profiles", "export", "openfoam", "--as", kind])
    assert printed.stdout == path.read_text()
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    assert CliRunner().invoke(cli, ["profiles", "export", "openfoam", "--as", kind, "-o", str(tmp_path)]).exit_code == 2
    assert CliRunner().invoke(cli, ["profiles", "export", "nobody", "--as", kind]).exit_code == 2


# ---- the numbers of the motion smoother ----


def one_face(*corners, apex=(0.5, 0.5, 1.0)):
    """A pyramid over a face whose corners run so that it is seen from below."""
    points = np.array([*corners, apex], float)
    return Mesh(points, (CellBlock("pyramid", [0], [[0, 1, 2, 3, 4]]),))


def test_the_concavity_of_a_dart_is_the_turn_at_its_reflex_corner():
    # at (0.25, 0.25): from (1, 0) to it and on to (0, 1): directions (-3, 1) and (-1, 3), turned by atan(8/6)
    mesh = one_face((0, 0, 0), (1, 0, 0), (0.25, 0.25, 0), (0, 1, 0))
    value = np.nanmax(QUANTITIES["openfoam.face_concavity_deg"].values(mesh))
    assert value == pytest.approx(math.degrees(math.atan2(8, 6)), rel=1e-12)


def test_a_cube_has_the_best_determinant_and_flat_faces():
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    mesh = Mesh(cube, (CellBlock("hex", [0], [np.arange(8)]),))
    assert QUANTITIES["openfoam.smoother_determinant"].values(mesh) == pytest.approx(1, rel=1e-12)
    assert QUANTITIES["openfoam.triangle_twist"].values(mesh) == pytest.approx(1, rel=1e-12)
    # the tet over an edge of a face, its centre and the centre of the cube: V = 1/24 (corners at 0, edges 1, h 1/2)
    tets = QUANTITIES["openfoam.tet_quality"].values(mesh)
    assert np.all((tets > 0) & (tets < 1))
    assert np.ptp(tets) < 1e-12
    box = Mesh(cube * (1, 2, 4), mesh.blocks)
    # faces 8, 4, 2 twice: 27 (8 4 2) / 14^3
    assert QUANTITIES["openfoam.smoother_determinant"].values(box) == pytest.approx(27 * 64 / 14**3, rel=1e-12)


def test_a_lone_regular_tet_has_faces_of_three_nodes_without_a_triangle_twist():
    points = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], float)
    mesh = Mesh(points, (CellBlock("tet", [0], [[0, 2, 1, 3]]),))
    assert np.isnan(QUANTITIES["openfoam.triangle_twist"].values(mesh)).all()
    flat = Mesh(points[:, :2].copy() @ np.eye(2, 3), (CellBlock("quad", [0], [[0, 1, 2, 3]]),))
    for quantity in QUANTITIES.values():
        assert np.isnan(quantity.values(flat)).all()  # edges of 2-D cells have none


def _moved(source, target, amplitude):
    """A copy of a polyMesh whose points are moved at random."""
    shutil.copytree(source, target)
    import gzip

    packed = target / "points.gz"
    text = gzip.decompress(packed.read_bytes()).decode() if packed.exists() else (target / "points").read_text()
    packed.unlink(missing_ok=True)
    rng = np.random.default_rng(1)

    def move(match):
        x = np.array([float(v) for v in match.groups()]) + rng.uniform(-amplitude, amplitude, 3)
        return "({!r} {!r} {!r})".format(*x.tolist())

    number = r"[-+.\deE]+"
    (target / "points").write_text(re.sub(rf"\(\s*({number})\s+({number})\s+({number})\s*\)", move, text))
    return target


def _checkmesh(case, text):
    """Number of faces that checkMesh -meshQuality finds for each entry that is on."""
    (case / "system" / "meshQualityDict").write_text(text)
    env = {**os.environ, "WM_PROJECT_DIR": os.environ.get("WM_PROJECT_DIR", "/usr/share/openfoam")}
    command = ["checkMesh", "-case", str(case), "-constant", "-meshQuality"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, env=env, cwd=case)
    assert "Checking faces in error" in done.stdout, done.stdout[-1500:] + done.stderr[-1500:]
    report = done.stdout.partition("Checking faces in error")[2].partition("\n\n")[0]
    return [int(n) for n in re.findall(r": (\d+)\s*$", report, re.MULTILINE)]


ROOT = Path(__file__).parent.parent
CASES = {
    "hybrid": (ROOT / "samples/hybrid/hybrid-openfoam", 0.05),
    "hybrid, folded": (ROOT / "samples/hybrid/hybrid-openfoam", 0.3),
    "polyhedra": (ROOT / "samples/cells/polyhedron-openfoam", 0.3),
}


@pytest.fixture(params=CASES)
def case(request, tmp_path):
    if shutil.which("checkMesh") is None:
        pytest.skip("checkMesh of OpenFOAM is not installed")
    folder, amplitude = CASES[request.param]
    shutil.copytree(folder / "system", tmp_path / "case/system")
    (tmp_path / "case/constant").mkdir()
    _moved(folder / "constant/polyMesh", tmp_path / "case/constant/polyMesh", amplitude)
    return tmp_path / "case"


def _between(values, share):
    """A limit in the widest gap near a share of the values, so that rounding does not decide."""
    ordered = np.unique(values[np.isfinite(values)])
    at = int(share * (len(ordered) - 1))
    near = ordered[max(0, at - 5) : at + 6]
    k = int(np.argmax(np.diff(near)))
    return float((near[k] + near[k + 1]) / 2)


TESTED = ("maxNonOrtho", "maxConcave", "minVol", "minTetQuality", "minArea", "maxInternalSkewness", "minFaceWeight",
          "minVolRatio", "minTwist", "minTriangleTwist", "minDeterminant")  # fmt: skip
DIFFERENT = {
    "minTwist": "OpenFOAM looks at faces of four nodes and more, the metric at all",
    "minVolRatio": "the motion smoother takes volumes without their sign, and some cells here are inverted",
}
"""Entries of which OpenFOAM may count fewer faces, and why."""


@pytest.mark.parametrize("key", TESTED)
def test_checkmesh_counts_the_faces_that_our_rules_count(case, key):
    mesh = read_openfoam(case)
    metric = KEYS[key].metrics[0]
    values = QUANTITIES[metric].values(mesh) if metric in QUANTITIES else measure(mesh, [metric]).values[metric]["face"]
    if KEYS[key].faces:
        inside = mesh.faces.neighbour >= 0
        values = values[inside if KEYS[key].faces == "interior" else ~inside]
    if key == "maxConcave":
        values = values[values > 0]
        if len(values) < 3:
            pytest.skip("hardly a concave face")
    for share in (0.1, 0.5, 0.9):
        level = _between(values, share)
        if KEYS[key].off(level):
            continue
        one = f"{key} {level!r};"
        ours = evaluate(measure(mesh, [metric] if metric in METRICS else []), read_mesh_quality_dict(one, "d")).rules[0]
        entries = {name: spec.none for name, spec in KEYS.items() if spec.required} | {key: repr(level)}
        if "Skewness" in key:
            entries |= {"maxBoundarySkewness": "1e30"}
        text = DICT.partition("maxNonOrtho")[0] + "".join(f"{name} {value};\n" for name, value in entries.items())
        if key in DIFFERENT:
            assert _checkmesh(case, text)[0] <= ours.failed
        else:
            assert _checkmesh(case, text) == [ours.failed]


@pytest.mark.parametrize("name", ["openfoam", "cfd", "gambit"])
def test_checkmesh_accepts_a_written_dict(case, name):
    text, _ = write_mesh_quality_dict(read_profile(name))
    counts = _checkmesh(case, text)
    on = sum(not spec.off(float(re.search(rf"^{key} +(\S+);", text, re.MULTILINE)[1])) for key, spec in KEYS.items()
             if spec.required and "Skewness" not in key)  # fmt: skip
    on += "Skewness  4.0" in text
    on += "minFaceFlatness" in text
    assert len(counts) == on


def test_the_dict_of_the_installation_is_read_or_refused_by_line():
    home = Path(os.environ.get("WM_PROJECT_DIR", "/usr/share/openfoam")) / "etc"
    whole, including = home / "caseDicts/meshQualityDict", home / "templates/closedVolume/system/meshQualityDict"
    if not (whole.is_file() and including.is_file()):
        pytest.skip("OpenFOAM is not installed")
    profile = read_gate_file(whole)
    assert {x.name for x in profile.limits} | {x.name for x in profile.unmeasurable} == {
        *("maxNonOrtho", "maxBoundarySkewness", "maxInternalSkewness", "maxConcave", "minVol", "minTetQuality"),
        *("minTwist", "minDeterminant", "minFaceWeight", "minVolRatio"),
    }
    with pytest.raises(UsageError, match="entries written out: give the file that it includes"):
        read_gate_file(including)


def test_a_gate_on_the_command_line_names_the_lines_of_its_file(tmp_path):
    (tmp_path / "d").write_text("maxNonOrtho 20;\nmaxConcave 80;\n")
    mesh = ROOT / "samples/hybrid/hybrid-openfoam"
    text = CliRunner().invoke(cli, ["audit", str(mesh), "--gate", str(tmp_path / "d"), "--quiet"])
    assert text.exit_code == 1
    assert re.search(r"fail +maxNonOrtho +faces +≤ 20 +35.26 .*line 1", text.stdout)
    assert "OpenFOAM wants these entries too" in text.stdout
