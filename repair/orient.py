"""Handedness: cells that look inside out are reversed, decided by their neighbours and never by their own Jacobian.

Two cells agree where they walk their common face in opposite directions. Cells are joined into components by that, and
the sign of a component's total volume (area in the plane) says which side of it is right. A tangled cell keeps its
order, a well-shaped one of the wrong hand does not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.connectivity import half_faces
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import CellBlock, Floats, Ints, Mesh
from meshwright.repair.face_order import order_faces
from meshwright.repair.outcome import Options, Outcome
from meshwright.repair.pairing import components
from meshwright.repair.sizes import signed_sizes

__all__ = ["mirrored", "orient"]

_MIRROR = {
    "tri": (0, 2, 1), "quad": (0, 3, 2, 1), "tet": (0, 2, 1, 3), "pyramid": (0, 3, 2, 1, 4),
    "wedge": (3, 4, 5, 0, 1, 2),
    "hex": (4, 5, 6, 7, 0, 1, 2, 3),
}  # fmt: skip
"""Order of the corners of a cell of the other hand, by type."""


def mirrored(name: str) -> tuple[int, ...] | None:
    """Node order that turns a cell of this type inside out; None where the type has no known one."""
    kind = CELL_TYPES[name]
    corners = _MIRROR.get(kind.corners)
    if corners is None:
        return None
    n = len(corners)
    order = list(corners)
    edges = [frozenset(edge) for edge in kind.edges]
    middle = dict(zip(edges, kind.mid_edges, strict=False))
    if kind.order > 1:
        order += [middle[frozenset(corners[c] for c in edge)] for edge in edges]
        rest = kind.n_nodes - n - len(edges)
        if rest > 1:
            return None  # nodes inside faces: their order differs between formats
        order += range(kind.n_nodes - rest, kind.n_nodes)
    return tuple(order)


def orient(mesh: Mesh, options: Options) -> Outcome:
    """Reverse the cells whose hand differs from that of their component."""
    if mesh.faces is not None:
        return order_faces(mesh)
    if any(block.items is not None for block in mesh.blocks):
        return Outcome(mesh, 0, refused=("polygons are not turned",))
    first, second, alike = half_faces(mesh).meetings()
    component, turned, torn = components(mesh.n_cells, first, second, alike)
    n = int(component.max()) + 1
    total, share, many, against = _totals(component, turned, signed_sizes(mesh), n)
    majority = against * 2 > many
    flip = np.where(np.abs(total) <= 1e-12 * share, majority, total < 0.0)
    if mesh.dimension == 3 and mesh.cell_dimension == 2:
        open_ = np.zeros(n, bool)
        open_[component[_with_free_edges(mesh, first, second)]] = True
        # a closed part that agrees with itself may be the wall of a void: beside others it is left as it is
        whole = against == 0
        flip = np.where(open_ | (whole & (n > 1)), majority, flip)
    reverse = turned.astype(bool)
    reverse ^= flip[component]
    refused = []
    bad = np.unique(component[torn])
    if len(bad):
        reverse[np.isin(component, bad)] = False
        refused.append(f"{len(bad)} part(s) of the mesh cannot be oriented: their cells form a one-sided band")
    blocks, changed = [], 0
    for block in mesh.blocks:
        here = reverse[block.rows]
        order = mirrored(block.type)
        if here.any() and order is None:
            refused.append(f"{int(here.sum())} {block.type} cells look inside out, but their node order is not known")
        elif here.any():
            nodes = np.array(block.nodes)
            nodes[here] = nodes[here][:, order]
            changed += int(here.sum())
            block = CellBlock(block.type, block.rows, nodes)  # noqa: PLW2901
        blocks.append(block)
    if not changed:
        return Outcome(mesh, 0, refused=tuple(refused))
    return Outcome(replace(mesh, blocks=tuple(blocks)), changed, "cells reversed", refused=tuple(refused))


@kernel
def _totals(component: Ints, turned: Ints, sizes: Floats, n: int) -> tuple[Floats, Floats, Ints, Ints]:
    """(summed size as its first cell sees it, the same without signs, cells, those turned) of each of n components."""
    total, share = np.zeros(n), np.zeros(n)
    many, against = np.zeros(n, np.int64), np.zeros(n, np.int64)
    for c in range(component.size):
        k = component[c]
        total[k] += -sizes[c] if turned[c] else sizes[c]
        share[k] += abs(sizes[c])
        many[k] += 1
        against[k] += turned[c]
    return total, share, many, against


def _with_free_edges(mesh: Mesh, first: Ints, second: Ints) -> Ints:
    """Cells that have a side which they do not share with exactly one other."""
    sides = np.zeros(mesh.n_cells, np.int64)
    for block in mesh.blocks:
        sides[block.rows] = len(CELL_TYPES[block.type].edges)
    met = np.bincount(first, minlength=mesh.n_cells) + np.bincount(second, minlength=mesh.n_cells)
    return np.flatnonzero(met < sides)
