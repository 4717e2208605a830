"""Our repair beside gmsh, netgen, mmg, MeshFix, MeshLab and trimesh on the same meshes in one run: quality before time.

Every tool gets the same points and cells, must keep the boundary, and is measured by our metrics, all of them: a better
dihedral angle with a worse scaled Jacobian is no gain. Peers that are not installed are named and left out.
Each tool runs in a process of its own, which a hang or a crash does not survive.

    python benchmarks/repair.py                  # meshes made here
    python benchmarks/repair.py FILE [FILE ...]  # any mesh of tets, hexes, quads, triangles; surfaces are closed
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
from meshes import loose_triangles, random_tets, thrown_block
from timing import machine, table

from meshwright.audit import measure, read
from meshwright.audit.geometry import total_volume
from meshwright.audit.mesh import CellBlock, Mesh
from meshwright.repair import repair
from meshwright.repair.hausdorff import surfaces_apart
from meshwright.repair.held import held_points
from meshwright.repair.intersections import intersecting
from meshwright.repair.outcome import Options
from meshwright.repair.passes import PASSES
from meshwright.repair.surface import sides_of

_LIMIT = 300.0
"""Seconds that a tool gets."""
_WELD = 1e-5
"""Within which the corners of loose triangles are one point."""


def mesh_of(points: Any, cells: dict[str, Any]) -> Mesh:
    blocks, at = [], 0
    for name, nodes in cells.items():
        blocks.append(CellBlock(name, np.arange(at, at + len(nodes)), np.asarray(nodes)))
        at += len(nodes)
    flat = set(cells) <= {"tri", "quad"} and not np.any(np.asarray(points)[:, 2])
    return Mesh(points, tuple(blocks), dimension=2 if flat else 3)


def ours(mesh: Mesh) -> Mesh:
    """What a user runs on a mesh without grading."""
    return repair(mesh, "orient,untangle,relax,improve,triangles").after


def ours_free(mesh: Mesh) -> Mesh:
    """The same with points put in and taken away."""
    return repair(mesh, "orient,untangle,improve", nodes="free").after


def ours_in_blocks(mesh: Mesh) -> Mesh:
    """What a user runs on structured blocks."""
    return repair(mesh, "orient,tfi-even").after


def closing(mesh: Mesh) -> Mesh:
    """What a user runs on the loose triangles of an STL file."""
    return repair(mesh, "surface", tolerance=_WELD).after


def with_meshfix(*, welded: bool) -> Callable[[Mesh], Mesh]:
    def run(mesh: Mesh) -> Mesh:
        import pymeshfix

        if welded:
            mesh = repair(mesh, "weld,drop-degenerate", tolerance=_WELD).after
        made = pymeshfix.MeshFix(mesh.points.copy(), mesh.block("tri").nodes.astype(np.int32))
        made.repair()
        return mesh_of(np.asarray(made.points), {"tri": np.asarray(made.faces)})

    return run


def by_pass(name: str) -> Callable[[Mesh], Mesh]:
    """A peer that is one of our passes, outside of the transaction: what it makes of the welded surface by itself."""

    def run(mesh: Mesh) -> Mesh:
        welded = repair(mesh, "weld,drop-degenerate", tolerance=_WELD).after
        return PASSES[name].run(welded, Options()).mesh

    return run


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
    "meshwright, nodes free": (ours_free, ""),
    "gmsh": (with_gmsh(""), "gmsh"),
    "gmsh + Netgen": (with_gmsh("", "Netgen"), "gmsh"),
    "netgen, nodes kept": (with_netgen("smsmsm"), "netgen"),
    "netgen": (with_netgen("cmdmustm"), "netgen"),
    "mmg3d, nodes kept": (with_mmg(optim=1, nosurf=1, noinsert=1), "mmgpy"),
    "mmg3d": (with_mmg(optim=1, nosurf=1), "mmgpy"),
}
HEXES = {
    "meshwright": (ours, ""),
    "meshwright, blocks": (ours_in_blocks, ""),
    "gmsh Relocate3D": (with_gmsh("Relocate3D"), "gmsh"),
}
OTHERS = {"meshwright": (ours, "")}
SURFACES = {
    "meshwright": (closing, ""),
    "MeshFix": (with_meshfix(welded=False), "pymeshfix"),
    "our weld + MeshFix": (with_meshfix(welded=True), "pymeshfix"),
    "our weld + MeshLab": (by_pass("pymeshlab-repair"), "pymeshlab"),
    "our weld + trimesh": (by_pass("trimesh-repair"), "trimesh"),
}


def _child(tool: Callable[[Mesh], Mesh], points: Any, cells: dict[str, Any], pipe: Connection) -> None:
    mesh = mesh_of(points, cells)
    if tool in (ours, ours_free, ours_in_blocks, closing):
        tool(mesh)  # compiled kernels are kept on disk; loading them is not what is compared
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


def closed(mesh: Mesh, before: Mesh) -> list[str]:
    tris = mesh.block("tri").nodes.astype(np.int64)
    use = sides_of(tris)
    x = mesh.points[tris]
    flat = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) <= 1e-14
    walked = np.stack([tris, np.roll(tris, -1, axis=1)], axis=2).reshape(-1, 2)
    twice = len(walked) - len(np.unique(walked, axis=0))
    apart = surfaces_apart((mesh.points, tris), (before.points, before.block("tri").nodes.astype(np.int64)))
    volume = float(np.einsum("ij,ij->i", x[:, 0], np.cross(x[:, 1], x[:, 2])).sum()) / 6.0
    return [
        f"{len(tris):,}", f"{len(mesh.points):,}", str(int((use == 1).sum())), str(int((use > 2).sum())), str(twice),
        str(int(flat.sum())), str(len(intersecting(mesh.points, tris))), f"{volume:.6g}", f"{apart.back:.2g}",
    ]  # fmt: skip


CLOSED = ["", "triangles", "points", "open sides", "sides of 3 and more", "sides walked twice", "flat",
          "pairs that cross", "volume", "off the input", "s"]  # fmt: skip
SHAPED = ["", "cells", "points", "min angle", "max angle", "min SJ", "mean SJ", "worst skew", "mean skew", "bad",
          "rim points lost", "dV/V", "s"]  # fmt: skip


def compare(name: str, mesh: Mesh) -> None:
    kinds = {b.type for b in mesh.blocks}
    is_surface = mesh.cell_dimension == 2 and mesh.dimension == 3
    tools = SURFACES if is_surface else TETS if kinds == {"tet"} else HEXES if kinds == {"hex"} else OTHERS
    measured, head = (closed, CLOSED) if is_surface else (figures, SHAPED)
    rows = [["before", *measured(mesh, mesh), ""]]
    for tool, (run, package) in tools.items():
        if package and find_spec(package) is None:
            print(f"{tool} is left out: the package {package} is not installed", flush=True)
            continue
        found = outcome(run, mesh)
        rows.append([tool, found] if isinstance(found, str) else [tool, *measured(found[0], mesh), f"{found[1]:.2f}"])
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
    loose = loose_triangles(5).reshape(-1, 3)
    compare("loose triangles of a sphere", mesh_of(loose, {"tri": np.arange(len(loose)).reshape(-1, 3)}))


if __name__ == "__main__":
    main()
