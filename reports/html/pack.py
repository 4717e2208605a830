"""Packing arrays for the browser: integers as differences in planes of bytes, which deflate makes small.

The container is: length of the header (4 bytes, little endian), header (JSON), then the bytes of all arrays, the whole
deflated (zlib) and in base64. `viewer/src/unpack.js` is the other side.
"""

from __future__ import annotations

import base64
import json
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Packer", "quantised", "renumbered"]

Ints = NDArray[np.integer]

_LEVEL = 6


class Packer:
    """Collects arrays; `text` is the container."""

    def __init__(self) -> None:
        self._entries: list[dict[str, Any]] = []
        self._parts: list[bytes] = []
        self._at = 0

    def add(self, name: str, values: Ints, *, width: int, delta: bool = False) -> None:
        """Unsigned integers of `width` bytes; delta: as differences to the one before, modulo 256 ** width."""
        flat = np.ascontiguousarray(values, dtype=np.uint64).ravel()
        if delta and len(flat):
            flat = np.diff(flat, prepend=np.uint64(0))  # wraps around, as the other side does
        planes = [(flat >> np.uint64(8 * k) & np.uint64(255)).astype(np.uint8).tobytes() for k in range(width)]
        data = b"".join(planes)
        self._entries.append({"name": name, "at": self._at, "n": len(flat), "width": width, "delta": delta})
        self._parts.append(data)
        self._at += len(data)

    def text(self, header: dict[str, Any]) -> str:
        """The container with this header, to which the list of arrays is added."""
        head = json.dumps({**header, "arrays": self._entries}, separators=(",", ":"), allow_nan=False).encode()
        data = len(head).to_bytes(4, "little") + head + b"".join(self._parts)
        return base64.b64encode(zlib.compress(data, _LEVEL)).decode("ascii")


def renumbered(nodes: Ints) -> tuple[Ints, Ints]:
    """(distinct nodes in the order of first use, code of each use): 0 for the next new one, else how far back it is."""
    distinct, first, inverse = np.unique(nodes, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    index = rank[inverse]
    high = np.maximum.accumulate(index) if len(index) else index
    before = np.concatenate([[-1], high[:-1]]) if len(index) else index
    return distinct[order], before + 1 - index


def quantised(points: NDArray[np.float64], low: NDArray[np.float64], size: NDArray[np.float64], bits: int) -> Ints:
    """(n, 3) places in the box as integers of that many bits; an axis without extent gives 0."""
    top = (1 << bits) - 1
    span = np.where(size > 0, size, 1.0)
    return np.rint(np.clip((points - low) / span, 0.0, 1.0) * top).astype(np.int64)
