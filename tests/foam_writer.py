"""Writes a small polyMesh in every encoding OpenFOAM knows, without any code of the reader.

Loaded with `runpy.run_path` by the tests that need it.
"""

import gzip
from pathlib import Path

import numpy as np

FILES = ("points", "faces", "owner", "neighbour", "boundary", "cellZones", "faceZones", "pointZones")

ENCODINGS = {
    "ascii": {},
    "ascii_compact": {"compact": True},
    "ascii_gz": {"gz": True},
    "binary": {"binary": True, "compact": True},
    "binary_gz": {"binary": True, "compact": True, "gz": True},
    "binary_face_list": {"binary": True},
    "binary_label64": {"binary": True, "compact": True, "label": 64},
    "binary_label64_face_list": {"binary": True, "label": 64},
    "binary_scalar32": {"binary": True, "compact": True, "scalar": 32},
    "binary_msb": {"binary": True, "compact": True, "order": ">"},
    "binary_msb_face_list": {"binary": True, "order": ">", "label": 64},
    "binary_no_arch": {"binary": True, "compact": True, "arch": False},
    "binary_label64_scalar32_no_arch": {"binary": True, "compact": True, "arch": False, "label": 64, "scalar": 32},
}

_STEPS = (((0, 1, 0), (0, 0, 1)), ((0, 0, 1), (1, 0, 0)), ((1, 0, 0), (0, 1, 0)))


def box_mesh(n=2):
    """n x n x n boxes: points, faces, owner, neighbour, and patches (name, type, nFaces, startFace).

    Coordinates are sums of few powers of two, so that float32 holds them too; one inner point is moved.
    """
    points = np.array([(i * 1.5, j * 1.25, k * 1.75) for k in range(n + 1) for j in range(n + 1) for i in range(n + 1)])
    points[1 + (n + 1) * (n + 2)] += (0.0625, -0.03125, 0.015625)
    point = lambda c: int(c[0] + (n + 1) * (c[1] + (n + 1) * c[2]))  # noqa: E731
    cell = lambda c: int(c[0] + n * (c[1] + n * c[2]))  # noqa: E731
    inner, outer = [], {"inlet": [], "outlet": [], "sides": []}
    for axis, (first, second) in enumerate(np.array(_STEPS)):
        shape = [n, n, n]
        shape[axis] = n + 1
        for corner in np.array(list(np.ndindex(*shape))):
            face = [point(corner), point(corner + first), point(corner + first + second), point(corner + second)]
            below = corner - np.eye(3, dtype=int)[axis]
            if 0 < corner[axis] < n:
                inner.append((cell(below), cell(corner), face))
            elif corner[axis] == 0:
                outer["inlet" if axis == 0 else "sides"].append((cell(corner), face[::-1]))
            else:
                outer["outlet" if axis == 0 else "sides"].append((cell(below), face))
    inner.sort()
    patches, boundary = [], []
    for (name, group), kind in zip(outer.items(), ("patch", "wall", "symmetry"), strict=True):
        patches.append((name, kind, len(group), len(inner) + len(boundary)))
        boundary += group
    faces = [face for *_, face in inner] + [face for _, face in boundary]
    owner = [own for own, *_ in inner] + [own for own, _ in boundary]
    return points, faces, owner, [other for _, other, _ in inner], patches


def write_polymesh(
    folder, *, binary=False, compact=False, label=32, scalar=64, order="<", arch=True, gz=False, zones=True
):
    """Write `box_mesh` and three zones; compact: a faceCompactList; arch: name byte order and widths."""
    points, faces, owner, neighbour, patches = box_mesh()
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    integers = np.dtype(f"{order}i{label // 8}")
    arch_line = f'    arch "{"LSB" if order == "<" else "MSB"};label={label};scalar={scalar}";\n' if arch else ""
    counts = f"nPoints:{len(points)}  nCells:{max(owner) + 1}  nFaces:{len(faces)}  nInternalFaces:{len(neighbour)}"

    def write(name, class_name, body, note=""):
        header = (
            "/*---- banner ( { 3 ----*/\nFoamFile\n{\n    version 2.0;\n"
            f"    format {'binary' if binary else 'ascii'};\n{arch_line}    class {class_name};\n"
            f"{note and f'    note {chr(34)}{note}{chr(34)};{chr(10)}'}    object {name};\n}}\n// * * * * //\n\n"
        )
        data = header.encode() + body + b"\n\n// **** //\n"
        if gz:
            (folder / f"{name}.gz").write_bytes(gzip.compress(data))
        else:
            (folder / name).write_bytes(data)

    def labels(values):
        if binary:
            raw = b"(" + np.array(values, integers).tobytes() + b")" if len(values) else b""
            return b"\n%d\n" % len(values) + raw
        if len(values) > 1 and len(set(values)) == 1:
            return b"%d{%d}" % (len(values), values[0])
        return b"\n%d\n(\n" % len(values) + b"\n".join(b"%d" % value for value in values) + b"\n)\n"

    if binary:
        raw = points.astype(f"{order}f{scalar // 8}").tobytes()
        write("points", "vectorField", b"%d\n(" % len(points) + raw + b")")
    else:
        rows = (" ".join(map(repr, row)) for row in points.tolist())
        write("points", "vectorField", f"{len(points)}\n(\n{''.join(f'({row})' + chr(10) for row in rows)})".encode())
    if compact:
        starts = [0, *np.cumsum([len(face) for face in faces]).tolist()]
        write("faces", "faceCompactList", labels(starts) + labels([node for face in faces for node in face]))
    else:
        one = labels if binary else lambda face: b"%d(%s)" % (len(face), b" ".join(b"%d" % node for node in face))
        write("faces", "faceList", b"%d\n(\n" % len(faces) + b"\n".join(map(one, faces)) + b"\n)\n")
    write("owner", "labelList", labels(owner), counts)
    write("neighbour", "labelList", labels(neighbour), counts)
    rows = (
        f"{name} {{ type {kind}; inGroups 1({kind}); nFaces {size}; startFace {start}; }}\n"
        for name, kind, size, start in patches
    )
    write("boundary", "polyBoundaryMesh", f"{len(patches)}\n(\n{''.join(rows)})\n".encode())
    if zones:
        flips = [0, 1, 0]
        _write_zones(write, labels, b"\n3\n(" + bytes(flips) + b")" if binary else labels(flips))
    return folder


def _write_zones(write, labels, flips):
    def zone(name, entity, members, extra=b""):
        head = f"{name}\n{{\n    type {entity}Zone;\n{entity}Labels      List<label> "
        return head.encode() + labels(members) + b";\n" + extra + b"}\n"

    cells = zone("left", "cell", [0, 2, 4, 6]) + zone("none", "cell", [])
    faces = zone("middle", "face", [0, 3, 5], b"flipMap List<bool> " + flips + b";\n")
    write("cellZones", "regIOobject", b"2\n(\n" + cells + b")\n")
    write("faceZones", "regIOobject", b"1\n(\n" + faces + b")\n")
    write("pointZones", "regIOobject", b"1\n(\n" + zone("corners", "point", [0, 26]) + b")\n")


def place(bad, name, sound, folder):
    """A polyMesh folder of links: the file `bad` under that name, the others from the folder `sound`.

    Links keep what `bad` is (fifo, folder, loop, device). Returns the folder.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for other in FILES:
        (folder / other).symlink_to(Path(bad).absolute() if other == name else Path(sound).absolute() / other)
    return folder
