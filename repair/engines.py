"""Other programs' repairs of triangle surfaces inside our transaction: pymeshlab and trimesh, where they are installed.

They get the points and triangles and nothing else. What comes back is welded by place to the points that were there,
and each triangle is in the zones of the one it lies nearest to.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from meshwright.audit.errors import MeshError
from meshwright.audit.mesh import Floats, Ints, Mesh
from meshwright.repair.bvh import Tree
from meshwright.repair.carrying import with_cells, with_more_points, without_points
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.surface import open_sides, triangles_of

__all__ = ["pymeshlab_repair", "trimesh_repair"]


def _module(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise MeshError(f"{name} is not installed; `pip install 'meshwright[surfaces]'` brings it") from None


def pymeshlab_repair(mesh: Mesh, options: Options) -> Outcome:
    """MeshLab's filters: duplicates, non-manifold edges and points, holes of up to 30 edges, orientation."""
    tris = triangles_of(mesh)
    if tris is None:
        return Outcome(mesh, 0)
    lab = _module("pymeshlab")
    work = lab.MeshSet(verbose=False)
    work.add_mesh(lab.Mesh(mesh.points, tris))
    try:
        work.meshing_remove_duplicate_faces()
        work.meshing_remove_null_faces()
        work.meshing_repair_non_manifold_edges()
        work.meshing_repair_non_manifold_vertices()
        work.meshing_close_holes(maxholesize=30)
        work.meshing_re_orient_faces_coherently()
    except lab.PyMeshLabException as error:
        raise MeshError(f"pymeshlab: {str(error).splitlines()[0][:200]}") from None
    found = work.current_mesh()
    return _taken(mesh, tris, np.asarray(found.vertex_matrix()), np.asarray(found.face_matrix()), "pymeshlab")


def trimesh_repair(mesh: Mesh, options: Options) -> Outcome:
    """trimesh's repair: winding, normals, holes of three and four edges."""
    tris = triangles_of(mesh)
    if tris is None:
        return Outcome(mesh, 0)
    trimesh = _module("trimesh")
    work = trimesh.Trimesh(np.array(mesh.points), np.array(tris), process=False)
    repair = _module("trimesh.repair")
    _module("networkx")  # which trimesh needs for this and does not ask for
    repair.fix_winding(work)
    repair.fix_inversion(work)
    repair.fill_holes(work)
    return _taken(mesh, tris, np.asarray(work.vertices), np.asarray(work.faces), "trimesh")


def _taken(mesh: Mesh, tris: Ints, points: Floats, faces: Ints, who: str) -> Outcome:
    """The outcome of another program as one of ours."""
    faces = faces.astype(np.int64)
    if not len(faces):
        return Outcome(mesh, 0, refused=(f"{who} left no triangle",))
    row = {tuple(p): i for i, p in reversed(list(enumerate(mesh.points.tolist())))}
    origin = np.array([row.get(tuple(p), -1) for p in points.tolist()], dtype=np.int64)
    new = np.flatnonzero(origin < 0)
    name = origin.copy()
    name[new] = len(mesh.points) + np.arange(len(new))
    nodes = name[faces]
    if _as_set(nodes) == _as_set(tris):
        return Outcome(mesh, 0)
    left, before = open_sides(nodes), open_sides(tris)
    if left > before:
        return Outcome(mesh, 0, refused=(f"{who} would leave {left:,} sides open or of more than two, {before:,} now",))
    _, nearest = Tree.of(mesh.points, tris).nearest(points[faces].mean(axis=1))
    fresh, cells_from = with_cells(with_more_points(mesh, points[new]), {"tri": (nodes, nearest)})
    used = np.zeros(len(fresh.points), np.bool_)
    used[fresh.block("tri").nodes] = True
    was = np.ones(len(fresh.points), np.bool_)
    was[tris] = False
    was[len(mesh.points) :] = False
    keep = np.flatnonzero(used | was)
    into = np.full(len(fresh.points), -1, np.int64)
    into[keep] = np.arange(len(keep))
    fresh, rows = without_points(fresh, keep, into)
    changed = len(_as_set(nodes) ^ _as_set(tris))
    points_from = np.where(rows < len(mesh.points), rows, -1)
    return Outcome(fresh, changed, f"triangles changed by {who}", points_from=points_from, cells_from=cells_from)


def _as_set(tris: Ints) -> set[tuple[int, ...]]:
    at = tris.argmin(axis=1)
    turned = tris[np.arange(len(tris))[:, None], (at[:, None] + np.arange(3)) % 3]
    return set(map(tuple, turned.tolist()))
