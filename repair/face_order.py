"""Which way the faces of a mesh run that is given by its faces: decided by the edges that they share, never by areas.

Around a closed cell every edge lies in two faces, and these run along it in opposite directions when both are seen from
outside. Faces are joined into components by that, as cells are in `orient`, and the sign of the volume that a component
encloses says which side of it is right. A face that runs the wrong way is reversed; its owner stays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import faces_of_cells
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import NO_CELL, Faces, Floats, Ints, Mesh
from meshwright.repair.outcome import Outcome
from meshwright.repair.pairing import components

__all__ = ["order_faces"]


def order_faces(mesh: Mesh) -> Outcome:
    """Reverse the faces of a 3-D mesh with faces of its own that look into their owner."""
    sides = mesh.faces
    if sides is None or mesh.cell_dimension != 3:
        return Outcome(mesh, 0)
    starts, items = faces_of_cells(mesh)
    first, second, alike = _meetings(starts, items, sides.offsets, sides.nodes, sides.owner)
    component, turned, torn = components(len(sides), first, second, alike)
    reverse = turned.astype(bool)
    n = int(component.max(initial=-1)) + 1
    outside = sides.neighbour == NO_CELL
    volumes = _cones(mesh.points, sides.offsets, sides.nodes)
    enclosed = np.bincount(component[outside], np.where(reverse, -volumes, volumes)[outside], minlength=n)
    scale = np.bincount(component[outside], np.abs(volumes)[outside], minlength=n)
    undecided = np.abs(enclosed) <= 1e-12 * scale
    majority = np.bincount(component, reverse, minlength=n) * 2 > np.bincount(component, minlength=n)
    reverse ^= np.where(undecided, majority, enclosed < 0.0)[component]
    refused: tuple[str, ...] = ()
    bad = np.unique(component[torn])
    if len(bad):
        reverse[np.isin(component, bad)] = False
        refused = (f"{len(bad)} part(s) of the mesh cannot be oriented: their faces contradict each other",)
    count = int(np.count_nonzero(reverse))
    if not count:
        return Outcome(mesh, 0, refused=refused)
    nodes = _reversed(sides.offsets, sides.nodes, reverse)
    fresh = replace(mesh, faces=Faces(sides.offsets, nodes, sides.owner, sides.neighbour, sides.ids))
    return Outcome(fresh, count, "faces reversed", refused=refused)


@kernel
def _meetings(starts: Ints, items: Ints, offsets: Ints, nodes: Ints, owner: Ints) -> tuple[Ints, Ints, Ints]:
    """(first, second, alike) of every edge that exactly two faces of a cell share: the faces, and 1 where both run
    along it the same way as seen from outside of the cell."""
    most = room = 0
    for c in range(starts.size - 1):
        n = 0
        for i in range(starts[c], starts[c + 1]):
            n += offsets[items[i] + 1] - offsets[items[i]]
        most = max(most, n)
        room += n // 2
    first, second = np.empty(room, np.int64), np.empty(room, np.int64)
    alike = np.empty(room, np.int64)
    low, high, face, runs = (
        np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most, np.bool_),
    )  # fmt: skip
    met = 0
    for c in range(starts.size - 1):
        n = 0
        for i in range(starts[c], starts[c + 1]):
            f = items[i]
            size = offsets[f + 1] - offsets[f]
            for k in range(size):
                a, b = nodes[offsets[f] + k], nodes[offsets[f] + (k + 1) % size]
                low[n], high[n], face[n] = min(a, b), max(a, b), f
                runs[n] = (a < b) == (owner[f] == c)
                n += 1
        for i in range(n):
            if face[i] < 0:
                continue
            found, other, runs_there = 0, -1, False
            for j in range(i + 1, n):
                if low[j] == low[i] and high[j] == high[i]:
                    found += 1
                    other, runs_there = face[j], runs[j]
                    face[j] = -1  # it has been met
            if found == 1 and other != face[i]:
                first[met], second[met] = face[i], other
                alike[met] = runs[i] == runs_there
                met += 1
    return first[:met], second[:met], alike[:met]


@kernel
def _cones(points: Floats, offsets: Ints, nodes: Ints) -> Floats:
    """(f,) six times the volume of the cone from the first point of the mesh to each face."""
    out = np.zeros(offsets.size - 1)
    for f in range(out.size):
        n = offsets[f + 1] - offsets[f]
        for k in range(1, n - 1):
            a, b, c = nodes[offsets[f]], nodes[offsets[f] + k], nodes[offsets[f] + k + 1]
            ux, uy, uz = points[a, 0] - points[0, 0], points[a, 1] - points[0, 1], points[a, 2] - points[0, 2]
            vx, vy, vz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
            wx, wy, wz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
            out[f] += ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
    return out


@kernel
def _reversed(offsets: Ints, nodes: Ints, reverse: NDArray[np.bool_]) -> Ints:
    """The nodes with these faces run the other way round, from the same node."""
    out = nodes.copy()
    for f in range(reverse.size):
        if reverse[f]:
            n = offsets[f + 1] - offsets[f]
            for k in range(1, n):
                out[offsets[f] + k] = nodes[offsets[f] + n - k]
    return out
