"""Fluent ASCII mesh files (.msh, .msh.gz), written from a `Polymesh`."""

from __future__ import annotations

import gzip
from pathlib import Path

from generate.grid import Polymesh

__all__ = ["write_fluent"]

_CELL = {"tri": 1, "tet": 2, "quad": 3, "hex": 4, "pyramid": 5, "wedge": 6, "polygon": 7, "polyhedron": 7}
_BOUNDARY = {"interior": 2, "wall": 3, "inlet": 10, "outlet": 5, "symmetry": 7}
_WORD = {10: "velocity-inlet", 5: "pressure-outlet", 3: "wall", 7: "symmetry", 2: "interior"}


def write_fluent(path: Path, mesh: Polymesh) -> None:
    """Write the mesh. In 3-D a face's normal points to its first cell (thumb to c0), so nodes are reversed here;
    in 2-D an edge has its first cell on the left, as ours do."""
    n_points, n_faces = len(mesh.points), len(mesh.faces)
    lines = ['(0 "made by samples/make.py")', f"(2 {mesh.dimension})"]
    lines.append(f"(10 (0 1 {n_points:x} 0 {mesh.dimension}))")
    lines.append(f"(12 (0 1 {mesh.n_cells:x} 0))")
    lines.append(f"(13 (0 1 {n_faces:x} 0))")
    lines.append(f"(10 (1 1 {n_points:x} 1 {mesh.dimension})(")
    rows = mesh.points[:, : mesh.dimension].tolist()
    lines += [" ".join(f"{x + 0.0!r}".removesuffix(".0") for x in point) for point in rows]
    lines.append("))")
    names: list[tuple[int, str, str]] = []
    zone = 2
    for name, role, rows in mesh.cell_zones:
        types = [_CELL[mesh.cell_types[row]] for row in rows.tolist()]
        first, last = int(rows[0]) + 1, int(rows[-1]) + 1
        if last - first + 1 != len(rows):
            raise ValueError(f"the cells of zone {name} are not consecutive")
        kind = 1 if role == "fluid" else 17
        if len(set(types)) == 1:
            lines.append(f"(12 ({zone:x} {first:x} {last:x} {kind:x} {types[0]}))")
        else:
            lines.append(f"(12 ({zone:x} {first:x} {last:x} {kind:x} 0)(")
            lines += [" ".join(map(str, types[i : i + 20])) for i in range(0, len(types), 20)]
            lines.append("))")
        names.append((zone, role, name))
        zone += 1
    in_patches = sum(len(rows) for _, _, rows in mesh.patches)
    groups: list[tuple[str, str, list[int]]] = []
    if n_faces > in_patches:
        groups.append(("interior", "interior", list(range(n_faces - in_patches))))
    groups += [(name, role, rows.tolist()) for name, role, rows in mesh.patches]
    for name, role, rows in groups:
        kind = _BOUNDARY[role]
        sizes = {len(mesh.faces[f]) for f in rows}
        shape = sizes.pop() if len(sizes) == 1 else 0
        if max(len(mesh.faces[f]) for f in rows) > 4:
            shape = 5
        lines.append(f"(13 ({zone:x} {rows[0] + 1:x} {rows[-1] + 1:x} {kind:x} {shape})(")
        for f in rows:
            nodes = mesh.faces[f] if mesh.dimension == 2 else mesh.faces[f][::-1]
            count = f"{len(nodes):x} " if shape in (0, 5) else ""
            corners = " ".join(f"{n + 1:x}" for n in nodes)
            lines.append(f"{count}{corners} {mesh.owner[f] + 1:x} {mesh.neighbour[f] + 1:x}")
        lines.append("))")
        names.append((zone, _WORD[kind], name))
        zone += 1
    lines += [f"(45 ({number} {word} {name})())" for number, word, name in names]
    text = "\n".join([*lines, ""]).encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text, 9, mtime=0) if path.suffix == ".gz" else text)
