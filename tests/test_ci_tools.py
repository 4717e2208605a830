"""The GitHub Action, the pre-commit hook and the pytest plugin, run for real as far as a machine alone can."""

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parent.parent
DEMO = ROOT / "samples" / "demo.msh.gz"
GOOD = ROOT / "samples" / "demo.v41.msh.gz"
LEFT_HANDED = ROOT / "samples" / "defects" / "left-handed.fluent.msh"
SCRIPTS = sysconfig.get_path("scripts")

pytest_plugins = ["pytester"]


def checked(kind, path):
    """Validate a file against a schema that check-jsonschema ships."""
    pytest.importorskip("check_jsonschema", reason="check-jsonschema is not installed")
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", kind, str(path)]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_action_is_what_github_expects():
    checked("vendor.github-actions", ROOT / "action.yml")


def test_no_input_of_the_action_is_part_of_a_script():
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    for step in action["runs"]["steps"]:
        assert "${{" not in step.get("run", "")


def run_action(folder, **inputs):
    """The script of the action with the environment that GitHub makes of its inputs; (status, outputs, what it said)."""
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    (step,) = [s for s in action["runs"]["steps"] if s.get("id") == "audit"]
    env = {**os.environ, "PATH": f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}", "GITHUB_OUTPUT": str(folder / "output"),
           "GITHUB_STEP_SUMMARY": str(folder / "summary.md"), "GITHUB_WORKSPACE": str(folder)}  # fmt: skip
    for name, spec in action["inputs"].items():
        env[f"MW_{name.upper().replace('-', '_')}"] = str(inputs.get(name.replace("-", "_"), spec.get("default", "")))
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
    result = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True)
    output = folder / "output"
    lines = output.read_text().splitlines() if output.exists() else []
    return result.returncode, dict(line.split("=", 1) for line in lines), result.stdout + result.stderr


def test_the_action_passes_a_good_mesh_and_leaves_its_files(tmp_path):
    status, outputs, said = run_action(tmp_path, path=str(GOOD), html="report.html")
    assert (status, outputs["verdict"]) == (0, "pass"), said
    assert json.loads((tmp_path / "meshwright.sarif").read_text())["version"] == "2.1.0"
    assert "<!doctype html>" in (tmp_path / "report.html").read_text()
    assert "pass" in (tmp_path / "summary.md").read_text()


def test_the_action_fails_a_bad_mesh_with_annotations(tmp_path):
    status, outputs, said = run_action(tmp_path, path=f"{GOOD}\n{LEFT_HANDED}\n")
    assert (status, outputs["verdict"]) == (1, "fail")
    assert "::error file=" in said


def test_the_action_says_incomplete_of_what_it_cannot_read(tmp_path):
    (tmp_path / "x.msh").write_text("nothing")
    status, outputs, said = run_action(tmp_path, path="x.msh")
    assert (status, outputs["verdict"]) == (3, "incomplete")
    assert "::error file=x.msh" in said


def test_nothing_in_an_input_of_the_action_is_run(tmp_path):
    run_action(
        tmp_path, path="$(touch hacked)\n`touch hacked`\n; touch hacked", gate="$(touch hacked)", args="; touch hacked"
    )
    assert not (tmp_path / "hacked").exists()


def test_the_hook_is_what_pre_commit_expects():
    load_manifest = pytest.importorskip("pre_commit.clientlib", reason="pre-commit is not installed").load_manifest
    (hook,) = load_manifest(str(ROOT / ".pre-commit-hooks.yaml"))
    assert hook["id"] == "meshwright-audit"


def test_the_entry_of_the_hook_takes_the_names_of_changed_files():
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    command = [str(Path(SCRIPTS) / hook["entry"].split()[0]), *hook["entry"].split()[1:]]
    assert subprocess.run([*command, str(GOOD), str(DEMO)], capture_output=True).returncode == 0
    assert subprocess.run([*command, str(GOOD), str(LEFT_HANDED)], capture_output=True).returncode == 1


# ----------------------------------------------------------------------------------------------------------- the plugin


def in_process(pytester, text):
    pytester.makepyfile(text)
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", "-q", "-rf")


def test_a_mesh_that_passes_its_gate_passes_its_test(pytester):
    result = in_process(
        pytester,
        f"def test_it(mesh_audit):\n    r = mesh_audit({str(DEMO)!r}).assert_gate('cfd')\n    assert r.verdict == 'warn'\n    assert r.rules",
    )
    result.assert_outcomes(passed=1)


def test_a_mesh_that_fails_its_gate_fails_its_test_with_a_line_a_rule(pytester):
    pytester.makefile(
        ".toml", meshgate='[[rule]]\nid = "skew"\nmetric = "gambit.equiangle_skew"\nstat = "max"\nle = 0.5\n'
    )
    result = in_process(
        pytester, f"def test_it(mesh_audit):\n    mesh_audit({str(DEMO)!r}).assert_gate('meshgate.toml')\n"
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["*demo.msh.gz: fail*", "*fail*gate.skew: Equi-angle skew on all is 0.899, limit*worst: cell 18912*"]
    )


def test_a_gate_that_cannot_be_judged_is_no_pass(pytester):
    pytester.makefile(".toml", meshgate='[[rule]]\nid = "a"\nmetric = "volume"\nstat = "max"\nno_worse = true\n')
    result = in_process(
        pytester, f"def test_it(mesh_audit):\n    mesh_audit({str(DEMO)!r}).assert_gate('meshgate.toml')\n"
    )
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*incomplete*there is no baseline*"])


def test_rules_can_be_tests_of_their_own(pytester):
    result = in_process(
        pytester,
        "import pytest\nfrom meshwright.reports.pytest_plugin import mesh_rules\n"
        f"@pytest.mark.parametrize('rule', mesh_rules({str(DEMO)!r}, 'gambit'))\n"
        "def test_rule(rule):\n    assert rule['state'] in ('pass', 'warn', 'fail')\n",
    )
    assert result.parseoutcomes()["passed"] == 3


def test_the_plugin_loads_nothing_until_it_is_asked(pytester):
    result = in_process(
        pytester,
        "import sys\ndef test_it():\n    assert 'numba' not in sys.modules\n    assert 'numpy' not in sys.modules",
    )
    result.assert_outcomes(passed=1)
