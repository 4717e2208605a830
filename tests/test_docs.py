"""What the documents say is so."""

import importlib.util
import re
from pathlib import Path

import numpy as np

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
