"""Large meshes made in memory and written fast: jittered blocks of hexahedra and tetrahedra; no loop over cells.

As a command: `python meshes.py CASE SIDE` writes an OpenFOAM case of SIDE ** 3 hexahedra.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from meshwright.audit.mesh import CellBlock, Mesh

__all__ = [
    "as_mesh",
    "block_faces",
    "hex_block",
    "loose_triangles",
    "random_tets",
    "sphere",
    "split_to_tets",
    "thrown_block",
    "write_fluent",
    "write_gmsh41",
    "write_openfoam",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_HEX = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
# The six tetrahedra around the diagonal 0-6 of a cube; the same cut in every cube, so that neighbours fit.
_TETS = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
_SIDES = ("left", "right", "front", "back", "bottom", "top")


def hex_block(n: tuple[int, int, int], jitter: float = 0.2, seed: int = 1) -> tuple[Floats, Ints]:
    """Points and (cells, 8) nodes of a unit cube cut into n hexahedra, x fastest.

    Inner points are moved at random by up to `jitter` of the spacing in each direction; the hull stays flat.
    """
    axes = [np.linspace(0.0, 1.0, k + 1) for k in n]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    move = np.random.default_rng(seed).uniform(-jitter, jitter, points.shape) / np.array(n)
    move[(points == 0.0) | (points == 1.0)] = 0.0
    points += move
    first = _first_nodes(n)
    nodes = np.empty((first.size, 8), dtype=np.int32)
    for column, (i, j, k) in enumerate(_HEX):
        nodes[:, column] = first + _step(n, i, j, k)
    return points, nodes


def _step(n: tuple[int, int, int], i: int, j: int, k: int) -> int:
    """Distance in point numbers of a step (i, j, k) through the block."""
    return i + (n[0] + 1) * (j + (n[1] + 1) * k)


def _first_nodes(n: tuple[int, int, int]) -> Ints:
    k, j, i = np.meshgrid(*(np.arange(m, dtype=np.int32) for m in n[::-1]), indexing="ij")
    return (i + (n[0] + 1) * (j + (n[1] + 1) * k)).ravel().astype(np.int32)


def split_to_tets(hexes: Ints) -> Ints:
    """(6 cells, 4) nodes: every hexahedron as six tetrahedra, conforming."""
    return np.concatenate([hexes[:, tet] for tet in _TETS])


def thrown_block(n: int, jitter: float, seed: int) -> tuple[Floats, Ints]:
    """Points and nodes of a unit cube in n^3 hexahedra, its inner points thrown about by up to `jitter` of the spacing.

    The hull is the regular grid. Cells are tangled from a jitter of about 0.5 on.
    """
    points, nodes = hex_block((n, n, n), 0.0)
    inner = ((points > 1e-9) & (points < 1.0 - 1e-9)).all(axis=1)
    points[inner] += np.random.default_rng(seed).uniform(-jitter / n, jitter / n, (int(inner.sum()), 3))
    return points, nodes


def random_tets(n: int, seed: int = 7) -> tuple[Floats, Ints]:
    """Points and nodes of the Delaunay tets of n random points in the unit cube: slivers everywhere, none inverted.

    The hull is a jittered grid with flat sides; flat tets in it are left out.
    """
    r = np.random.default_rng(seed)
    k = max(3, round(n ** (1 / 3) * 0.9))
    axis = np.linspace(0.0, 1.0, k + 1)
    grid = np.array(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1).T
    hull = grid[((grid == 0.0) | (grid == 1.0)).any(axis=1)]
    move = r.uniform(-0.18 / k, 0.18 / k, hull.shape)
    move[(hull == 0.0) | (hull == 1.0)] = 0.0
    points = np.vstack([hull + move, 0.5 / k + (1.0 - 1.0 / k) * r.random((n, 3))])
    tets = Delaunay(points).simplices.astype(np.int32)
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    size = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
    tets[size < 0.0] = tets[size < 0.0][:, [0, 2, 1, 3]]
    return points, tets[np.abs(size) > 1e-13]


def sphere(levels: int) -> tuple[Floats, Ints]:
    """Points and triangles of the unit sphere: an octahedron, its triangles cut in four `levels` times."""
    corners = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    points = [np.array(p, float) for p in corners]
    tris = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(levels):
        middle: dict[tuple[int, int], int] = {}

        def half(a: int, b: int, middle: dict[tuple[int, int], int] = middle) -> int:
            key = (min(a, b), max(a, b))
            if key not in middle:
                p = points[a] + points[b]
                middle[key] = len(points)
                points.append(p / np.linalg.norm(p))
            return middle[key]

        finer = []
        for a, b, c in tris:
            ab, bc, ca = half(a, b), half(b, c), half(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        tris = finer
    return np.array(points), np.array(tris, np.int32)


def loose_triangles(levels: int, seed: int = 4) -> Floats:
    """(k, 3, 3) corners of the triangles of a sphere with every fault of a bad STL file.

    A seventh is turned, three points are missing, and there are a T-junction, three second copies, two fins, a flat
    triangle and a speck of eight far away; all corners are off by up to 1e-8, the order is random.
    """
    r = np.random.default_rng(seed)
    points, tris = sphere(levels)
    holes = [10, 100, 200]
    corners = points[tris[~np.isin(tris, holes).any(axis=1)]]
    corners[::7] = corners[::7, ::-1]
    a, b, c = corners[50].copy()
    middle = 0.5 * (a + b)
    corners[50] = [a, middle, c]  # the neighbour across a-b does not know of the middle
    extra = [np.array([[middle, b, c]]), corners[[5, 60, 90]]]
    extra += [np.array([[x[0], x[1], 1.2 * x.mean(axis=0)]]) for x in corners[[20, 70]]]
    extra += [np.array([[x[0], x[1], 0.5 * (x[0] + x[1])]]) for x in corners[[30]]]
    extra += [0.01 * points[tris[:8]] + [3.0, 0.0, 0.0]]
    loose = np.vstack([corners, *extra])
    loose = loose + r.uniform(-1e-8, 1e-8, loose.shape)
    return loose[r.permutation(len(loose))]


def as_mesh(kind: str, points: Floats, nodes: Ints) -> Mesh:
    """A `Mesh` of one block."""
    return Mesh(points, (CellBlock(kind, np.arange(len(nodes), dtype=np.int32), nodes),))


def block_faces(n: tuple[int, int, int]) -> tuple[Ints, Ints, Ints, list[tuple[str, int]]]:
    """Faces (f, 4) of a hex block, owner (f,), neighbour (inner faces only), and (side, count) of the six sides.

    Inner faces come in upper-triangular order: by owner, then by neighbour. Normals leave the owner.
    """
    first = _first_nodes(n)
    cells = np.arange(first.size, dtype=np.int32)
    shape = n[::-1]
    k, j, i = (axis.ravel() for axis in np.indices(shape, dtype=np.int32, sparse=False))
    steps = (1, n[0], n[0] * n[1])
    corner = {
        axis: [_step(n, *_HEX[c]) for c in face] for axis, face in enumerate(((1, 2, 6, 5), (3, 7, 6, 2), (4, 5, 6, 7)))
    }
    inside = np.column_stack([i < n[0] - 1, j < n[1] - 1, k < n[2] - 1])
    every = np.empty((first.size, 3, 4), dtype=np.int32)
    other = np.empty((first.size, 3), dtype=np.int32)
    for axis in range(3):
        for column, step in enumerate(corner[axis]):
            every[:, axis, column] = first + step
        other[:, axis] = cells + steps[axis]
    owner = np.repeat(cells[:, None], 3, axis=1)[inside]
    faces, owners, sides = [every[inside]], [owner], []
    neighbour = other[inside]
    outer = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
    ends = (i == 0, i == n[0] - 1, j == 0, j == n[1] - 1, k == 0, k == n[2] - 1)
    for name, face, chosen in zip(_SIDES, outer, ends, strict=True):
        rows = cells[chosen]
        faces.append(np.stack([first[rows] + _step(n, *_HEX[c]) for c in face], axis=1).astype(np.int32))
        owners.append(rows)
        sides.append((name, len(rows)))
    return np.concatenate(faces), np.concatenate(owners), neighbour, sides


def _foam_head(kind: str, name: str, form: str = "binary", note: str = "") -> bytes:
    remark = f'    note        "{note}";\n' if note else ""
    return (
        f"FoamFile\n{{\n    version     2.0;\n    format      {form};\n    class       {kind};\n{remark}"
        f'    arch        "LSB;label=32;scalar=64";\n    location    "constant/polyMesh";\n'
        f"    object      {name};\n}}\n\n"
    ).encode()


def _foam_list(file: BinaryIO, array: NDArray, count: int) -> None:
    file.write(f"\n{count}\n(".encode())
    np.ascontiguousarray(array).tofile(file)
    file.write(b")\n")


def write_openfoam(case: Path, n: tuple[int, int, int], jitter: float = 0.2) -> None:
    """A case with a binary polyMesh of prod(n) jittered hexahedra, all six sides walls."""
    points, _ = hex_block(n, jitter)
    faces, owner, neighbour, sides = block_faces(n)
    folder = case / "constant" / "polyMesh"
    folder.mkdir(parents=True)
    note = f"nPoints:{len(points)} nCells:{np.prod(n)} nFaces:{len(faces)} nInternalFaces:{len(neighbour)}"
    with (folder / "points").open("wb") as file:
        file.write(_foam_head("vectorField", "points"))
        _foam_list(file, points, len(points))
    with (folder / "faces").open("wb") as file:
        file.write(_foam_head("faceCompactList", "faces"))
        _foam_list(file, np.arange(0, faces.size + 1, 4, dtype=np.int32), len(faces) + 1)
        _foam_list(file, faces, faces.size)
    for name, labels in (("owner", owner), ("neighbour", neighbour)):
        with (folder / name).open("wb") as file:
            file.write(_foam_head("labelList", name, note=note))
            _foam_list(file, labels, len(labels))
    start = len(neighbour)
    text = [f"{len(sides)}\n("]
    for name, count in sides:
        text.append(f"{name}\n{{\n    type wall;\n    nFaces {count};\n    startFace {start};\n}}")
        start += count
    (folder / "boundary").write_bytes(
        _foam_head("polyBoundaryMesh", "boundary", "ascii") + "\n".join([*text, ")\n"]).encode()
    )
    system = case / "system"
    system.mkdir()
    control = "application checkMesh;\nstartFrom startTime;\nstartTime 0;\nendTime 1;\ndeltaT 1;\nwriteInterval 1;\n"
    schemes = "gradSchemes {}\ndivSchemes {}\nlaplacianSchemes {}\n"
    for name, body in (("controlDict", control), ("fvSchemes", schemes), ("fvSolution", "")):
        head = f"FoamFile\n{{\n    version 2.0;\n    format ascii;\n    class dictionary;\n    object {name};\n}}\n"
        (system / name).write_text(head + body)


def _text_rows(file: BinaryIO, rows: NDArray, form: str) -> None:
    """Rows of numbers as text, a slice at a time: one C-level format call a slice, no loop over rows."""
    line = " ".join([form] * rows.shape[1]) + "\n"
    for start in range(0, len(rows), 50_000):
        part = rows[start : start + 50_000]
        file.write(((line * len(part)) % tuple(part.ravel().tolist())).encode())


def write_fluent(path: Path, n: tuple[int, int, int]) -> None:
    """An ASCII Fluent file of prod(n) jittered hexahedra."""
    points, _ = hex_block(n)
    faces, owner, neighbour, sides = block_faces(n)
    cells, inner = int(np.prod(n)), len(neighbour)
    rows = np.zeros((len(faces), 6), dtype=np.int32)
    rows[:, :4] = faces[:, ::-1] + 1
    rows[:, 4] = owner + 1
    rows[:inner, 5] = neighbour + 1
    with path.open("wb") as file:
        file.write(
            f"(2 3)\n(10 (0 1 {len(points):x} 0 3))\n(12 (0 1 {cells:x} 0))\n(13 (0 1 {len(faces):x} 0))\n".encode()
        )
        file.write(f"(10 (1 1 {len(points):x} 1 3)(\n".encode())
        _text_rows(file, points, "%.12g")
        file.write(f"))\n(12 (2 1 {cells:x} 1 4))\n(13 (3 1 {inner:x} 2 4)(\n".encode())
        _text_rows(file, rows[:inner], "%x")
        file.write(b"))\n")
        start = inner
        for zone, (_, count) in enumerate(sides, 4):
            file.write(f"(13 ({zone:x} {start + 1:x} {start + count:x} 3 4)(\n".encode())
            _text_rows(file, rows[start : start + count], "%x")
            file.write(b"))\n")
            start += count
        names = [
            (2, "fluid", "block"),
            (3, "interior", "inside"),
            *((z, "wall", s) for z, (s, _) in enumerate(sides, 4)),
        ]
        file.write("".join(f"(45 ({zone} {kind} {name})())\n" for zone, kind, name in names).encode())


def write_gmsh41(path: Path, points: Floats, nodes: Ints) -> None:
    """An ASCII Gmsh 4.1 file of one block of tetrahedra or hexahedra."""
    number = {4: 4, 8: 5}[nodes.shape[1]]
    with path.open("wb") as file:
        file.write(b'$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 "block"\n$EndPhysicalNames\n')
        file.write(b"$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 1 0\n$EndEntities\n")
        count = len(points)
        file.write(f"$Nodes\n1 {count} 1 {count}\n3 1 0 {count}\n".encode())
        _text_rows(file, np.arange(1, count + 1)[:, None], "%d")
        _text_rows(file, points, "%.12g")
        count = len(nodes)
        file.write(f"$EndNodes\n$Elements\n1 {count} 1 {count}\n3 1 {number} {count}\n".encode())
        _text_rows(file, np.column_stack([np.arange(1, count + 1), nodes + 1]), "%d")
        file.write(b"$EndElements\n")


if __name__ == "__main__":
    write_openfoam(Path(sys.argv[1]), (int(sys.argv[2]),) * 3)
