"""Elements of the boundary that the file lists, after the edges between them were turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import half_faces
from meshwright.audit.errors import MeshError
from meshwright.audit.mesh import NO_CELL, CellBlock, Floats, Ints, Mesh
from meshwright.repair.bvh import Tree
from meshwright.repair.pairing import WALL, pair_sides
from meshwright.repair.zoning import zone_numbers

__all__ = ["listed_anew"]

Mask = NDArray[np.bool_]

_WHOLE = np.array([[0, 1, 2]])


def listed_anew(mesh: Mesh) -> Mesh:
    """The mesh with its listed triangles where the boundary's triangles are now: of the same zones and numbers.

    A turned edge leaves two elements without a face and two faces without an element, in one plane and one zone. Each
    face takes the place of an element of the zones of the one that it lies on. MeshError where they do not match up.
    """
    at = next((i for i, block in enumerate(mesh.boundary) if block.type == "tri"), None)
    if at is None:
        return mesh
    block = mesh.boundary[at]
    sides = half_faces(mesh)
    inner = sides.loops(sides.other >= 0)
    outer = sides.loops(sides.other == NO_CELL)
    outer = outer[outer[:, 3] < 0, :3]
    gone = np.flatnonzero(~_among(block.nodes, outer) & ~_among(block.nodes, inner[inner[:, 3] < 0, :3]))
    if not len(gone):
        return mesh
    lies_on, away = _nearest(mesh, block.nodes[gone], outer, ~_among(outer, block.nodes))
    faces = np.flatnonzero((lies_on >= 0) & (away <= 1e-9 * float(np.ptp(mesh.points, axis=0).max())))
    zones = zone_numbers((z for z in mesh.zones if z.entity == "face"), mesh.n_boundary)[block.rows[gone]]
    # elements and faces by their zones: any order will do among those of the same
    old, new = np.argsort(zones, kind="stable"), faces[np.argsort(zones[lies_on[faces]], kind="stable")]
    if len(new) != len(gone) or not np.array_equal(zones[old], zones[lies_on[new]]):
        raise MeshError(f"{len(gone)} listed triangles would lose their faces, and {len(new)} faces be left for them")
    nodes = np.array(block.nodes)
    nodes[gone[old]] = _as_before(mesh, outer[new], block.nodes[gone[lies_on[new]]])
    boundary = list(mesh.boundary)
    boundary[at] = CellBlock("tri", block.rows, nodes)
    return replace(mesh, boundary=tuple(boundary))


def _among(tris: Ints, others: Ints) -> Mask:
    """(k,) which of the triangles (k, 3) name the same points as one of the others."""
    both = np.concatenate([tris, others]).astype(np.int64)
    meets = pair_sides(both, _WHOLE, np.empty((0, 3), np.int64))[: len(tris), 0]
    return np.asarray(meets != WALL)


def _nearest(mesh: Mesh, tris: Ints, outer: Ints, chosen: Mask) -> tuple[Ints, Floats]:
    """(which of `tris` the middle of each of the outer faces that are chosen lies on, how far from it); else -1."""
    lies_on, away = np.full(len(outer), -1, np.int64), np.full(len(outer), np.inf)
    rows = np.flatnonzero(chosen)
    away[rows], lies_on[rows] = Tree.of(mesh.points, tris).nearest(mesh.points[outer[rows]].mean(axis=1))
    return lies_on, away


def _as_before(mesh: Mesh, faces: Ints, elements: Ints) -> Ints:
    """The faces, turned to look the way the elements that they lie on did."""
    normals = []
    for tris in (faces, elements):
        x = mesh.points[tris]
        normals.append(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]))
    against = np.einsum("ij,ij->i", *normals) < 0.0
    out = np.array(faces)
    out[against] = out[against][:, [0, 2, 1]]
    return out
