"""Comparing meshes and audits, and keeping baselines."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner
from hostile_names import NAMES
from lxml import html
from report_meshes import block_of_hexes

from meshwright.audit.mesh import Mesh, Zone
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.cli import cli
from meshwright.reports.compare_html import render_html
from meshwright.reports.compare_text import conclusion, render_markdown, render_text
from meshwright.reports.comparison import compare_documents, match_audits

SAMPLES = Path(__file__).parent.parent / "samples"
DEMO, OTHER = str(SAMPLES / "demo.msh.gz"), str(SAMPLES / "demo.v41.msh.gz")
SCHEMA = json.loads((Path(__file__).parent.parent / "reports" / "schema" / "compare-1.schema.json").read_text())
SKEW = "gambit.equiangle_skew"


def run(*args, **options):
    return CliRunner().invoke(cli, [str(arg) for arg in args], **options)


def compared(a, b, **options):
    sides = [audit(mesh) for mesh in (a, b)]
    found = compare_documents(*(summarise(side) for side in sides), **options)
    match_audits(found, *sides)
    jsonschema.Draft202012Validator(SCHEMA).validate(json.loads(json.dumps(found)))
    return found


def bent(mesh, step=0.4):
    """The mesh with its middle point moved."""
    points = mesh.points.copy()
    middle = int(np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    points[middle] += (step, 0.3 * step, 0)
    return Mesh(
        points,
        mesh.blocks,
        boundary=mesh.boundary,
        zones=mesh.zones,
        cell_ids=mesh.cell_ids,
        path="bent.msh",
        format="made",
    )


def test_a_mesh_compared_with_itself_has_nothing_worse():
    found = compared(block_of_hexes(4), block_of_hexes(4))
    assert found["nothing_worse"]
    assert found["metrics"]["changed"] == found["findings"] == found["zones"]["lost"] == []
    assert found["matching"]["same"] == 64
    assert conclusion(found) == "nothing got worse"


def test_a_worse_mesh_says_what_got_worse_and_where():
    mesh = block_of_hexes(4, jitter=0)
    found = compared(mesh, bent(mesh))
    assert not found["nothing_worse"]
    assert any(text.startswith(SKEW) for text in found["worse"])
    assert found["matching"]["moved"]["count"] == 8
    (skew,) = [entry for entry in found["matching"]["worse"] if entry["metric"] == SKEW]
    assert skew["cells"][0]["after"] > skew["cells"][0]["before"]
    assert {c["cell"] for c in skew["cells"]} <= set(found["matching"]["moved"]["ids"])
    back = compared(bent(mesh), mesh)
    assert any(entry["metric"] == SKEW and entry["better"] for entry in back["metrics"]["changed"])


def test_a_tolerance_forgives_a_small_loss():
    mesh = block_of_hexes(4)
    found = compared(mesh, bent(mesh, 0.01), absolute=10.0)
    assert not any("worst" in entry["worse"] or "mean" in entry["worse"] for entry in found["metrics"]["changed"])


def test_zones_that_change_their_name_are_told():
    mesh = block_of_hexes(4)
    other = Mesh(
        mesh.points,
        mesh.blocks,
        boundary=mesh.boundary,
        zones=(*mesh.zones[:1], Zone("top", "part", "fluid", "cell", mesh.zones[1].members), mesh.zones[2]),
    )
    found = compared(mesh, other)
    assert [z["name"] for z in found["zones"]["lost"]] == ["upper"]
    assert [z["name"] for z in found["zones"]["new"]] == ["top"]
    assert found["zones"]["maybe_renamed"] == [] or found["zones"]["maybe_renamed"][0]["after"] == "top"
    assert found["matching"]["zone_changed"] == [{"before": "upper", "after": "top", "count": 32}]


def test_what_one_side_did_not_measure_is_never_compared():
    mesh = block_of_hexes(3)
    a, b = summarise(audit(mesh, SKEW)), summarise(audit(mesh, "volume"))
    found = compare_documents(a, b)
    assert found["metrics"]["changed"] == []
    assert not found["nothing_worse"]
    assert any("measured before only" in text for text in found["cautions"])
    assert any("measured after only" in text for text in found["cautions"])


def test_the_same_mesh_in_two_formats_is_the_same():
    result = run("compare", DEMO, OTHER, "--quiet", "--format", "json")
    assert result.exit_code == 0
    found = json.loads(result.stdout)
    assert found["matching"]["same"] == sum(found["before"]["cells"].values())
    assert found["worse"] == []


def test_saved_audits_compare_with_each_other_and_with_meshes(tmp_path):
    page, data = tmp_path / "a.html", tmp_path / "b.json"
    assert run("audit", DEMO, "--quiet", "--html", page, "-o", data, "--format", "json").exit_code == 0
    for sides in ((page, data), (data, OTHER), (DEMO, page)):
        result = run("compare", *sides, "--quiet", "--format", "json")
        assert result.exit_code == 0, result.output
        found = json.loads(result.stdout)
        assert found["matching"] is None
        assert found["worse"] == []
    assert "cells are not matched" in run("compare", page, data, "--quiet").stdout


def test_fail_on_worse_is_status_1_and_what_cannot_be_compared_3(tmp_path):
    mesh = block_of_hexes(4, jitter=0)
    names = {}
    for name, made, metrics in (("good", mesh, "default"), ("bad", bent(mesh), "default"), ("other", mesh, SKEW)):
        names[name] = tmp_path / f"{name}.json"
        names[name].write_text(json.dumps(summarise(audit(made, metrics))))
    assert run("compare", names["good"], names["good"], "--fail-on", "worse").exit_code == 0
    assert run("compare", names["good"], names["bad"]).exit_code == 0
    assert run("compare", names["good"], names["bad"], "--fail-on", "worse").exit_code == 1
    assert run("compare", names["good"], names["other"], "--fail-on", "worse").exit_code == 3
    assert run("compare", names["good"], tmp_path / "absent.msh").exit_code == 3
    assert run("compare", names["good"], names["bad"], "--format", "pdf").exit_code == 2
    assert run("compare", names["good"], names["bad"], "-o", names["bad"]).exit_code == 2


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "{}",
        '{"schema": "meshwright.audit/2"}',
        "<html></html>",
        "\0",
        '{"schema": "meshwright.audit/1"}',
    ],
)
def test_what_is_no_saved_audit_is_refused_in_one_line(tmp_path, text):
    path = tmp_path / "x.json"
    path.write_text(text)
    result = run("compare", path, path, "--quiet")
    assert result.exit_code == 3
    assert len(result.stderr.splitlines()) == 1


def hostile_comparison():
    mesh = block_of_hexes(4, zones=False)
    zones = tuple(Zone(name, "part", "", "cell", [k]) for k, name in enumerate(NAMES.values()))
    other = Mesh(mesh.points, mesh.blocks, zones=zones, path=NAMES["script end"], format="made")
    return compared(
        Mesh(mesh.points, mesh.blocks, zones=(zones[0],), path=NAMES["attribute"], format="made"), bent(other)
    )


def test_no_name_breaks_out_of_a_comparison():
    found = hostile_comparison()
    page = render_html(found)
    tree = html.fromstring(page)
    assert tree.xpath("//script | //img | //iframe | //b | //i | //svg[@onload]") == []
    assert not any(
        name.startswith("on") for element in tree.iter() if isinstance(element.tag, str) for name in element.attrib
    )
    assert len(page) < 2_000_000
    for text in (render_text(found, width=100, colour=False), render_markdown(found), page):
        assert not re.search("[\x00-\x08\x0b-\x1f\x7f\u200b\u202a-\u202e\u2066-\u2069\ud800-\udfff]", text)
    assert "<script>" not in render_markdown(found).replace("\\<script\\>", "")


# -------------------------------------------------------------------------------------------------------- baselines


@pytest.fixture
def project(tmp_path, monkeypatch):
    (tmp_path / ".git").mkdir()
    folder = tmp_path / "cases" / "wing"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    return tmp_path


def test_a_baseline_is_kept_listed_used_and_removed(project):
    assert "no baselines here" in run("baseline", "list").stdout
    assert run("baseline", "save", "main", DEMO, "--quiet", "--profile", "fluent").exit_code == 0
    assert (project / ".meshwright" / "baselines" / "main.json").is_file()
    (entry,) = json.loads(run("baseline", "list", "--format", "json").stdout)
    assert entry["name"] == "main"
    assert entry["cells"] == 56134
    assert "main" in run("baseline", "list").stdout
    audited = json.loads(
        run("audit", OTHER, "--quiet", "--baseline", "main", "--profile", "fluent", "--format", "json").stdout
    )
    assert audited["gate"]["baseline"]["path"].endswith("main.json")
    assert any(rule["baseline"] is not None for rule in audited["gate"]["rules"])
    assert run("baseline", "remove", "main").exit_code == 0
    assert run("baseline", "remove", "main").exit_code == 2


@pytest.mark.parametrize("name", ["../x", "a/b", "", ".", "..", "x.json", "a b", "-x", "a\0b", "x" * 101])
def test_a_name_that_could_be_a_path_is_refused(project, name):
    result = run("baseline", "save", "--", name, DEMO)
    assert result.exit_code == 2
    assert list(project.rglob("*.json")) == []


def test_a_broken_baseline_is_listed_as_such(project):
    folder = project / ".meshwright" / "baselines"
    folder.mkdir(parents=True)
    (folder / "x.json").write_text("{")
    assert "unreadable" in run("baseline", "list").stdout


def test_a_kill_while_saving_leaves_the_old_baseline_whole(project):
    assert run("baseline", "save", "main", DEMO, "--quiet").exit_code == 0
    path = project / ".meshwright" / "baselines" / "main.json"
    before = path.read_bytes()
    script = (
        "import sys, time\n"
        "from meshwright.reports import baseline_store\n"
        "import json\n"
        "real = json.dumps\n"
        "def slow(*a, **k):\n"
        "    text = real(*a, **k)\n"
        "    print('writing', flush=True)\n"
        "    return text\n"
        "from meshwright.audit import files\n"
        "baseline_store.json.dumps = slow\n"
        "from contextlib import contextmanager\n"
        "inner = baseline_store.replacing\n"
        "@contextmanager\n"
        "def hanging(path):\n"
        "    with inner(path) as stream:\n"
        "        yield stream\n"
        "        stream.flush()\n"
        "        print('written', flush=True)\n"
        "        time.sleep(60)\n"
        "baseline_store.replacing = hanging\n"
        "from meshwright.reports.cli import cli\n"
        f"cli.main(['baseline', 'save', 'main', {OTHER!r}, '--quiet'])\n"
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        if "written" in process.stdout.readline():
            break
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert path.read_bytes() == before
    assert json.loads(run("baseline", "list", "--format", "json").stdout)[0]["name"] == "main"
    shutil.rmtree(project / ".meshwright")
