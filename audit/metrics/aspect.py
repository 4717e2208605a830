"""Aspect ratios (GAMBIT's, from 1 up; ICEM CFD's, from 1 down) and equi-size skew."""

from __future__ import annotations

import math

import numpy as np

from meshwright.audit.cells import LINEAR_TYPES
from meshwright.audit.jit import inner
from meshwright.audit.metrics.edges import edge_ratio_inverse
from meshwright.audit.metrics.row import Metric
from meshwright.audit.metrics.stages import Lane, edges, faces, volume
from meshwright.audit.metrics.tile import LANES, Tile, tile_kernel

__all__ = ["FLAT", "ROWS"]

FLAT = 1e-14
"""A cell counts as flat when its volume (area) is below this times the cube (square) of its longest edge."""


@inner
def _distance2(tile, a, b, i):  # type: ignore[no-untyped-def]
    """Squared distance of corners a and b."""
    x = tile.x
    return (x[b, 0, i] - x[a, 0, i]) ** 2 + (x[b, 1, i] - x[a, 1, i]) ** 2 + (x[b, 2, i] - x[a, 2, i]) ** 2


@inner
def _twice_area(tile, a, b, c, i):  # type: ignore[no-untyped-def]
    """Twice the area of triangle abc, 0 when it is flat."""
    x = tile.x
    ux, uy, uz = x[b, 0, i] - x[a, 0, i], x[b, 1, i] - x[a, 1, i], x[b, 2, i] - x[a, 2, i]
    vx, vy, vz = x[c, 0, i] - x[a, 0, i], x[c, 1, i] - x[a, 1, i], x[c, 2, i] - x[a, 2, i]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    longest2 = max(_distance2(tile, a, b, i), _distance2(tile, b, c, i), _distance2(tile, c, a, i))
    twice = math.sqrt(nx * nx + ny * ny + nz * nz)
    return twice if twice >= 2.0 * FLAT * longest2 else 0.0


@inner
def _triangle_ratio(tile, a, b, c, i):  # type: ignore[no-untyped-def]
    """R / 2r of triangle abc: inf when flat, nan when two corners coincide and there is no circumcircle."""
    p = math.sqrt(_distance2(tile, a, b, i))
    q = math.sqrt(_distance2(tile, b, c, i))
    r = math.sqrt(_distance2(tile, c, a, i))
    twice = _twice_area(tile, a, b, c, i)
    return p * q * r * (p + q + r) / (4.0 * twice * twice)


@tile_kernel
def triangle_aspect(tile: Tile, out: Lane) -> None:
    """R / 2r."""
    for i in range(LANES):
        out[i] = _triangle_ratio(tile, 0, 1, 2, i)


@inner
def tet_radii(tile, radius, surface):  # type: ignore[no-untyped-def]
    """12 |V| R, the circumradius without its division, and the total face area."""
    x = tile.x
    for i in range(LANES):
        ax, ay, az = x[1, 0, i], x[1, 1, i], x[1, 2, i]
        bx, by, bz = x[2, 0, i], x[2, 1, i], x[2, 2, i]
        cx, cy, cz = x[3, 0, i], x[3, 1, i], x[3, 2, i]
        a2, b2, c2 = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
        rx = a2 * (by * cz - bz * cy) + b2 * (cy * az - cz * ay) + c2 * (ay * bz - az * by)
        ry = a2 * (bz * cx - bx * cz) + b2 * (cz * ax - cx * az) + c2 * (az * bx - ax * bz)
        rz = a2 * (bx * cy - by * cx) + b2 * (cx * ay - cy * ax) + c2 * (ax * by - ay * bx)
        radius[i] = math.sqrt(rx * rx + ry * ry + rz * rz)
    for i in range(LANES):
        surface[i] = 0.0
    for f in range(4):
        a = tile.face[f]
        for i in range(LANES):
            surface[i] += math.sqrt(a[0, i] ** 2 + a[1, i] ** 2 + a[2, i] ** 2)


@inner
def tet_volume(tile, out):  # type: ignore[no-untyped-def]
    """Signed volume, 0 when the tet is flat."""
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        v = tile.volume[i]
        out[i] = v if abs(v) >= FLAT * longest2 * math.sqrt(longest2) else 0.0


@tile_kernel
def tet_aspect(tile: Tile, out: Lane) -> None:
    """R / 3r, with r = 3 |V| / total area."""
    radius, surface, size = tile.work[0], tile.work[1], tile.work[2]
    tet_radii(tile, radius, surface)
    tet_volume(tile, size)
    for i in range(LANES):
        out[i] = radius[i] * surface[i] / (108.0 * size[i] * size[i]) if size[i] != 0.0 else np.inf


@inner
def _quad_ratio(tile, a, b, c, d, i):  # type: ignore[no-untyped-def]
    """Larger over smaller mean length of the two pairs of opposite edges."""
    p = math.sqrt(_distance2(tile, a, b, i)) + math.sqrt(_distance2(tile, c, d, i))
    q = math.sqrt(_distance2(tile, b, c, i)) + math.sqrt(_distance2(tile, d, a, i))
    low = min(p, q)
    return max(p, q) / low if low > 0.0 else np.inf


@tile_kernel
def quad_aspect(tile: Tile, out: Lane) -> None:
    """Mean length over mean width."""
    for i in range(LANES):
        out[i] = _quad_ratio(tile, 0, 1, 2, 3, i)


@tile_kernel
def hex_aspect(tile: Tile, out: Lane) -> None:
    """Largest over smallest of the three means of four parallel edges."""
    e = tile.edge2
    for i in range(LANES):
        p = math.sqrt(e[0, i]) + math.sqrt(e[2, i]) + math.sqrt(e[4, i]) + math.sqrt(e[6, i])
        q = math.sqrt(e[1, i]) + math.sqrt(e[3, i]) + math.sqrt(e[5, i]) + math.sqrt(e[7, i])
        r = math.sqrt(e[8, i]) + math.sqrt(e[9, i]) + math.sqrt(e[10, i]) + math.sqrt(e[11, i])
        low = min(p, q, r)
        out[i] = max(p, q, r) / low if low > 0.0 else np.inf


@tile_kernel
def worst_face_aspect(tile: Tile, out: Lane) -> None:
    """Worst face: R / 2r of triangles, mean length over mean width of quadrilaterals."""
    tris, quads = tile.tables.tris, tile.tables.quads
    for i in range(LANES):
        out[i] = 0.0
    for r in range(len(tris)):
        a, b, c = tris[r, 0], tris[r, 1], tris[r, 2]
        for i in range(LANES):
            ratio = _triangle_ratio(tile, a, b, c, i)
            out[i] = out[i] if out[i] > ratio else ratio
    for r in range(len(quads)):
        a, b, c, d = quads[r, 0], quads[r, 1], quads[r, 2], quads[r, 3]
        for i in range(LANES):
            ratio = _quad_ratio(tile, a, b, c, d, i)
            out[i] = out[i] if out[i] > ratio else ratio


@tile_kernel
def icem_triangle_aspect(tile: Tile, out: Lane) -> None:
    """Area over the area of the equilateral triangle on the longest edge."""
    for i in range(LANES):
        longest2 = tile.edge_range[1, i]
        out[i] = 2.0 * _twice_area(tile, 0, 1, 2, i) / (math.sqrt(3.0) * longest2) if longest2 > 0.0 else 0.0


@tile_kernel
def icem_tet_aspect(tile: Tile, out: Lane) -> None:
    """V / R^3 over that of the regular tet, signed."""
    radius, surface, size = tile.work[0], tile.work[1], tile.work[2]
    tet_radii(tile, radius, surface)
    tet_volume(tile, size)
    for i in range(LANES):
        v = size[i]
        r = radius[i] / (12.0 * abs(v))
        out[i] = v / (r * r * r) * (27.0 / (8.0 * math.sqrt(3.0))) if v != 0.0 else 0.0


@tile_kernel
def icem_quad_aspect(tile: Tile, out: Lane) -> None:
    """Smallest of the parallelogram areas at the corners, each over the square of either edge there."""
    x = tile.x
    for i in range(LANES):
        out[i] = np.inf
    for k in range(4):
        o, a, b = k, (k + 1) % 4, (k + 3) % 4
        for i in range(LANES):
            ux, uy, uz = x[a, 0, i] - x[o, 0, i], x[a, 1, i] - x[o, 1, i], x[a, 2, i] - x[o, 2, i]
            vx, vy, vz = x[b, 0, i] - x[o, 0, i], x[b, 1, i] - x[o, 1, i], x[b, 2, i] - x[o, 2, i]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            longest2 = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
            ratio = math.sqrt(nx * nx + ny * ny + nz * nz) / longest2 if longest2 > 0.0 else 0.0
            out[i] = min(out[i], ratio)


@tile_kernel
def triangle_size_skew(tile: Tile, out: Lane) -> None:
    """(A_eq - A) / A_eq, A_eq the equilateral triangle in the same circumcircle."""
    for i in range(LANES):
        twice = _twice_area(tile, 0, 1, 2, i)
        product2 = tile.edge2[0, i] * tile.edge2[1, i] * tile.edge2[2, i]
        ratio = 8.0 * twice * twice * twice / (3.0 * math.sqrt(3.0) * product2)
        out[i] = 1.0 - ratio if twice > 0.0 else 1.0


@tile_kernel
def tet_size_skew(tile: Tile, out: Lane) -> None:
    """(V_eq - |V|) / V_eq, V_eq the regular tet in the same circumsphere."""
    icem_tet_aspect(tile, out)
    for i in range(LANES):
        out[i] = 1.0 - abs(out[i])


ROWS = (
    Metric(
        id="gambit.aspect_ratio", title="Aspect ratio", on=LINEAR_TYPES, unit="1", low=1.0, high=math.inf, best="low",
        ideal=1.0, degenerate=math.inf, systems=("GAMBIT: Aspect Ratio", "Pointwise: Aspect Ratio (quad)", "Verdict: radius ratio (tri, tet)"),
        formula="tri R/2r; tet R/3r; quad and hex: largest / smallest mean length of parallel edges; "
        "pyramid and wedge: the worst face by these rules",
        source="GAMBIT 2 User's Guide 3.4; pyramid and wedge have no published formula: worst face, as MAPDL does",
        caveat="Fluent's own aspect ratio is another number: 1.73 for a cube. Undefined where two corners of a triangle coincide.",
        kernel={
            "tri": triangle_aspect, "tet": tet_aspect, "quad": quad_aspect, "hex": hex_aspect,
            "pyramid": worst_face_aspect, "wedge": worst_face_aspect,
        },
        stages={"tet": (edges, faces, volume), "hex": (edges,)},
    ),
    Metric(
        id="icem.aspect_ratio", title="Aspect ratio (ICEM)", on=("tri", "quad", "tet", "hex"), unit="1", low=-1.0, high=1.0,
        best="high", ideal=1.0, degenerate=0.0, systems=("ICEM CFD: Aspect ratio",),
        formula="tri 4A/(sqrt(3) Lmax^2); tet V/R^3 over that of the regular tet; quad: smallest corner parallelogram "
        "area over an adjacent edge squared; hex: shortest / longest edge",
        source="Ansys ICEM CFD help 24.2, edit-mesh quality metrics",
        caveat="Not 1 / GAMBIT's ratio: a right isosceles triangle has 0.577 here and 1.207 there. Negative for a mirrored tet.",
        kernel={"tri": icem_triangle_aspect, "tet": icem_tet_aspect, "quad": icem_quad_aspect, "hex": edge_ratio_inverse},
        stages={"tri": (edges,), "tet": (edges, faces, volume), "hex": (edges,)},
    ),
    Metric(
        id="gambit.equisize_skew", title="Equi-size skew", on=("tri", "tet"), unit="1", low=0.0, high=1.0, best="low",
        ideal=0.0, degenerate=1.0,
        systems=("GAMBIT: EquiSize Skew", "Fluent: Cell Equivolume Skew (its default for tri, tet)", "HyperMesh: vol. skew"),
        formula="(S_eq - S)/S_eq; S_eq = 3 sqrt(3)/4 R^2 (tri), 8 sqrt(3)/27 R^3 (tet), R the circumradius",
        source="GAMBIT 2 User's Guide 3.4; Altair HyperMesh help (vol. skew)",
        kernel={"tri": triangle_size_skew, "tet": tet_size_skew}, stages={"tri": (edges,), "tet": (edges, faces, volume)},
    ),
)  # fmt: skip
