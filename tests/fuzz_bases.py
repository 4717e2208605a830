"""Small sound meshes in every dialect of the three own readers, and damage by the file's own grammar.

No code of the readers is used. Coordinates are decimal fractions and node numbers stay below 120, for the tool that
damages the files takes lines of integers for cells and 120 for a node that is not there.
"""

import gzip
import random
import re
import runpy
import shutil
import struct
from pathlib import Path

_HERE = Path(__file__).parent
_SAMPLES = _HERE.parent / "samples"
_FOAM = runpy.run_path(str(_HERE / "foam_writer.py"))

# A hexahedron, a pyramid on top of it, a wedge beside it and a tetrahedron on the wedge.
_LATTICE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), (2, 0, 0), (2, 0, 1))
_SOLID = [(x * 1.0625 + 0.1875, y * 0.9375 + 0.3125, z * 1.1875 - 0.5625) for x, y, z in _LATTICE]
_SOLID += [(0.71875, 0.78125, 2.28125), (1.59375, 0.65625, 1.71875)]
_SOLID_CELLS = (
    ("hex", (0, 1, 2, 3, 4, 5, 6, 7)),
    ("pyramid", (4, 5, 6, 7, 10)),
    ("wedge", (1, 8, 2, 5, 9, 6)),
    ("tet", (5, 9, 6, 11)),
)
_FLAT = [(x * 1.0625 + 0.1875, y * 0.9375 + 0.3125) for y in (0, 1) for x in (0, 1, 2)] + [(2.96875, 0.84375)]
_FLAT_CELLS = (("quad", (0, 1, 4, 3)), ("tri", (1, 2, 4)), ("tri", (2, 5, 4)), ("tri", (2, 6, 5)))
_FACES = {
    "hex": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "tet": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tri": ((0, 1), (1, 2), (2, 0)),
}
_FLUENT = {"tri": 1, "tet": 2, "quad": 3, "hex": 4, "pyramid": 5, "wedge": 6}
_GMSH = {"tri": (2, 2), "quad": (3, 2), "tet": (4, 3), "hex": (5, 3), "wedge": (6, 3), "pyramid": (7, 3)}


def _faces(cells):
    """(inner, outer): [(nodes that turn outwards from the first cell, first cell, other cell or -1)], rows from 0."""
    found = {}
    for row, (kind, nodes) in enumerate(cells):
        for face in _FACES[kind]:
            ring = tuple(nodes[i] for i in face)
            found.setdefault(frozenset(ring), []).append((ring, row))
    rows = [(pair[0][0], pair[0][1], pair[1][1] if len(pair) == 2 else -1) for pair in found.values()]
    return [row for row in rows if row[2] >= 0], [row for row in rows if row[2] < 0]


# --- Fluent -----------------------------------------------------------------------------------------------------
def _fluent(points, cells, binary=0):
    """A Fluent file; binary: bytes of a real, 0 for text."""
    dimension = len(points[0])
    prefix = {0: "", 4: "20", 8: "30"}[binary]
    groups = [group for group in _faces(cells) if group]
    n_faces = sum(map(len, groups))

    def section(number, header, rows):
        flat = [value for row in rows for value in row]
        if not binary:
            form = (lambda v: f"{v:.5f}") if number == 10 else (lambda v: f"{v:x}")
            body = "\n".join(" ".join(map(form, row)) for row in rows)
            return f"({number} ({header})(\n{body}\n))\n".encode()
        form = "i" if number != 10 else "f" if binary == 4 else "d"
        body = b"(" + struct.pack(f"<{len(flat)}{form}", *flat) + b")"
        mark = f"{prefix}{number}"
        return f"({mark} ({header})\n".encode() + body + f"\nEnd of Binary Section   {mark})\n".encode()

    out = f'(0 "a comment")\n(2 {dimension})\n(10 (0 1 {len(points):x} 0 {dimension}))\n'.encode()
    out += f"(12 (0 1 {len(cells):x} 0))\n(13 (0 1 {n_faces:x} 0))\n".encode()
    out += section(10, f"1 1 {len(points):x} 1 {dimension}", points)
    out += section(12, f"2 1 {len(cells):x} 1 0", [[_FLUENT[kind] for kind, _ in cells]])
    first = 1
    for zone, group in enumerate(groups, 3):
        rows = []
        for ring, own, other in group:
            # In space a face turns towards its first cell here; in the plane that cell lies to its left.
            nodes = [node + 1 for node in (ring[::-1] if dimension == 3 else ring)]
            rows.append([*([len(ring)] if dimension == 3 else []), *nodes, own + 1, other + 1])
        last = first + len(rows) - 1
        kind, shape = (2 if zone == 3 else 3), (0 if dimension == 3 else 2)
        out += section(13, f"{zone:x} {first:x} {last:x} {kind:x} {shape}", rows)
        first = last + 1
    return out + b"(45 (2 fluid water)())\n(45 (3 interior inside)())\n(45 (4 wall hull)())\n"


def _fluent_bases():
    tests = runpy.run_path(str(_HERE / "test_fluent.py"))
    longer = lambda text: re.sub(r"(?<=\d)\.(\d?\d?)(?=\s)", lambda m: f".{m[1]:0<4}", text).encode()  # noqa: E731
    pairs = tests["TWO_HEXES"].replace("(13 (0 1 B 0))", "(13 (0 1 d 0))")
    pairs = pairs.replace(
        "(13 (4 1 1 2 4) (\n2 5 b 8 2 1\n))",
        "(13 (4 1 1 3ea 4)(\n2 5 b 8 2 1\n))\n(13 (6 c d 18 4)(\n2 5 b 8 2 0\n8 b 5 2 1 0\n))",
    )
    yield "solid.msh", _fluent(_SOLID, _SOLID_CELLS)
    yield "solid8.msh", _fluent(_SOLID, _SOLID_CELLS, binary=8)
    yield "flat.msh", _fluent(_FLAT, _FLAT_CELLS)
    yield "packed.msh.gz", gzip.compress(_fluent(_SOLID, _SOLID_CELLS), mtime=0)
    yield "solid4.msh", _fluent(_SOLID, _SOLID_CELLS, binary=4)
    yield "flat4.msh", _fluent(_FLAT, _FLAT_CELLS, binary=4)
    yield "split2.msh", longer(tests["REFINED"])
    yield "split3.msh", longer(tests["hex_refined_beside_a_whole_one"]())
    yield "pairs.msh", longer(pairs + "(61 (1 1)(c d))\n(18 (1 1 5 5)(2 3))\n")
    yield "bigend.msh", tests["binary"](tests["TWO_HEXES"], width=8, order=">")
    yield "polyhedra.msh", (_SAMPLES / "cells" / "polyhedron.fluent.msh").read_bytes()


# --- Gmsh -------------------------------------------------------------------------------------------------------
def _elements(cells):
    """[(Gmsh's number, dimension, nodes from 1)]: the outer faces first, as Gmsh writes them."""
    outer = [("tri" if len(ring) == 3 else "quad", ring) for ring, *_ in _faces(cells)[1] if len(ring) > 2]
    return [(*_GMSH[kind], [node + 1 for node in nodes]) for kind, nodes in (*outer, *cells)]


def _gmsh(version, points, cells, order=""):
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


def _with_fractions(path):
    """A sample of ours with its coordinates written as decimal fractions."""
    head, nodes, rest = re.split(r"(?<=\$Nodes\n)|(?=\$EndNodes)", path.read_text())
    wanted = 3 if " 4." in head or "\n4." in head else 4
    lines = []
    for line in nodes.splitlines():
        words = line.split()
        if len(words) == wanted and (wanted == 3 or lines):
            words[-3:] = (f"{float(word):.7f}" for word in words[-3:])
        lines.append(" ".join(words))
    return (head + "\n".join([*lines, ""]) + rest).encode()


def _gmsh_bases():
    yield "text22.msh", _gmsh("2.2", _SOLID, _SOLID_CELLS)
    yield "text41.msh", _gmsh("4.1", _SOLID, _SOLID_CELLS)
    yield "little22.msh", _gmsh("2.2", _SOLID, _SOLID_CELLS, "<")
    yield "little41.msh", _gmsh("4.1", _SOLID, _SOLID_CELLS, "<")
    yield "big22.msh", _gmsh("2.2", _SOLID, _SOLID_CELLS, ">")
    yield "big41.msh", _gmsh("4.1", _SOLID, _SOLID_CELLS, ">")
    yield "old.msh", _gmsh("1", _SOLID, _SOLID_CELLS)
    yield "text40.msh", _gmsh("4.0", _SOLID, _SOLID_CELLS)
    yield "flat22.msh", _gmsh("2.2", _FLAT, _FLAT_CELLS)
    yield "packed.msh.gz", gzip.compress(_gmsh("4.1", _FLAT, _FLAT_CELLS), mtime=0)
    yield "curved22.msh", _with_fractions(_SAMPLES / "cells" / "tri6.msh")
    yield "curved41.msh", _with_fractions(_SAMPLES / "cells" / "tet10.v41.msh")


# --- OpenFOAM ---------------------------------------------------------------------------------------------------
FOAM_FILES = _FOAM["FILES"]


def _foam_bases(folder):
    """Files <variant>_<role>; the whole polyMesh they belong to stands in <variant>/polyMesh beside them."""
    for name, how in _FOAM["ENCODINGS"].items():
        variant = name.replace("_", "")
        sound = _FOAM["write_polymesh"](folder / variant / "polyMesh", **how)
        for role in FOAM_FILES:
            if how.get("gz"):
                (sound / f"{role}.gz").rename(sound / role)
            yield Path(shutil.copy(sound / role, folder / f"{variant}_{role}"))


def write_bases(reader, folder):
    """The base files of one reader (fluent, gmsh, openfoam) in `folder`, the most telling first."""
    folder.mkdir(parents=True)
    if reader == "openfoam":
        return list(_foam_bases(folder))
    files = []
    for name, content in {"fluent": _fluent_bases, "gmsh": _gmsh_bases}[reader]():
        files.append(folder / name)
        files[-1].write_bytes(content)
    return files


# --- damage that knows where the numbers stand -------------------------------------------------------------------
_INTEGER = re.compile(rb"(?<![\w.+\-])\d+(?![\w.])")
_LIST = re.compile(rb"\n(\d+)(?=[\s{(])")
_VALUES = (b"0", b"1", b"-1", b"7", b"2147483647", b"4294967296", b"1000000000000", b"9223372036854775808", b"1.5", b"x")


def more_cases(path, seed, n):
    """(kind, expect, note, content): integers of a text or of a binary file's headings exchanged, dropped, doubled.

    Counts of OpenFOAM's lists, which stand alone on their line, are certain to be wrong afterwards.
    """
    data = Path(path).read_bytes()
    rng = random.Random(f"{seed}/{Path(path).name}")  # noqa: S311 - cases to be repeated, nothing secret
    if data[:2] == b"\x1f\x8b":
        return
    spans = [match.span() for match in _INTEGER.finditer(data)]
    for _ in range(n if spans else 0):
        start, stop = rng.choice(spans)
        new = rng.choice((*_VALUES, b"", data[slice(*rng.choice(spans))], data[start:stop] + b" " + data[start:stop]))
        yield "number", "any", f"{data[start:stop]!r} -> {new!r} at {start}", data[:start] + new + data[stop:]
    if b"FoamFile" not in data:
        return
    body = data.index(b"// * *")
    for match in list(_LIST.finditer(data, body))[:3]:
        count = int(match[1])
        for value in (0, count - 1, count + 1, -1, 10**9, 2**31, 10**12, 2**63, 10**25):
            if value != count and count:
                new = data[: match.start(1)] + b"%d" % value + data[match.end(1) :]
                yield "count", "reject", f"count {count} -> {value} at {match.start(1)}", new
