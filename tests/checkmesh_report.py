"""What the lines of a checkMesh report say, for the tests that compare.

Loaded with `runpy.run_path` by the tests that need it.
"""

import re

import numpy as np

X = r"(-?[\d.]+(?:e[-+]\d+)?)"
POINT = rf"\({X} {X} {X}\)"
BOX = rf"{POINT} {POINT}"

LINES = (
    *((rf"{title}:\s+(\d+)", (name,)) for title, name in (
        ("points", "points"), ("internal points", "internal points"), ("edges", "edges"),
        ("internal edges", "internal edges"), ("internal edges using one boundary point", "edges from the boundary"),
        ("internal edges using two boundary points", "edges across"), ("faces", "faces"),
        ("internal faces", "internal faces"), ("cells", "cells"), ("boundary patches", "patches"),
        ("point zones", "point zones"), ("face zones", "face zones"), ("cell zones", "cell zones"),
        ("hexahedra", "hex"), ("prisms", "wedge"), ("wedges", "OpenFOAM wedges"), ("pyramids", "pyramid"),
        ("tet wedges", "tet wedges"), ("tetrahedra", "tet"), ("polyhedra", "polyhedron"),
    )),
    (rf"faces per cell:\s+{X}", ("faces per cell",)),
    (r"Number of regions: (\d+) .*", ("regions",)),
    (r"<<Writing (\d+) cells with one non-boundary face to set .*", ("cells of one inner face",)),
    (r"<<Writing (\d+) cells with two non-boundary faces to set .*", ("cells of two inner faces",)),
    (rf"Overall domain bounding box {BOX}", tuple(f"box {i}" for i in range(6))),
    (rf".*Boundary openness {POINT}.*", tuple(f"boundary openness {i}" for i in range(3))),
    (rf"Max cell openness = {X} OK\.", ("openness",)),
    (rf"Max aspect ratio = {X} OK\.", ("aspect ratio",)),
    (rf"\*\*\*High aspect ratio cells found, Max aspect ratio: {X}, number of cells (\d+)",
     ("aspect ratio", "slender cells")),
    (r"<<Writing (\d+) cells with high aspect ratio to set .*", ("slender cells",)),
    (r"<<Writing (\d+) zero volume cells to set .*", ("cells without volume",)),
    (rf"Minimum face area = {X}\. Maximum face area = {X}\.  Face area magnitudes OK\.",
     ("least area", "largest area")),
    (rf"Min volume = {X}\. Max volume = {X}\.  Total volume = {X}\.  Cell volumes OK\.",
     ("least volume", "largest volume", "volume")),
    (rf".*Zero or negative cell volume detected\.  Minimum negative volume: {X}, Number of .* cells: (\d+)",
     ("least volume", "cells without volume")),
    (rf"Mesh non-orthogonality Max: {X} average: {X}", ("worst non-orthogonality", "mean non-orthogonality")),
    (r"\*Number of severely non-orthogonal \(> 70 degrees\) faces: (\d+)\.", ("severely non-orthogonal",)),
    (r"\*\*\*Number of non-orthogonality errors: (\d+)\.", ("beyond a right angle",)),
    (r"<<Writing (\d+) non-orthogonal faces to set .*", ("non-orthogonal",)),
    (r"<<Writing (\d+) faces with incorrect orientation to set .*", ("faces of negative pyramids",)),
    (rf"Max skewness = {X} OK\.", ("skewness",)),
    (rf"\*\*\*Max skewness = {X}, (\d+) highly skew faces.*", ("skewness", "skew faces")),
    (r"<<Writing (\d+) skew faces to set .*", ("skew faces",)),
    (rf"Min/max edge length = {X} {X} OK\.", ("shortest edge", "longest edge")),
    (rf"\*Edges too small, min/max edge length = {X} {X}, number too small: \d+", ("shortest edge", "longest edge")),
    (rf"\*There are (\d+) faces with concave angles between consecutive edges\. Max concave angle = {X} degrees\.",
     ("concave faces", "concave angle")),
    (r"<<Writing (\d+) faces with concave angles to set .*", ("concave faces",)),
    (rf"Face flatness \(1 = flat, 0 = butterfly\) : min = {X}  average = {X}", ("least flatness", "mean flatness")),
    (rf"\*There are (\d+) faces with ratio between projected and actual area < {X}", ("warped faces", "0.8")),
    (rf"Minimum ratio \(minimum flatness, maximum warpage\) = {X}", ("least flatness",)),
    (r"<<Writing (\d+) warped faces to set .*", ("warped faces",)),
    (rf"Cell determinant \(wellposedness\) : minimum: {X} average: {X}", ("least determinant", "mean determinant")),
    (r"\*\*\*Cells with small determinant \(< 0\.001\) found, number of cells: (\d+)", ("undetermined cells",)),
    (r"<<Writing (\d+) under-determined cells to set .*", ("undetermined cells",)),
    (r"\*\*\*Concave cells \(using face planes\) found, number of cells: (\d+)", ("concave cells",)),
    (r"<<Writing (\d+) concave cells to set .*", ("concave cells",)),
    (rf"Face interpolation weight : minimum: {X} average: {X}", ("least weight", "mean weight")),
    (rf".*Faces with small interpolation weight \(< {X}\) found, number of faces: (\d+)",
     ("0.05", "faces of small weight")),
    (r"<<Writing (\d+) faces with low interpolation weights to set .*", ("faces of small weight",)),
    (rf"Face volume ratio : minimum: {X} average: {X}", ("least volume ratio", "mean volume ratio")),
    (rf".*Faces with small volume ratio \(< {X}\) found, number of faces: (\d+)",
     ("0.01", "faces of small volume ratio")),
    (r"<<Writing (\d+) faces with low volume ratio cells to set .*", ("faces of small volume ratio",)),
)  # fmt: skip
"""Lines of the report, and what the numbers in them are. A number printed twice must be the same one."""

SKIPPED = {
    r"Coupled point location match .*": "of pairs of coupled patches, which these meshes have not",
    r"Mesh has \d (geometric|solution) .*": "follows from the types of patches; its directions are taken over below",
    r"Wedge \S+ with angle .*": "the opening of an axisymmetric sector, which is the user's own number",
    r".*Error in face pyramids: \d+ .*": "counts a face once for each of its sides; the set written next is compared",
    r".*Error in face tets: \d+ .*": "of the tets in which OpenFOAM tracks particles; no metric of ours",
    r"<<Writing \d+ faces with low quality or negative volume decomposition tets .*": "the same",
    r"Failed \d+ mesh checks\.": "its verdict; ours is that of a profile",
    r"<<Writing \d+ points on short edges .*": "edges shorter than a millionth of the box; a list of points",
    r"<<Writing \d+ near \(closer than .*": "points nearer than that; a list of points",
}
"""Lines with figures that are not compared, and why."""


def parse(report):
    """({quantity: number}, patches, cell zones, polyhedra by number of faces, directions, lines left over)."""
    found, patches, zones, counts, directions, left = {}, {}, {}, {}, None, []
    for line in map(str.strip, report[report.index("Mesh stats") :].splitlines()):
        if not re.search(r"\d", line):
            continue
        for pattern, names in LINES:
            if match := re.fullmatch(pattern, line):
                for name, text in zip(names, match.groups(), strict=True):
                    assert found.setdefault(name, float(text)) == float(text), line
                break
        else:
            if match := re.fullmatch(rf"(\S+)\s+(\d+)\s+(\d+)\s+(?:ok|multiply) .*\)\s+{BOX}", line):
                patches[match[1]] = [float(text) for text in match.groups()[1:]]
            elif match := re.fullmatch(rf"(\S+)\s+(\d+)\s+(\d+)\s+{X}\s+{BOX}", line):
                zones[match[1]] = [float(text) for text in match.groups()[1:]]
            elif match := re.fullmatch(r"(\d+)\s+(\d+)", line):
                counts[int(match[1])] = int(match[2])
            elif match := re.fullmatch(r"Mesh has \d geometric .*\((\d) (\d) (\d)\)", line):
                directions = np.array([int(text) for text in match.groups()], bool)
            elif not any(re.fullmatch(pattern, line) for pattern in SKIPPED) and "(empty)" not in line:
                left.append(line)
    return found, patches, zones, counts, directions, left
