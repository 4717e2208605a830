"""Random and adversarial cells of every type, by the thousand, for the tests that try every metric on them.

Loaded with `runpy.run_path` by the tests that need it.
"""

import numpy as np

from meshwright.audit.mesh import CellBlock, Mesh

SHAPES = {
    "tri": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0)],
    "quad": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    "tet": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0.5, 0.29, 0.82)],
    "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0.7)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0.5, 0.87, 0), (0, 0, 1), (1, 0, 1), (0.5, 0.87, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}


def turned(cells, rng):
    """Each cell turned at random about the origin."""
    q, _ = np.linalg.qr(rng.normal(size=(len(cells), 3, 3)))
    return np.einsum("cij,cnj->cni", q, cells)


def random_cells(name, n, seed=0):
    """(n, k, 3): from nearly perfect to fully random corners, a third each, turned at random."""
    rng = np.random.default_rng(seed)
    shape = np.array(SHAPES[name], float)
    spread = np.repeat([0.1, 0.4, 1.5], -(-n // 3))[:n, None, None]
    return turned(shape + spread * rng.uniform(-1, 1, (n, *shape.shape)), rng)


def adversarial_cells(name, n, seed=0):
    """(n, k, 3): flat, folded, collapsed, mirrored, huge, tiny, far away, thin; all coordinates finite."""
    rng = np.random.default_rng(seed)
    shape = np.array(SHAPES[name], float)
    k = len(shape)
    per = -(-n // 10)
    kinds = []
    base = shape + rng.uniform(-0.2, 0.2, (per, k, 3))
    thin = base * (1, 1, 0) + base * (0, 0, 1) * 10.0 ** rng.uniform(-18, -6, (per, 1, 1))
    kinds.append(turned(thin, rng))  # squashed to a sheet
    needle = base * (1, 0, 0) + base * (0, 1, 1) * 10.0 ** rng.uniform(-18, -3, (per, 1, 1))
    kinds.append(turned(needle, rng))  # drawn out to a needle
    flat = turned(base * (1, 1, 0), rng)
    kinds.append(flat)  # in one plane, as far as rounding lets it
    kinds.append(np.round(8 * base) / 8)  # on a coarse grid: exact zeros, exact ties, right angles
    collapsed = base.copy()
    one, other = rng.integers(0, k, (2, per))
    collapsed[np.arange(per), one] = collapsed[np.arange(per), other]
    kinds.append(collapsed)  # two corners in one place
    pushed = base.copy()
    pushed[np.arange(per), one] += 3 * (base.mean(axis=1) - pushed[np.arange(per), one])
    kinds.append(pushed)  # a corner pushed through the cell
    kinds.append(base[:, rng.permutation(k)])  # corners in another order
    kinds.append(base * 10.0 ** rng.uniform(-100, 100, (per, 1, 1)))  # of any size
    kinds.append(base + 1e9 * rng.uniform(-1, 1, (per, 1, 3)))  # far from the origin
    line = base * (1, 0, 0)
    line[: per // 3] = line[: per // 3, :1]
    kinds.append(line)  # on one line, a third of them in a single point
    return np.concatenate(kinds)[:n]


def as_mesh(name, cells):
    """A mesh of cells that share no point."""
    nodes = np.arange(cells.shape[0] * cells.shape[1]).reshape(cells.shape[:2])
    return Mesh(cells.reshape(-1, 3), (CellBlock(name, np.arange(len(nodes)), nodes),))
