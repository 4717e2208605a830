"""Every file of samples/ is read and compared with samples/expected.json, whose values come from elsewhere."""

import gzip
import json
import math
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.findings import run_checks
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers import read

SAMPLES = Path(__file__).parent.parent / "samples"
ENTRIES = json.loads((SAMPLES / "expected.json").read_text())["samples"]
REPEATABLE = ("cells", "defects", "hybrid", "aerofoil")


@pytest.fixture(scope="module")
def meshes() -> dict[str, Mesh]:
    return {}


def opened(meshes: dict[str, Mesh], path: str) -> Mesh:
    """Each file once for all tests of this module."""
    if path not in meshes:
        meshes[path] = read(SAMPLES / path)
    return meshes[path]


def each_sample(entries: list[dict] = ENTRIES) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("entry", entries, ids=[e["path"] for e in entries])


@each_sample()
def test_a_sample_holds_the_points_cells_and_zones_of_the_table(entry: dict, meshes: dict[str, Mesh]) -> None:
    mesh = opened(meshes, entry["path"])
    assert len(mesh.points) == entry["points"]
    assert {kind: count for kind, count in mesh.counts.items() if count} == entry["cells"]
    assert mesh.dimension == entry["dimension"]
    found = {(zone.name, zone.entity, len(zone.members)) for zone in mesh.zones}
    assert {(zone["name"], zone["entity"], zone["count"]) for zone in entry["zones"]} <= found


@each_sample()
def test_a_sample_measures_what_closed_forms_and_vtk_say(entry: dict, meshes: dict[str, Mesh]) -> None:
    mesh = opened(meshes, entry["path"])
    measured = measure(mesh, tuple(entry["values"]), threads=1)
    for metric, by_type in entry["values"].items():
        for kind, wanted in by_type.items():
            values = measured.values[metric][kind]
            if isinstance(wanted, dict):
                for stat, value in wanted.items():
                    assert getattr(np, stat)(values) == pytest.approx(value, rel=1e-9, abs=1e-12)
                continue
            assert len(values) == len(wanted)
            for value, number in zip(values, wanted, strict=True):
                if number is not None:
                    assert value == pytest.approx(float(number), rel=1e-9, abs=1e-9)
    for kind, count in entry.get("over_0_8", {}).items():
        assert int((measured.values["gambit.equiangle_skew"][kind] > 0.8).sum()) == count


@each_sample()
def test_a_sample_shows_its_defects_and_no_others(entry: dict, meshes: dict[str, Mesh]) -> None:
    findings = run_checks(opened(meshes, entry["path"]))
    assert {f.code: f.count for f in findings if f.severity in ("error", "warning")} == entry["findings"]


def test_the_bin_edge_samples_lie_on_the_edges() -> None:
    by_path = {entry["path"]: entry for entry in ENTRIES}
    skew = by_path["defects/skew-bin-edges.msh"]["values"]["gambit.equiangle_skew"]["quad"]
    assert skew[:9] == [k / 10 for k in range(1, 10)]
    ratio = by_path["defects/aspect-bin-edges.msh"]["values"]["gambit.aspect_ratio"]["quad"]
    assert ratio == [10.0 / k for k in range(1, 11)]


def test_integer_rectangles_measure_exactly_the_bin_edges(meshes: dict[str, Mesh]) -> None:
    mesh = opened(meshes, "defects/aspect-bin-edges.msh")
    values = measure(mesh, ("gambit.aspect_ratio",), threads=1).values["gambit.aspect_ratio"]["quad"]
    assert values.tolist() == [10.0 / k for k in range(1, 11)]


def test_the_four_formats_of_the_hybrid_mesh_hold_one_volume(meshes: dict[str, Mesh]) -> None:
    paths = [entry["path"] for entry in ENTRIES if entry["path"].startswith("hybrid/")]
    assert len(paths) == 4
    layers = 0.05 * (1.2**5 - 1) / 0.2
    for path in paths:
        volumes = measure(opened(meshes, path), ("volume",), threads=1).values["volume"]
        assert sum(math.fsum(v) for v in volumes.values()) == pytest.approx(36.0 * (4.0 + layers), rel=1e-12)


def test_the_demo_case_fills_its_box(meshes: dict[str, Mesh]) -> None:
    for path in ("demo.msh.gz", "demo.v41.msh.gz"):
        volumes = measure(opened(meshes, path), ("volume",), threads=1).values["volume"]
        assert sum(math.fsum(v) for v in volumes.values()) == pytest.approx(14.0 * 6.0 * 4.0, rel=1e-9)
        assert min(float(v.min()) for v in volumes.values()) > 0.0


def test_the_table_is_the_one_the_expected_values_make() -> None:
    make = runpy.run_path(str(SAMPLES / "generate" / "readme.py"))["readme"]
    assert (SAMPLES / "README.md").read_text() == make(ENTRIES)


def test_the_collection_is_complete_and_small() -> None:
    listed = {entry["path"] for entry in ENTRIES}
    own = ("generate", "__pycache__", "make.py", "expected.json", "README.md")
    files = [path.relative_to(SAMPLES).parts for path in SAMPLES.rglob("*") if path.is_file()]
    present = {"/".join(parts[:2]) for parts in files if parts[0] not in own}
    assert present == listed
    assert sum(path.stat().st_size for path in SAMPLES.rglob("*") if path.is_file()) < 6_000_000


def test_the_generators_write_the_same_files_again(tmp_path: Path) -> None:
    only = [word for name in REPEATABLE for word in ("--only", name)]
    command = [sys.executable, "-B", str(SAMPLES / "make.py"), "--into", str(tmp_path), *only]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    made = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(made) > 40
    for path in made:
        assert unpacked(path) == unpacked(SAMPLES / path.relative_to(tmp_path)), path.relative_to(tmp_path)


def unpacked(path: Path) -> bytes:
    """The bytes inside: two versions of zlib may pack the same bytes differently."""
    data = path.read_bytes()
    return gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
