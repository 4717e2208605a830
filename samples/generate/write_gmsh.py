"""Gmsh ASCII files, versions 2.2 and 4.1, written from a `Grid`."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
from generate.grid import Boundary, Cells, Grid

__all__ = ["write_gmsh"]

_NUMBER = {
    "line": 1, "tri": 2, "quad": 3, "tet": 4, "hex": 5, "wedge": 6, "pyramid": 7,
    "tri6": 9, "tet10": 11, "quad8": 16, "hex20": 17,
}  # fmt: skip
_DIMENSION = {"line": 1, "tri": 2, "quad": 2, "tri6": 2, "quad8": 2}
# Gmsh lists the mid-edge nodes of these two types in its own order of edges.
_FROM_VTK = {
    "tet10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "hex20": [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14],
}


def write_gmsh(path: Path, grid: Grid, version: str = "2.2") -> None:
    """Write the grid; every zone is a physical group and an entity of its own. `.gz` is packed, without a date."""
    text = {"2.2": _text_22, "4.1": _text_41}[version](grid)
    path.parent.mkdir(parents=True, exist_ok=True)
    packed = gzip.compress(text.encode(), 9, mtime=0) if path.suffix == ".gz" else text.encode()
    path.write_bytes(packed)


def _zones(grid: Grid) -> dict[tuple[int, str], int]:
    """(dimension, name) -> tag, boundary zones after the cell zones."""
    tags: dict[tuple[int, str], int] = {}
    for part in _parts(grid):
        tags.setdefault((_DIMENSION.get(part.type, 3), part.zone), len(tags) + 1)
    return tags


def _parts(grid: Grid) -> list[Cells | Boundary]:
    return [*grid.cells, *grid.boundary]


def _names(grid: Grid) -> list[str]:
    zones = _zones(grid)
    rows = [f'{dimension} {tag} "{name}"' for (dimension, name), tag in zones.items()]
    return ["$PhysicalNames", str(len(rows)), *rows, "$EndPhysicalNames"]


def _ordered(part: Cells | Boundary) -> list[list[int]]:
    return (part.nodes[:, _FROM_VTK.get(part.type, list(range(part.nodes.shape[1])))] + 1).tolist()


def _triple(values: np.ndarray) -> str:
    return " ".join(f"{float(v) + 0.0!r}".removesuffix(".0") for v in values)  # + 0.0 turns -0.0 into 0.0


def _text_22(grid: Grid) -> str:
    zones = _zones(grid)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", *_names(grid)]
    lines += ["$Nodes", str(len(grid.points))]
    lines += [f"{i} {_triple(p)}" for i, p in enumerate(grid.points, 1)]
    elements: list[str] = []
    for part in _parts(grid):
        tag = zones[_DIMENSION.get(part.type, 3), part.zone]
        for nodes in _ordered(part):
            elements.append(f"{len(elements) + 1} {_NUMBER[part.type]} 2 {tag} {tag} {' '.join(map(str, nodes))}")
    lines += ["$EndNodes", "$Elements", str(len(elements)), *elements, "$EndElements", ""]
    return "\n".join(lines)


def _text_41(grid: Grid) -> str:
    zones = _zones(grid)
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", *_names(grid), "$Entities"]
    lines.append(" ".join(str(sum(d == dimension for d, _ in zones)) for dimension in range(4)))
    box = f"{_triple(grid.points.min(axis=0))} {_triple(grid.points.max(axis=0))}"
    for dimension in (1, 2, 3):
        lines += [f"{tag} {box} 1 {tag} 0" for (d, _), tag in zones.items() if d == dimension]
    top = max(d for d, _ in zones)
    holder = next(tag for (d, _), tag in zones.items() if d == top)
    n = len(grid.points)
    lines += ["$EndEntities", "$Nodes", f"1 {n} 1 {n}", f"{top} {holder} 0 {n}"]
    lines += [str(i) for i in range(1, n + 1)]
    lines += [_triple(p) for p in grid.points]
    parts = _parts(grid)
    total = sum(len(part.nodes) for part in parts)
    lines += ["$EndNodes", "$Elements", f"{len(parts)} {total} 1 {total}"]
    number = 1
    for part in parts:
        dimension = _DIMENSION.get(part.type, 3)
        lines.append(f"{dimension} {zones[dimension, part.zone]} {_NUMBER[part.type]} {len(part.nodes)}")
        for nodes in _ordered(part):
            lines.append(f"{number} {' '.join(map(str, nodes))}")
            number += 1
    lines += ["$EndElements", ""]
    return "\n".join(lines)
