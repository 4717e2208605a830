"""Formats without a reader of their own: meshio in a child process with limits, its result taken as hostile."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from meshwright.audit.errors import ReadError, UnsupportedError
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers.foreign import su2_zones
from meshwright.audit.readers.foreign.checks import check_source, stated_counts
from meshwright.audit.readers.foreign.child import REFUSED
from meshwright.audit.readers.foreign.mesh import mesh_of_arrays
from meshwright.audit.readers.source import Source

__all__ = ["read_via_meshio"]

_MEGABYTE = 1 << 20
_CPU_SECONDS, _CPU_SECONDS_PER_MEGABYTE = 3, 3
_WALL_FACTOR, _WALL_SECONDS = 4, 30
_MEMORY, _MEMORY_PER_BYTE = 192 * _MEGABYTE, 48
_MISSING = re.compile(r"(?:ModuleNotFoundError|ImportError): No module named '([A-Za-z0-9_.]+)'")
_STRINGS = re.compile(rb"<DataArray\b[^<>]*\btype=[\"']String[\"'][^<>]*(?:/>|>[^<]*</DataArray\s*>)")
"""Texts in a VTK file, at which meshio's reader ends; `zones` reads those that name zones."""
_IN_PLACE = ("xdmf", "tetgen")
"""Formats spread over several files of one folder; all others are copied, so that they can refer to nothing."""


def read_via_meshio(source: Source, name: str) -> Mesh:
    """Reads with meshio's reader `name`. Raises ReadError whatever happens to it."""
    spans = su2_zones.spans(source) if name == "su2" else []
    if spans:
        return su2_zones.joined([_read(su2_zones.part(source, span), name) for span in spans])
    return _read(source, name)


def _read(source: Source, name: str) -> Mesh:
    notes = check_source(source, name)
    n_points, n_elements = stated_counts(source, name)
    with tempfile.TemporaryDirectory(prefix="meshwright-") as folder:
        path = _file_to_read(source, name, Path(folder))
        result = Path(os.path.realpath(folder)) / "result.npz"
        _run(source, name, path, result, Path(folder))
        head, arrays = _load(source, result)
    mesh = mesh_of_arrays(source, name, head, arrays)
    found = len(mesh.points), mesh.n_cells + mesh.n_boundary
    for what, stated, read in (("points", n_points, found[0]), ("elements", n_elements, found[1])):
        if stated is not None and stated != read:
            raise ReadError(source.path, "", f"{stated} {what}, as the file says", f"{read} that meshio can read")
    return replace(mesh, notes=(*mesh.notes, *notes))


def _file_to_read(source: Source, name: str, folder: Path) -> Path:
    here = Path(source.path)
    if name in _IN_PLACE and here.is_file() and here.stat().st_size == len(source) + source.skipped:
        return Path(os.path.realpath(here.parent)) / here.name
    # Some readers take the variety (.lb8.ugrid) from the name; nothing else of it is used.
    suffixes = "".join(re.findall(r"\.[A-Za-z0-9]{1,8}", Path(source.path).name.lower().removesuffix(".gz"))[-2:])
    inner = folder / "mesh"
    inner.mkdir()
    path = Path(os.path.realpath(inner)) / f"mesh{suffixes}"
    with path.open("wb") as file:
        if name == "vtu":
            end = source.find(b"<AppendedData")
            head = source.data[: len(source) if end < 0 else end]
            file.write(_STRINGS.sub(lambda found: b" " * len(found[0]), head.tobytes()))
            source.data[len(head) :].tofile(file)
        else:
            source.data.tofile(file)
    return path


def _environment() -> dict[str, str]:
    kept = ("PATH", "PYTHONPATH", "PYTHONHOME", "LANG", "LC_ALL", "SYSTEMROOT", "LD_LIBRARY_PATH", "VIRTUAL_ENV")
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    # No filter plug-ins, which are code, and no locks, which need a writable folder.
    hdf5 = {"HDF5_PLUGIN_PATH": "::", "HDF5_USE_FILE_LOCKING": "FALSE"}
    # meshio writes its messages with rich, which folds them at the width of the terminal.
    return {k: os.environ[k] for k in kept if k in os.environ} | threads | hdf5 | {"COLUMNS": "1000", "NO_COLOR": "1"}


def _run(source: Source, name: str, path: Path, result: Path, folder: Path) -> None:
    size = len(source) if name not in _IN_PLACE else sum(f.stat().st_size for f in path.parent.glob(f"{path.stem}*"))
    cpu = _CPU_SECONDS + _CPU_SECONDS_PER_MEGABYTE * size // _MEGABYTE
    memory = _MEMORY + _MEMORY_PER_BYTE * size
    module = "meshwright.audit.readers.foreign.child"
    command = [sys.executable, "-P", "-m", module, str(path), name, str(result), str(cpu), str(memory)]
    log = folder / "log"
    with log.open("wb") as out:
        child = subprocess.Popen(  # noqa: S603 - this program itself, no shell
            command,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            cwd=path.parent,  # some references are resolved from there
            env=_environment(),
            start_new_session=True,
        )
        try:
            status = child.wait(_WALL_SECONDS + _WALL_FACTOR * cpu)
        except subprocess.TimeoutExpired:
            status = -signal.SIGKILL
        finally:
            if child.poll() is None:
                os.killpg(child.pid, signal.SIGKILL)
                child.wait()
    if status:
        raise _failure(source, name, status, log)


def _failure(source: Source, name: str, status: int, log: Path) -> ReadError:
    expected = f"a file that meshio's {name} reader understands"
    if status in (-signal.SIGXCPU, -signal.SIGKILL):
        return ReadError(source.path, "", expected, "one that keeps it busy without end")
    if status < 0:
        return ReadError(source.path, "", expected, f"one that crashes it ({signal.Signals(-status).name})")
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - 4096))
        lines = file.read().decode("utf-8", "replace").strip().splitlines()
    last = lines[-1].strip() if lines else "no message"
    if last.startswith(REFUSED):
        wanted, _, found = last.removeprefix(REFUSED).partition("|")
        return ReadError(source.path, "", wanted, found)
    missing = _MISSING.search(last)
    if missing:
        return UnsupportedError(source.path, "", f"the Python package {missing[1]}, which {name} files need", "none")
    if "MemoryError" in last or "Unable to allocate" in last:
        return ReadError(source.path, "", expected, "one that claims more data than it can hold")
    return ReadError(source.path, "", expected, last)


def _load(source: Source, result: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    try:
        with np.load(result, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        return json.loads(arrays.pop("head").tobytes()), arrays
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise ReadError(source.path, "", "a result from the reading process", str(error)) from error
