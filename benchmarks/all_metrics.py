"""What every metric of the registry costs: seconds on one core for a million hexahedra and tetrahedra, by entity.

Cells, faces and points are measured apart, as `--metrics all` does in one go; the last column is the share of a metric.
"""

from __future__ import annotations

import argparse

from meshes import as_mesh, hex_block, split_to_tets
from timing import CLOCKS, best_of, machine, table

from meshwright.audit.connectivity import edges, faces
from meshwright.audit.geometry import cell_geometry
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics import METRICS


def rows_of(kind: str, mesh: Mesh, times: int, clock: str) -> list[list[str]]:
    start = CLOCKS[clock]()
    faces(mesh), edges(mesh), cell_geometry(mesh)
    rows = [[kind, "faces, edges, centres", "", f"{CLOCKS[clock]() - start:.2f}", ""]]
    own = {id_: row for id_, row in METRICS.items() if row.entity != "cell" or kind in row.on}
    groups = {
        "cells": [id_ for id_, row in own.items() if row.entity == "cell" and not row.column],
        "cells and their neighbours": [id_ for id_, row in own.items() if row.entity == "cell" and row.column],
        "faces": [id_ for id_, row in own.items() if row.entity == "face"],
        "points": [id_ for id_, row in own.items() if row.entity == "point"],
    }
    for name, ids in groups.items():
        if ids:
            seconds = best_of(times, lambda ids=ids: measure(mesh, ids, threads=1), CLOCKS[clock])
            rows.append([kind, name, str(len(ids)), f"{seconds:.2f}", f"{seconds / len(ids) * 1e9 / mesh.n_cells:.1f}"])
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--times", type=int, default=2, help="runs of which the fastest counts")
    parser.add_argument("--clock", choices=CLOCKS, default="cpu")
    options = parser.parse_args()
    print(machine())
    side = round(options.cells ** (1 / 3))
    rows = rows_of("hex", as_mesh("hex", *hex_block((side, side, side))), options.times, options.clock)
    side = round((options.cells / 6) ** (1 / 3))
    points, hexes = hex_block((side, side, side))
    rows += rows_of("tet", as_mesh("tet", points, split_to_tets(hexes)), options.times, options.clock)
    print(f"\nabout {options.cells} cells each, one thread, fastest of {options.times}\n")
    print(table(["cells", "what", "metrics", "seconds", "ns per cell and metric"], rows))


if __name__ == "__main__":
    main()
