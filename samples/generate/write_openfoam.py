"""OpenFOAM cases: constant/polyMesh in ASCII and the least system folder that checkMesh accepts."""

from __future__ import annotations

import gzip
from collections.abc import Iterable
from pathlib import Path

from generate.grid import Polymesh

__all__ = ["write_openfoam"]

_PATCH = {"wall": "wall", "inlet": "patch", "outlet": "patch", "symmetry": "symmetryPlane", "empty": "empty"}

_CONTROL = """application     checkMesh;
startFrom       startTime;
startTime       0;
stopAt          endTime;
endTime         1;
deltaT          1;
writeControl    timeStep;
writeInterval   1;
"""
_SCHEMES = "gradSchemes {}\ndivSchemes {}\nlaplacianSchemes {}\n"


def _header(kind: str, location: str, name: str, note: str = "") -> str:
    remark = f'    note        "{note}";\n' if note else ""
    return (
        f"FoamFile\n{{\n    version     2.0;\n    format      ascii;\n    class       {kind};\n{remark}"
        f'    location    "{location}";\n    object      {name};\n}}\n\n'
    )


def _list(rows: Iterable[str]) -> str:
    lines = list(rows)
    return "\n".join([str(len(lines)), "(", *lines, ")", ""])


def _save(path: Path, text: str, packed: bool) -> None:
    if packed:
        path.with_suffix(".gz").write_bytes(gzip.compress(text.encode(), 9, mtime=0))
    else:
        path.write_text(text)


def write_openfoam(case: Path, mesh: Polymesh) -> None:
    """Write the case folder. Interior faces come first, in upper-triangular order, then the patches. The lists of a
    mesh of more than 2000 faces are gzipped one by one, as OpenFOAM itself does with writeCompression on."""
    folder = case / "constant" / "polyMesh"
    folder.mkdir(parents=True, exist_ok=True)
    where = "constant/polyMesh"
    inside = int((mesh.neighbour >= 0).sum())
    counts = f"nPoints:{len(mesh.points)} nCells:{mesh.n_cells} nFaces:{len(mesh.faces)} nInternalFaces:{inside}"
    points = _list("(" + " ".join(f"{x + 0.0!r}".removesuffix(".0") for x in p) + ")" for p in mesh.points.tolist())
    faces = _list(f"{len(f)}({' '.join(map(str, f))})" for f in mesh.faces)
    lists = {
        "points": _header("vectorField", where, "points") + points,
        "faces": _header("faceList", where, "faces") + faces,
        "owner": _header("labelList", where, "owner", counts) + _list(map(str, mesh.owner)),
        "neighbour": _header("labelList", where, "neighbour", counts) + _list(map(str, mesh.neighbour[:inside])),
    }
    for name, text in lists.items():
        _save(folder / name, text, packed=len(mesh.faces) > 2000)
    patches = [
        f"    {name}\n    {{\n        type            {_PATCH[role]};\n        nFaces          {len(rows)};\n"
        f"        startFace       {int(rows[0])};\n    }}"
        for name, role, rows in mesh.patches
    ]
    (folder / "boundary").write_text(_header("polyBoundaryMesh", where, "boundary") + _list(patches))
    if len(mesh.cell_zones) > 1:
        zones = [
            f"{name}\n{{\n    type cellZone;\n    cellLabels List<label>\n{_list(map(str, rows))};\n}}"
            for name, _, rows in mesh.cell_zones
        ]
        (folder / "cellZones").write_text(_header("regIOobject", where, "cellZones") + _list(zones))
    system = case / "system"
    system.mkdir(exist_ok=True)
    (system / "controlDict").write_text(_header("dictionary", "system", "controlDict") + _CONTROL)
    (system / "fvSchemes").write_text(_header("dictionary", "system", "fvSchemes") + _SCHEMES)
    (system / "fvSolution").write_text(_header("dictionary", "system", "fvSolution"))
