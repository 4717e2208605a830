"""The sections of a Fluent mesh or case file: where each starts, what its numbers are, where it ends.

A file is a row of sections `(number (header) (body))`. Header and index numbers are hexadecimal. A number of
2000 + s or 3000 + s is section s with a binary body (reals of 4 or 8 bytes, integers always of 4), closed by the
words "End of Binary Section". Source: Ansys Fluent User's Guide, appendix "Mesh File Format".
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.jit import kernel
from meshwright.audit.mesh import Ints
from meshwright.audit.readers.fluent.records import Integers
from meshwright.audit.readers.scan import read_all_ints, read_floats, read_ints, skip_space
from meshwright.audit.readers.source import Source

__all__ = ["Section", "SectionScanner"]

_END_MARK = b"End of Binary Section"
_LONGEST_HEADER = 400
_HEXADECIMAL = re.compile(r"[0-9a-fA-F]{1,16}")
_OPEN, _CLOSE, _BLANK = ord("("), ord(")"), ord(" ")
_WORD = re.compile(r"[^ \t\r\n\f\v]+")
_NAME = re.compile(r'[^ \t\r\n\f\v()"]+')


@dataclass(frozen=True)
class Section:
    """One section: `number` without the 2000 or 3000, `width` of its reals in bytes (0 for text), `start` offset of
    its parenthesis, `mark` the number as written."""

    number: int
    width: int
    start: int
    mark: int

    def __str__(self) -> str:
        return f"section {self.mark}"


class SectionScanner:
    """Walks a file section by section. `at` is the offset of the next byte to be looked at."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.at = 0
        self._size = len(source)
        self.byte_order = "<"

    def next_section(self) -> Section | None:
        """The section that starts here, `at` placed behind its number; None at the end of the file."""
        start = self._skip_space()
        if start == self._size:
            return None
        if self.source.data[start] != _OPEN:
            raise self.source.error(start, "a section, which starts with a parenthesis")
        self.at = start + 1
        begin = self._skip_space()
        word = self._word(begin, 8)
        if not (word.isascii() and word.isdigit() and len(word) < 8):
            raise self.source.error(begin, "the number of a section")
        self.at = begin + len(word)
        mark = int(word)
        binary = 2000 <= mark < 4000
        return Section(mark % 1000 if binary else mark, (4 if mark < 3000 else 8) if binary else 0, start, mark)

    def header(self, section: Section, least: int, most: int) -> tuple[int, ...]:
        """The hexadecimal numbers of the first group, `at` placed behind it. ReadError unless least to most of them."""
        return tuple(self._hexadecimal(word, offset) for word, offset in self._header_words(section, least, most))

    def header_words(self, section: Section, count: int) -> list[str]:
        """As `header`, for exactly `count` words whose base is uncertain."""
        return [word for word, _ in self._header_words(section, count, count)]

    def rest(self, section: Section) -> str:
        """What stands between here and the end of a short section without groups."""
        start = self.at
        end = self.source.find(b")", start, start + _LONGEST_HEADER)
        if end < 0:
            raise self.source.error(start, f"the parenthesis that closes {section}")
        self.at = end + 1
        return self.source.text(start, end)

    def has_body(self) -> bool:
        """Whether another group follows."""
        at = self._skip_space()
        return at < self._size and self.source.data[at] == _OPEN

    def integers(self, section: Section, count: int, what: str) -> Integers:
        """Exactly `count` integers, and the end of the section."""
        start = self._open_body(section, what)
        self.source.checked_count(count, 4 if section.width else 2, start, what)
        values: Ints
        if section.width:
            values = self._binary_integers(start, count)
        else:
            stop = self._text_end(section, start)
            values, self.at = read_ints(self.source, start, stop, count, what, base=16)
        self._close_body(section, what)
        return Integers(values, start, section.width > 0)

    def all_integers(self, section: Section, what: str) -> Integers:
        """All integers of the body, however many, and the end of the section."""
        start = self._open_body(section, what)
        values: Ints
        if not section.width:
            stop = self._text_end(section, start)
            values = read_all_ints(self.source, start, stop, what, base=16)
            self.at = stop
        else:
            stop = self.source.find(_END_MARK, start)
            if stop < 0:
                raise self.source.error(self._size, f"the end of {section}")
            while stop > start and self.source.data[stop - 1] != _CLOSE:
                stop -= 1
            # Up to three bytes of white space may stand before the closing parenthesis.
            values = self._binary_integers(start, max(stop - 1 - start, 0) // 4)
        self._close_body(section, what)
        return Integers(values, start, section.width > 0)

    def reals(self, section: Section, count: int, what: str) -> NDArray[np.float64]:
        """Exactly `count` finite reals, and the end of the section."""
        start = self._open_body(section, what)
        self.source.checked_count(count, section.width or 2, start, what)
        if section.width:
            kind = f"{self.byte_order}f{section.width}"
            values = np.frombuffer(self.source.data, kind, count, start).astype(np.float64)
            self.at = start + section.width * count
            finite = np.isfinite(values)
            if not finite.all():
                bad = int(np.argmin(finite))
                place = start + section.width * bad
                raise self.source.error(place, f"a finite number ({what})", str(values[bad]), binary=True)
        else:
            stop = self._text_end(section, start)
            values, self.at = read_floats(self.source, start, stop, count, what)
        self._close_body(section, what)
        return values

    def words(self, section: Section) -> list[str]:
        """The words of the first group, as text; the rest of the section is stepped over."""
        begin = self._skip_space()
        if begin >= self._size or self.source.data[begin] != _OPEN:
            raise self.source.error(begin, f"the header of {section}")
        end = self._group_end(section, begin)
        self.skip(section)
        raw = self.source.data[begin + 1 : end - 1].tobytes()
        try:
            text = raw.decode("utf-8")
        except UnicodeDecodeError:
            text = raw.decode("latin-1")
        return [word.strip('"') for word in text.split()]

    def skip(self, section: Section) -> None:
        """Step over the whole section."""
        if section.width:
            self._skip_binary(section)
        else:
            self.at = self._group_end(section, section.start)

    def close(self, section: Section) -> None:
        """Step over the end of the section, which must be here."""
        at = self._skip_space()
        if section.width:
            if self.source.find(_END_MARK, at, at + len(_END_MARK)) != at:
                raise self.source.error(at, f"the words “End of Binary Section” that close {section}", binary=True)
            self.at = at + len(_END_MARK)
            at = self._skip_space()
            word = self._word(at, 8)
            if word != str(section.mark):
                raise self.source.error(at, f"the number {section.mark} that closes the section")
            self.at = at + len(word)
            at = self._skip_space()
        if at >= self._size or self.source.data[at] != _CLOSE:
            raise self.source.error(at, f"the parenthesis that closes {section}")
        self.at = at + 1

    def _binary_integers(self, start: int, count: int) -> Ints:
        """`count` integers of 4 bytes as a native array, `at` placed behind them."""
        self.at = start + 4 * count
        return np.frombuffer(self.source.data, self.byte_order + "i4", count, start).astype(np.int32)

    def _skip_binary(self, section: Section) -> None:
        self.at = section.start
        while True:
            mark = self.source.find(_END_MARK, self.at)
            if mark < 0:
                raise self.source.error(self._size, f"the words “End of Binary Section” that close {section}")
            self.at = mark + len(_END_MARK)
            if self._word(self._skip_space(), 8) == str(section.mark):
                self.at = mark
                self.close(section)
                return

    def _group_end(self, section: Section, start: int) -> int:
        end = int(_skip_group(self.source.data, start, self._size))
        if end < 0:
            raise self.source.error(self._size, f"the parenthesis that closes {section}")
        return end

    def _header_words(self, section: Section, least: int, most: int) -> list[tuple[str, int]]:
        begin = self._skip_space()
        if begin >= self._size or self.source.data[begin] != _OPEN:
            raise self.source.error(begin, f"the header of {section}")
        end = self.source.find(b")", begin, min(begin + _LONGEST_HEADER, self._size))
        if end < 0:
            raise self.source.error(begin, f"the header of {section}, a short group of numbers")
        text = self.source.text(begin + 1, end)
        words = [(match.group(), begin + 1 + match.start()) for match in _WORD.finditer(text)]
        if not least <= len(words) <= most:
            raise self.source.error(begin, f"{least} to {most} numbers in the header of {section}")
        self.at = end + 1
        return words

    def _hexadecimal(self, word: str, offset: int) -> int:
        if not _HEXADECIMAL.fullmatch(word):
            raise self.source.error(offset, "a hexadecimal number", word)
        return int(word, 16)

    def _open_body(self, section: Section, what: str) -> int:
        if not self.has_body():
            raise self.source.error(self.at, f"the {what} of {section}")
        return self.at + 1

    def _text_end(self, section: Section, start: int) -> int:
        stop = self.source.find(b")", start)
        if stop < 0:
            raise self.source.error(self._size, f"the parenthesis that closes {section}")
        return stop

    def _close_body(self, section: Section, what: str) -> None:
        at = self._skip_space()
        if at >= self._size or self.source.data[at] != _CLOSE:
            raise self.source.error(at, f"the end of the {what} of {section}", binary=section.width > 0)
        self.at = at + 1
        self.close(section)

    def _skip_space(self) -> int:
        if self.at < self._size and self.source.data[self.at] <= _BLANK:
            self.at = int(skip_space(self.source.data, self.at, self._size))
        return self.at

    def _word(self, start: int, longest: int) -> str:
        """The characters from `start` up to white space, a parenthesis or a quotation mark, at most `longest`."""
        text = self.source.text(start, min(start + longest, self._size))
        match = _NAME.match(text)
        return match.group() if match else ""


@kernel
def _skip_group(data: NDArray[np.uint8], start: int, stop: int) -> int:
    """Offset behind the group that opens at `start`; -1 when it never closes. Strings are opaque."""
    depth = 0
    at = start
    while at < stop:
        c = data[at]
        if c == 34:  # a string, in which \" is no end
            at += 1
            while at < stop and data[at] != 34:
                at += 2 if data[at] == 92 else 1
        elif c == 35 and at + 1 < stop and data[at + 1] == 92:  # #\( is a character of Scheme
            at += 2
        elif c == 40:
            depth += 1
        elif c == 41:
            depth -= 1
            if depth == 0:
                return at + 1
        at += 1
    return -1
