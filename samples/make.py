"""Write the whole collection again: every sample, expected.json and README.md. Run it with `make samples`.

Needs numpy, gmsh (sets circle and demo) and vtk (values without a closed form).
"""

from __future__ import annotations

import argparse
import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from generate.readme import readme
from generate.sample import Sample, write

HERE = Path(__file__).parent
SETS = ("cells", "defects", "hybrid", "aerofoil", "circle", "demo")


def record(sample: Sample) -> dict[str, Any]:
    """What is known about a sample, as one entry of expected.json."""
    entry: dict[str, Any] = {"path": sample.path, "shows": sample.shows}
    if sample.mesh is not None:
        mesh = sample.mesh
        kinds = list(dict.fromkeys(mesh.cell_types))
        entry["dimension"] = mesh.dimension
        entry["points"] = len(mesh.points)
        entry["cells"] = {kind: mesh.cell_types.count(kind) for kind in kinds}
        zones = [(name, "cell", len(rows)) for name, _, rows in mesh.cell_zones]
        zones += [(name, "face", len(rows)) for name, _, rows in mesh.patches]
    else:
        grid = sample.grid
        entry["dimension"] = grid.dimension
        entry["points"] = len(grid.points)
        entry["cells"] = _counts((part.type, len(part.nodes)) for part in grid.cells)
        zones = [(n, "cell", c) for n, c in _counts((part.zone, len(part.nodes)) for part in grid.cells).items()]
        zones += [(n, "face", c) for n, c in _counts((part.zone, len(part.nodes)) for part in grid.boundary).items()]
    if sample.path.endswith("-openfoam") and sum(entity == "cell" for _, entity, _ in zones) == 1:
        zones = [zone for zone in zones if zone[1] == "face"]  # a lone cell zone is not written
    entry["zones"] = [{"name": name, "entity": entity, "count": count} for name, entity, count in zones]
    entry["findings"] = sample.findings
    entry["values"] = sample.values
    if sample.how == "VTK":
        from generate.oracle import equiangle_skew  # noqa: PLC0415  VTK loads slowly and only the table needs it

        skew = equiangle_skew(sample.grid)
        entry["values"] = {"gambit.equiangle_skew": {kind: {"max": float(v.max())} for kind, v in skew.items()}}
        entry["over_0_8"] = {kind: int(np.count_nonzero(v > 0.8)) for kind, v in skew.items()}
    entry["how"] = sample.how
    return entry


def _counts(pairs: Any) -> dict[str, int]:
    total: dict[str, int] = {}
    for name, count in pairs:
        total[name] = total.get(name, 0) + count
    return total


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--into", type=Path, default=HERE, help="folder to write to (default: samples/)")
    parser.add_argument("--only", action="append", choices=SETS, help="sets to write; no table is written then")
    options = parser.parse_args()
    entries: list[dict[str, Any]] = []
    for name in options.only or SETS:
        for sample in import_module(f"generate.{name}").samples():
            write(options.into, sample)
            if not options.only:
                entries.append(record(sample))
    if not options.only:
        text = json.dumps({"samples": entries}, indent=1) + "\n"
        (options.into / "expected.json").write_text(text)
        (options.into / "README.md").write_text(readme(entries))


if __name__ == "__main__":
    main()
