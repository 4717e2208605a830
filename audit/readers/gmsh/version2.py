"""Gmsh MSH 1 ($NOD, $ELM) and 2.0 to 2.2 (text and binary): one line or record a node and an element."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.errors import ReadError, UnsupportedError
from meshwright.audit.jit import inner, kernel
from meshwright.audit.readers.gmsh.elements import ELEMENTS, NODE_COUNTS
from meshwright.audit.readers.gmsh.parts import ElementPart, NodePart
from meshwright.audit.readers.gmsh.sections import BinaryCursor, FileKind, Section, TextCursor
from meshwright.audit.readers.scan import read_ints
from meshwright.audit.readers.source import Source
from meshwright.audit.readers.tokens import Pointer, parse_float, parse_int, pass_space, pointer

__all__ = ["read_elements", "read_nodes", "scan_node_lines"]

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

NO_GROUP = 0
"""Physical number of an element in no group."""
NO_ENTITY = -(2**62)
"""Elementary number of an element that has no such tag."""

# What a scanner stopped at.
DONE, NOT_INT, NOT_FLOAT, NOT_FINITE, UNKNOWN_TYPE, BAD_COUNT, LINE_ENDS, LINE_GOES_ON, TOO_SHORT = range(9)
_EXPECTED = {
    NOT_INT: "an integer",
    NOT_FLOAT: "a coordinate",
    NOT_FINITE: "a finite coordinate",
    UNKNOWN_TYPE: "an element type that has nodes of its own",
    BAD_COUNT: "as many tags, elements or nodes as the type has",
    LINE_ENDS: "more numbers on this line: the element's type, tags and nodes",
    LINE_GOES_ON: "the end of the line after the element's last node",
    TOO_SHORT: "more records before the end of the section",
}
_ID, _TYPE, _PHYSICAL, _ENTITY, _START = range(5)


@inner
def _same_line(buf: Pointer, pos: int, stop: int) -> int:
    """First offset from `pos` that is not a blank within the line."""
    while pos < stop and (buf[pos] == 32 or buf[pos] == 9 or buf[pos] == 11 or buf[pos] == 12):
        pos += 1
    return pos


@inner
def _at_line_end(buf: Pointer, pos: int, stop: int) -> bool:
    return pos >= stop or buf[pos] == 10 or buf[pos] == 13


@kernel
def _scan_nodes(buf: Any, pos: int, stop: int, extra: int, ids: Ints, points: Floats) -> tuple[int, int, int]:
    """Node lines: id x y z and `extra` more numbers (-1: dimension, entity and its parameters)."""
    text = pointer(buf)  # type: ignore[call-arg,var-annotated]
    for i in range(len(ids)):
        pos = pass_space(text, pos, stop)
        if pos >= stop:
            return i, pos, TOO_SHORT
        ids[i], pos, ok = parse_int(text, pos, stop)
        if not ok:
            return i, pos, NOT_INT
        more = max(extra, 0)
        for k in range(3 + more):
            pos = pass_space(text, pos, stop)
            value, after, ok = parse_float(text, pos, stop)
            if not ok:
                return i, pos, NOT_FLOAT
            if not np.isfinite(value):
                return i, pos, NOT_FINITE
            if k < 3:
                points[i, k] = value
            pos = after
        if extra < 0:
            pos = pass_space(text, pos, stop)
            dimension, pos, ok = parse_int(text, pos, stop)
            if not ok:
                return i, pos, NOT_INT
            pos = pass_space(text, pos, stop)
            _entity, pos, ok = parse_int(text, pos, stop)
            if not ok:
                return i, pos, NOT_INT
            more = dimension if 1 <= dimension <= 2 else 0
            for _ in range(more):
                pos = pass_space(text, pos, stop)
                value, pos, ok = parse_float(text, pos, stop)
                if not ok:
                    return i, pos, NOT_FLOAT
    return len(ids), pos, DONE


@kernel
def _scan_elements(
    buf: Any, pos: int, stop: int, oldest: bool, counts: Ints, heads: Ints, nodes: Ints
) -> tuple[int, int, int, int]:
    """Element lines `id type n tags... nodes...`; `oldest`: `id type physical entity n nodes...`.

    heads: (n, 5) id, type, physical, entity, start in `nodes`.  Returns (done, offset, code, nodes used).
    """
    text = pointer(buf)  # type: ignore[call-arg,var-annotated]
    used = 0
    for i in range(len(heads)):
        pos = pass_space(text, pos, stop)
        if pos >= stop:
            return i, pos, TOO_SHORT, used
        heads[i, _PHYSICAL] = NO_GROUP
        heads[i, _ENTITY] = NO_ENTITY
        heads[i, _START] = used
        n_tags = 2 if oldest else 0
        n_nodes = 0
        k = 0
        while k < 3 + n_tags + n_nodes:
            pos = _same_line(text, pos, stop)
            if _at_line_end(text, pos, stop):
                return i, pos, LINE_ENDS, used
            value, after, ok = parse_int(text, pos, stop)
            if not ok:
                return i, pos, NOT_INT, used
            column = k
            if oldest and 2 <= k <= 4:
                column = 2 if k == 4 else k + 1  # the node count stands behind the tags here
            if column == 0:
                heads[i, _ID] = value
            elif column == 1:
                if value < 0 or value >= len(counts) or counts[value] < 0:
                    return i, pos, UNKNOWN_TYPE, used
                heads[i, _TYPE] = value
                n_nodes = counts[value]
            elif column == 2:
                if oldest and value != n_nodes:
                    return i, pos, BAD_COUNT, used
                if not oldest:
                    if value < 0 or value > stop - pos:
                        return i, pos, BAD_COUNT, used
                    n_tags = value
            elif column == 3 and n_tags > 0:
                heads[i, _PHYSICAL] = value
            elif column == 4 and n_tags > 1:
                heads[i, _ENTITY] = value
            elif column >= 3 + n_tags:
                nodes[used] = value
                used += 1
            pos = after
            k += 1
        if not _at_line_end(text, _same_line(text, pos, stop), stop):
            return i, _same_line(text, pos, stop), LINE_GOES_ON, used
    return len(heads), pos, DONE, used


@kernel
def _scan_binary_elements(words: Any, counts: Ints, heads: Ints, nodes: Ints) -> tuple[int, int, int, int]:
    """Runs of `type, n elements, n tags` and their records; as `_scan_elements`, offsets in words."""
    used = 0
    pos = 0
    i = 0
    while i < len(heads):
        if pos + 3 > len(words):
            return i, pos, TOO_SHORT, used
        number, follow, n_tags = words[pos], words[pos + 1], words[pos + 2]
        if number < 0 or number >= len(counts) or counts[number] < 0:
            return i, pos, UNKNOWN_TYPE, used
        if follow < 1 or follow > len(heads) - i or n_tags < 0 or n_tags > len(words):
            return i, pos, BAD_COUNT, used
        n_nodes = counts[number]
        pos += 3
        if pos + follow * (1 + n_tags + n_nodes) > len(words):
            return i, pos, TOO_SHORT, used
        for _ in range(follow):
            heads[i, _ID] = words[pos]
            heads[i, _TYPE] = number
            heads[i, _PHYSICAL] = words[pos + 1] if n_tags > 0 else NO_GROUP
            heads[i, _ENTITY] = words[pos + 2] if n_tags > 1 else NO_ENTITY
            heads[i, _START] = used
            pos += 1 + n_tags
            for k in range(n_nodes):
                nodes[used + k] = words[pos + k]
            used += n_nodes
            pos += n_nodes
            i += 1
    return i, pos, DONE, used


def _stopped(source: Source, at: int, code: int, *, binary: bool = False) -> ReadError:
    return source.error(at, _EXPECTED[code], binary=binary)


def scan_node_lines(source: Source, start: int, stop: int, count: int, extra: int) -> tuple[Ints, Floats, int]:
    """`count` node lines with `extra` numbers after z: ids, (count, 3) coordinates, next offset."""
    source.checked_count(count, 8, start, "nodes")
    ids, points = np.empty(count, np.int64), np.empty((count, 3))
    _done, at, code = _scan_nodes(source.data, start, stop, extra, ids, points)
    if code != DONE:
        raise _stopped(source, at, code)
    return ids, points, at


def read_nodes(source: Source, section: Section, kind: FileKind) -> NodePart:
    """The nodes of $NOD, $Nodes or $ParametricNodes."""
    parametric = section.name == "ParametricNodes"
    count, at = read_ints(source, section.start, section.stop, 1, "number of nodes")
    if not kind.binary:
        ids, points, end = scan_node_lines(source, at, section.stop, int(count[0]), -1 if parametric else 0)
        _text_rest(source, section, end)
        return NodePart(ids, points)
    if parametric:
        place = f"line {source.line(section.at)}"
        raise UnsupportedError(source.path, place, "nodes without parameters in a binary file", "$ParametricNodes")
    cursor = BinaryCursor(source, section, kind)
    cursor.at = _after_line(source, at)
    record = np.dtype([("id", f"{kind.order}i4"), ("x", f"{kind.order}f8", 3)])
    first = cursor.at
    records = cursor.take(record, int(count[0]), "nodes")
    points = records["x"].astype(np.float64)
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        bad = int(np.flatnonzero(~finite)[0])
        offset = first + bad * record.itemsize + 4
        raise source.error(offset, "finite coordinates", str(points[bad].tolist()), binary=True)
    cursor.finish()
    return NodePart(records["id"].astype(np.int64), points)


def _after_line(source: Source, at: int) -> int:
    newline = source.find(b"\n", at, at + 8)
    if newline < 0 or source.text(at, newline).strip():
        raise source.error(at, "the end of the line")
    return newline + 1


def _text_rest(source: Source, section: Section, at: int) -> None:
    cursor = TextCursor(source, section)
    cursor.at = at
    cursor.finish()


def read_elements(source: Source, section: Section, kind: FileKind) -> list[ElementPart]:
    """The elements of $ELM or $Elements by type, each with its physical group and entity."""
    values, at = read_ints(source, section.start, section.stop, 1, "number of elements")
    count = int(values[0])
    if kind.binary:
        start = _after_line(source, at)
        words = source.data[start : start + (section.stop - start) // 4 * 4].view(f"{kind.order}i4").astype(np.int32)
        source.checked_count(count, 8, start, "elements", binary=True)
        heads, nodes = np.empty((count, 5), np.int64), np.empty(len(words), np.int64)
        _done, pos, code, used = _scan_binary_elements(words, NODE_COUNTS, heads, nodes)
        end = start + 4 * pos
    else:
        source.checked_count(count, 6, at, "elements")
        heads, nodes = np.empty((count, 5), np.int64), np.empty((section.stop - at) // 2 + 1, np.int64)
        _done, end, code, used = _scan_elements(
            source.data, at, section.stop, kind.version < 2, NODE_COUNTS, heads, nodes
        )
    if code != DONE:
        raise _stopped(source, end, code, binary=kind.binary)
    _text_rest(source, section, end)
    present = np.flatnonzero(np.bincount(heads[:, _TYPE], minlength=1))
    return [_part(number, heads, nodes[:used]) for number in present.tolist()]


def _part(number: int, heads: Ints, nodes: Ints) -> ElementPart:
    element = ELEMENTS[number]
    positions = np.flatnonzero(heads[:, _TYPE] == number)
    n, first = len(positions), int(positions[0])
    one_run = int(positions[-1]) - first == n - 1
    mine = heads[first : first + n] if one_run else heads[positions]
    if one_run:
        start = int(mine[0, _START])
        own_nodes = nodes[start : start + n * element.n_nodes].reshape(n, element.n_nodes)
    else:
        own_nodes = nodes[mine[:, _START, None] + np.arange(element.n_nodes)]
    # The sign of a group's number only tells that Gmsh turned the element round when it wrote it.
    ids, physical, entity = mine[:, _ID], np.abs(mine[:, _PHYSICAL]), mine[:, _ENTITY].copy()
    rows = np.arange(n)
    # An element in several groups is written once for each of them, one copy right after the other.
    copies = np.flatnonzero((physical[1:] != physical[:-1]) & (entity[1:] == entity[:-1])) + 1
    copies = copies[(own_nodes[copies] == own_nodes[copies - 1]).all(axis=1)]
    if len(copies):
        kept = np.ones(n, dtype=bool)
        kept[copies] = False
        rows = np.cumsum(kept) - 1
        ids, own_nodes, positions = ids[kept], own_nodes[kept], positions[kept]
    physical_groups, entities = _members(physical, rows, NO_GROUP), _members(entity, rows, NO_ENTITY)
    return ElementPart(element, ids, own_nodes, positions, physical_groups, entities)


def _members(numbers: Ints, rows: Ints, none: int) -> tuple[tuple[int, Ints], ...]:
    if numbers.min() == numbers.max():
        return () if numbers[0] == none else ((int(numbers[0]), rows),)
    order = np.argsort(numbers, kind="stable")
    ordered = numbers[order]
    starts = np.flatnonzero(np.diff(ordered)) + 1
    groups = np.split(rows[order], starts)
    values = ordered[np.concatenate(([0], starts))].tolist()
    return tuple((value, group) for value, group in zip(values, groups, strict=True) if value != none)
