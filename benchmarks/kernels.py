"""Our metric kernels against VTK's for the same metrics: nanoseconds a cell and their ratio, one thread each.

VTK runs one filter a metric, as its users must. Where the definitions agree, so must the numbers: the last column is
the largest difference relative to the values' size, and a pair marked "same" that differs by more than 1e-7 ends the
run. On a busy machine use --clock cpu: processor time of the process instead of wall time (two threads: always wall).
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import dataclass

os.environ["VTK_SMP_MAX_THREADS"] = "1"  # read when VTK starts its thread pool

import numpy as np
import vtk
from meshes import Floats, Ints, as_mesh, hex_block, split_to_tets
from timing import CLOCKS, Clock, best_of, machine, table
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

from meshwright.audit.measurement import measure
from meshwright.audit.mesh import Mesh
from meshwright.audit.metrics import DEFAULT, METRICS


@dataclass(frozen=True)
class Pair:
    """One of our metrics and the VTK measure nearest to it; `same`: equal after `turn`."""

    id: str
    vtk: str
    same: bool = True
    turn: Callable[[Floats], Floats] = np.asarray
    why: str = ""


def _reciprocal(x: Floats) -> Floats:
    return 1.0 / x


def _mirror(x: Floats) -> Floats:
    return 1.0 - x


PAIRS = {
    "hex": (
        Pair("volume", "Volume", False, why="VTK takes the Jacobian at the centre"),
        Pair("gambit.equiangle_skew", "EquiangleSkew"),
        Pair("icem.equiangle_skewness", "EquiangleSkew", turn=_mirror),
        Pair("gambit.diagonal_ratio", "Diagonal", turn=_reciprocal),
        Pair("gambit.edge_ratio", "EdgeRatio", False, why="VTK's longest edge looks at six edges"),
        Pair("gambit.aspect_ratio", "MaxEdgeRatio", False, why="ratio of principal axes"),
        Pair("gambit.midangle_skew", "Skew"),
        Pair("gambit.stretch", "Stretch", turn=_mirror),
        Pair("gambit.taper", "Taper", False, why="another normalisation"),
        Pair("icem.determinant", "NodalJacobianRatio", turn=np.asarray),
        Pair("jacobian.min_corner", "Jacobian", False, why="VTK adds the centre, and scales it"),
    ),
    "tet": (
        Pair("volume", "Volume"),
        Pair("gambit.aspect_ratio", "RadiusRatio"),
        Pair("gambit.edge_ratio", "EdgeRatio"),
        Pair("gambit.equiangle_skew", "EquiangleSkew", False, why="VTK adds dihedral angles"),
        Pair("gambit.equisize_skew", "EquivolumeSkew"),
        Pair("icem.aspect_ratio", "EquivolumeSkew", turn=_mirror),
        Pair("angle.min", "MinAngle", False, why="VTK: dihedral angle"),
        Pair("jacobian.min_corner", "Jacobian"),
    ),
}


def vtk_grid(kind: str, points: Floats, nodes: Ints) -> vtk.vtkUnstructuredGrid:
    grid = vtk.vtkUnstructuredGrid()
    where = vtk.vtkPoints()
    where.SetData(numpy_to_vtk(points, deep=True))
    grid.SetPoints(where)
    cells = vtk.vtkCellArray()
    offsets = np.arange(0, nodes.size + 1, nodes.shape[1], dtype=np.int64)
    flat = nodes.ravel().astype(np.int64)
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(flat, deep=True))
    grid.SetCells({"hex": vtk.VTK_HEXAHEDRON, "tet": vtk.VTK_TETRA}[kind], cells)
    return grid


def vtk_measure(kind: str, grid: vtk.vtkUnstructuredGrid, name: str, times: int, clock: Clock) -> tuple[float, Floats]:
    """Seconds of the filter and its values."""
    quality = vtk.vtkMeshQuality()
    quality.SetInputData(grid)
    getattr(quality, f"Set{kind.capitalize()}QualityMeasureTo{name}")()

    def update() -> None:
        quality.Modified()
        quality.Update()

    seconds = best_of(times, update, clock)
    return seconds, np.array(vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality")))


def compare(kind: str, mesh: Mesh, grid: vtk.vtkUnstructuredGrid, times: int, clock: Clock) -> None:
    n = mesh.n_cells
    rows: list[list[str]] = []
    pairs = PAIRS[kind]
    vtk_total = our_total = 0.0
    for pair in pairs:
        theirs, values = vtk_measure(kind, grid, pair.vtk, times, clock)
        ours = best_of(times, lambda id_=pair.id: measure(mesh, (id_,), threads=1), clock)
        mine = measure(mesh, (pair.id,), threads=1).values[pair.id][kind]
        apart = float(np.max(np.abs(mine - pair.turn(values))) / np.max(np.abs(mine)))
        if pair.same and apart > 1e-7:
            raise SystemExit(f"{kind} {pair.id} and VTK's {pair.vtk} differ by {apart:.1e}")
        vtk_total, our_total = vtk_total + theirs, our_total + ours
        note = f"{apart:.0e}" if pair.same else pair.why
        rows.append(
            [pair.id, pair.vtk, f"{theirs / n * 1e9:.0f}", f"{ours / n * 1e9:.0f}", f"{theirs / ours:.1f}", note]
        )
    ids = tuple(pair.id for pair in pairs)
    whole = best_of(times, lambda: measure(mesh, ids, threads=1), clock)
    default = tuple(id_ for id_ in DEFAULT if kind in METRICS[id_].on)
    table_of_all = best_of(times, lambda: measure(mesh, default, threads=1), clock)
    alone = best_of(times, lambda: measure(mesh, default, threads=1))
    both = best_of(times, lambda: measure(mesh, default, threads=2))
    rows.append(
        [
            "sum of single runs",
            "",
            f"{vtk_total / n * 1e9:.0f}",
            f"{our_total / n * 1e9:.0f}",
            f"{vtk_total / our_total:.1f}",
            "",
        ]
    )
    rows.append(
        ["all in one pass", "", f"{vtk_total / n * 1e9:.0f}", f"{whole / n * 1e9:.0f}", f"{vtk_total / whole:.1f}", ""]
    )
    theirs, ours = vtk_total / n / len(pairs) * 1e9, table_of_all / n / len(default) * 1e9
    rows.append(
        [f"default table, {len(default)} metrics: each", "", f"{theirs:.1f}", f"{ours:.1f}", f"{theirs / ours:.1f}", ""]
    )
    print(f"\n{n} jittered {kind} cells, one thread, ns per cell, fastest of {times}\n")
    print(table(["metric", "VTK measure", "VTK", "ours", "VTK / ours", "largest difference"], rows))
    print(f"\ntwo threads, default table: {both / n * 1e9:.0f} ns per cell, {alone / both:.2f} times as fast as one")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--times", type=int, default=3, help="runs of which the fastest counts")
    parser.add_argument("--clock", choices=CLOCKS, default="wall")
    options = parser.parse_args()
    clock = CLOCKS[options.clock]
    print(f"{machine()}, VTK {vtk.vtkVersion.GetVTKVersion()}")
    side = round(options.cells ** (1 / 3))
    points, hexes = hex_block((side, side, side))
    compare("hex", as_mesh("hex", points, hexes), vtk_grid("hex", points, hexes), options.times, clock)
    side = round((options.cells / 6) ** (1 / 3))
    points, hexes = hex_block((side, side, side))
    tets = split_to_tets(hexes)
    compare("tet", as_mesh("tet", points, tets), vtk_grid("tet", points, tets), options.times, clock)


if __name__ == "__main__":
    main()
