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
_GMSH = runpy.run_path(str(_HERE / "gmsh_writer.py"))
_faces, _gmsh = _GMSH["faces_of"], _GMSH["write_gmsh"]
_FOAM = runpy.run_path(str(_HERE / "foam_writer.py"))

# A hexahedron, a pyramid on top of it, a wedge beside it and a tetrahedron on the wedge.
_LATTICE = (
    (0, 0, 0),
    (1, 0, 0),
    (1, 1, 0),
    (0, 1, 0),
    (0, 0, 1),
    (1, 0, 1),
    (1, 1, 1),
    (0, 1, 1),
    (2, 0, 0),
    (2, 0, 1),
)
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
_FLUENT = {"tri": 1, "tet": 2, "quad": 3, "hex": 4, "pyramid": 5, "wedge": 6}


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
        if how.get("gz"):
            for role in FOAM_FILES:
                (sound / f"{role}.gz").rename(sound / role)
        # The other files are labels again, or text in every variant.
        for role in FOAM_FILES if variant in ("ascii", "binary") else ("points", "faces", "faceZones"):
            yield Path(shutil.copy(sound / role, folder / f"{variant}_{role}"))


_NO_MESH = re.compile(rb"\s*\((?:0|1|18|37|38|39|40|41|45|64)\s+[(\"]")
_MESH = re.compile(rb"\((?:[23]0)?(?:10|12|13|58|59|61|62)\s*\(")


def ends_between_names(whole, cut):
    """Whether a Fluent file lacks only whole sections that bring no mesh: nobody can tell, for it has no end mark."""
    rest = whole[len(cut) :]
    return whole.startswith(cut) and _NO_MESH.match(rest) is not None and _MESH.search(rest) is None


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
_VALUES = (
    b"0",
    b"1",
    b"-1",
    b"7",
    b"2147483647",
    b"4294967296",
    b"1000000000000",
    b"9223372036854775808",
    b"1.5",
    b"x",
)


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
