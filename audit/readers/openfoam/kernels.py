"""Compiled scanners of OpenFOAM's text and binary lists: comments, labels, vectors, faces.

All take (buf uint8[:], pos, stop, ...) with 0 <= pos <= stop <= len(buf) and read nothing outside that range.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import inner, kernel
from meshwright.audit.mesh import Floats, Ints
from meshwright.audit.readers.tokens import Pointer, parse_float, parse_int, pass_space, pointer

__all__ = [
    "BAD_NODE",
    "BAD_SIZE",
    "FINE",
    "MORE_ROOM",
    "NO_CLOSE",
    "NO_OPEN",
    "read_faces",
    "read_labels",
    "read_vectors",
    "skip_blank",
]

FINE: Final = 0
MORE_ROOM: Final = 1
BAD_SIZE: Final = 2
NO_OPEN: Final = 3
NO_CLOSE: Final = 4
BAD_NODE: Final = 5

Bytes = NDArray[np.uint8]

_OPEN, _CLOSE, _STAR, _SLASH, _ZERO = 40, 41, 42, 47, 48
_LF, _CR = 10, 13


@kernel
def skip_blank(buf: Bytes, pos: int, stop: int) -> int:
    """First offset from `pos` that is neither white space nor in a comment; `stop` in a comment without end."""
    return _pass_blank(pointer(buf), pos, stop)  # type: ignore[call-arg]


@inner
def _pass_blank(buf: Pointer, pos: int, stop: int) -> int:
    while True:
        pos = pass_space(buf, pos, stop)
        if pos + 1 >= stop or buf[pos] != _SLASH:
            return pos
        if buf[pos + 1] == _SLASH:
            pos += 2
            while pos < stop and buf[pos] != _LF and buf[pos] != _CR:
                pos += 1
        elif buf[pos + 1] == _STAR:
            pos += 2
            while pos + 1 < stop and not (buf[pos] == _STAR and buf[pos + 1] == _SLASH):
                pos += 1
            pos = pos + 2 if pos + 1 < stop else stop
        else:
            return pos


@inner
def _next(buf: Pointer, pos: int, stop: int) -> int:
    """As `skip_blank`, at once where a token begins: every blank and '/' is below the digits in ASCII."""
    if pos < stop and buf[pos] >= _ZERO:
        return pos
    return _pass_blank(buf, pos, stop)


@kernel
def read_labels(buf: Bytes, pos: int, stop: int, least: int, end: int, out: Ints) -> tuple[int, int]:
    """Integers in [least, end) into `out`: (how many, offset after them or of the token that is none)."""
    text = pointer(buf)  # type: ignore[call-arg,var-annotated]
    for i in range(len(out)):
        if pos < stop and buf[pos] == _LF:
            pos += 1  # one a line is how lists are written
        pos = _next(text, pos, stop)
        value, after, ok = parse_int(text, pos, stop)
        if not ok or value < least or value >= end:
            return i, pos
        out[i] = value
        pos = after
    return len(out), pos


@kernel
def read_vectors(buf: Bytes, pos: int, stop: int, out: Floats) -> tuple[int, int]:
    """`(x y z)` of finite numbers into the rows of `out`: (how many, offset after them or of what is none)."""
    text = pointer(buf)  # type: ignore[call-arg,var-annotated]
    for i in range(len(out)):
        pos = _next(text, pos, stop)
        if pos >= stop or buf[pos] != _OPEN:
            return i, pos
        pos += 1
        for k in range(3):
            pos = _next(text, pos, stop)
            value, after, ok = parse_float(text, pos, stop)
            if not ok or not np.isfinite(value):
                return i, pos
            out[i, k] = value
            pos = after
        pos = _next(text, pos, stop)
        if pos >= stop or buf[pos] != _CLOSE:
            return i, pos
        pos += 1
    return len(out), pos


@inner
def _raw_label(buf: Bytes, pos: int, width: int, big: bool) -> np.int64:
    """The two's complement integer of `width` bytes (4 or 8) at `pos`."""
    bits = np.uint64(0)
    for k in range(width):
        byte = buf[pos + k] if big else buf[pos + width - 1 - k]
        bits = bits << np.uint64(8) | np.uint64(byte)
    if width == 4:
        return np.int64(np.int32(np.uint32(bits)))
    return np.int64(bits)


@kernel
def read_faces(
    buf: Bytes, pos: int, stop: int, width: int, big: bool, n_points: int, first: int, offsets: Ints, nodes: Ints
) -> tuple[int, int, int, int]:
    """Faces `n(a b c ...)` from face `first` on into `offsets` and `nodes`.

    width: bytes of a binary label, 0 for text.  Returns (fault, offset, faces done, nodes needed). On
    MORE_ROOM the offset is that of the first face not done, and reading goes on there with longer `nodes`.
    """
    text = pointer(buf)  # type: ignore[call-arg,var-annotated]
    used = int(offsets[first])
    least = max(width, 2)  # a label of text is a digit and a blank
    for face in range(first, len(offsets) - 1):
        pos = _next(text, pos, stop)
        start = pos
        size, after, ok = parse_int(text, pos, stop)
        if not ok or size < 3 or size > (stop - after) // least:
            return BAD_SIZE, pos, face, used
        if used + size > len(nodes):
            return MORE_ROOM, start, face, used + size
        pos = _next(text, after, stop)
        if pos >= stop or buf[pos] != _OPEN:
            return NO_OPEN, pos, face, used
        pos += 1
        if size * width > stop - pos:
            return NO_CLOSE, stop, face, used
        for k in range(size):
            if width:
                node, after, ok = _raw_label(buf, pos, width, big), pos + width, True
            else:
                pos = _next(text, pos, stop)
                node, after, ok = parse_int(text, pos, stop)
            if not ok or node < 0 or node >= n_points:
                return BAD_NODE, pos, face, used
            nodes[used + k] = node
            pos = after
        pos = _next(text, pos, stop) if width == 0 else pos
        if pos >= stop or buf[pos] != _CLOSE:
            return NO_CLOSE, pos, face, used
        pos += 1
        used += size
        offsets[face + 1] = used
    return FINE, pos, len(offsets) - 1, used
