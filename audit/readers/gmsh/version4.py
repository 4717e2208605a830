"""Gmsh MSH 4.0 (text) and 4.1 (text and binary): entities, nodes and elements in blocks, one per entity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshwright.audit.errors import UnsupportedError
from meshwright.audit.readers.gmsh.elements import ELEMENTS
from meshwright.audit.readers.gmsh.parts import ElementPart, NodePart
from meshwright.audit.readers.gmsh.sections import BinaryCursor, Cursor, FileKind, Section, TextCursor
from meshwright.audit.readers.gmsh.version2 import scan_node_lines
from meshwright.audit.readers.source import Source

__all__ = ["read_elements", "read_entities", "read_nodes"]

EntityGroups = dict[tuple[int, int], tuple[int, ...]]

_LEAST_NODE = 8
"""Bytes of the shortest node in text: `1 0 0 0` and a newline."""


def _cursor(source: Source, section: Section, kind: FileKind) -> Cursor:
    if not kind.binary:
        return TextCursor(source, section)
    if kind.version < 4.1:
        place = f"line {source.line(section.at)}"
        raise UnsupportedError(
            source.path, place, "text, or binary of version 4.1 (save it again)", "binary of version 4.0"
        )
    return BinaryCursor(source, section, kind)


def _one(values: np.ndarray) -> int:
    return int(values[0])


def read_entities(source: Source, section: Section, kind: FileKind) -> EntityGroups:
    """Physical groups of each elementary entity (dimension, number), from $Entities or $PartitionedEntities."""
    cursor = _cursor(source, section, kind)
    partitioned = section.name == "PartitionedEntities"
    if partitioned:
        cursor.sizes(1, "number of partitions")
        ghosts = _one(cursor.sizes(1, "number of ghost entities"))
        cursor.ints(2 * ghosts, "ghost entities")
    counts = cursor.sizes(4, "numbers of points, curves, surfaces and volumes")
    groups: EntityGroups = {}
    for dimension, count in enumerate(counts.tolist()):
        source.checked_count(count, 8, cursor.at, "entities")
        for _ in range(count):
            tag = _one(cursor.ints(1, "entity number"))
            if partitioned:
                cursor.ints(2, "parent of a partitioned entity")
                cursor.ints(_one(cursor.sizes(1, "number of partitions")), "partitions of an entity")
            # Gmsh gives an entity without geometry an empty box, whose bounds may be infinite.
            bounds = 3 if dimension == 0 and kind.version >= 4.1 else 6
            cursor.doubles(bounds, "bounds of an entity", finite=False)
            physical = cursor.ints(_one(cursor.sizes(1, "number of physical groups")), "physical groups")
            if dimension:
                cursor.ints(_one(cursor.sizes(1, "number of bounding entities")), "bounding entities")
            if (dimension, tag) in groups:
                raise cursor.error("each entity once", f"a second entity {tag} of dimension {dimension}")
            # The sign of a group's number only tells that Gmsh turns the entity's normal round.
            groups[dimension, tag] = tuple(dict.fromkeys(abs(value) for value in physical.tolist()))
    cursor.finish()
    return groups


@dataclass
class _Range:
    """Bounds a version 4.1 file states for the numbers of its nodes or elements."""

    low: int
    high: int

    def check(self, cursor: Cursor, ids: np.ndarray, what: str) -> None:
        if len(ids) and (int(ids.min()) < self.low or int(ids.max()) > self.high):
            found = int(ids.min()) if int(ids.min()) < self.low else int(ids.max())
            raise cursor.error(f"{what} numbers from {self.low} to {self.high}, as the section announces", str(found))


def _heading(cursor: Cursor, kind: FileKind, what: str) -> tuple[int, int, _Range]:
    blocks, total = cursor.sizes(2, f"numbers of blocks and of {what}s").tolist()
    low, high = cursor.sizes(2, f"lowest and highest {what} number").tolist() if kind.version >= 4.1 else (0, 2**62)
    return blocks, total, _Range(low, high)


def _entity(cursor: Cursor, kind: FileKind, what: str) -> tuple[int, int, int, int]:
    first, second, third = cursor.ints(3, f"entity of a block of {what}s").tolist()
    count = _one(cursor.sizes(1, f"number of {what}s in a block"))
    dimension, tag = (first, second) if kind.version >= 4.1 else (second, first)
    if not 0 <= dimension <= 3:
        raise cursor.error("an entity of dimension 0 to 3", str(dimension))
    return dimension, tag, third, count


def read_nodes(source: Source, section: Section, kind: FileKind) -> NodePart:
    """Numbers and coordinates of all nodes of $Nodes."""
    cursor = _cursor(source, section, kind)
    blocks, total, limits = _heading(cursor, kind, "node")
    source.checked_count(total, _LEAST_NODE, cursor.at, "nodes")
    all_ids, all_points, done = [np.empty(0, np.int64)], [np.empty((0, 3))], 0
    source.checked_count(blocks, 8, cursor.at, "blocks of nodes")
    for _ in range(blocks):
        dimension, _tag, parametric, count = _entity(cursor, kind, "node")
        if parametric not in (0, 1):
            raise cursor.error("0 or 1 (whether nodes have parameters)", str(parametric))
        done += count
        if count < 0 or done > total:
            raise cursor.error(f"{total} nodes in all", f"a block of {count} nodes, {done} so far")
        # Volumes have parameters from version 4.1 on.
        extra = dimension if parametric and (dimension < 3 or kind.version >= 4.1) else 0
        if kind.version >= 4.1:
            ids = cursor.sizes(count, "node numbers")
            points = cursor.doubles(count * (3 + extra), "coordinates").reshape(count, 3 + extra)[:, :3]
        else:
            ids, points, cursor.at = scan_node_lines(source, cursor.at, section.stop, count, extra)
        limits.check(cursor, ids, "node")
        all_ids.append(ids)
        all_points.append(points)
    cursor.finish()
    if done != total:
        raise cursor.error(f"{total} nodes", f"{done} nodes in {blocks} blocks")
    return NodePart(np.concatenate(all_ids), np.concatenate(all_points))


def read_elements(source: Source, section: Section, kind: FileKind, groups: EntityGroups) -> list[ElementPart]:
    """The blocks of $Elements, each with the physical groups of its entity."""
    cursor = _cursor(source, section, kind)
    blocks, total, limits = _heading(cursor, kind, "element")
    source.checked_count(total, 4, cursor.at, "elements")
    source.checked_count(blocks, 8, cursor.at, "blocks of elements")
    parts, done = [], 0
    for _ in range(blocks):
        dimension, tag, number, count = _entity(cursor, kind, "element")
        element = ELEMENTS.get(number)
        if element is None:
            raise cursor.error("an element type that has nodes of its own", f"element type {number}")
        if element.dimension != dimension:
            raise cursor.error(f"elements of dimension {dimension}", f"element type {number} ({element.type})")
        if count < 0 or done + count > total:
            raise cursor.error(f"{total} elements in all", f"a block of {count} elements, {done} before it")
        rows = cursor.sizes(count * (element.n_nodes + 1), f"numbers of {element.type} elements and their nodes")
        rows = rows.reshape(count, element.n_nodes + 1)
        limits.check(cursor, rows[:, 0], "element")
        whole = slice(None)
        physical = tuple((group, whole) for group in groups.get((dimension, tag), ()))
        positions = np.arange(done, done + count, dtype=np.int64)
        parts.append(ElementPart(element, rows[:, 0], rows[:, 1:], positions, physical, ((tag, whole),)))
        done += count
    cursor.finish()
    if done != total:
        raise cursor.error(f"{total} elements", f"{done} elements in {blocks} blocks")
    return parts
