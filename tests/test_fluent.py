"""Fluent legacy files: every section that carries mesh, strictness, and the real files held against other counts."""

import gzip
import itertools
import struct

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import ReadError
from meshwright.audit.readers.fluent.reader import read_fluent, sniff_fluent
from meshwright.audit.readers.source import open_source

# --- two hexes side by side, x from 0 to 2, written by hand -------------------------------------------------------
TWO_HEXES = """(0 "two hexes, a comment with ) in a string")
(1 "by hand")
(2 3)
(10 (0 1 c 0 3))
(12 (0 1 2 0))
(13 (0 1 B 0))
(37 ((case-config ((rp-seg? . #t) (note "an \\"odd\\" ( string"))) (ch #\\( )))
(10 (1 1 c 1 3) (
0. 0. 0.  1. 0. 0.  2. 0. 0.
0. 1. 0.  1. 1. 0.  2. 1. 0.
0. 0. 1.  1. 0. 1.  2. 0. 1.
0. 1. 1.  1. 1. 1.  2. 1e0 1.0
))
(12 (2 1 1 1 4))
(12 (3 2 2 11 4))
(13 (4 1 1 2 4) (
2 5 b 8 2 1
))
(13 (5 2 b 3 0) (
4 1 4 a 7 1 0
4 3 6 c 9 0 2
4 1 2 8 7 0 1
4 2 3 9 8 0 2
4 4 a b 5 0 1
4 5 b c 6 0 2
4 1 4 5 2 0 1
4 2 5 6 3 0 2
4 7 8 b a 0 1
4 8 9 c b 0 2
))
(45 (2 fluid left)())
(39 (3 solid "right" 1)((material . steel) (sources? . #f)))
(45 (4 interior middle)())
(45 (5 wall outside)())
"""


@pytest.fixture
def read(tmp_path):
    def reader(content, name="mesh.msh"):
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return read_fluent(open_source(path))

    return reader


def swapped(text, *pairs):
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def face_lists(faces):
    return [list(f) for f in np.split(faces.nodes, faces.offsets[1:-1])]


def volumes_by_faces(mesh):
    """Divergence theorem over `Mesh.faces`, each face a fan about the mean of its points (2-D: shoelace)."""
    out = np.zeros(mesh.n_cells)
    faces, origin = mesh.faces, mesh.points.mean(axis=0)
    if mesh.dimension == 2:
        a, b = (mesh.points[faces.nodes[i::2], :2] - origin[:2] for i in (0, 1))
        flux = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    else:
        flux = np.zeros(len(faces))
        sizes = np.diff(faces.offsets)
        for size in np.unique(sizes):
            rows = np.flatnonzero(sizes == size)
            corners = mesh.points[faces.nodes[faces.offsets[rows][:, None] + np.arange(size)]] - origin
            centre = corners.mean(axis=1)
            for i in range(size):
                triple = np.cross(corners[:, i], corners[:, (i + 1) % size])
                flux[rows] += (centre * triple).sum(axis=1) / 6
    np.add.at(out, faces.owner, flux)
    inner = faces.neighbour >= 0
    np.add.at(out, faces.neighbour[inner], -flux[inner])
    return out


def volumes_by_nodes(mesh, block):
    """The same from the node order of a block: its faces are outward in a positive cell."""
    corners = mesh.points[block.nodes] - mesh.points[block.nodes[:, :1]]
    out = np.zeros(len(block))
    for face in CELL_TYPES[block.type].faces:
        x = corners[:, list(face)]
        if CELL_TYPES[block.type].dimension == 2:
            y = np.roll(x, -1, axis=1)
            return (x[..., 0] * y[..., 1] - x[..., 1] * y[..., 0]).sum(axis=1) / 2
        centre = x.mean(axis=1)
        for i in range(len(face)):
            out += (centre * np.cross(x[:, i], x[:, (i + 1) % len(face)])).sum(axis=1) / 6
    return out


# --- what a small file says -------------------------------------------------------------------------------------
def test_two_hexes_have_unit_volume_and_the_zones_of_the_file(read):
    mesh = read(TWO_HEXES)
    assert mesh.counts == {"hex": 2}
    assert mesh.dimension == 3
    assert volumes_by_faces(mesh) == pytest.approx([1, 1])
    assert volumes_by_nodes(mesh, mesh.block("hex")) == pytest.approx([1, 1])
    assert [(z.name, z.kind, z.role, z.entity, list(z.members), z.id) for z in mesh.zones] == [
        ("left", "zone", "fluid", "cell", [0], 2),
        ("right", "zone", "solid", "cell", [1], 3),
        ("middle", "zone", "interior", "face", [0], 4),
        ("outside", "zone", "wall", "face", list(range(1, 11)), 5),
    ]
    assert list(mesh.cell_ids) == [1, 2]
    assert list(mesh.point_ids) == list(range(1, 13))
    assert list(mesh.faces.ids) == list(range(1, 12))
    assert mesh.notes == ()
    assert mesh.format == "fluent"


def test_a_face_keeps_its_number_and_its_normal_leaves_the_owner(read):
    faces = read(TWO_HEXES).faces
    assert list(faces.owner) == [1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1]
    assert list(faces.neighbour) == [0] + [-1] * 10
    assert face_lists(faces)[0] == [7, 10, 4, 1]  # c0 = 2 owns it, so 2 5 b 8 is stored reversed
    assert face_lists(faces)[2] == [2, 5, 11, 8]  # c0 = 0, so c1 owns it and it stays as it is


def test_zones_without_names_are_called_by_their_number_and_get_their_role_from_the_section(read):
    bare = TWO_HEXES[: TWO_HEXES.index("(45")]
    for number, role in (
        (3, "wall"),
        (0xA, "inlet"),
        (0x24, "outlet"),
        (0x25, "axis"),
        (7, "symmetry"),
        (1003, "wall"),
    ):
        mesh = read(bare.replace("(13 (5 2 b 3 0)", f"(13 (5 2 b {number:x} 0)"))
        assert [(z.name, z.role) for z in mesh.zones] == [
            ("zone-2", "fluid"),
            ("zone-3", "solid"),
            ("zone-4", "interior"),
            ("zone-5", role),
        ]


def test_the_order_of_sections_does_not_matter(read):
    head, *sections = TWO_HEXES.split("\n(1")
    sections = ["(1" + s for s in sections]
    cells = [s for s in sections if s.startswith(("(12 (2", "(12 (3"))]
    others = [s for s in sections if s not in cells]
    mesh, moved = read(TWO_HEXES), read("\n".join([head, *others, *cells]))
    assert np.array_equal(mesh.block("hex").nodes, moved.block("hex").nodes)
    assert np.array_equal(mesh.faces.nodes, moved.faces.nodes)


def binary(text, *, width, order="<"):
    """The same file with binary nodes, cells and faces."""
    real = "f" if width == 4 else "d"
    prefix = b"%d0" % (2 if width == 4 else 3)
    mesh = [float(w) for w in text.split("(10 (1 1 c 1 3) (")[1].split("))")[0].split()]
    inner = [int(w, 16) for w in text.split("(13 (4 1 1 2 4) (")[1].split("))")[0].split()]
    outer = [int(w, 16) for w in text.split("(13 (5 2 b 3 0) (")[1].split("))")[0].split()]

    def section(number, header, data):
        mark = prefix + number
        return b"(%s %s\n(%s)\nEnd of Binary Section   %s)\n" % (mark, header, data, mark)

    out = b'(0 "binary")\n(2 3)\n(4 (%s 0 1 2 4 4 4 8 8 8 4))\n' % (b"60 0" if order == "<" else b"23 1")
    out += b"(10 (0 1 c 0 3))\n(12 (0 1 2 0))\n(13 (0 1 b 0))\n"
    out += section(b"10", b"(1 1 c 1 3)", struct.pack(f"{order}{len(mesh)}{real}", *mesh))
    out += section(b"41", b"(1 c)", b"End of Binary Section 7) (((" + bytes(20))
    out += prefix.join([b"(", b"12 (2 1 1 1 4)\nEnd of Binary Section  ", b"12)\n"])
    out += section(b"12", b"(3 2 2 11 0)", struct.pack(order + "i", 4))
    out += section(b"13", b"(4 1 1 2 4)", struct.pack(f"{order}6i", *inner))
    out += section(b"13", b"(5 2 b 3 5)", struct.pack(f"{order}{len(outer)}i", *outer))
    return out + text[text.index("(45 (2") :].encode()


@pytest.mark.parametrize(("width", "order"), [(4, "<"), (8, "<"), (4, ">"), (8, ">")])
def test_binary_sections_of_either_width_and_byte_order_hold_the_same_mesh(read, width, order):
    mesh, other = read(TWO_HEXES), read(binary(TWO_HEXES, width=width, order=order))
    assert np.array_equal(mesh.points, other.points)
    assert np.array_equal(mesh.faces.nodes, other.faces.nodes)
    assert np.array_equal(mesh.faces.owner, other.faces.owner)
    assert np.array_equal(mesh.block("hex").nodes, other.block("hex").nodes)
    assert [(z.name, z.role) for z in mesh.zones] == [(z.name, z.role) for z in other.zones]


def test_white_space_between_the_data_and_its_closing_parenthesis_is_no_data(read):
    content = binary(TWO_HEXES, width=8).replace(b")\nEnd of", b"\n)\nEnd of").replace(b"   30", b" 30")
    assert np.array_equal(read(content).faces.nodes, read(TWO_HEXES).faces.nodes)


def test_line_ends_tabs_and_upper_case_change_nothing(read):
    mesh = read(TWO_HEXES)
    for text in (
        TWO_HEXES.replace("\n", "\r\n"),
        TWO_HEXES.replace("\n", "\r"),
        TWO_HEXES.replace(" ", "\t"),
        "\ufeff" + TWO_HEXES,
        "\n\n\n" + TWO_HEXES.rstrip(),
        TWO_HEXES.replace("(10 (1 1 c 1 3) (", "(10(1 1 C 1 3)("),
    ):
        assert np.array_equal(read(text.encode()).faces.nodes, mesh.faces.nodes)


def test_cell_types_may_be_absent_or_listed(read):
    for old, new in (
        ("(12 (2 1 1 1 4))\n(12 (3 2 2 11 4))", "(12 (2 1 2 1 0))"),
        ("(12 (2 1 1 1 4))\n(12 (3 2 2 11 4))", "(12 (2 1 2 1))"),
        ("(12 (2 1 1 1 4))\n(12 (3 2 2 11 4))", "(12 (2 1 2 1 0)(4 4))"),
    ):
        assert read(TWO_HEXES.replace(old, new)).counts == {"hex": 2}


def test_a_cell_that_the_file_calls_a_polyhedron_stays_one(read):
    mesh = read(TWO_HEXES.replace("(12 (3 2 2 11 4))", "(12 (3 2 2 11 7))"))
    assert mesh.counts == {"hex": 1, "polyhedron": 1}
    assert list(mesh.block("polyhedron").rows) == [1]
    assert list(mesh.block("polyhedron").items) == [0, 2, 4, 6, 8, 10]


def test_a_cell_of_another_type_than_the_file_says_is_refused(read):
    with pytest.raises(ReadError, match=r"cell 2: expected the faces of a wedge.*found those of a hex"):
        read(TWO_HEXES.replace("(12 (3 2 2 11 4))", "(12 (3 2 2 11 6))"))


# --- flat meshes and refinement ---------------------------------------------------------------------------------
# Cell 1 is the square 0..2, cell 6 the square 2..4 beside it, split into cells 2 to 5.
REFINED = """(2 2)
(10 (0 1 b 0 2))
(12 (0 1 6 0))
(13 (0 1 13 0))
(10 (1 1 b 1 2)(
0. 0.  2. 0.  4. 0.  0. 2.  2. 2.  4. 2.
3. 0.  2. 1.  3. 1.  4. 1.  3. 2.
))
(12 (2 1 1 1 3))
(12 (3 2 5 1 3))
(12 (4 6 6 20 3))
(13 (5 1 6 2 2)(
2 8 1 2
8 5 1 4
7 9 2 3
9 b 4 5
8 9 4 2
9 a 5 3
))
(13 (6 7 f 3 0)(
2 1 2 1 0
2 4 1 1 0
2 5 4 1 0
2 2 7 2 0
2 7 3 3 0
2 3 a 3 0
2 a 6 5 0
2 6 b 5 0
2 5 b 0 4
))
(13 (7 10 13 1f 2)(
2 5 1 6
2 3 6 0
3 6 6 0
6 5 6 0
))
(58 (6 6 4 3)(4 2 3 4 5))
(59 (10 10 7 5)(2 1 2))
(59 (11 13 7 6)(2 a b 2 c d 2 e f))
(45 (2 fluid coarse)())(45 (3 fluid fine)())(45 (4 fluid old)())
"""


def test_a_quad_refined_beside_a_whole_one_leaves_five_quads_and_no_parent(read):
    mesh = read(REFINED)
    assert mesh.counts == {"quad": 5}
    assert volumes_by_faces(mesh) == pytest.approx([4, 1, 1, 1, 1])
    assert volumes_by_nodes(mesh, mesh.block("quad")) == pytest.approx([4, 1, 1, 1, 1])
    assert sorted(mesh.block("quad").nodes[0]) == [0, 1, 3, 4]  # the whole one, without the node on its edge
    assert len(mesh.faces) == 15
    assert list(mesh.cell_ids) == [1, 2, 3, 4, 5]
    assert [(z.name, len(z.members)) for z in mesh.zones] == [("coarse", 1), ("fine", 4), ("zone-5", 6), ("zone-6", 9)]
    assert "1 parent cells and 4 parent faces" in mesh.notes[0]


def test_a_refined_cell_that_some_face_still_names_is_refused(read):
    text = swapped(REFINED, ("9 b 4 5\n", "9 b 4 6\n"))
    with pytest.raises(ReadError, match="cell 6: expected no unsplit face beside a parent cell"):
        read(text)


def test_a_tree_of_faces_that_do_not_exist_is_refused(read):
    for old, new in (
        ("(2 1 2))", "(2 1 14))"),
        ("(2 1 2))", "(2 0 2))"),
        ("(2 1 2))", "(3 1 2))"),
        ("(2 1 2))", "(1 1 2))"),
    ):
        with pytest.raises(ReadError, match=r"numbers of faces of 1 to 19|lists of children"):
            read(swapped(REFINED, (old, new)))


def hex_refined_beside_a_whole_one():
    """Unit hex 0..1 whole, unit hex 1..2 split into 8; faces found by matching corners, an independent way."""
    grid = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    half = [(1 + x / 2, y / 2, z / 2) for z in range(3) for y in range(3) for x in range(3)]
    points = list(dict.fromkeys(grid + half + [(2, y, z) for y in (0, 1) for z in (0, 1)]))
    number = {p: i + 1 for i, p in enumerate(points)}

    def sides(x, y, z, h):
        for axis, far in itertools.product(range(3), (0, 1)):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            ring = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                p = [x, y, z]
                p[axis] += far * h
                p[u] += a * h
                p[v] += b * h
                ring.append(tuple(p))
            yield ring if not far else ring[::-1]  # the normal points into the cell

    cells = [(0, 0, 0, 1)] + [(1 + x / 2, y / 2, z / 2, 0.5) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    found = {}
    for cell, box in enumerate(cells, 1):
        for ring in sides(*box):
            found.setdefault(frozenset(ring), []).append((ring, cell))
    whole = frozenset(p for p in grid if p[0] == 1)
    (parent, _), *_ = found.pop(whole)
    lines = {"inner": [], "outer": [], "pieces": []}
    for pair in found.values():
        ring, cell = pair[0]
        piece = len(pair) == 1 and all(p[0] == 1 for p in ring)
        other = pair[1][1] if len(pair) == 2 else 1 if piece else 0
        row = [number[p] for p in ring] + [cell, other]
        lines["pieces" if piece else "inner" if other else "outer"].append(" ".join(f"{v:x}" for v in row))
    out = ["(2 3)", f"(10 (1 1 {len(points):x} 1 3)(", *(" ".join(f"{x:.2f}" for x in p) for p in points), "))"]
    out += ["(12 (1 1 1 1 4))", "(12 (2 2 9 1 4))", "(12 (3 a a 20 4))"]
    at = 1
    for zone, (name, kind) in enumerate((("pieces", 2), ("inner", 2), ("outer", 3)), 4):
        out += [f"(13 ({zone:x} {at:x} {at + len(lines[name]) - 1:x} {kind} 4)(", *lines[name], "))"]
        at += len(lines[name])
    ring = " ".join(f"{number[p]:x}" for p in parent)
    out += [f"(13 (9 {at:x} {at:x} 1f 4)({ring} 1 a))", "(58 (a a 3 2)(8 2 3 4 5 6 7 8 9))"]
    return "\n".join([*out, f"(59 ({at:x} {at:x} 9 4)(4 1 2 3 4))"])


def test_a_hex_beside_eight_smaller_ones_stays_a_hex_while_its_face_stays_split(read):
    mesh = read(hex_refined_beside_a_whole_one())
    assert mesh.counts == {"hex": 9}
    assert volumes_by_faces(mesh) == pytest.approx([1] + [1 / 8] * 8)
    assert volumes_by_nodes(mesh, mesh.block("hex")) == pytest.approx([1] + [1 / 8] * 8)
    beside_whole = (mesh.faces.owner == 0) | (mesh.faces.neighbour == 0)
    assert np.count_nonzero(beside_whole) == 5 + 4
    again = read(hex_refined_beside_a_whole_one().replace("(12 (1 1 1 1 4))", "(12 (1 1 1 1 7))"))
    assert again.counts == {"hex": 8, "polyhedron": 1}
    assert sorted(again.block("polyhedron").items) == list(np.flatnonzero(beside_whole))


def test_a_piece_of_a_split_face_that_has_left_the_whole_cell_is_refused(read):
    text = hex_refined_beside_a_whole_one()
    with pytest.raises(ReadError, match="a cell on either side of face 1, which is in an interior zone, found '0"):
        read(swapped(text, ("2 b 13 10 2 1", "2 b 13 10 2 0")))
    with pytest.raises(ReadError, match="face 1: expected the unrefined cell beside face 42, of which it is a piece"):
        read(swapped(text, ("2 b 13 10 2 1", "2 b 13 10 2 4")))


def test_faces_cut_out_of_interfaces_are_left_out_and_said_so(read):
    # The face between the hexes becomes two boundary faces of interface zones, and a piece cut out of both.
    text = swapped(
        TWO_HEXES,
        ("(13 (0 1 B 0))", "(13 (0 1 d 0))"),
        (
            "(13 (4 1 1 2 4) (\n2 5 b 8 2 1\n))",
            "(13 (4 1 1 3ea 4)(\n2 5 b 8 2 1\n))(13 (6 c d 18 4)(2 5 b 8 2 0 8 b 5 2 1 0))",
        ),
    )
    for section in ("(61 (1 1)(c d))", "(61 (1 1)(c 0))", "(62 (4 6 1)(1 c))"):
        mesh = read(text + section)
        assert mesh.counts == {"hex": 2}
        assert volumes_by_faces(mesh) == pytest.approx([1, 1])
        assert list(mesh.faces.ids) == list(range(2, 14))
        assert not np.any(mesh.faces.neighbour >= 0)
        assert [z.name for z in mesh.zones] == ["left", "right", "zone-6", "outside"]
        assert mesh.notes[0].startswith("1 faces cut out of non-conformal interfaces")
    with pytest.raises(ReadError, match=r"in exactly 2 of its faces, found edge 1-4 in 3"):
        read(text)


def test_pairs_of_periodic_faces_and_edges_are_counted_in_the_notes(read):
    mesh = read(TWO_HEXES + "(18 (1 1 5 5)(2 3))\n(11 (0 1 2 0))(11 (7 1 2 0 2)(1 2 2 3))")
    assert mesh.notes == (
        "The pairing of 1 periodic faces (section 18) is not kept.",
        "2 edges (section 11) are not kept.",
    )
    with pytest.raises(ReadError, match="numbers of faces of 1 to 11"):
        read(TWO_HEXES + "(18 (1 1 5 5)(2 c))")


# --- strictness -------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(10 (0 1 c 0 3))", "(10 (0 1 d 0 3))", "line 4: expected as many nodes as the zones bring, 12, found 13"),
        ("(12 (0 1 2 0))", "(12 (0 1 3 0))", "line 5: expected as many cells"),
        ("(13 (0 1 B 0))", "(13 (0 1 ffffffffffff 0))", "line 6: expected as many faces"),
        ("(10 (1 1 c 1 3)", "(10 (1 1 7fffffff 1 3)", "line 8: expected a count of coordinates that fits"),
        ("(10 (1 1 c 1 3)", "(10 (1 1 b 1 3)", "the end of the coordinates of section 10"),
        ("(10 (1 1 c 1 3)", "(10 (1 1 d 1 3)", "39 numbers"),
        ("(10 (1 1 c 1 3)", "(10 (1 1 c 1 2)", "dimension 3, as said before"),
        ("(10 (1 1 c 1 3)", "(10 (1 0 b 1 3)", "a range of nodes"),
        ("(10 (1 1 c 1 3)", "(10 (1 c 1 1 3)", "a range of nodes"),
        ("(10 (1 1 c 1 3)", "(10 (1 1 -c 1 3)", "a hexadecimal number"),
        ("(12 (2 1 1 1 4))", "(12 (2 1 1 1 9))", "an element type of 0 to 7"),
        ("(12 (3 2 2 11 4))", "(12 (3 3 3 11 4))", "cells from number 2, found from 3"),
        ("(12 (3 2 2 11 4))", "(12 (3 1 1 11 4))", "cells from number 2, found from 1"),
        ("(12 (0 1 2 0))\n", "(12 (3 3 3fffffff 1))\n", "at most 22 cells beside 11 faces"),
        ("(12 (3 2 2 11 4))", "", "as many cells"),
        ("2 5 b 8 2 1", "2 5 b d 2 1", "line 17: expected a node of 1 to 12 (face 1), found 'd"),
        ("2 5 b 8 2 1", "2 5 b 0 2 1", "line 17: expected a node of 1 to 12"),
        ("2 5 b 8 2 1", "2 5 b -1 2 1", "line 17: expected a node of 1 to 12"),
        ("2 5 b 8 2 1", "2 5 b 8 3 1", "line 17: expected a cell of 1 to 2, or 0 for none"),
        ("2 5 b 8 2 1", "2 5 b 8 1 1", "two different cells"),
        ("2 5 b 8 2 1", "2 5 b 8 0 0", "two different cells"),
        ("2 5 b 8 2 1", "2 5 b 8 2", "line 18: expected 6 integers"),
        ("2 5 b 8 2 1", "2 5 b 8 2 1 1", "the end of the faces of section 13"),
        ("2 5 b 8 2 1", "2 5 b 5 2 1", "twice"),
        ("2 5 b 8 2 1", "2 5 b 8 2 0", "line 17: expected a cell on either side of face 1"),
        ("4 8 9 c b 0 2", "5 8 9 c b 0 2", "line 29: expected 10 faces"),
        ("4 8 9 c b 0 2", "2 8 9 c b 0 2", "line 29: expected 10 faces"),
        ("4 1 4 a 7 1 0", "4 1 4 a.0 7 1 0", "hexadecimal"),
        ("(13 (4 1 1 2 4)", "(13 (4 1 1 2 2)", "a face type of a 3-D mesh"),
        ("(13 (4 1 1 2 4)", "(13 (4 1 1 2 9)", "a face type of a 3-D mesh"),
        ("2. 1e0 1.0", "2. nan 1.0", "line 12: expected a finite number"),
        ("2. 1e0 1.0", "2. 1e999 1.0", "line 12"),
        ("2. 1e0 1.0", "2. 1,0 1.0", "line 12"),
        ("(2 3)", "(2 4)", "a dimension of 2 or 3"),
        ("(2 3)", "(2 2)", "dimension 2, as said before"),
        ("(45 (5 wall outside)())", "(45 (5 wall outside)()", "line 35: expected the parenthesis that closes"),
        ("(45 (5 wall outside)())", "(45 (5 wall outside)()))", "a section, which starts with a parenthesis"),
        ("(45 (5 wall outside)())", "(45 (five wall outside)())", "the number, type and name of a zone"),
        ("(45 (5 wall outside)())", "(45 (4 wall outside)())", "to be “middle” of type interior"),
        ("(1 \"by hand\")", "(x \"by hand\")", "the number of a section"),
    ],
)  # fmt: skip
def test_a_contradiction_is_refused_with_its_place(read, old, new, message):
    with pytest.raises(ReadError) as caught:
        read(swapped(TWO_HEXES, (old, new)))
    assert message in str(caught.value)


def test_every_truncation_is_refused_up_to_the_names_of_zones(read):
    for cut in range(1, TWO_HEXES.index("\n(45 (2")):
        with pytest.raises(ReadError):
            read(TWO_HEXES[:cut])


def test_a_truncation_among_the_names_of_zones_is_refused_unless_between_two_sections(read):
    whole = read(TWO_HEXES)
    for cut in range(TWO_HEXES.index("\n(45 (2"), len(TWO_HEXES)):
        part = TWO_HEXES[:cut].rstrip()
        if part.count("(") - TWO_HEXES.count("(") == part.count(")") - TWO_HEXES.count(")"):
            assert np.array_equal(read(part).faces.nodes, whole.faces.nodes)
        else:
            with pytest.raises(ReadError):
                read(part)


def test_every_truncation_of_a_binary_file_is_refused_up_to_the_names_of_zones(read):
    content = binary(TWO_HEXES, width=4)
    for cut in range(1, content.index(b"\n(45 (2")):
        with pytest.raises(ReadError):
            read(content[:cut])


def test_a_file_written_twice_in_a_row_is_refused(read):
    with pytest.raises(ReadError, match="nodes from number 13, found from 1"):
        read(TWO_HEXES + TWO_HEXES)


def test_a_truncated_file_names_the_section_it_ends_in(read):
    with pytest.raises(ReadError, match=r"line 28: expected the parenthesis that closes section 13, found end of file"):
        read(TWO_HEXES[: TWO_HEXES.index("4 8 9 c")].rstrip())


def test_a_million_open_parentheses_are_refused(read):
    with pytest.raises(ReadError, match="the parenthesis that closes section 37"):
        read(TWO_HEXES + "(37 " + "(" * 1_000_000)


# --- which files are Fluent's -----------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "head",
    [
        b'(0 "GAMBIT")',
        b"\r\n ( 2 3 )",
        b"(2 2)\n",
        b'(1 "TGrid 3D")',
        b"(10(0 1 e84 1 2))",
        b"(0 unquoted)",
        b"(4 (60 0",
    ],
)
def test_the_first_section_is_recognised(head):
    assert sniff_fluent(head, "anything.dat")


@pytest.mark.parametrize(
    "head",
    [
        b"",
        b"$MeshFormat\n",
        b"(0 0 0)\n(1 0 0)",
        b"(1 2 3)",
        b"8\n(\n(0 0 0)",
        b"((0 0 0))",
        b"(2.5 3)",
        b"(a)",
        b"solid (0 x",
    ],
)
def test_other_formats_are_not_claimed(head):
    assert not sniff_fluent(head, "mesh.msh")


# --- real files -------------------------------------------------------------------------------------------------
def real_files(shared):
    rows = [line.split("\t") for line in (shared / "meshes/INDEX.tsv").read_text().splitlines()[1:]]
    return [row for row in rows if row[1] == "fluent_legacy"]


def test_in_every_real_file_nodes_and_faces_give_the_same_volumes_and_interior_zones_are_inside(shared):
    rows = real_files(shared)
    assert len(rows) >= 18
    for path, *_ in rows:
        source = open_source(shared / "meshes" / path)
        assert sniff_fluent(source.data[:4096].tobytes(), path), path
        mesh = read_fluent(source)
        volumes = volumes_by_faces(mesh)
        assert volumes.min() > 0, path
        for block in mesh.blocks:
            if len(block.nodes):
                own = volumes_by_nodes(mesh, block)
                assert own == pytest.approx(volumes[block.rows], rel=1e-6, abs=1e-9 * volumes.max()), path
        roles = {z.role for z in mesh.zones}
        assert roles <= {"fluid", "solid", "interior", "wall", "inlet", "outlet", "symmetry", "axis", "interface"}, path
        boundary = np.ones(len(mesh.faces), dtype=bool)
        for zone in mesh.zones:
            if zone.role == "interior":
                boundary[zone.members] = False
        assert np.all(mesh.faces.neighbour[boundary] == -1), path


@pytest.mark.parametrize("name", ["axial_comp.msh", "elbow.cas.gz", "mixer-ran_2019r3.cas.gz"])
def test_vtk_finds_the_same_corners_in_every_standard_cell(shared, tmp_path, name):
    vtk = pytest.importorskip("vtkmodules.vtkIOGeometry", reason="VTK is the oracle")
    arrays = pytest.importorskip("vtkmodules.util.numpy_support")
    path = shared / "meshes/fluent_legacy" / name
    mesh = read_fluent(open_source(path))
    plain = tmp_path / "mesh.cas"
    data = path.read_bytes()
    plain.write_bytes(gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data)
    reader = vtk.vtkFLUENTReader()
    reader.SetFileName(str(plain))
    reader.Update()
    output = reader.GetOutput()
    found = {12: [], 10: []}
    for i in range(output.GetNumberOfBlocks()):
        label = output.GetMetaData(i).Get(output.NAME()) if output.HasMetaData(i) else ""
        if not label.endswith((":fluid", ":solid")):
            continue
        grid = output.GetBlock(i)
        offsets = arrays.vtk_to_numpy(grid.GetCells().GetOffsetsArray())
        corners = arrays.vtk_to_numpy(grid.GetCells().GetConnectivityArray())
        for kind, rows in found.items():
            of_kind = [j for j in range(grid.GetNumberOfCells()) if grid.GetCellType(j) == kind]
            rows += [tuple(sorted(corners[offsets[j] : offsets[j + 1]])) for j in of_kind]
    assert any(found.values())
    for kind, rows in found.items():
        own = [b for b in mesh.blocks if CELL_TYPES[b.type].vtk == kind]
        assert sorted(rows) == sorted(tuple(sorted(row)) for block in own for row in block.nodes.tolist())
