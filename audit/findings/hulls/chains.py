"""Edges of a surface strung together: loops around holes, chains along joints, with their length and place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.csr import invert
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints, Mesh, index_array
from meshwright.audit.places import plain

__all__ = ["Chains", "chains_of"]

Floats = NDArray[np.float64]

MOST_CHAINS = 50
"""Chains that are described, longest first."""
MOST_CORNERS = 200
"""Corners of a chain that are listed."""


@dataclass(frozen=True, eq=False)
class Chains:
    """k chains, longest first.

    edges (k,): how many.  first (k,): an edge of each, by its place in the list given.  closed (k,).  length, extent
    (k,): of the chain, and of its bounding box from corner to corner.  offsets (k + 1,), corners: point rows in order;
    a closed chain names its first corner again at its end.
    """

    mesh: Mesh
    edges: Ints
    first: Ints
    closed: NDArray[np.bool_]
    length: Floats
    extent: Floats
    offsets: Ints
    corners: Ints

    def __len__(self) -> int:
        return len(self.edges)

    def described(self) -> list[dict[str, Any]]:
        """The longest chains as figures."""
        return [self._described(k) for k in range(min(len(self), MOST_CHAINS))]

    def _described(self, k: int) -> dict[str, Any]:
        mesh = self.mesh
        corners = self.corners[self.offsets[k] : self.offsets[k + 1] - int(self.closed[k])]
        places = mesh.points[corners]
        listed = corners[:MOST_CORNERS]
        ids = listed if mesh.point_ids is None else mesh.point_ids[listed]
        with np.errstate(over="ignore", invalid="ignore"):
            centre = places.mean(axis=0)
        return {
            "edges": int(self.edges[k]),
            "closed": bool(self.closed[k]),
            "length": plain(float(self.length[k])),
            "centre": [plain(x) for x in centre],
            "low": [plain(x) for x in places.min(axis=0)],
            "high": [plain(x) for x in places.max(axis=0)],
            "points": ids.tolist(),
            "coordinates": [[plain(x) for x in place] for place in places[:MOST_CORNERS]],
        }


def chains_of(mesh: Mesh, ends: Ints) -> Chains:
    """Chains of these edges (m, 2), point rows, each once.

    Where other than two edges meet at a point, chains end there; a chain that comes back to where it began is closed.
    """
    points, inverse = np.unique(ends, return_inverse=True)
    local = index_array(inverse.reshape(-1, 2))
    starts, around = invert(index_array(np.arange(0, 2 * len(ends) + 1, 2)), index_array(local.ravel()), len(points))
    order, stops, strung = _string(local, starts, around)
    k = len(stops) - 1
    edges = np.diff(stops)
    offsets = stops + np.arange(k + 1)
    corners = points[strung[: offsets[-1]]]
    closed = corners[offsets[:-1]] == corners[offsets[1:] - 1]
    place = mesh.points[corners]
    low, high = np.empty((0, 3)), np.empty((0, 3))
    length = np.zeros(k)
    if k:
        with np.errstate(over="ignore", invalid="ignore"):
            step = np.sqrt(((place[1:] - place[:-1]) ** 2).sum(axis=1))
            inside = np.ones(len(step), dtype=bool)
            inside[offsets[1:-1] - 1] = False  # from the end of a chain to the start of the next
            length = np.add.reduceat(step[inside], stops[:-1])
            low, high = np.minimum.reduceat(place, offsets[:-1]), np.maximum.reduceat(place, offsets[:-1])
    with np.errstate(over="ignore", invalid="ignore"):
        extent = np.sqrt(((high - low) ** 2).sum(axis=1))
    least = np.minimum.reduceat(corners, offsets[:-1]) if k else np.empty(0, np.int64)
    # by length, a length that is no number first, then by the lowest point
    rank = np.lexsort((least, -np.where(np.isnan(length), np.inf, length)))
    sizes = edges[rank] + 1
    to = np.concatenate([[0], np.cumsum(sizes)])
    picked = np.repeat(offsets[:-1][rank] - to[:-1], sizes) + np.arange(to[-1])
    return Chains(
        mesh, edges[rank], order[stops[:-1][rank]], closed[rank], length[rank], extent[rank], to, corners[picked]
    )


@kernel
def _string(ends: Ints, starts: Ints, around: Ints) -> tuple[Ints, Ints, Ints]:
    """(edges in order, offsets of the chains, corners in order, one more than edges in each chain)."""
    m = ends.shape[0]
    order, stops, corners = np.empty(m, np.int32), np.zeros(m + 1, np.int32), np.empty(2 * m, np.int32)
    done = np.zeros(m, np.bool_)
    n = chains = 0
    for turn in range(2):  # chains from their ends first, then what is left: plain loops
        for p in range(starts.size - 1):
            if turn == 0 and starts[p + 1] - starts[p] == 2:
                continue
            for i in range(starts[p], starts[p + 1]):
                e = around[i]
                if done[e]:
                    continue
                q = p
                corners[n + chains] = q
                while e >= 0:
                    done[e] = True
                    order[n] = e
                    n += 1
                    q = ends[e, 0] + ends[e, 1] - q
                    corners[n + chains] = q
                    e = -1
                    if starts[q + 1] - starts[q] == 2:
                        for j in range(starts[q], starts[q + 1]):
                            if not done[around[j]]:
                                e = around[j]
                chains += 1
                stops[chains] = n
    return order, stops[: chains + 1], corners
