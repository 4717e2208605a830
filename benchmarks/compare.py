"""Matching a mesh with a copy of it in another order, beside the audit of the mesh."""

from __future__ import annotations

import argparse
import time

import numpy as np
from meshes import as_mesh, hex_block

from meshwright.audit.matching import match_meshes
from meshwright.audit.run import audit


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side", type=int, default=100, help="cells along an edge of the block")
    options = parser.parse_args()
    points, nodes = hex_block((options.side,) * 3)
    rng = np.random.default_rng(0)
    order, rows = rng.permutation(len(points)), rng.permutation(len(nodes))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    mesh, other = as_mesh("hex", points, nodes), as_mesh("hex", points[order], place[nodes][rows])
    audit(as_mesh("hex", *hex_block((4,) * 3)))  # compiles
    start = time.perf_counter()
    audit(mesh)
    audited = time.perf_counter() - start
    start = time.perf_counter()
    found = match_meshes(mesh, other)
    matched = time.perf_counter() - start
    assert len(found.same) == mesh.n_cells
    ratio = matched / audited
    print(f"{mesh.n_cells:,} cells: audit {audited:.2f} s, match with a shuffled copy {matched:.2f} s: {ratio:.2f}")


if __name__ == "__main__":
    main()
