"""The lists of OpenFOAM files: labels, flags, points, faces; text or raw bytes, counts and ranges checked.

A list is `n ( ... )`, or `n { value }` when all its entries are equal, optionally after a type word such as
List<label>. In a binary file the entries of a list of plain numbers are raw bytes between the brackets, and a
list of none is its bare count (source: the stream operators of OpenFOAM's List, UList and CompactIOList). The
header's `arch` gives byte order and widths; older releases write none, and there the width is the one with
which the closing bracket falls into place.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.errors import ReadError
from meshwright.audit.mesh import Floats, Ints
from meshwright.audit.readers.openfoam import kernels
from meshwright.audit.readers.openfoam.file import FoamFile, Token

__all__ = ["read_compact_faces", "read_faces", "read_flags", "read_labels", "read_vectors", "skip_value"]

_TYPE_WORD = re.compile(r"(?:nonuniform|List<\w+>)")
_RAW_TYPES = {
    "List<label>": 1,
    "List<bool>": 1,
    "List<scalar>": 1,
    "List<sphericalTensor>": 1,
    "List<vector>": 3,
    "List<symmTensor>": 6,
    "List<tensor>": 9,
}
_MAY_FOLLOW = frozenset(b" \t\n\v\f\r;/)}")
_INT32_END = 2**31 - 1


@dataclass(frozen=True)
class _Head:
    """count: of entries.  uniform: `{` follows.  start: of the count.  stop: after the opening bracket,
    or after the count of an empty binary list without brackets."""

    count: int
    uniform: bool
    start: int
    stop: int
    bare: bool = False


def read_labels(
    file: FoamFile, pos: int, what: str, end: int, most: int, *, least: int = 0, raw: bool | None = None
) -> tuple[Ints, int]:
    """A list of at most `most` labels in [least, end), and the offset after it. raw: as `file.binary`."""
    raw = file.binary if raw is None else raw
    head = _head(file, pos, what, most, 1 if raw else 2)
    wanted = f"{what} from {least} to {end - 1}"
    dtype = _index_dtype(end)
    if head.uniform:
        inside = file.token(head.stop, wanted)
        if inside.kind != "label" or not least <= int(inside.text) < end:
            raise file.error(inside.start, wanted)
        stop = file.take(inside.stop, "}", f"after the {what} all entries share")
        return np.full(head.count, int(inside.text), dtype), stop
    if head.bare:
        return np.empty(0, dtype), head.stop
    if not raw:
        values = np.empty(head.count, dtype)
        done, stop = kernels.read_labels(file.source.data, head.stop, len(file.source), least, end, values)
        if done < head.count:
            raise _bad_entry(file, stop, wanted, done, head.count)
        return values, file.take(stop, ")", f"after {head.count} entries ({what})")
    numbers, stop = _raw(file, head, 1, "i", file.label_bytes, what)
    if len(numbers) and (numbers.min() < least or numbers.max() >= end):
        worst = int(((numbers < least) | (numbers >= end)).argmax())
        raise _bad_number(file, stop, numbers, worst, f"{wanted} (entry {worst} of {head.count})")
    return numbers.astype(dtype, copy=False), stop


def read_flags(file: FoamFile, pos: int, what: str, most: int) -> tuple[NDArray[np.bool_], int]:
    """A list of at most `most` booleans, 0 or 1 (a byte each where raw), and the offset after it."""
    if not file.binary or _head(file, pos, what, most, 1).uniform:
        values, stop = read_labels(file, pos, what, 2, most, raw=False)
        return values.astype(np.bool_), stop
    head = _head(file, pos, what, most, 1)
    if head.bare:
        return np.empty(0, np.bool_), head.stop
    numbers, stop = _raw(file, head, 1, "u", 1, what)
    if len(numbers) and int(numbers.max()) > 1:
        raise _bad_number(file, stop, numbers, int(numbers.argmax()), f"{what} 0 or 1")
    return numbers.astype(np.bool_), stop


def read_vectors(file: FoamFile, pos: int, what: str) -> tuple[Floats, int]:
    """A list of n finite vectors as (n, 3) float64, and the offset after it."""
    head = _head(file, pos, what, None, 1 if file.binary else 7)
    wanted = f"{what} '(x y z)' of finite numbers"
    if head.uniform:
        raise file.error(head.start, f"a {what} for each entry", "one that all entries share")
    if head.bare:
        return np.empty((0, 3)), head.stop
    if not file.binary:
        values = np.empty((head.count, 3))
        done, stop = kernels.read_vectors(file.source.data, head.stop, len(file.source), values)
        if done < head.count:
            raise _bad_entry(file, stop, wanted, done, head.count)
        return values, file.take(stop, ")", f"after {head.count} entries ({what})")
    numbers, stop = _raw(file, head, 3, "f", file.scalar_bytes, what)
    bad = ~np.isfinite(numbers)
    if bad.any():
        worst = int(bad.argmax())
        raise _bad_number(file, stop, numbers, worst, f"{wanted} (entry {worst // 3} of {head.count})")
    return numbers.astype(np.float64, copy=False).reshape(-1, 3), stop


def read_faces(file: FoamFile, pos: int, n_points: int) -> tuple[Ints, Ints, int]:
    """A faceList of faces `n(a b c ...)`: offsets (f + 1,), nodes, and the offset after it."""
    data, end = file.source.data, len(file.source)
    width = (file.label_bytes or 4) if file.binary else 0
    head = _head(file, pos, "face", None, 3 * width + 3 if width else 8)
    if head.uniform:
        raise file.error(head.start, "each face by itself", "one that all entries share")
    if head.bare:
        return np.zeros(1, np.int32), np.empty(0, np.int32), head.stop
    offsets = np.zeros(head.count + 1, _index_dtype(end))
    nodes = np.empty(4 * head.count, _index_dtype(n_points))
    pos, done, fault = head.stop, 0, kernels.MORE_ROOM
    while fault == kernels.MORE_ROOM:
        fault, pos, done, need = kernels.read_faces(
            data, pos, end, width, file.big_endian, n_points, done, offsets, nodes
        )
        if fault == kernels.MORE_ROOM:
            longer = np.empty(max(need, len(nodes) * 3 // 2), nodes.dtype)
            longer[: offsets[done]] = nodes[: offsets[done]]
            nodes = longer
    if fault != kernels.FINE:
        wanted = {
            kernels.BAD_SIZE: "the number of points of a face, at least 3 and no more than the bytes left can hold",
            kernels.NO_OPEN: "'(' before the points of a face",
            kernels.NO_CLOSE: "')' after the points of a face",
            kernels.BAD_NODE: f"a point of a face from 0 to {n_points - 1}",
        }[fault]
        raise _bad_entry(file, pos, wanted, done, head.count)
    return offsets, nodes[: offsets[-1]], file.take(pos, ")", f"after {head.count} faces")


def read_compact_faces(file: FoamFile, pos: int, n_points: int) -> tuple[Ints, Ints, int]:
    """A faceCompactList, the starts of all faces and then their points: as `read_faces`."""
    first = file.skip(pos)
    end = len(file.source)
    offsets, pos = read_labels(file, pos, "start of a face", end, end)
    if not len(offsets) or offsets[0] != 0:
        raise file.error(first, "starts of faces, the first 0", "none" if not len(offsets) else str(offsets[0]))
    size = np.diff(offsets)
    if len(size) and size.min() < 3:
        worst = int((size < 3).argmax())
        raise file.error(first, f"at least 3 points between the starts of face {worst} and the next", str(size[worst]))
    second = file.skip(pos)
    nodes, pos = read_labels(file, pos, "a point of a face", n_points, end)
    if len(nodes) != offsets[-1]:
        raise file.error(second, f"the {offsets[-1]} points that the starts of faces announce", f"{len(nodes)}")
    return offsets, nodes, pos


def skip_value(file: FoamFile, pos: int) -> int:
    """Offset after any value of a dictionary, raw lists in it included."""

    def skip_list(word: Token) -> int:
        components = _RAW_TYPES.get(word.text)
        if components is None:
            return word.stop  # lists of words and of dictionaries are text in a binary file too
        head = _head(file, word.stop, "entry", len(file.source), 1)
        if head.bare or head.uniform:
            return word.stop
        kind, width = {"List<label>": ("i", file.label_bytes), "List<bool>": ("u", 1)}.get(
            word.text, ("f", file.scalar_bytes)
        )
        return _raw(file, head, components, kind, width, "entry")[1]

    return file.skip_value(pos, skip_list if file.binary else None)


def _head(file: FoamFile, pos: int, what: str, most: int | None, least_bytes: int) -> _Head:
    """The start of a list; its count is believed only if `most` allows it and the bytes left can hold it."""
    token = file.token(pos, f"a count of entries ({what})")
    while token.kind == "word" and _TYPE_WORD.fullmatch(token.text):
        token = file.token(token.stop, f"a count of entries ({what})")
    if token.kind != "label":
        raise file.error(token.start, f"a count of entries ({what})")
    count = int(token.text)
    if most is not None and not 0 <= count <= most:
        raise file.error(token.start, f"a count of at most {most} entries ({what})", token.text)
    mark = file.token(token.stop, "'(' and the entries") if count or not file.binary else None
    if mark is None:
        return _empty_head(file, token)
    if mark.is_mark("{"):
        return _Head(count, True, token.start, mark.stop)
    if not mark.is_mark("("):
        raise file.error(mark.start, f"'(' before {count} entries ({what})")
    file.source.checked_count(count, least_bytes, token.start, f"entries ({what})", binary=file.binary)
    return _Head(count, False, token.start, mark.stop)


def _empty_head(file: FoamFile, count: Token) -> _Head:
    """An empty list of a binary file: `0`, or as text `0()`."""
    start = file.skip(count.stop)
    if file.source.find(b"(", start, start + 1) < 0:
        return _Head(0, False, count.start, count.stop, bare=True)
    return _Head(0, False, count.start, file.take(start + 1, ")", "after no entries"), bare=True)


def _raw(file: FoamFile, head: _Head, components: int, kind: str, width: int, what: str) -> tuple[NDArray, int]:
    """Native numbers of a raw list, (count * components,), and the offset after its closing bracket."""
    data = file.source.data
    usual = {"i": (4, 8), "f": (8, 4), "u": (1,)}[kind]
    for size in (width,) if width else usual:
        stop = head.stop + head.count * components * size
        if stop < len(data) and data[stop] == ord(")") and (width or _may_follow(file, stop + 1)):
            dtype = np.dtype(f"{'>' if file.big_endian else '<'}{kind}{size}")
            # Always a copy: aligned for the kernels, and free of the file, which may be a map that is cut later.
            return data[head.stop : stop].view(dtype).astype(dtype.newbyteorder("=")), stop + 1
    stop = min(head.stop + head.count * components * (width or usual[0]), len(data))
    sizes = str(width) if width else " or ".join(map(str, sorted(usual)))
    wanted = f"')' after {head.count} entries ({what}) of {components} x {sizes} bytes"
    raise file.source.error(stop, wanted, binary=True)


def _may_follow(file: FoamFile, pos: int) -> bool:
    return pos >= len(file.source) or int(file.source.data[pos]) in _MAY_FOLLOW


def _index_dtype(end: int) -> type[np.signedinteger]:
    return np.int32 if end <= _INT32_END else np.int64


def _bad_entry(file: FoamFile, pos: int, wanted: str, done: int, count: int) -> ReadError:
    return file.error(pos, f"{wanted} (entry {done} of {count})")


def _bad_number(file: FoamFile, stop: int, numbers: NDArray, worst: int, wanted: str) -> ReadError:
    """The error about one number of a raw list whose closing bracket ends at `stop`."""
    offset = stop - 1 - (len(numbers) - worst) * numbers.dtype.itemsize
    return file.error(offset, wanted, str(numbers[worst]))
