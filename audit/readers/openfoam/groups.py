"""Patches and zones of an OpenFOAM mesh: the files boundary, cellZones, faceZones and pointZones.

Both kinds are lists of named dictionaries, `n ( name { type wall; nFaces 20; startFace 760; } ... )`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from meshwright.audit.mesh import Zone, index_array
from meshwright.audit.readers.openfoam.file import FoamFile, Token
from meshwright.audit.readers.openfoam.lists import read_flags, read_labels, skip_value

__all__ = ["read_patches", "read_zones"]

_KNOWN_OF_PATCHES = frozenset(("type", "nFaces", "startFace"))
_LEAST_BYTES_OF_GROUP = 4
_NAME_IN_LIST = re.compile(r"(?!List<)[A-Za-z_][^\s();]*")


@dataclass(frozen=True)
class _Patch:
    name: Token
    type: str
    start: int
    size: int
    index: int


def read_patches(file: FoamFile, n_internal: int, n_faces: int) -> tuple[tuple[Zone, ...], frozenset[str]]:
    """The patches in file order, and the keywords whose values no zone keeps.

    Raises ReadError, naming the patch, unless patches tile the boundary faces [n_internal, n_faces) exactly,
    in whatever order they are listed; an empty patch may start anywhere.
    """
    patches: list[_Patch] = []
    dropped: set[str] = set()

    def read_patch(name: Token, pos: int) -> int:
        words: dict[str, str] = {}
        groups: set[str] = set()

        def read_entry(keyword: Token) -> int:
            what = f"{keyword.shown} of patch '{name.shown}'"
            if keyword.text == "type":
                words["type"], stop = file.value(keyword.stop, "word", what)
            elif keyword.text in _KNOWN_OF_PATCHES:
                place = file.skip(keyword.stop)
                words[keyword.text], stop = file.value(keyword.stop, "label", what)
                if not 0 <= int(words[keyword.text]) <= n_faces:
                    raise file.error(place, f"{what} from 0 to {n_faces}", words[keyword.text])
            else:
                stop = skip_value(file, keyword.stop)
                if keyword.text == "inGroups":
                    groups.update(_NAME_IN_LIST.findall(file.source.text(keyword.stop, stop)))
                else:
                    dropped.add(keyword.shown)
            return stop

        pos = file.entries(pos, f"patch '{name.shown}'", read_entry)
        for keyword in sorted(_KNOWN_OF_PATCHES - words.keys()):
            raise file.error(name.start, f"{keyword} of patch '{name.shown}'", "none")
        if groups - {words["type"]}:  # OpenFOAM puts every patch into a group of its type's name: nothing is lost
            dropped.add("inGroups")
        patches.append(_Patch(name, words["type"], int(words["startFace"]), int(words["nFaces"]), len(patches)))
        return pos

    _read_list(file, "patch", read_patch)
    _check_tiling(file, patches, n_internal, n_faces)
    return tuple(
        Zone(p.name.text, "patch", p.type, "face", np.arange(p.start, p.start + p.size), p.index) for p in patches
    ), frozenset(dropped)


def _check_tiling(file: FoamFile, patches: list[_Patch], n_internal: int, n_faces: int) -> None:
    at = n_internal
    for patch in sorted((p for p in patches if p.size), key=lambda p: p.start):
        if patch.start != at:
            fault = "gap before it" if patch.start > at else "overlap"
            expected = f"patch '{patch.name.shown}' to start at face {at}"
            raise file.error(patch.name.start, expected, f"startFace {patch.start} ({fault})")
        at += patch.size
        if at > n_faces:
            expected = f"patch '{patch.name.shown}' to end with the last of {n_faces} faces"
            raise file.error(patch.name.start, expected, f"startFace {patch.start} and nFaces {patch.size}")
    if at != n_faces:
        last = max(patches, key=lambda p: p.start, default=None)
        where = f"after patch '{last.name.shown}'" if last is not None else "in a file without patches"
        place = file.body if last is None else last.name.start
        raise file.error(
            place, f"every boundary face in a patch, {n_internal} to {n_faces - 1}", f"a gap at {at} {where}"
        )


def read_zones(file: FoamFile, entity: str, n: int) -> tuple[tuple[Zone, ...], bool, frozenset[str]]:
    """The zones of an entity ("cell", "face", "point") of which there are n.

    Returns the zones, whether any face in them is flipped, and the keywords whose values no zone keeps.
    """
    zones: list[Zone] = []
    flipped = False
    dropped: set[str] = set()
    wanted = f"{entity}Labels"

    def read_zone(name: Token, pos: int) -> int:
        members = None
        flips: int | None = None

        def read_entry(keyword: Token) -> int:
            nonlocal members, flips, flipped
            what = f"{entity} of zone '{name.shown}'"
            if keyword.text == wanted:
                members, stop = read_labels(file, keyword.stop, what, n, n)
                return file.take(stop, ";", f"after {wanted}")
            if keyword.text == "flipMap":
                values, stop = read_flags(file, keyword.stop, f"flip of a {what}", n)
                flips = len(values)
                flipped |= bool(values.any())
                return file.take(stop, ";", "after flipMap")
            if keyword.text == "type":
                word, stop = file.value(keyword.stop, "word", f"type of zone '{name.shown}'")
                if word != f"{entity}Zone":
                    raise file.error(keyword.start, f"type {entity}Zone of zone '{name.shown}'", word)
                return stop
            dropped.add(keyword.shown)
            return skip_value(file, keyword.stop)

        pos = file.entries(pos, f"zone '{name.shown}'", read_entry)
        if members is None:
            raise file.error(name.start, f"{wanted} of zone '{name.shown}'", "none")
        if flips is not None and flips != len(members):
            raise file.error(name.start, f"a flipMap for the {len(members)} faces of zone '{name.shown}'", str(flips))
        zones.append(Zone(name.text, f"{entity}Zone", "", entity, index_array(members), len(zones)))
        return pos

    _read_list(file, f"{entity} zone", read_zone)
    return tuple(zones), flipped, frozenset(dropped)


def _read_list(file: FoamFile, what: str, read: Callable[[Token, int], int]) -> None:
    """The whole body of a file of named dictionaries. read: (name, offset of its '{') -> offset after it."""
    token = file.token(file.body, f"the number of {what} entries")
    announced = None
    if token.kind == "label":
        announced = int(token.text)
        file.source.checked_count(announced, _LEAST_BYTES_OF_GROUP, token.start, f"{what} entries")
        if not announced and file.binary and file.skip(token.stop) == len(file.source):
            return
        token = file.token(token.stop, f"'(' before the {what} entries")
    if not token.is_mark("("):
        raise file.error(token.start, f"'(' before the {what} entries")
    start, pos = token.start, token.stop
    names: set[str] = set()
    wanted = f"the name of a {what} or ')'"
    while not (name := file.token(pos, wanted)).is_mark(")"):
        if name.kind not in ("word", "string", "label"):
            raise file.error(name.start, wanted)
        if name.text in names:
            raise file.error(name.start, f"each {what} once", f"'{name.shown}' again")
        names.add(name.text)
        pos = read(name, name.stop)
    if announced is not None and len(names) != announced:
        raise file.error(start, f"{announced} {what} entries, as the count says", str(len(names)))
    file.end(name.stop, f"the {what} entries")
