"""Writes small meshes in every dialect of Gmsh's MSH, without any code of the reader.

Cells are pairs (type, point rows); coordinates are decimal fractions.
"""

import struct

_FACES = {
    "hex": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "tet": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tri": ((0, 1), (1, 2), (2, 0)),
}
_GMSH = {"tri": (2, 2), "quad": (3, 2), "tet": (4, 3), "hex": (5, 3), "wedge": (6, 3), "pyramid": (7, 3)}


def faces_of(cells):
    """(inner, outer): [(nodes that turn outwards from the first cell, first cell, other cell or -1)], rows from 0."""
    found = {}
    for row, (kind, nodes) in enumerate(cells):
        for face in _FACES[kind]:
            ring = tuple(nodes[i] for i in face)
            found.setdefault(frozenset(ring), []).append((ring, row))
    rows = [(pair[0][0], pair[0][1], pair[1][1] if len(pair) == 2 else -1) for pair in found.values()]
    return [row for row in rows if row[2] >= 0], [row for row in rows if row[2] < 0]


def _elements(cells):
    """[(Gmsh's number, dimension, nodes from 1)]: the outer faces first, as Gmsh writes them."""
    outer = [("tri" if len(ring) == 3 else "quad", ring) for ring, *_ in faces_of(cells)[1] if len(ring) > 2]
    return [(*_GMSH[kind], [node + 1 for node in nodes]) for kind, nodes in (*outer, *cells)]


def write_gmsh(version, points, cells, order=""):
    """A Gmsh file; order: "<" or ">" for binary."""
    points = [(*point, 0.0)[:3] for point in points]
    elements = _elements(cells)
    text = (_old, _middle, _blocks, _blocks)[("1", "2.2", "4.0", "4.1").index(version)]
    if text is _old:
        return _old(points, elements).encode()
    head = f"$MeshFormat\n{version} {int(bool(order))} 8\n".encode()
    head += (struct.pack(order + "i", 1) + b"\n" if order else b"") + b"$EndMeshFormat\n"
    top = max(dimension for _, dimension, _ in elements)
    names = f'{top} {10 - top} "water"\n' + ('2 8 "hull"\n' if top == 3 else "")
    head += f"$PhysicalNames\n{names.count(chr(10))}\n{names}$EndPhysicalNames\n".encode()
    parts = _packed if order else text
    nodes, rows = parts(version, points, elements, order)
    if text is _blocks:
        head += b"$Entities\n%s\n$EndEntities\n" % _entities(top, points, order)
    return head + b"$Nodes\n%s\n$EndNodes\n$Elements\n%s\n$EndElements\n" % (nodes, rows)


def _old(points, elements):
    rows = [f"{i} {x:.5f} {y:.5f} {z:.5f}" for i, (x, y, z) in enumerate(points, 1)]
    lines = ["$NOD", str(len(rows)), *rows, "$ENDNOD", "$ELM", str(len(elements))]
    for i, (number, dimension, nodes) in enumerate(elements, 1):
        lines.append(" ".join(map(str, (i, number, 10 - dimension, 1, len(nodes), *nodes))))
    return "\n".join([*lines, "$ENDELM", ""])


def _middle(_version, points, elements, _order):
    nodes = [f"{i} {x:.5f} {y:.5f} {z:.5f}" for i, (x, y, z) in enumerate(points, 1)]
    rows = [
        " ".join(map(str, (i, number, 2, 10 - dimension, 1, *nodes)))
        for i, (number, dimension, nodes) in enumerate(elements, 1)
    ]
    return ["\n".join([str(len(part)), *part]).encode() for part in (nodes, rows)]


def _runs(elements):
    """[(number, dimension, first id, [nodes])]: neighbours of one type together."""
    runs = []
    for i, (number, dimension, nodes) in enumerate(elements, 1):
        if not runs or runs[-1][0] != number:
            runs.append((number, dimension, i, []))
        runs[-1][3].append(nodes)
    return runs


def _entities(top, points, order):
    """One surface, and a volume in space, each with its physical group and without bounding entities."""
    box = [*map(min, *points), *map(max, *points)]
    found = [10 - dimension for dimension in (2, 3) if dimension <= top]
    counts = (0, 0, 1, len(found) - 1)
    if order:
        rows = (struct.pack(order + "i6dQiQ", 1, *box, 1, group, 0) for group in found)
        return struct.pack(order + "4Q", *counts) + b"".join(rows)
    corners = " ".join(f"{value:.5f}" for value in box)
    return "\n".join([" ".join(map(str, counts)), *(f"1 {corners} 1 {group} 0" for group in found)]).encode()


def _blocks(version, points, elements, _order):
    runs, n, m = _runs(elements), len(points), len(elements)
    top = max(dimension for _, dimension, _ in elements)
    new = version == "4.1"
    rows = [f"{x:.5f} {y:.5f} {z:.5f}" for x, y, z in points]
    if new:
        nodes = [f"1 {n} 1 {n}", f"{top} 1 0 {n}", *map(str, range(1, n + 1)), *rows]
    else:
        nodes = [f"1 {n}", f"1 {top} 0 {n}", *(f"{i} {row}" for i, row in enumerate(rows, 1))]
    lines = [f"{len(runs)} {m} 1 {m}" if new else f"{len(runs)} {m}"]
    for number, dimension, first, cells in runs:
        lines.append(f"{dimension} 1 {number} {len(cells)}" if new else f"1 {dimension} {number} {len(cells)}")
        lines += [" ".join(map(str, (first + k, *nodes))) for k, nodes in enumerate(cells)]
    return "\n".join(nodes).encode(), "\n".join(lines).encode()


def _packed(version, points, elements, order):
    runs, n, m = _runs(elements), len(points), len(elements)
    top = max(dimension for _, dimension, _ in elements)

    def pack(form, *values):
        return struct.pack(order + form, *values)

    if version == "2.2":
        nodes = b"%d\n" % n + b"".join(pack("i3d", i, *point) for i, point in enumerate(points, 1))
        rows = b"%d\n" % m
        for number, dimension, first, cells in runs:
            rows += pack("3i", number, len(cells), 2)
            for k, cell in enumerate(cells):
                rows += pack(f"{3 + len(cell)}i", first + k, 10 - dimension, 1, *cell)
        return nodes, rows
    nodes = pack(f"4Q3iQ{n}Q", 1, n, 1, n, top, 1, 0, n, *range(1, n + 1)) + b"".join(pack("3d", *p) for p in points)
    rows = pack("4Q", len(runs), m, 1, m)
    for number, dimension, first, cells in runs:
        rows += pack("3iQ", dimension, 1, number, len(cells))
        rows += b"".join(pack(f"{1 + len(cell)}Q", first + k, *cell) for k, cell in enumerate(cells))
    return nodes, rows
