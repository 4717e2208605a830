"""The shipped bundle of the 3-D view is what its source makes."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
VIEWER = ROOT / "reports" / "html" / "viewer"
BUNDLE = ROOT / "reports" / "html" / "static" / "viewer.js"


def test_the_bundle_names_its_licence_and_ends_no_script():
    text = BUNDLE.read_text(encoding="utf-8")
    assert text.startswith("/*! three.js 0.187.0\n")
    assert "MIT" in text[:2000]


def test_no_lock_file_names_a_registry():
    for lock in (VIEWER / "package-lock.json", ROOT / "tests" / "schemas" / "package-lock.json"):
        assert "resolved" not in lock.read_text()
        assert "://registry" not in lock.read_text()


def test_the_source_makes_the_bundle(tmp_path):
    if shutil.which("npm") is None:
        pytest.skip("no node here")
    copy = tmp_path / "html" / "viewer"
    shutil.copytree(VIEWER, copy, ignore=shutil.ignore_patterns("node_modules"))
    (tmp_path / "html" / "static").mkdir()
    install = subprocess.run(
        ["npm", "ci", "--no-audit", "--no-fund", "--silent"], cwd=copy, capture_output=True, text=True
    )
    if install.returncode:
        pytest.skip("npm cannot install here")
    subprocess.run(["node", "build.mjs"], cwd=copy, check=True, capture_output=True)
    assert (tmp_path / "html" / "static" / "viewer.js").read_bytes() == BUNDLE.read_bytes()
