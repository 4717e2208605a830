"""What a repair leaves and why: the angles of boundary faces that stay, sides of a surface that are open."""

from __future__ import annotations

import numpy as np

from meshwright.audit.connectivity import half_faces
from meshwright.audit.measurement import measure
from meshwright.audit.mesh import NO_CELL, CellBlock, Ints, Mesh
from meshwright.audit.parallel import workers
from meshwright.repair.surface import sides_of, triangles_of

__all__ = ["limits"]

_SKEW = "gambit.equiangle_skew"
_ROUNDING = 1e-9
_FINE = 0.5
"""Skew up to which nobody asks what stands in the way of less."""


def limits(mesh: Mesh) -> tuple[str, ...]:
    """Sentences on figures of the mesh that its boundary alone decides, with where; none where inner cells do.

    Of a shell of triangles: how many sides keep it from being watertight.

    A cell's equiangle skew is that of its worst face, so that no cell on a fixed face can be better than the face.
    """
    tris = triangles_of(mesh)
    if tris is not None:
        return _open_places(mesh, tris)
    if mesh.cell_dimension != 3 or mesh.faces is not None or any(block.items is not None for block in mesh.blocks):
        return ()
    cells = measure(mesh, [_SKEW], threads=workers()).values[_SKEW]
    shell = _shell(mesh)
    if shell is None or not cells:
        return ()
    worst = max(float(np.nanmax(values)) for values in cells.values())
    sides = measure(shell, [_SKEW], threads=workers()).values[_SKEW]
    name = max(sides, key=lambda kind: float(np.nanmax(sides[kind])))
    at = int(np.nanargmax(sides[name]))
    skew = float(sides[name][at])
    if skew < worst - _ROUNDING or worst < _FINE:
        return ()
    x, y, z = mesh.points[shell.block(name).nodes[at]].mean(axis=0)
    return (
        f"the worst equiangle skew cannot fall under {skew:.3g} while the boundary stays: "
        f"that is the skew of the boundary face at ({x:.5g}, {y:.5g}, {z:.5g})",
    )


def _shell(mesh: Mesh) -> Mesh | None:
    """The sides that only one cell has, as a mesh."""
    sides = half_faces(mesh)
    loops = sides.loops(sides.other == NO_CELL)
    tris, quads = loops[loops[:, 3] < 0, :3], loops[loops[:, 3] >= 0]
    blocks = [CellBlock("tri", np.arange(len(tris)), tris)] if len(tris) else []
    if len(quads):
        blocks.append(CellBlock("quad", len(tris) + np.arange(len(quads)), quads))
    return Mesh(mesh.points, tuple(blocks)) if blocks else None


def _open_places(mesh: Mesh, tris: Ints) -> tuple[str, ...]:
    use = sides_of(tris)
    out = []
    for many, words in (
        (use == 1, "no other triangle: the surface is open"),
        (use > 2, "more than one other triangle"),
    ):
        if many.any():
            t, k = (int(i[0]) for i in np.nonzero(many))
            x, y, z = mesh.points[[tris[t, k], tris[t, (k + 1) % 3]]].mean(axis=0)
            out.append(f"{int(many.sum()):,} sides of triangles have {words}, one at ({x:.5g}, {y:.5g}, {z:.5g})")
    return tuple(out)
