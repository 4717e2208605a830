"""Damaged files by the thousand: every one is refused in a typed error or read as it stands, within limits.

The tools that damage files and judge the outcomes are shared with other projects and know nothing of our readers. Each
case runs in a process of its own under limits of time and memory, and every mesh that comes back is also audited.
A few hundred cases run always, the rest with `pytest -m fuzz`.
"""

import collections
import json
import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
_BASES = runpy.run_path(str(HERE / "fuzz_bases.py"))
more_cases, write_bases = _BASES["more_cases"], _BASES["write_bases"]
cut_between_names = _BASES["ends_between_names"]
READERS = ("fluent", "gmsh", "openfoam")
SEEDS = (0, 1, 2)
LEAST_CASES = 600
"""Of one reader and seed: together more than 5,000."""

FAILURES = {
    "silent": "a wrong mesh came back without a word",
    "logged": "a wrong mesh came back with a word in the log",
    "invalid": "indices out of range or numbers that are not finite came back",
    "odd": "an accidental exception, or an error that does not say where, what was expected and what was found",
    "crash": "the process died",
    "hang": "too slow",
    "mem": "too much memory",
}
FEW = ("--trunc", "4", "--flip", "3", "--over", "2", "--ids", "1")
MANY = ("--trunc", "16", "--flip", "16", "--over", "16", "--ids", "6")
LIMITS = ("--wall", "12", "--cpu", "9", "--mem", "1024", "--rss", "96")

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="each case is read in a fork")


@pytest.fixture
def tools(shared):
    folder = shared / "tools"
    if not all((folder / name).is_file() for name in ("malform.py", "run_cases.py")):
        pytest.skip(f"no tools that damage files in {folder}")
    return folder


def run(tool, *args, seconds):
    search = os.pathsep.join([str(HERE), str(tool.parent), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, tool, *map(str, args)],
        env={**os.environ, "PYTHONPATH": search, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def rows_of(file):
    return [json.loads(line) for line in file.read_text().splitlines()]


def prepare(manifest, bases, seed, n, only_bytes):
    """Complete the list of cases: more damage by the grammar, and what nobody can tell is not held against us.

    only_bytes: for files that have a node 120, and perhaps coordinates that look like node numbers.
    """
    rows = [row for row in rows_of(manifest) if not (only_bytes and row["kind"] in ("id", "coord"))]
    for row in rows:
        if row["kind"] == "trunc" and cut_between_names(Path(row["base"]).read_bytes(), Path(row["file"]).read_bytes()):
            row["expect"] = "nomark"
    for base in bases:
        stem, _, suffix = base.name.partition(".")
        for i, (kind, expect, note, content) in enumerate(more_cases(base, seed, n), 900):
            file = manifest.parent / stem / f"{stem}__{i}_{kind}{suffix and '.' + suffix}"
            file.write_bytes(content)
            rows.append(dict(id=f"{stem}/{i}", file=str(file), base=str(base), kind=kind, expect=expect, note=note))
    manifest.write_text("".join(json.dumps(row) + "\n" for row in rows))


def verdicts(tools, reader, bases, folder, seed, how, more, *, only_bytes=False, seconds=1500):
    """Count of each verdict over all cases. Fails on a base that cannot be read and on every verdict of `FAILURES`."""
    run(tools / "malform.py", *bases, "--out", folder / "cases", "--seed", seed, *how, seconds=300)
    manifest = folder / "cases" / "manifest.jsonl"
    prepare(manifest, bases, seed, more, only_bytes)
    results = folder / "results.jsonl"
    options = ("--reader", reader, "--module", "fuzz_reader", "--out", results, *LIMITS)
    print(run(tools / "run_cases.py", manifest, *options, seconds=seconds))
    rows = rows_of(results)
    assert [row for row in rows if "unreadable" in row] == []
    failed = [
        f"{row['id']} {row['kind']} ({row['note']}): {FAILURES[row['verdict']]}; {row['why']} {row['msg']} {row['at']}"
        for row in rows
        if row["verdict"] in FAILURES
    ]
    assert not failed, "\n".join([f"{len(failed)} of {len(rows)} cases", *failed[:40]])
    counts = collections.Counter(row["verdict"] for row in rows)
    assert counts["clean"] > len(rows) // 3  # the damage was felt
    assert counts["same"] > 0
    shutil.rmtree(folder / "cases")  # hundreds of megabytes that only a failure would need
    return counts


FIRST = {
    "fluent": ("solid.msh", "solid8.msh", "flat.msh"),
    "gmsh": ("text22.msh", "text41.msh", "little22.msh", "little41.msh"),
    "openfoam": ("ascii_faces", "ascii_boundary", "binary_points", "binary_faces", "binary_owner", "ascii_cellZones"),
}


@pytest.mark.parametrize("reader", READERS)
def test_no_damage_to_a_few_files_is_read_as_a_sound_mesh(reader, tools, tmp_path):
    bases = [base for base in write_bases(reader, tmp_path / "bases") if base.name in FIRST[reader]]
    assert len(bases) == len(FIRST[reader])
    counts = verdicts(tools, reader, bases, tmp_path, 0, FEW, 6, seconds=300)
    assert counts.total() >= 150


@pytest.mark.fuzz
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("reader", READERS)
def test_no_damage_to_any_dialect_is_read_as_a_sound_mesh(reader, seed, tools, tmp_path):
    bases = write_bases(reader, tmp_path / "bases")
    assert verdicts(tools, reader, bases, tmp_path, seed, MANY, 40).total() >= LEAST_CASES


@pytest.mark.fuzz
@pytest.mark.parametrize(("reader", "folder"), [("fluent", "fluent_legacy"), ("gmsh", "gmsh")])
def test_no_damage_to_the_bytes_of_a_real_file_is_read_as_a_sound_mesh(reader, folder, tools, shared, tmp_path):
    small = sorted(file for file in (shared / "meshes" / folder).iterdir() if file.stat().st_size < 45_000)
    assert len({file.name.partition(".")[0] for file in small}) >= 5
    verdicts(tools, reader, small, tmp_path, 0, MANY, 0, only_bytes=True)


@pytest.mark.parametrize("reader", READERS)
def test_the_adapter_is_a_command_too(reader, tmp_path):
    base = write_bases(reader, tmp_path / "bases")[0]
    cut = tmp_path / f"{base.stem}__0_cut{base.suffix}"
    cut.write_bytes(base.read_bytes()[:200])
    done = {}
    for path in (base, cut):
        command = [sys.executable, HERE / "fuzz_reader.py", reader, path]
        done[path] = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done[base].returncode == 0, done[base].stderr
    assert json.loads(done[base].stdout)["ncells"] >= 4
    assert (done[cut].returncode, json.loads(done[cut].stdout)["error"]) == (3, "ReadError")
