"""Runs one meshio reader in a process of its own and writes what it found as plain arrays.

`python -P -m meshwright.audit.readers.foreign.child FILE FORMAT RESULT CPU_SECONDS BYTES`

Everything that can go wrong here (an endless loop, a gigantic allocation, `sys.exit` inside the library, a
crash) ends this process and nothing else. What meshio raises is left to end it: its last line is the message.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

__all__ = ["REFUSED", "main"]

REFUSED = "refused: "
"""Begins the last line when this module, not meshio, turns the file down: `refused: expected|found`."""

_FILE_BYTES = 64 << 20
_HDF5 = b"\x89HDF"
_HDF5_LEVELS = 32


def _refuse(expected: str, found: str) -> SystemExit:
    return SystemExit(f"{REFUSED}{expected}|{found}")


def _cap(which: int, value: int) -> None:
    """Lowers a limit to `value`; what a caller has set lower stays."""
    _soft, hard = resource.getrlimit(which)
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(which, (value, value))


def _limit(cpu_seconds: int, n_bytes: int) -> None:
    """Caps what this process may use beyond what it took to get here."""
    statm = Path("/proc/self/statm")
    if statm.exists():
        _cap(resource.RLIMIT_AS, int(statm.read_text().split()[0]) * resource.getpagesize() + n_bytes)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    _cap(resource.RLIMIT_CPU, int(usage.ru_utime + usage.ru_stime) + 1 + cpu_seconds)
    _cap(resource.RLIMIT_FSIZE, _FILE_BYTES + n_bytes)
    _cap(resource.RLIMIT_CORE, 0)


def _fence(folder: Path, result: Path) -> None:
    """From now on no file may be opened outside `folder`, except `result` and Python's own."""
    own = {sysconfig.get_paths()[name] for name in ("stdlib", "platstdlib", "purelib", "platlib")}
    own |= {entry for entry in sys.path if entry}
    allowed = [os.path.realpath(entry) for entry in (str(folder), *own)]

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if event != "open" or isinstance(arguments[0], int):
            return
        path = os.path.realpath(os.fsdecode(arguments[0]))
        if path == str(result) or any(path == root or path.startswith(root + os.sep) for root in allowed):
            return
        raise _refuse("a mesh that refers to no file outside its own folder", f"a reference to {path}")

    sys.addaudithook(watch)


def _hdf5_items(group: Any, level: int = 0) -> Iterator[Any]:
    import h5py  # noqa: PLC0415 - only HDF5 files need it

    if level > _HDF5_LEVELS:
        raise _refuse(f"groups nested at most {_HDF5_LEVELS} deep", "deeper ones")
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise _refuse("data inside the file itself", f"a link to {link.filename}")
        if isinstance(link, h5py.HardLink):
            item = group[name]
            if isinstance(item, h5py.Group):
                yield from _hdf5_items(item, level + 1)
            else:
                yield item


def _check_hdf5(path: Path) -> None:
    import h5py  # noqa: PLC0415 - only HDF5 files need it

    with h5py.File(path, "r") as file:
        for item in _hdf5_items(file):
            if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
                raise _refuse("data inside the file itself", f"the data set {item.name} stored in another file")


def _check_xml(path: Path, kind: str) -> None:
    """Refuses document type definitions and, in XDMF, references that leave the folder of the file."""
    text = path.read_bytes()
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise _refuse("XML without a document type definition", "<!DOCTYPE or <!ENTITY")
    if text[:256].lstrip()[:1] != b"<":
        raise _refuse("XML in ASCII or UTF-8", repr(text[:8]))
    if kind != "xdmf":
        return
    for item in ET.parse(path).iter():  # noqa: S314 - without a DTD nothing expands, and this process is capped
        tag = item.tag.rsplit("}", 1)[-1] if isinstance(item.tag, str) else ""
        if tag == "include" and item.get("href"):
            raise _refuse("one XML file", "an xi:include")
        if tag == "DataItem" and item.get("Format", "XML").upper() != "XML":
            _check_reference(path, (item.text or "").strip(), hdf5=item.get("Format", "").upper() == "HDF")


def _check_reference(path: Path, text: str, *, hdf5: bool) -> None:
    name = text.split(":", 1)[0] if hdf5 else text
    target = path.parent / name
    inside = Path(os.path.realpath(target)).parent == Path(os.path.realpath(path.parent))
    if not name or Path(name).name != name or not inside or not target.is_file():
        raise _refuse("data in a file of the same folder", repr(name))
    if hdf5:
        _check_hdf5(target)


def _arrays_of(mesh: Any) -> dict[str, np.ndarray]:
    """What of a meshio mesh is kept, as arrays that need no pickle; "head" is JSON."""
    arrays: dict[str, np.ndarray] = {"points": np.asarray(mesh.points)}
    head: dict[str, Any] = {"cells": [], "cell_data": [], "cell_sets": [], "point_sets": [], "point_data": []}
    for i, block in enumerate(mesh.cells):
        head["cells"].append(block.type)
        if block.type.startswith("polyhedron"):
            faces = [np.asarray(face) for cell in block.data for face in cell]
            arrays[f"cells{i}_faces"] = np.array([len(cell) for cell in block.data], dtype=np.int64)
            arrays[f"cells{i}_sizes"] = np.array([len(face) for face in faces], dtype=np.int64)
            arrays[f"cells{i}"] = np.concatenate(faces) if faces else np.empty(0, np.int64)
        else:
            arrays[f"cells{i}"] = np.asarray(block.data)
    for name, per_block in mesh.cell_data.items():
        values = [np.asarray(block) for block in per_block]
        if len(values) == len(mesh.cells) and all(v.ndim == 1 and v.dtype.kind in "iu" for v in values):
            arrays[f"cell_data{len(head['cell_data'])}"] = np.concatenate(values) if values else np.empty(0, np.int64)
            head["cell_data"].append(name)
    for name, data in mesh.point_data.items():
        numbers = np.asarray(data)
        if numbers.ndim == 1 and numbers.dtype.kind in "iu":
            arrays[f"point_data{len(head['point_data'])}"] = numbers
            head["point_data"].append(name)
    starts = np.concatenate(([0], np.cumsum([len(block.data) for block in mesh.cells], dtype=np.int64)))
    for name, per_block in mesh.cell_sets.items():
        rows = [np.asarray(r, dtype=np.int64) + s for r, s in zip(per_block, starts, strict=False) if r is not None]
        arrays[f"cell_set{len(head['cell_sets'])}"] = np.concatenate(rows) if rows else np.empty(0, np.int64)
        head["cell_sets"].append(str(name))
    for name, rows in mesh.point_sets.items():
        arrays[f"point_set{len(head['point_sets'])}"] = np.asarray(rows, dtype=np.int64).ravel()
        head["point_sets"].append(str(name))
    for kind in ("cell_tags", "point_tags"):
        families = getattr(mesh, kind, None) or {}
        head[kind] = {str(int(number)): [str(name) for name in names] for number, names in families.items()}
    for name, array in arrays.items():
        if array.dtype.kind not in "iuf":
            raise _refuse("numbers", f"{name} of type {array.dtype}")
    arrays["head"] = np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)
    return arrays


def main(arguments: list[str]) -> None:
    """Reads a file with one of meshio's readers and writes the arrays; ends the process with a message otherwise."""
    path, result = Path(arguments[0]), Path(arguments[2])
    import meshio  # noqa: PLC0415 - the limits count from after this import

    with path.open("rb") as file:
        start = file.read(64)
    if start.startswith(_HDF5) or arguments[1] == "xdmf":
        import h5py  # noqa: F401, PLC0415 - so that its memory is not counted as the file's
    _limit(int(arguments[3]), int(arguments[4]))
    _fence(path.parent, result)
    if start.startswith(_HDF5):
        _check_hdf5(path)
    elif start.lstrip().startswith(b"<"):
        _check_xml(path, arguments[1])
    np.savez(result, allow_pickle=False, **_arrays_of(meshio.read(path, arguments[1])))


if __name__ == "__main__":
    main(sys.argv[1:])
