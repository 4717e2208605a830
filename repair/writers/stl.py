"""STL, binary: triangles, each with its own three points in single precision."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from meshwright.audit.mesh import Mesh
from meshwright.repair.writers.common import only_faces_of_three

__all__ = ["write_mesh"]

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_mesh(mesh: Mesh, stream: BinaryIO) -> list[str]:
    """Write the mesh; see `write`."""
    corners = mesh.points[only_faces_of_three(mesh)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    out = np.zeros(len(corners), _RECORD)
    out["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    out["corners"] = corners
    stream.write(b"meshwright".ljust(80) + np.array([len(corners)], "<u4").tobytes())
    stream.write(out.tobytes())
    notes = ["coordinates are rounded to single precision: STL has no other"]
    return notes + [f"zone {z.name!r} is not kept: STL has no groups" for z in mesh.zones]
