"""PNG files from arrays, small: a palette wherever 256 colours will do.

Source: W3C, Portable Network Graphics (PNG) Specification, third edition.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

__all__ = ["png"]

Image = NDArray[np.uint8]

_COMMON = 192
_COLOURS = 256


def png(image: Image, *, exact: bool = False) -> bytes:
    """The bytes of a PNG file of an image (height, width, 3).

    Up to 256 colours are kept as they are. Of more, the most common are kept and every other pixel gets the nearest of
    256, rare strong colours included, unless `exact` asks for all of them.
    """
    height, width = image.shape[:2]
    packed = image.reshape(-1, 3).astype(np.int32) @ np.array([65536, 256, 1], np.int32)
    values, index, counts = np.unique(packed, return_inverse=True, return_counts=True)
    colours = np.column_stack([values >> 16, values >> 8 & 255, values & 255])
    if exact and len(values) > _COLOURS:
        rows = np.empty((height, 1 + 3 * width), np.uint8)
        rows[:, 0] = 2  # every byte as the difference to the one above
        rows[:, 1:] = np.diff(image.reshape(height, -1), axis=0, prepend=np.zeros((1, 3 * width), np.uint8))
        return _file(width, height, 2, b"", rows)
    if len(values) > _COLOURS:
        colours, nearest = _palette(colours, counts)
        index = nearest[index]
    rows = np.zeros((height, 1 + width), np.uint8)
    rows[:, 1:] = index.reshape(height, width)
    return _file(width, height, 3, _chunk(b"PLTE", colours.astype(np.uint8).tobytes()), rows)


def _palette(colours: NDArray[np.int32], counts: NDArray[np.intp]) -> tuple[NDArray, NDArray[np.intp]]:
    """(256, 3) colours for a picture, and for each of its colours the nearest of them.

    Three quarters are the most common ones; the rest are means of what is left in coarse cubes of the colour space, the
    cubes farthest from the common ones first, so that a colour that only a few pixels have is not lost.
    """
    order = np.argsort(-counts, kind="stable")
    common, rest = colours[order[:_COMMON]], colours[order[_COMMON:]]
    weight = counts[order[_COMMON:]].astype(float)
    cube = rest // 24 @ np.array([121, 11, 1])
    _, member = np.unique(cube, return_inverse=True)
    total = np.bincount(member, weight)
    means = np.column_stack([np.bincount(member, weight * rest[:, d]) / total for d in range(3)])
    gaps = ((means[:, None] - common[None]) ** 2).sum(axis=2).min(axis=1)
    chosen = np.argsort(-gaps, kind="stable")[: _COLOURS - _COMMON]
    palette = np.concatenate([common, np.rint(means[chosen])])
    nearest = np.empty(len(colours), np.intp)
    for start in range(0, len(colours), 4096):
        piece = colours[start : start + 4096]
        nearest[start : start + 4096] = ((piece[:, None] - palette[None]) ** 2).sum(axis=2).argmin(axis=1)
    return palette, nearest


def _file(width: int, height: int, kind: int, palette: bytes, rows: Image) -> bytes:
    head = _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0))
    return (
        b"\x89PNG\r\n\x1a\n" + head + palette + _chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + _chunk(b"IEND", b"")
    )


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
