"""Fixtures shared by all tests."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real meshes and reference values that lives beside a development checkout."""
    folder = Path(os.environ.get("MESHWRIGHT_SHARED") or Path(__file__).parent.parent.parent / "shared")
    if not (folder / "meshes" / "INDEX.tsv").is_file():
        pytest.skip(f"no reference meshes at {folder.name}: set MESHWRIGHT_SHARED to their folder")
    return folder
