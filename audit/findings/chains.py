"""Edges of a surface strung together: loops around holes, chains along joints, with their length and place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.csr import invert
from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints, Mesh, index_array
from meshwright.audit.places import plain

__all__ = ["Chain", "chains_of", "described"]

MOST_CHAINS = 50
"""Chains that are described, longest first."""
MOST_CORNERS = 200
"""Corners of a chain that are listed."""


class Chain:
    """One chain: its edges by their place in the list given, its corners as point rows, whether it closes.

    A closed chain names its first corner once.
    """

    def __init__(self, edges: Ints, corners: Ints, points: NDArray[np.float64]) -> None:
        self.edges = edges
        self.closed = len(corners) > 1 and bool(corners[0] == corners[-1])
        self.corners = corners[:-1] if self.closed else corners
        place = points[corners]
        with np.errstate(over="ignore", invalid="ignore"):
            self.length = float(np.sqrt(((place[1:] - place[:-1]) ** 2).sum(axis=1)).sum())
            self.low, self.high = place.min(axis=0), place.max(axis=0)
            self.centre = points[self.corners].mean(axis=0)
            self.extent = float(np.sqrt(((self.high - self.low) ** 2).sum()))


def chains_of(mesh: Mesh, ends: Ints) -> list[Chain]:
    """Chains of these edges (m, 2), point rows, each once, longest first.

    Where other than two edges meet at a point, chains end there; a chain that comes back to where it began is closed.
    """
    if not len(ends):
        return []
    points, local = np.unique(ends, return_inverse=True)
    local = index_array(local.reshape(-1, 2))
    starts, around = invert(index_array(np.arange(0, 2 * len(ends) + 1, 2)), index_array(local.ravel()), len(points))
    order, stops, corners = _string(local, starts, around)
    chains = []
    for k in range(len(stops) - 1):
        rows = slice(stops[k], stops[k + 1])
        corner = corners[stops[k] + k : stops[k + 1] + k + 1]
        chains.append(Chain(order[rows], points[corner], mesh.points))
    chains.sort(key=lambda chain: (-chain.length if chain.length == chain.length else 0.0, int(chain.corners.min())))
    return chains


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


def described(mesh: Mesh, chains: list[Chain]) -> list[dict[str, Any]]:
    """The longest chains as figures."""
    return [_described(mesh, chain) for chain in chains[:MOST_CHAINS]]


def _described(mesh: Mesh, chain: Chain) -> dict[str, Any]:
    listed = chain.corners[:MOST_CORNERS]
    ids = listed if mesh.point_ids is None else mesh.point_ids[listed]
    return {
        "edges": len(chain.edges),
        "closed": chain.closed,
        "length": plain(chain.length),
        "centre": [plain(x) for x in chain.centre],
        "low": [plain(x) for x in chain.low],
        "high": [plain(x) for x in chain.high],
        "points": ids.tolist(),
        "coordinates": [[plain(x) for x in mesh.points[p]] for p in listed],
    }
