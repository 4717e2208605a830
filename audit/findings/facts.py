"""`Facts`: what the checks are given. Everything expensive is computed once, on demand, and kept with the mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.connectivity import duplicate_cells, faces, overused_faces
from meshwright.audit.csr import take
from meshwright.audit.findings.options import Options
from meshwright.audit.findings.signs.shapes import Shapes, cell_shapes
from meshwright.audit.findings.signs.sides import BOTH, FROM_OWNER, face_sides
from meshwright.audit.mesh import NO_CELL, CellBlock, Ints, Mesh, index_array
from meshwright.audit.sets import hash_rows

__all__ = ["HANDFUL", "NEEDS", "Facts"]

HANDFUL = 4
"""Up to so many cells may all be wrong by chance; more of one type, every one of them reversed, are a convention."""


@dataclass(frozen=True, eq=False)
class Facts:
    """A mesh, what the user told of it, and what several checks share."""

    mesh: Mesh
    options: Options = field(default_factory=Options)

    @property
    def shapes(self) -> Shapes:
        """Size, centre and corners of every cell."""
        return cell_shapes(self.mesh)

    @cached_property
    def reversed_types(self) -> dict[str, int]:
        """Cell types all of whose cells are negative, with their number: the file orders their nodes differently.

        More than a handful of them, or of cells in a mesh that is negative throughout; or fewer beside other cells
        that are all positive, when their faces show that they lie where they belong and only their node order is
        mirrored. Surface meshes have none.
        """
        if self.mesh.dimension == 3 and self.mesh.cell_dimension == 2:
            return {}
        negative, sized = self.shapes.negative, ~self.shapes.flat & np.isfinite(self.shapes.relative)
        in_all, below_all = np.count_nonzero(sized), np.count_nonzero(negative)
        found: dict[str, int] = {}
        for block in self.mesh.blocks:
            below, of = np.count_nonzero(negative[block.rows]), np.count_nonzero(sized[block.rows])
            if not of or below != of:
                continue
            beside_good = in_all > of and below_all == below
            many = below > HANDFUL or (below_all == in_all and in_all > HANDFUL)
            if many or (beside_good and self._mirrored(block)):
                found[block.type] = int(below)
        return found

    def _mirrored(self, block: CellBlock) -> bool:
        """Whether every face of these cells is the wrong way round as they turn it, and right for their neighbours.

        A cell that is inverted by a misplaced node fails this: it sees some faces from the wrong side, but they still
        point the way its neighbours expect.
        """
        own = np.zeros(self.mesh.n_cells, dtype=bool)
        own[block.rows] = True
        found, faults = faces(self.mesh), face_sides(self.mesh).faults
        inside = found.neighbour != NO_CELL
        mine = own[found.owner]
        theirs = ~mine & inside & own[found.neighbour]
        return bool(np.all(faults[mine] == np.where(inside[mine], BOTH, FROM_OWNER)) and not faults[theirs].any())

    @cached_property
    def reversed_cells(self) -> NDArray[np.bool_]:
        """(n_cells,) the negative cells that `reversed_types` explains."""
        mask = np.zeros(self.mesh.n_cells, dtype=bool)
        for block in self.mesh.blocks:
            if block.type in self.reversed_types:
                mask[block.rows] = self.shapes.negative[block.rows]
        return mask

    @cached_property
    def crowded_faces(self) -> Ints:
        """One row of `connectivity.faces` for each set of nodes that more than two different cells name as a face.

        Copies of a cell do not count: they are for the check on duplicate cells.
        """
        rows = overused_faces(self.mesh)
        if not len(rows):
            return rows
        found = faces(self.mesh)
        keys = hash_rows(*take(found.offsets, found.nodes, rows))
        _, first, group = np.unique(keys, return_index=True, return_inverse=True)
        named = np.concatenate([np.stack([group, side[rows]]) for side in (found.owner, found.neighbour)], axis=1)
        copies = duplicate_cells(self.mesh)[:, 0]
        named = named[:, (named[1] != NO_CELL) & ~np.isin(named[1], copies)]
        different = np.unique(named, axis=1)[0]
        return index_array(np.sort(rows[first[np.bincount(different, minlength=len(first)) > 2]]))


NEEDS: dict[str, Callable[[Facts], bool]] = {
    "signed cells": lambda facts: facts.mesh.cell_dimension == 3 or facts.mesh.dimension == 2,
    "surface": lambda facts: facts.mesh.cell_dimension == 2 and facts.mesh.dimension == 3,
    "own faces": lambda facts: facts.mesh.faces is not None,
    "derived faces": lambda facts: facts.mesh.faces is None,
    "cell zones": lambda facts: bool(facts.mesh.cell_zones),
    "face zones": lambda facts: any(zone.entity == "face" for zone in facts.mesh.zones),
    "zones": lambda facts: bool(facts.mesh.zones),
    "several types": lambda facts: sum(len(block) > 0 for block in facts.mesh.blocks) > 1,
}
"""Words of `Check.needs`."""
