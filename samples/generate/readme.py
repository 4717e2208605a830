"""README.md of the collection, from the entries of expected.json."""

from __future__ import annotations

from typing import Any

__all__ = ["readme"]

_HEAD = """# Sample meshes

Small meshes with known contents and known defects. All are made by the scripts in `generate/`; nothing here was copied
from elsewhere. `expected.json` holds this table for machines, with every value; `tests/test_samples.py` reads each file
and compares.

To make them again: `make samples` (numpy, gmsh and vtk; `python samples/make.py --only cells` for one set). All but the
sets `circle` and `demo` come out the same to the last digit; those two depend on the version of Gmsh.

The names say the format: `.fluent.msh` Fluent, `.v41.msh` Gmsh 4.1, any other `.msh` Gmsh 2.2 (but `demo.msh.gz` is
Fluent), `-openfoam` an OpenFOAM case.

Skew is GAMBIT's equi-angle skew, 0 best; the number is the worst cell of that type. "closed form": worked out from the
angles by hand (the formula stands in the generator); "VTK": computed by vtkMeshQuality. Findings are all those of
severity error or warning, by code.

| file | shows | points | cells | zones | findings | worst skew | known from |
|---|---|---|---|---|---|---|---|
"""

_TAIL = """
## What else was checked

`checkMesh -allGeometry -allTopology` (OpenFOAM 1912) finds nothing in the OpenFOAM cases but small cell determinants,
which thin cells and cells with few interior faces have. Two Fluent files were read by `fluent3DMeshToFoam` and
counted again by `checkMesh`. `hybrid.fluent.msh.gz`: 108 hexahedra, 360 prisms, 36 pyramids, 360 tetrahedra, total
volume 157.395.
`demo.msh.gz`: the counts above, total volume 336 (the box), largest non-orthogonality 86.7 degrees, 16 faces
beyond 70 degrees, skewness 1.86 at most, no face turned the wrong way.
"""


def readme(entries: list[dict[str, Any]]) -> str:
    """The whole text."""
    return _HEAD + "".join(_row(entry) for entry in entries) + _TAIL


def _row(entry: dict[str, Any]) -> str:
    cells = ", ".join(f"{count} {kind}" for kind, count in entry["cells"].items())
    zones = ", ".join(f"{zone['name']} {zone['count']}" for zone in entry["zones"])
    findings = ", ".join(f"{code} {count}" for code, count in entry["findings"].items()) or "none"
    skew = ", ".join(f"{kind} {_worst(v):.4f}" for kind, v in entry["values"].get("gambit.equiangle_skew", {}).items())
    columns = (f"`{entry['path']}`", entry["shows"], str(entry["points"]), cells, zones, findings, skew, entry["how"])
    return "| " + " | ".join(columns) + " |\n"


def _worst(values: Any) -> float:
    if isinstance(values, dict):
        return float(values["max"])
    return max(float(v) for v in values if v is not None)
