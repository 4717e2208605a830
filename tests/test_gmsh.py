"""The Gmsh reader: real files, files that Gmsh itself writes, every kind of damage."""

import struct
from pathlib import Path

import numpy as np
import pytest

from meshwright.audit.cells import CELL_TYPES
from meshwright.audit.errors import ReadError, UnsupportedError
from meshwright.audit.findings import run_checks
from meshwright.audit.mesh import Mesh
from meshwright.audit.readers.gmsh.elements import ELEMENTS
from meshwright.audit.readers.gmsh.reader import read_gmsh
from meshwright.audit.readers.source import open_source

TWO_TETS = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
3 7 "the fluid"
2 8 "the wall"
$EndPhysicalNames
$Nodes
5
10 0 0 0
20 1 0 0
30 0 1 0
40 0 0 1
9000000 1 1 1
$EndNodes
$Elements
3
1 2 2 8 1 10 20 30
2 4 2 7 1 10 20 30 40
3 4 3 0 1 9 20 30 40 9000000
$EndElements
"""
TWO_TETS_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Nodes
1 5 1 9
3 1 0 5
1
2
3
4
9
0 0 0
1 0 0
0 1 0
0 0 1
1 1 1
$EndNodes
$Elements
2 3 1 3
2 1 2 1
1 1 2 3
3 1 4 2
2 1 2 3 4
3 2 3 4 9
$EndElements
"""


def read(path: Path) -> Mesh:
    return read_gmsh(open_source(path))


def read_text(folder: Path, text: str | bytes) -> Mesh:
    path = folder / "mesh.msh"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read(path)


def zones(mesh: Mesh) -> dict[str, tuple[str, list[int]]]:
    return {zone.name: (zone.entity, zone.members.tolist()) for zone in mesh.zones}


def test_names_of_physical_groups_in_a_real_file(shared: Path) -> None:
    mesh = read(shared / "meshes/gmsh/rectangle-mix-p2.msh")
    sizes = {zone.name: (zone.kind, zone.entity, len(zone.members)) for zone in mesh.zones}
    assert sizes == {
        "left": ("physical group", "cell", 148),
        "right": ("physical group", "cell", 108),
        "inlet": ("physical group", "face", 6),
        "outlet": ("physical group", "face", 6),
        "wall": ("physical group", "face", 42),
    }
    assert (mesh.dimension, mesh.order) == (2, 2)


def test_binary_and_text_twins_hold_the_same_mesh(shared: Path) -> None:
    text, binary = (read(shared / f"meshes/gmsh/petsc_gmsh-3d-{kind}.msh2") for kind in ("ascii", "binary"))
    assert np.array_equal(text.block("tet").nodes, binary.block("tet").nodes)
    assert np.allclose(text.points, binary.points, rtol=0, atol=1e-14)


def test_sparse_node_numbers_groups_and_ids_are_kept(tmp_path: Path) -> None:
    mesh = read_text(tmp_path, TWO_TETS)
    assert mesh.block("tet").nodes.tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    assert mesh.point_ids is not None
    assert mesh.cell_ids is not None
    assert mesh.boundary_ids is not None
    assert mesh.point_ids.tolist() == [10, 20, 30, 40, 9000000]
    assert (mesh.cell_ids.tolist(), mesh.boundary_ids.tolist()) == ([2, 3], [1])
    assert zones(mesh) == {"the fluid": ("cell", [0]), "the wall": ("face", [0])}
    assert (mesh.dimension, mesh.format) == (3, "Gmsh MSH 2.2 (text)")


def test_without_physical_groups_the_entities_are_zones(tmp_path: Path) -> None:
    mesh = read_text(tmp_path, TWO_TETS_41)
    assert zones(mesh) == {"volume 1": ("cell", [0, 1]), "surface 1": ("face", [0])}
    assert {zone.kind for zone in mesh.zones} == {"entity"}


def test_an_element_written_once_per_group_is_one_cell_in_two_zones(tmp_path: Path) -> None:
    text = TWO_TETS.replace("$Elements\n3\n", "$Elements\n4\n").replace(
        "3 4 3 0 1 9 20 30 40 9000000\n", "3 4 2 9 1 10 20 30 40\n4 4 2 9 1 20 30 40 9000000\n"
    )
    mesh = read_text(tmp_path, text)
    assert mesh.n_cells == 2
    assert zones(mesh)["the fluid"] == ("cell", [0])
    assert zones(mesh)["physical volume 9"] == ("cell", [0, 1])


def test_version_1_reads_like_version_2(tmp_path: Path) -> None:
    old = (
        TWO_TETS[TWO_TETS.index("$Nodes") :]
        .replace("$Nodes", "$NOD")
        .replace("$EndNodes", "$ENDNOD")
        .replace("$Elements", "$ELM")
        .replace("$EndElements", "$ENDELM")
        .replace("1 2 2 8 1 10", "1 2 8 1 3 10")
        .replace("2 4 2 7 1 10", "2 4 7 1 4 10")
        .replace("3 4 3 0 1 9 20", "3 4 0 1 4 20")
    )
    mesh = read_text(tmp_path, old)
    assert mesh.block("tet").nodes.tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    assert zones(mesh) == {"physical volume 7": ("cell", [0]), "physical surface 8": ("face", [0])}


def test_skipped_sections_and_third_order_cells_are_in_the_ledger(tmp_path: Path, shared: Path) -> None:
    extra = "$Periodic\n0\n$EndPeriodic\n$NodeData\nx\n$EndNodeData\n$Mine\nabc\n$EndMine\n$Comments\n!\n$EndComments\n"
    notes = " | ".join(read_text(tmp_path, TWO_TETS + extra).notes)
    assert "$Periodic" in notes
    assert "$NodeData" in notes
    assert "$Mine" in notes
    assert "Comments" not in notes
    notes = " | ".join(read(shared / "meshes/gmsh/petsc_cube_q3.msh").notes)
    assert "24 tetrahedra of 20 nodes (third order or higher) are measured by their corners" in notes


def test_the_nodes_of_third_order_cells_are_not_called_unused(shared: Path) -> None:
    mesh = read(shared / "meshes/gmsh/petsc_cube_q3.msh")
    assert len(mesh.points) == 172
    assert len(mesh.spare_points) == 172 - 14  # the cells keep their 14 corners
    assert [finding.code for finding in run_checks(mesh)] == ["features"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("5\n10 0", "6\n10 0", "more records"),
        ("5\n10 0", "4\n10 0", "$EndNodes"),
        ("5\n10 0", "99999999999\n10 0", "count of nodes that fits"),
        ("20 1 0 0", "10 1 0 0", "each node number once"),
        ("20 1 0 0", "20 1 nan 0", "finite"),
        ("20 1 0 0", "20 1 0,5 0", "a coordinate"),
        ("20 1 0 0", "-20 1 0 0", "0 or more"),
        ("20 30 40 9000000", "20 30 40 50", "element 3: expected a node listed in $Nodes, found node 50"),
        ("20 30 40 9000000", "20 30 40", "more numbers on this line"),
        ("20 30 40 9000000", "20 30 40 9000000 7", "end of the line"),
        ("3 4 3 0 1 9", "3 76 3 0 1 9", "element type"),
        ("3 4 3 0 1 9", "3 4 -3 0 1 9", "as many tags"),
        ("$Elements\n3", "$Elements\n2", "$EndElements"),
        ("$Elements\n3", "$Elements\n4", "more records"),
        ("$EndElements\n", "", "$EndElements that closes"),
        ("$EndElements\n", "$EndElements\nrubbish", "start of a section"),
        ("$EndElements\n", "$EndElements\n$Nodes\n0\n$EndNodes\n", "one section $Nodes"),
        ("2.2 0 8", "2.3 0 8", "version 2.3"),
        ("2.2 0 8", "2.2 2 8", "file type"),
        ('2\n3 7 "the', '3\n3 7 "the', "physical names"),
    ],
)
def test_damage_is_refused_with_its_place(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in TWO_TETS
    with pytest.raises(ReadError, match=r".") as caught:
        read_text(tmp_path, TWO_TETS.replace(old, new, 1))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("1 5 1 9", "1 5 1 8", "node numbers from 1 to 8"),
        ("1 5 1 9", "2 5 1 9", "integer"),
        ("3 1 0 5", "3 1 0 6", "5 nodes in all"),
        ("3 1 0 5", "4 1 0 5", "dimension 0 to 3"),
        ("3 1 0 5", "3 1 2 5", "0 or 1"),
        ("2 3 1 3", "2 4 1 3", "4 elements"),
        ("2 1 2 1", "3 1 2 1", "elements of dimension 3"),
        ("3 1 4 2", "3 1 140 2", "element type 140"),
        ("3 2 3 4 9", "3 2 3 4 5", "node 5"),
    ],
)
def test_damage_in_version_4_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in TWO_TETS_41
    with pytest.raises(ReadError, match=r".") as caught:
        read_text(tmp_path, TWO_TETS_41.replace(old, new, 1))
    assert words in str(caught.value)


def binary(order: str, version: float) -> bytes:
    """TWO_TETS as Gmsh would write it on a machine of that byte order."""
    points = [(10, 0, 0, 0), (20, 1, 0, 0), (30, 0, 1, 0), (40, 0, 0, 1), (50, 1, 1, 1)]
    head = f"$MeshFormat\n{version} 1 8\n".encode() + struct.pack(order + "i", 1) + b"\n$EndMeshFormat\n"
    if version == 2.2:
        nodes = b"5\n" + b"".join(struct.pack(order + "i3d", *point) for point in points)
        cells = b"2\n" + struct.pack(order + "3i", 4, 2, 2)
        cells += struct.pack(order + "14i", 1, 7, 1, 10, 20, 30, 40, 2, 7, 1, 20, 30, 40, 50)
    else:
        nodes = struct.pack(order + "4Q3iQ", 1, 5, 10, 50, 3, 1, 0, 5) + struct.pack(order + "5Q", 10, 20, 30, 40, 50)
        nodes += b"".join(struct.pack(order + "3d", *point[1:]) for point in points)
        cells = struct.pack(order + "4Q3iQ", 1, 2, 1, 2, 3, 1, 4, 2)
        cells += struct.pack(order + "10Q", 1, 10, 20, 30, 40, 2, 20, 30, 40, 50)
    return head + b"$Nodes\n" + nodes + b"\n$EndNodes\n$Elements\n" + cells + b"\n$EndElements\n"


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("version", [2.2, 4.1])
def test_binary_files_of_both_byte_orders_are_read(tmp_path: Path, order: str, version: float) -> None:
    mesh = read_text(tmp_path, binary(order, version))
    assert mesh.block("tet").nodes.tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]


@pytest.mark.parametrize(
    "whole", [TWO_TETS.encode(), TWO_TETS_41.encode(), binary("<", 2.2), binary("<", 4.1)], ids=["2t", "4t", "2b", "4b"]
)
def test_a_file_cut_anywhere_is_refused(tmp_path: Path, whole: bytes) -> None:
    for size in range(1, len(whole.rstrip())):
        with pytest.raises(ReadError):
            read_text(tmp_path, whole[:size])


def test_a_binary_coordinate_that_is_not_finite_is_refused(tmp_path: Path) -> None:
    whole = binary("<", 4.1)
    with pytest.raises(ReadError, match="finite"):
        read_text(tmp_path, whole.replace(struct.pack("<3d", 1, 1, 1), struct.pack("<3d", 1, float("inf"), 1)))


def test_the_element_table_is_that_of_gmsh() -> None:
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        # Gmsh's own interface does not name these prisms, though its files may hold them.
        unnamed = {90, 91, *range(106, 118)}
        for number, element in ELEMENTS.items():
            if number not in unnamed:
                _, dimension, _, n_nodes, _, n_corners = gmsh.model.mesh.getElementProperties(number)
                corners = CELL_TYPES[CELL_TYPES[element.type].corners].n_nodes
                assert (element.dimension, element.n_nodes, corners) == (dimension, n_nodes, n_corners)
    finally:
        gmsh.finalize()


def write_box(gmsh, path: Path, version: float, is_binary: bool, order: int, *, hexes: bool = False) -> None:
    gmsh.option.setNumber("General.Terminal", 0)
    box = gmsh.model.occ.addBox(0, 0, 0, 1, 2, 3)
    gmsh.model.occ.synchronize()
    for _, curve in gmsh.model.getEntities(1):
        gmsh.model.mesh.setTransfiniteCurve(curve, 4)
    for dimension, tag in gmsh.model.getEntities(2):
        gmsh.model.mesh.setTransfiniteSurface(tag)
        if hexes:
            gmsh.model.mesh.setRecombine(dimension, tag)
    gmsh.model.mesh.setTransfiniteVolume(box)
    gmsh.model.addPhysicalGroup(3, [box], 7, "fluid")
    gmsh.model.addPhysicalGroup(2, [1, 2], 3, "ends")
    gmsh.model.addPhysicalGroup(2, [2, 3], 4)
    gmsh.model.addPhysicalGroup(0, [1, 8], 5, "corners")
    gmsh.option.setNumber("Mesh.SaveParametric", 1 if version == 4.1 else 0)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", int(is_binary))
    gmsh.write(str(path))


@pytest.mark.parametrize(
    ("version", "is_binary", "order", "hexes"),
    [
        *[(1, False, 1, False), (2.2, False, 2, False), (2.2, True, 1, True), (4.0, False, 2, True)],
        *[(4.1, False, 2, True), (4.1, True, 2, False), (4.1, True, 3, False)],
    ],
)
def test_gmsh_and_this_reader_agree_on_what_gmsh_wrote(
    tmp_path: Path,
    version: float,
    is_binary: bool,
    order: int,
    hexes: bool,
) -> None:
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        write_box(gmsh, tmp_path / "box.msh", version, is_binary, order, hexes=hexes)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        by_tag = dict(zip(tags.tolist(), coordinates.reshape(-1, 3), strict=True))
        types, ids, nodes = gmsh.model.mesh.getElements(3)
        ends = {tag for t in (1, 2) for block in gmsh.model.mesh.getElements(2, t)[1] for tag in block.tolist()}
        both = {tag for block in gmsh.model.mesh.getElements(2, 2)[1] for tag in block.tolist()}
        sides = {tag for t in (2, 3) for block in gmsh.model.mesh.getElements(2, t)[1] for tag in block.tolist()}
    finally:
        gmsh.finalize()
    mesh = read(tmp_path / "box.msh")
    assert len(types) == 1
    assert len(mesh.blocks) == 1
    assert mesh.n_cells == len(ids[0]) == 27 * (1 if hexes else 6)
    block, width = mesh.blocks[0], ELEMENTS[int(types[0])].n_nodes
    corners = CELL_TYPES[CELL_TYPES[block.type].corners].n_nodes
    expected = np.array([[by_tag[tag] for tag in row[:corners]] for row in nodes[0].reshape(-1, width).tolist()])
    assert np.allclose(mesh.points[block.nodes[:, :corners]], expected, rtol=0, atol=1e-12)
    found = {zone.id: zone for zone in mesh.zones}
    assert (found[7].entity, len(found[7].members)) == ("cell", mesh.n_cells)
    assert (found[3].entity, len(found[3].members)) == ("face", len(ends))
    assert len(found[4].members) == len(sides)
    assert len(set(found[3].members) & set(found[4].members)) == len(both)
    assert sorted(mesh.points[found[5].members].sum(axis=1).round(9).tolist())[0] in (0.0, 3.0)
    assert mesh.n_boundary == len(ends | sides) + 2
    if version > 1:
        assert {found[7].name, found[3].name, found[5].name} == {"fluid", "ends", "corners"}
    if order == 2:
        assert_mid_nodes_lie_on_mid_edges(mesh)


def assert_mid_nodes_lie_on_mid_edges(mesh: Mesh) -> None:
    for block in (*mesh.blocks, *mesh.boundary):
        kind = CELL_TYPES[block.type]
        if kind.order == 2:
            ends = mesh.points[block.nodes[:, kind.edge_table]]
            mids = mesh.points[block.nodes[:, list(kind.mid_edges)]]
            assert np.allclose(mids, ends.mean(axis=2), rtol=0, atol=1e-9), block.type


SHAPES = {
    "tet": (4, [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]),
    "hex": (5, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]),
    "wedge": (6, [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)]),
    "pyramid": (7, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)]),
    "tri": (2, [(0, 0, 0), (1, 0, 0), (0, 1, 0)]),
    "quad": (3, [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]),
}


@pytest.mark.parametrize("incomplete", [False, True])
@pytest.mark.parametrize("shape", SHAPES)
def test_second_order_nodes_stand_in_vtk_order(tmp_path: Path, shape: str, incomplete: bool) -> None:
    gmsh = pytest.importorskip("gmsh")
    number, points = SHAPES[shape]
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        dimension = 2 if shape in ("tri", "quad") else 3
        gmsh.model.addDiscreteEntity(dimension, 1)
        gmsh.model.mesh.addNodes(dimension, 1, list(range(1, len(points) + 1)), [c for p in points for c in p])
        gmsh.model.mesh.addElementsByType(1, number, [1], list(range(1, len(points) + 1)))
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(incomplete))
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(tmp_path / "one.msh"))
    finally:
        gmsh.finalize()
    mesh = read(tmp_path / "one.msh")
    assert (mesh.n_cells, mesh.order) == (1, 2)
    assert_mid_nodes_lie_on_mid_edges(mesh)
    if mesh.blocks[0].type == "hex27":
        # VTK: x-, x+, y-, y+, z-, z+ and the middle, as this cell lies.
        centres = mesh.points[mesh.blocks[0].nodes[0, 20:]]
        expected = [
            (0, 0.5, 0.5),
            (1, 0.5, 0.5),
            (0.5, 0, 0.5),
            (0.5, 1, 0.5),
            (0.5, 0.5, 0),
            (0.5, 0.5, 1),
            (0.5,) * 3,
        ]
        assert np.allclose(centres, expected, rtol=0, atol=1e-12)


def test_a_file_of_lines_only_is_no_mesh(tmp_path: Path) -> None:
    text = TWO_TETS.replace("$Elements\n3\n", "$Elements\n1\n1 1 2 0 1 10 20\n$EndElements\n$Rest\n")
    with pytest.raises(ReadError, match="surface or volume elements"):
        read_text(tmp_path, text.replace("9000000\n$EndElements", "9000000\n$EndRest"))


def test_binary_version_4_0_is_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match=r"binary of version 4\.0"):
        read_text(tmp_path, binary("<", 4.1).replace(b"4.1 1 8", b"4.0 1 8"))
