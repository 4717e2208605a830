"""What no repair that keeps the boundary can pass: the angles of the boundary's own faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from meshwright.audit.measurement import measure
from meshwright.audit.mesh import Mesh
from meshwright.audit.parallel import workers
from meshwright.audit.surface import boundary_mesh

__all__ = ["limits"]

_SKEW = "gambit.equiangle_skew"
_ROUNDING = 1e-9
_FINE = 0.5
"""Skew up to which nobody asks what stands in the way of less."""


def limits(mesh: Mesh) -> tuple[str, ...]:
    """Sentences on figures of the mesh that its boundary alone decides, with where; none where inner cells do.

    A cell's equiangle skew is that of its worst face, so that no cell on a fixed face can be better than the face.
    """
    if mesh.cell_dimension != 3 or mesh.faces is not None or any(block.items is not None for block in mesh.blocks):
        return ()
    cells = measure(mesh, [_SKEW], threads=workers()).values[_SKEW]
    shell = boundary_mesh(replace(mesh, boundary=(), boundary_ids=None, zones=()))
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
