"""One OpenFOAM file: its FoamFile header, its tokens and its dictionaries.

Grammar (OpenFOAM user guide, "Basic input/output file format"; token reading of its ISstream): white space and
C++ comments separate tokens; a dictionary is `{ keyword value; keyword { ... } }`. Directives (#include, #calc)
and macros ($name) are refused: a mesh file needs none, and following them would read or run foreign files.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike

from meshwright.audit.errors import ReadError, printable
from meshwright.audit.readers.openfoam.kernels import skip_blank
from meshwright.audit.readers.source import Source, open_source

__all__ = ["FoamFile", "Token", "open_foam"]

_TOKEN = re.compile(
    rb"""(?P<string>"[^"\\\x00-\x08\x0a-\x1f\x7f]*(?:\\.[^"\\\x00-\x08\x0a-\x1f\x7f]*)*")
       | (?P<mark>[(){}\[\];])
       | (?P<label>[-+]?[0-9]{1,30})(?=[\s(){}\[\];/]|\Z)
       | (?P<word>[^\x00-\x20\x7f"'(){}\[\];/]+(?:\([^\x00-\x20\x7f"'(){}\[\];/]*\)[^\x00-\x20\x7f"'(){}\[\];/]*)*)""",
    re.VERBOSE,
)
_ARCH = re.compile(r"(?P<order>LSB|MSB);label=(?P<label>32|64);scalar=(?P<scalar>32|64)")
_HEADER_ENTRIES = ("format", "class", "arch", "note")
_LONGEST_WORD = 4096
_NO_DIRECTIVES = "directives and macros in mesh files are not followed"
_CLOSING = {"(": ")", "{": "}", "[": "]"}


@dataclass(frozen=True)
class Token:
    """kind: "word", "string", "label", "mark" or "end".  text: without quotes.  start, stop: offsets."""

    kind: str
    text: str
    start: int
    stop: int

    @property
    def shown(self) -> str:
        """The text for a message: hostile names neither flood it nor break its line."""
        return printable(self.text, 60)

    def is_mark(self, mark: str) -> bool:
        """Whether this is that bracket or semicolon, not a string that spells it."""
        return self.kind == "mark" and self.text == mark


@dataclass(frozen=True)
class FoamFile:
    """A file with its header read.

    header: format, class, arch and note, as far as the FoamFile dictionary has them.  body: offset of the
    first byte after it.  binary: whether lists of numbers are raw bytes, of `label_bytes` and `scalar_bytes`
    each (0: the header does not say).
    """

    source: Source
    header: dict[str, str]
    body: int
    binary: bool = False
    big_endian: bool = False
    label_bytes: int = 0
    scalar_bytes: int = 0

    def error(self, offset: int, expected: str, found: str | None = None) -> ReadError:
        """The error about what stands at `offset`: the line of a text file, the byte of a binary one."""
        if found is None and not self.binary and self.source.text(offset, offset + 1) in ("#", "$"):
            expected = f"{expected} ({_NO_DIRECTIVES})"
        return self.source.error(offset, expected, found, binary=self.binary)

    def skip(self, pos: int) -> int:
        """First offset from `pos` on that is neither white space nor in a comment."""
        return int(skip_blank(self.source.data, pos, len(self.source)))

    def token(self, pos: int, expected: str) -> Token:
        """The token at `pos`, kind "end" at the end of the file. ReadError for a directive or a macro."""
        pos = self.skip(pos)
        if pos >= len(self.source):
            return Token("end", "", pos, pos)
        match = _TOKEN.match(self.source.data.data, pos)
        if match is None or match.lastgroup is None:
            raise self.error(pos, expected)
        if match.end() - pos > _LONGEST_WORD:
            raise self.error(pos, f"{expected} of at most {_LONGEST_WORD} bytes")
        text = match[0].decode("utf-8", "backslashreplace")
        if match.lastgroup == "string":
            text = text[1:-1]
        elif text[0] in "#$":
            raise self.error(pos, expected if not self.binary else f"{expected} ({_NO_DIRECTIVES})")
        return Token(match.lastgroup, text, pos, match.end())

    def take(self, pos: int, mark: str, where: str) -> int:
        """Offset after the bracket or semicolon that must stand at `pos`."""
        token = self.token(pos, f"'{mark}' {where}")
        if not token.is_mark(mark):
            raise self.error(token.start, f"'{mark}' {where}")
        return token.stop

    def end(self, pos: int, what: str) -> None:
        """Refuse anything but white space and comments after `what`, so that no doubled file passes."""
        pos = self.skip(pos)
        if pos < len(self.source):
            raise self.error(pos, f"nothing more after {what}")

    def value(self, pos: int, kind: str, what: str) -> tuple[str, int]:
        """The one word or string (kind "word") or label of an entry, and the offset after its semicolon."""
        token = self.token(pos, what)
        if token.kind != kind and not (kind == "word" and token.kind in ("string", "label")):
            raise self.error(token.start, what)
        return token.text, self.take(token.stop, ";", f"after {what}")

    def skip_value(self, pos: int, skip_list: Callable[[Token], int] | None = None) -> int:
        """Offset after any value: a dictionary, or all up to a semicolon.

        skip_list: what jumps over the list that a word such as List<label> announces, where that is raw bytes.
        """
        what = "the rest of an entry and its ';'"
        awaited: list[str] = []
        while True:
            token = self.token(pos, what)
            pos = token.stop
            if token.kind == "end":
                raise self.error(token.start, what)
            if skip_list is not None and token.kind == "word" and token.text.startswith("List<"):
                pos = skip_list(token)
            elif token.kind == "mark" and token.text in _CLOSING:
                awaited.append(_CLOSING[token.text])
            elif token.is_mark(";"):
                if not awaited:
                    return pos
            elif token.kind == "mark":
                if not awaited or awaited.pop() != token.text:
                    raise self.error(token.start, "brackets that match")
                if not awaited and token.text == "}":
                    return pos

    def entries(self, pos: int, what: str, read: Callable[[Token], int]) -> int:
        """Read the dictionary that opens at `pos`; offset after its closing bracket.

        read: called with each keyword, returns the offset after the value. A keyword may occur once.
        """
        pos = self.take(pos, "{", f"of {what}")
        seen: set[str] = set()
        wanted = f"an entry of {what} or its '}}'"
        while not (token := self.token(pos, wanted)).is_mark("}"):
            if token.is_mark(";"):  # OpenFOAM reads over a semicolon too many
                pos = token.stop
                continue
            if token.kind not in ("word", "string"):
                raise self.error(token.start, wanted)
            if token.text in seen:
                raise self.error(token.start, f"each entry of {what} once", f"'{token.shown}' again")
            seen.add(token.text)
            pos = read(token)
        return token.stop


def open_foam(path: str | PathLike[str], classes: tuple[str, ...]) -> FoamFile:
    """Open a file and read its header. ReadError unless its class is one of `classes` (any, when empty)."""
    source = open_source(path)
    bare = FoamFile(source, {}, 0)
    start = bare.token(0, "the FoamFile header")
    if start.text != "FoamFile":
        raise bare.error(start.start, "the FoamFile header")
    header: dict[str, str] = {}
    places: dict[str, int] = {}

    def read(keyword: Token) -> int:
        if keyword.text not in _HEADER_ENTRIES:
            return bare.skip_value(keyword.stop)
        places[keyword.text] = bare.skip(keyword.stop)
        header[keyword.text], stop = bare.value(keyword.stop, "word", f"the value of {keyword.shown}")
        return stop

    body = bare.entries(start.stop, "the FoamFile header", read)
    for keyword in ("format", "class"):
        if keyword not in header:
            raise bare.error(start.start, f"a FoamFile header that names the {keyword}", "none")
    if classes and header["class"] not in classes:
        raise bare.error(places["class"], f"class {' or '.join(classes)}", header["class"])
    if header["format"] not in ("ascii", "binary"):
        raise bare.error(places["format"], "format ascii or binary", header["format"])
    arch = _ARCH.fullmatch(header.get("arch", ""))
    if "arch" in header and arch is None:
        raise bare.error(places["arch"], 'arch such as "LSB;label=32;scalar=64"', header["arch"])
    if arch is None:
        return FoamFile(source, header, body, header["format"] == "binary")
    widths = int(arch["label"]) // 8, int(arch["scalar"]) // 8
    return FoamFile(source, header, body, header["format"] == "binary", arch["order"] == "MSB", *widths)
