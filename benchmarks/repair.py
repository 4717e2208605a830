"""Our repair beside gmsh, netgen-mesher and mmgpy on the same meshes in one run: quality before time.

Every tool gets the same points and cells, must keep the boundary, and is measured by our metrics, all of them: a better
dihedral angle with a worse scaled Jacobian is no gain. Peers that are not installed are named and left out.
Each tool runs in a process of its own, which a hang or a crash does not survive.

    python benchmarks/repair.py                  # meshes made here
    python benchmarks/repair.py FILE [FILE ...]  # any mesh of tets, hexes, quads, triangles
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from collections.abc import Callable
from importlib.util import find_spec
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from meshes import random_tets, thrown_block
from timing import machine, table

from meshwright.audit import measure, read
from meshwright.audit.geometry import total_volume
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.repair import repair
from meshwright.repair.held import held_points
from meshwright.repair.outcome import Options

_LIMIT = 300.0
"""Seconds that a tool gets."""


def mesh_of(points: Any, cells: dict[str, Any]) -> Mesh:
    blocks, at = [], 0
    for name, nodes in cells.items():
        blocks.append(CellBlock(name, np.arange(at, at + len(nodes)), np.asarray(nodes)))
        at += len(nodes)
    flat = set(cells) <= {"tri", "quad"} and not np.any(points[:, 2])
    return Mesh(points, tuple(blocks), dimension=2 if flat else 3)


def ours(mesh: Mesh) -> Mesh:
    """What a user runs on a mesh without grading."""
    return repair(mesh, "orient,untangle,relax,improve,triangles").after


def outside(tets: Any) -> Any:
    """(k, 3) boundary triangles, outward."""
    sides = np.vstack([tets[:, [1, 2, 3]], tets[:, [0, 3, 2]], tets[:, [0, 1, 3]], tets[:, [0, 2, 1]]])
    _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    return sides[first[count == 1]]


def with_netgen(schedule: str) -> Callable[[Mesh], Mesh]:
    """s swaps, m moves points, as netgen's own letters; nodes are kept by these."""

    def run(mesh: Mesh) -> Mesh:
        from netgen import meshing as ng

        tets = mesh.block("tet").nodes.astype(np.int64)
        made = ng.Mesh(3)
        ids = [made.Add(ng.MeshPoint(ng.Pnt(*p))) for p in mesh.points.tolist()]
        made.SetMaterial(1, "v")
        face = made.Add(ng.FaceDescriptor(surfnr=1, domin=1, bc=1))
        for f in outside(tets).tolist():
            made.Add(ng.Element2D(face, [ids[v] for v in f]))
        for t in tets[:, [0, 2, 1, 3]].tolist():  # netgen's tets have the other hand
            made.Add(ng.Element3D(1, [ids[v] for v in t]))
        start = time.perf_counter()
        made.OptimizeVolumeMesh(ng.MeshingParameters(optimize3d=schedule, optsteps3d=3))
        run.seconds = time.perf_counter() - start  # type: ignore[attr-defined]
        cells = np.array([[v.nr - 1 for v in e.vertices] for e in made.Elements3D()])[:, [0, 2, 1, 3]]
        return mesh_of(np.array([list(p.p) for p in made.Points()]), {"tet": cells})

    return run


def with_gmsh(*methods: str) -> Callable[[Mesh], Mesh]:
    def run(mesh: Mesh) -> Mesh:
        import gmsh

        name = next(b.type for b in mesh.blocks)
        kind = {"tet": 4, "hex": 5}[name]
        gmsh.initialize(interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        cells = mesh.block(name).nodes.astype(np.int64)
        gmsh.model.addDiscreteEntity(2, 1)
        gmsh.model.addDiscreteEntity(3, 1, [1])
        is_held = held_points(mesh, Options())  # nodes of a surface stay, those of the volume may move
        for dimension, rows in ((2, np.flatnonzero(is_held)), (3, np.flatnonzero(~is_held))):
            gmsh.model.mesh.addNodes(dimension, 1, rows + 1, mesh.points[rows].ravel())
        if name == "tet":
            gmsh.model.mesh.addElementsByType(1, 2, [], (outside(cells) + 1).ravel())
        else:
            sides = cells[
                :, [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
            ].reshape(-1, 4)
            gmsh.model.mesh.addElementsByType(1, 3, [], (sides[is_held[sides].all(axis=1)] + 1).ravel())
        gmsh.model.mesh.addElementsByType(1, kind, [], (cells + 1).ravel())
        start = time.perf_counter()
        for method in methods:
            before = set(gmsh.model.mesh.getElementsByType(kind)[0].tolist())
            gmsh.model.mesh.optimize(method, force=True)
        run.seconds = time.perf_counter() - start  # type: ignore[attr-defined]
        tags, nodes = gmsh.model.mesh.getElementsByType(kind)
        found = nodes.reshape(-1, cells.shape[1])
        fresh = np.array([tag not in before for tag in tags.tolist()])
        if methods[-1] == "Netgen" and fresh.any():
            found = found[fresh]  # on a discrete volume gmsh leaves the old tets beside the new ones
        ids, where, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(ids)
        places = where.reshape(-1, 3)[order]
        used, found = np.unique(np.searchsorted(ids[order], found), return_inverse=True)
        return mesh_of(places[used], {name: found.reshape(-1, cells.shape[1])})

    return run


def with_mmg(**options: Any) -> Callable[[Mesh], Mesh]:
    def run(mesh: Mesh) -> Mesh:
        import mmgpy

        made = mmgpy.MmgMesh3D(mesh.points.copy(), mesh.block("tet").nodes.astype(np.int32))
        start = time.perf_counter()
        made.remesh(verbose=-1, **options)
        run.seconds = time.perf_counter() - start  # type: ignore[attr-defined]
        return mesh_of(np.asarray(made.get_vertices()), {"tet": np.asarray(made.get_tetrahedra())})

    return run


TETS = {
    "meshwright": (ours, ""),
    "gmsh": (with_gmsh(""), "gmsh"),
    "gmsh + Netgen": (with_gmsh("", "Netgen"), "gmsh"),
    "netgen, nodes kept": (with_netgen("smsmsm"), "netgen"),
    "netgen": (with_netgen("cmdmustm"), "netgen"),
    "mmg3d, nodes kept": (with_mmg(optim=1, nosurf=1, noinsert=1), "mmgpy"),
    "mmg3d": (with_mmg(optim=1, nosurf=1), "mmgpy"),
}
HEXES = {"meshwright": (ours, ""), "gmsh Relocate3D": (with_gmsh("Relocate3D"), "gmsh")}
OTHERS = {"meshwright": (ours, "")}


def _child(tool: Callable[[Mesh], Mesh], points: Any, cells: dict[str, Any], pipe: Connection) -> None:
    mesh = mesh_of(points, cells)
    if tool is ours:
        ours(mesh)  # compiled kernels are kept on disk; loading them is not what is compared
    start = time.perf_counter()
    after = tool(mesh)
    seconds = getattr(tool, "seconds", time.perf_counter() - start)
    pipe.send((after.points, {b.type: b.nodes for b in after.blocks}, seconds))


def outcome(tool: Callable[[Mesh], Mesh], mesh: Mesh) -> tuple[Mesh, float] | str:
    """What a tool makes of the mesh and its seconds, or why there is nothing."""
    here, there = multiprocessing.Pipe(duplex=False)
    cells = {b.type: b.nodes for b in mesh.blocks}
    process = multiprocessing.get_context("fork").Process(target=_child, args=(tool, mesh.points, cells, there))
    process.start()
    there.close()
    try:
        if not here.poll(_LIMIT):
            return f"not done in {_LIMIT:.0f} s"
        points, found, seconds = here.recv()
    except EOFError:
        return "crashed"
    finally:
        process.kill()
        process.join()
    return mesh_of(points, found), seconds


def figures(mesh: Mesh, before: Mesh) -> list[str]:
    ids = ["dihedral.min", "dihedral.max", "angle.min", "angle.max", "verdict.scaled_jacobian", "gambit.equiangle_skew"]
    values = {k: np.concatenate(list(v.values())) for k, v in measure(mesh, ids).values.items() if v}
    low, high = ("dihedral.min", "dihedral.max") if mesh.cell_dimension == 3 else ("angle.min", "angle.max")
    rim = np.flatnonzero(held_points(before, Options()))
    kept = {tuple(p) for p in mesh.points.tolist()}
    lost = sum(tuple(p) not in kept for p in before.points[rim].tolist())
    change = abs(total_volume(mesh)) / abs(total_volume(before)) - 1.0
    sj, skew = values["verdict.scaled_jacobian"], values["gambit.equiangle_skew"]
    return [
        f"{mesh.n_cells:,}", f"{len(mesh.points):,}", f"{np.nanmin(values[low]):.2f}", f"{np.nanmax(values[high]):.2f}",
        f"{np.nanmin(sj):.4f}", f"{np.nanmean(sj):.4f}", f"{np.nanmax(skew):.3f}", f"{np.nanmean(skew):.4f}",
        str(int((sj <= 0.0).sum())), str(lost), f"{change:.0e}",
    ]  # fmt: skip


def compare(name: str, mesh: Mesh) -> None:
    kinds = {b.type for b in mesh.blocks}
    tools = TETS if kinds == {"tet"} else HEXES if kinds == {"hex"} else OTHERS
    rows = [["before", *figures(mesh, mesh), ""]]
    for tool, (run, package) in tools.items():
        if package and find_spec(package) is None:
            print(f"{tool} is left out: the package {package} is not installed", flush=True)
            continue
        found = outcome(run, mesh)
        rows.append([tool, found] if isinstance(found, str) else [tool, *figures(found[0], mesh), f"{found[1]:.2f}"])
    head = ["", "cells", "points", "min angle", "max angle", "min SJ", "mean SJ", "worst skew", "mean skew", "bad",
            "rim points lost", "dV/V", "s"]  # fmt: skip
    print(f"\n{name}\n")
    print(table(head, [row + [""] * (len(head) - len(row)) for row in rows]), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--points", type=int, default=3000, help="inner points of the random tets")
    parser.add_argument("--side", type=int, default=20, help="hexes along an edge of the block")
    options = parser.parse_args()
    print(machine())
    if options.files:
        for file in options.files:
            compare(file.name, read(file))
        return
    points, tets = random_tets(options.points)
    compare("tets of random points", mesh_of(points, {"tet": tets}))
    for jitter in (0.3, 0.75, 1.5):
        points, hexes = thrown_block(options.side, jitter, seed=12)
        compare(f"hexes thrown about by {jitter} of an edge", mesh_of(points, {"hex": hexes}))


if __name__ == "__main__":
    main()
