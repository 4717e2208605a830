"""What the documents say is so."""

import importlib.util
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.findings import CHECKS
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.audit.metrics import METRICS
from meshwright.audit.profiles import PROFILES

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_the_readme_names_every_check_and_no_other():
    table = README[README.index("| about | codes |") : README.index("## Formats")]
    assert sorted(re.findall(r"`([a-z-]+)`", table)) == sorted(CHECKS)


def test_the_readme_counts_the_metrics_and_names_the_profiles():
    assert f"measures {len(METRICS)} quality parameters" in README
    listed = re.search(r"meshwright profiles +# (.*) \.\.\.", README)
    assert set(listed[1].split()) <= set(PROFILES)


def test_the_example_of_a_new_metric_takes_twenty_lines_and_measures(tmp_path):
    code = re.search(r"```python\n(.*?)```", CONTRIBUTING, re.DOTALL)[1]
    assert len([line for line in code.splitlines() if line.strip()]) <= 20
    file = tmp_path / "spread.py"
    file.write_text(code)
    spec = importlib.util.spec_from_file_location("spread", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    box = np.array([(x, y, z) for z in (0, 4) for x, y in ((0, 0), (1, 0), (1, 2), (0, 2))], dtype=float)
    mesh = Mesh(box, (CellBlock("hex", [0], [np.arange(8)]),))
    assert measure(mesh, module.ROWS).values["ours.edge_spread"]["hex"].tolist() == [3.0]


PLOTS = (ROOT / "docs" / "plots.md").read_text(encoding="utf-8")


def test_every_command_of_the_page_about_pictures_draws_one(tmp_path, monkeypatch):
    from meshwright.reports.cli import cli

    demo = ROOT / "samples" / "demo.msh.gz"
    monkeypatch.chdir(tmp_path)
    commands = re.findall(r"`meshwright (plot [^`]*)`", PLOTS)
    assert len(commands) == 9
    with pytest.raises(SystemExit):
        cli.main(["audit", str(demo), "--format", "json", "-o", "old.json", "--quiet"])
    shutil.copy("old.json", "last-month.json")
    for command in commands:
        words = shlex.split(command)
        words[1] = words[1] if words[1].endswith(".json") else str(demo)
        with pytest.raises(SystemExit) as stop:
            cli.main([*words, "--quiet"])
        assert stop.value.code == 0, command
        assert (tmp_path / words[words.index("-o") + 1]).stat().st_size > 1000


def test_the_examples_of_the_page_about_pictures_run(tmp_path, monkeypatch):
    import matplotlib.pyplot as plt

    plt.switch_backend("Agg")
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "samples" / "cells" / "tet.msh", "wing.msh")
    names = {}
    for code in re.findall(r"```python\n(.*?)```", PLOTS, re.DOTALL):
        exec(code.replace("[17, 42]", "[0]"), names)  # noqa: S102 - our own page
    assert (tmp_path / "cells.png").read_bytes().startswith(b"\x89PNG")
    plt.close("all")
