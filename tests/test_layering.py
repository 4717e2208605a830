"""Who may import whom, read off the sources."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = [name for name in ("audit", "repair", "reports") if (ROOT / name).is_dir()]
ALLOWED = {"audit": {"audit"}, "repair": {"audit", "repair"}, "reports": {"audit", "repair", "reports"}}
LAYERS = ("errors", "cells", "mesh", "connectivity", "metrics", "tables")
"""Inside audit: a module may import from its own layer and the ones before it."""


def imports(path):
    """Full names of the project's modules that a file imports, under TYPE_CHECKING and in functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = [node.module]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        yield from (name for name in names if name.split(".")[0] == "meshwright")


def sources(package):
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_imports_only_the_packages_below_it(package):
    found = {(path.name, name) for path in sources(package) for name in imports(path)}
    assert found or package != "reports"
    strays = {(file, name) for file, name in found if name.split(".")[1] not in ALLOWED[package]}
    assert strays == set()


@pytest.mark.parametrize("package", PACKAGES)
def test_no_file_imports_a_top_level_folder_by_its_bare_name(package):
    for path in sources(package):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert not {name.split(".")[0] for name in names} & set(ALLOWED), path


def reachable(module):
    """Layers of audit reached from a module of audit, however long the way."""
    seen, todo = set(), [module]
    while todo:
        here = todo.pop()
        if here in seen:
            continue
        seen.add(here)
        path = ROOT / "audit" / Path(*here.split("."))
        files = sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]
        for file in files:
            todo += [name.removeprefix("meshwright.audit.") for name in imports(file) if name != "meshwright.audit"]
    return {name.split(".")[0] for name in seen}


@pytest.mark.parametrize("rank", range(len(LAYERS)))
def test_the_layers_of_audit_reach_only_downwards(rank):
    above = set(LAYERS[rank + 1 :])
    assert reachable(LAYERS[rank]) & above == set()


def test_reading_and_measuring_know_nothing_of_summaries():
    assert reachable("readers") & {"tables", "run", "summary", "findings", "metrics"} == set()
    assert reachable("findings") & {"tables", "run", "summary", "readers"} == set()
