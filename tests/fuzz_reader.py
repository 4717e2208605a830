"""Adapter between our readers and the tools that damage files and judge what comes back.

As a module it gives one function per reader, from a path to a summary, for processes that fork after `warm`; as a
command, `fuzz_reader.py READER FILE` prints the summary as a line of JSON, or {"error": ...} with exit status 3.
A file of an OpenFOAM mesh is read within its polyMesh, the other files of which stand in a folder `bases`.
"""

import contextlib
import hashlib
import json
import re
import sys
import tempfile
import warnings
from pathlib import Path

import foam_writer
import numpy as np

from meshwright.audit.errors import ReadError
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers import guess_format, read
from meshwright.audit.run import audit
from meshwright.audit.summary import summarise

_ROLE = re.compile(r"([a-z0-9]+)_(" + "|".join(foam_writer.FILES) + r")(__\d+_\w+)?")


def _outside(values, low, high):
    values = np.asarray(values)
    return int(np.count_nonzero((values < low) | (values >= high)))


def summary(mesh: Mesh):
    """What the judge compares: counts, indices that point nowhere, a digest of everything the mesh holds."""
    digest = hashlib.sha256(np.ascontiguousarray(mesh.points).tobytes())
    n, cells = len(mesh.points), mesh.n_cells
    n_faces = mesh.n_boundary if mesh.faces is None else len(mesh.faces)
    bad = 0
    for block in (*mesh.blocks, *mesh.boundary):
        items = block.nodes if block.items is None else block.items
        bad += _outside(items, 0, n_faces if block.type == "polyhedron" else n)
        offsets = [] if block.offsets is None else block.offsets.tolist()
        digest.update(repr((block.type, block.rows.tolist(), items.tolist(), offsets)).encode())
    if mesh.faces is not None:
        faces = mesh.faces
        bad += _outside(faces.nodes, 0, n) + _outside(faces.owner, 0, cells) + _outside(faces.neighbour, -1, cells)
        for array in (faces.offsets, faces.nodes, faces.owner, faces.neighbour):
            digest.update(array.astype(np.int64).tobytes())
    ends = {"cell": cells, "face": n_faces, "point": n}
    for zone in mesh.zones:
        bad += _outside(zone.members, 0, ends[zone.entity])
        digest.update(repr((zone.name, zone.kind, zone.role, zone.entity, zone.members.tolist())).encode())
    return {
        "npts": n,
        "ncells": cells,
        "bad_ids": bad,
        "nonfinite": int(np.count_nonzero(~np.isfinite(mesh.points))),
        "digest": digest.hexdigest(),
        "vals": [repr(float(value)) for value in np.unique(mesh.points)[:400]],
    }


def _result(path, format_name):
    """The summary of a mesh that could be read and audited, or the refusal; a refusal out of form is no refusal."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with contextlib.suppress(ReadError):
            guess_format(path)  # the reader itself must hold, whether the file is recognised or not
        try:
            mesh = read(path, format=format_name)
        except ReadError as error:
            text = str(error)
            told = str(path) in text and "\n" not in text and ": expected " in text and error.found
            return {"exc": type(error).__name__, "msg": text, "deliberate": bool(told)}
        found = summary(mesh)
        summarise(audit(mesh, threads=1))
        return found


def fluent(path):
    return _result(path, "fluent")


def gmsh(path):
    return _result(path, "gmsh")


def openfoam(path):
    """`path` is named <variant>_<role>, with more behind it when it is damaged."""
    variant, role, _ = _ROLE.fullmatch(Path(path).name).groups()
    bases = next(parent / "bases" for parent in Path(path).absolute().parents if (parent / "bases").is_dir())
    with tempfile.TemporaryDirectory() as scratch:
        return _result(
            foam_writer.place(path, role, bases / variant / "polyMesh", Path(scratch) / "polyMesh"), "openfoam"
        )


READERS = {function.__name__: function for function in (fluent, gmsh, openfoam)}


def warm(name):
    """Compile what the readers need before anyone forks: sound files, and some damaged ones for the slow paths."""
    from fuzz_bases import more_cases, write_bases
    from malform import cases

    with tempfile.TemporaryDirectory() as folder:
        bases = write_bases(name, Path(folder) / "bases")
        if name == "openfoam":  # each file is read together with its whole mesh, so one of a variant is enough
            bases = [base for base in bases if base.name.startswith("ascii_") or base.name.endswith("_faces")]
        for base in bases:
            READERS[name](base)
            damaged = Path(folder) / base.name
            some = [content for *_, content in cases(base, 1, 3, 3, 3, 1)][::3]
            for content in (*some, *(content for *_, content in more_cases(base, 1, 4))):
                damaged.write_bytes(content)
                READERS[name](damaged)
            if "curved" in base.name:  # a node far away folds a curved cell, which its own kernels prove
                parts = base.read_bytes().split(b"0.0000000")
                for k in range(1, len(parts)):
                    damaged.write_bytes(b"0.0000000".join(parts[:k]) + b"1.5D2" + b"0.0000000".join(parts[k:]))
                    READERS[name](damaged)


def main():
    name, path = sys.argv[1:]
    found = READERS[name](path)
    if "exc" in found:
        print(json.dumps({"error": found["exc"], "message": found["msg"]}))
        raise SystemExit(3 if found["deliberate"] else 1)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
