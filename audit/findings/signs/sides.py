"""Which faces are left-handed, and which cells have such a face.

A face is right-handed when its normal leads away from the centre of its owner and towards that of its neighbour:
A.(c_f - C_owner) > 0 and A.(C_neighbour - c_f) > 0. Boundary faces have the first half only. The sign of a cell's
volume alone cannot tell: file formats disagree about the order of a wedge's nodes, and a reversed face hides in a
cell whose volume stays positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.cache import once_per_mesh
from meshwright.audit.connectivity import duplicate_cells, faces
from meshwright.audit.findings.signs.polycells import face_vector
from meshwright.audit.findings.signs.shapes import cell_shapes
from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Ints, Mesh
from meshwright.audit.parallel import in_parallel

__all__ = [
    "BOTH",
    "FROM_NEIGHBOUR",
    "FROM_OWNER",
    "Sides",
    "face_handedness",
    "face_sides",
    "left_handed_cells",
]

FROM_OWNER, FROM_NEIGHBOUR, BOTH = 1, 2, 3
"""Bits of `Sides.faults`."""

_PIECE = 1 << 18
"""Faces that a thread judges in one go."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Sides:
    """faults (f,): bit 1 where the normal does not leave the owner, bit 2 where it does not lead to the neighbour.

    openness (n_cells,): |sum A| / sum |A| over the faces of a cell, in a mesh that brings its own faces; faces at
    fault on both sides are turned first, since they are reversed and not missing. 0 for cells of fixed type without a
    fault, whose faces close by construction. Empty in any other mesh.
    """

    faults: NDArray[np.uint8]
    openness: Floats


@once_per_mesh
def face_sides(mesh: Mesh) -> Sides:
    """Judge every face of a solid or flat mesh against the centres of its cells. Cells without size judge nothing."""
    found = faces(mesh)
    shapes = cell_shapes(mesh)
    judge = ~shapes.flat & np.isfinite(shapes.relative)
    size = float(np.max(np.abs(mesh.points), where=np.isfinite(mesh.points), initial=0.0))
    # a power of two that keeps products of three lengths in range, whatever the unit of the file
    scale = 1.0 if 1e-60 < size < 1e60 or size == 0.0 else math.ldexp(1.0, -max(min(math.frexp(size)[1], 1020), -1020))
    table = (found.offsets, found.nodes, found.owner, found.neighbour)
    faults = np.zeros(len(found), np.uint8)
    flat = mesh.dimension == 2

    def judge_piece(start: int) -> None:
        _judge(mesh.points, *table, start, min(start + _PIECE, len(found)), shapes.centre, judge, flat, scale, faults)

    list(in_parallel(judge_piece, range(0, len(found), _PIECE)))
    if mesh.faces is None:
        return Sides(faults, np.empty(0))
    total = np.zeros((mesh.n_cells, 4))
    suspect = _suspects(mesh, faults)
    if suspect.any():
        _add_up(mesh.points, *table, faults, suspect, flat, scale, total)
    return Sides(faults, _openness(total))


def _suspects(mesh: Mesh, faults: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(n_cells,) cells that might be open: polyhedra and polygons, and whatever has a face at fault."""
    found = faces(mesh)
    suspect = np.zeros(mesh.n_cells, dtype=bool)
    for block in mesh.blocks:
        suspect[block.rows] = block.items is not None
    wrong = np.flatnonzero(faults)
    suspect[found.owner[wrong]] = True
    suspect[found.neighbour[wrong[found.neighbour[wrong] >= 0]]] = True
    return suspect


@inner
def _face(points, offsets, nodes, f, flat, scale):  # type: ignore[no-untyped-def]
    """(area vector, centre relative to the first node) of one face, lengths times `scale`."""
    first, last = offsets[f], offsets[f + 1]
    p = nodes[first]
    ox, oy, oz = points[p, 0], points[p, 1], points[p, 2]
    if flat:
        q = nodes[last - 1]
        cx, cy = 0.5 * scale * (points[q, 0] - ox), 0.5 * scale * (points[q, 1] - oy)
        return 2.0 * cy, -2.0 * cx, 0.0, cx, cy, 0.0
    ax, ay, az, cx, cy, cz, _ = face_vector(points, nodes, first, last, ox, oy, oz, scale)
    return ax, ay, az, cx, cy, cz


@inner
def _clearly_sound(points, nodes, first, c, b, centre, judge, scale):  # type: ignore[no-untyped-def]
    """Whether a quadrilateral looks away from its owner and towards its neighbour wherever in the face its centre lies.

    Along the normal its nodes stand at two heights, one for each diagonal; the centre lies between them, and the mean
    of the nodes, which costs less, halfway. Whatever is not clear by four times that is judged in full.
    """
    if not judge[c] or (b >= 0 and not judge[b]):
        return False
    p, q, r, s = nodes[first], nodes[first + 1], nodes[first + 2], nodes[first + 3]
    ox, oy, oz = points[p, 0], points[p, 1], points[p, 2]
    qx, qy, qz = scale * (points[q, 0] - ox), scale * (points[q, 1] - oy), scale * (points[q, 2] - oz)
    rx, ry, rz = scale * (points[r, 0] - ox), scale * (points[r, 1] - oy), scale * (points[r, 2] - oz)
    sx, sy, sz = scale * (points[s, 0] - ox), scale * (points[s, 1] - oy), scale * (points[s, 2] - oz)
    # the product of the diagonals, and how far apart they are along it, which is how warped the face is
    dx, dy, dz = sx - qx, sy - qy, sz - qz
    ax, ay, az = ry * dz - rz * dy, rz * dx - rx * dz, rx * dy - ry * dx
    warp = abs(ax * qx + ay * qy + az * qz)
    mx, my, mz = 0.25 * (qx + rx + sx), 0.25 * (qy + ry + sy), 0.25 * (qz + rz + sz)
    ux, uy, uz = mx + scale * (ox - centre[c, 0]), my + scale * (oy - centre[c, 1]), mz + scale * (oz - centre[c, 2])
    own = ax * ux + ay * uy + az * uz
    size = abs(ax) * abs(ux) + abs(ay) * abs(uy) + abs(az) * abs(uz)
    if not own > 2.0 * warp + 1e-9 * size:
        return False
    if b < 0:
        return True
    vx, vy, vz = mx + scale * (ox - centre[b, 0]), my + scale * (oy - centre[b, 1]), mz + scale * (oz - centre[b, 2])
    other = ax * vx + ay * vy + az * vz
    size = abs(ax) * abs(vx) + abs(ay) * abs(vy) + abs(az) * abs(vz)
    return other < -2.0 * warp - 1e-9 * size


@kernel
def _judge(
    points: Floats,
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    neighbour: Ints,
    begin: int,
    end: int,
    centre: Floats,
    judge: NDArray[np.bool_],
    flat: bool,
    scale: float,
    faults: NDArray[np.uint8],
) -> None:
    for f in range(begin, end):
        if (
            not flat
            and offsets[f + 1] - offsets[f] == 4
            and _clearly_sound(points, nodes, offsets[f], owner[f], neighbour[f], centre, judge, scale)
        ):
            faults[f] = 0
            continue
        ax, ay, az, cx, cy, cz = _face(points, offsets, nodes, f, flat, scale)
        p = nodes[offsets[f]]
        ox, oy, oz = points[p, 0], points[p, 1], points[p, 2]
        c, b = owner[f], neighbour[f]
        fault = 0
        looks = ax != 0.0 or ay != 0.0 or az != 0.0  # a face without area looks nowhere
        if looks and judge[c]:
            dx = cx + scale * (ox - centre[c, 0])
            dy = cy + scale * (oy - centre[c, 1])
            dz = cz + scale * (oz - centre[c, 2])
            if not ax * dx + ay * dy + az * dz > 0.0:
                fault |= FROM_OWNER
        if looks and b >= 0 and judge[b]:
            dx = cx + scale * (ox - centre[b, 0])
            dy = cy + scale * (oy - centre[b, 1])
            dz = cz + scale * (oz - centre[b, 2])
            if not ax * dx + ay * dy + az * dz < 0.0:
                fault |= FROM_NEIGHBOUR
        faults[f] = fault


@kernel
def _add_up(
    points: Floats,
    offsets: Ints,
    nodes: Ints,
    owner: Ints,
    neighbour: Ints,
    faults: NDArray[np.uint8],
    suspect: NDArray[np.bool_],
    flat: bool,
    scale: float,
    total: Floats,
) -> None:
    """total[c] += area vector and area of every face of the suspect cells."""
    for f in range(owner.size):
        c, b = owner[f], neighbour[f]
        if not suspect[c] and (b < 0 or not suspect[b]):
            continue
        ax, ay, az, _, _, _ = _face(points, offsets, nodes, f, flat, scale)
        both = FROM_OWNER if b < 0 else BOTH
        sign = -1.0 if faults[f] == both else 1.0
        size = np.sqrt(ax * ax + ay * ay + az * az)
        for cell in (c, b):
            if cell >= 0 and suspect[cell]:
                total[cell, 0] += sign * ax
                total[cell, 1] += sign * ay
                total[cell, 2] += sign * az
                total[cell, 3] += size
            sign = -sign


def _openness(total: Floats) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y, z = total[:, :3].T / np.where(total[:, 3] == 0.0, 1.0, total[:, 3])
    return np.sqrt(x * x + y * y + z * z)


def face_handedness(mesh: Mesh) -> tuple[NDArray[np.bool_], NDArray[np.uint8]]:
    """(left-handed (f,) per face of `connectivity.faces`, flag (n_cells,) 1 for a cell with a left-handed face).

    Faces that the file brings along are judged as it turns them, and flag the cells they fail. Derived faces are
    judged as their owner turns them; a cell is flagged by its own node order, so that a reversed cell is flagged
    and its neighbours are not, whichever of them the face was derived from. Surface meshes have no sides: nothing
    is flagged.
    """
    if mesh.dimension == 3 and mesh.cell_dimension == 2:
        return np.zeros(len(faces(mesh)), dtype=bool), np.zeros(mesh.n_cells, dtype=np.uint8)
    faults = face_sides(mesh).faults
    return faults != 0, left_handed_cells(mesh).astype(np.uint8)


def left_handed_cells(mesh: Mesh) -> NDArray[np.bool_]:
    """(n_cells,) the flag of `face_handedness`."""
    found, faults, shapes = faces(mesh), face_sides(mesh).faults, cell_shapes(mesh)
    inside = found.neighbour >= 0
    if mesh.faces is not None:
        flags = np.zeros(mesh.n_cells, dtype=bool)
        flags[found.owner[faults & FROM_OWNER != 0]] = True
        flags[found.neighbour[inside & (faults & FROM_NEIGHBOUR != 0)]] = True
        return flags
    flags = shapes.turned & ~shapes.flat
    # Two cells, sound in themselves, on one side of the face between them: they lie over each other.
    over = np.flatnonzero(inside & (faults == FROM_NEIGHBOUR))
    over = over[~flags[found.owner[over]] & ~flags[found.neighbour[over]]]
    if len(over):  # the same cell twice is for another check
        twice = np.zeros(mesh.n_cells, dtype=bool)
        twice[duplicate_cells(mesh)] = True
        over = over[~(twice[found.owner[over]] & twice[found.neighbour[over]])]
    flags[found.owner[over]] = True
    flags[found.neighbour[over]] = True
    return flags
