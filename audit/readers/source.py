"""`Source`: the bytes of one file, opened guardedly and unpacked, with the words for errors about them.

Every reader of this program reads through here. Opening never blocks and never trusts the path: only a
regular file is read, whatever a link pretends. Offsets count unpacked bytes after a byte order mark.
"""

from __future__ import annotations

import mmap
import os
import stat
import zlib
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meshwright.audit.errors import ReadError

__all__ = ["DEFAULT_LIMIT", "Source", "open_source"]

DEFAULT_LIMIT = 64 << 30
"""Most bytes a file may have once unpacked."""

_COPIED = 256 << 20
_CHUNK = 1 << 20
_PACKED_CHUNK = 1 << 16
# Meshes pack 3 to 30 times, deflate at most 1032 times. Beyond _FREE bytes more than _RATIO is a bomb.
_FREE = 32 << 20
_RATIO = 200
_GZIP = b"\x1f\x8b\x08"
_UTF8_MARK = b"\xef\xbb\xbf"
_UTF16 = {b"\xff\xfe": "<u2", b"\xfe\xff": ">u2"}
_NEWLINE, _RETURN = 10, 13


@dataclass(frozen=True, eq=False)
class Source:
    """One guarded, unpacked file.

    path: as the user named it.  data: (n,) all bytes, read-only, C-contiguous.
    skipped: bytes of a byte order mark that stand before `data` in the file.
    """

    path: str
    data: NDArray[np.uint8]
    skipped: int = 0

    def __post_init__(self) -> None:
        # Always read-only, so that every kernel is compiled for one kind of array.
        data = self.data.view()
        data.flags.writeable = False
        object.__setattr__(self, "data", data)

    def __len__(self) -> int:
        return len(self.data)

    def line(self, offset: int) -> int:
        """1-based number of the line that the byte at `offset` is on; LF, CR LF and lone CR end lines."""
        line = 1
        offset = min(offset, len(self))
        for start in range(0, offset, _CHUNK):
            stop = min(start + _CHUNK, offset)
            part = self.data[start:stop]
            line += int(np.count_nonzero(part == _NEWLINE))
            returns = np.flatnonzero(part == _RETURN) + (start + 1)
            if returns.size:
                after = self.data[np.minimum(returns, len(self) - 1)]  # behind the last byte: that byte, a CR
                line += int(np.count_nonzero(after != _NEWLINE))
        return line

    def text(self, start: int, stop: int) -> str:
        """The bytes from `start` to `stop`, one character a byte (latin-1), so that no byte is refused."""
        return self.data[start:stop].tobytes().decode("latin-1")

    def quote(self, offset: int, length: int = 40) -> str:
        """What stands at `offset` for a message: the rest of the line in quotes, at most `length` bytes."""
        if offset >= len(self):
            return "end of file"
        part = self.data[offset : offset + length].tobytes()
        if part[0] in b"\r\n":
            return "end of line"
        return f"'{part.splitlines()[0].decode('utf-8', 'backslashreplace')}'"

    def error(self, offset: int, expected: str, found: str | None = None, *, binary: bool = False) -> ReadError:
        """The error to raise about the byte at `offset`; `binary` names the byte instead of the line."""
        place = f"byte {offset + self.skipped}" if binary else f"line {self.line(offset)}"
        return ReadError(self.path, place, expected, self.quote(offset) if found is None else found)

    def find(self, pattern: bytes, start: int = 0, stop: int | None = None) -> int:
        """First offset of `pattern` that lies wholly within `start` to `stop`, or -1."""
        end = len(self) if stop is None else min(stop, len(self))
        size = 4096  # grows: a near match must not cost a big copy, a far one not many small ones
        while start + len(pattern) <= end:
            part = self.data[start : min(start + size + len(pattern) - 1, end)].tobytes()
            at = part.find(pattern)
            if at >= 0:
                return start + at
            start += size
            size = min(2 * size, _CHUNK)
        return -1

    def checked_count(self, count: int, least_bytes: int, offset: int, what: str, *, binary: bool = False) -> int:
        """`count`, once it is sure that so many records of `least_bytes` each can stand after `offset`.

        Call it before allocating anything by a count that a file states. Raises ReadError.
        """
        count = int(count)  # a numpy integer would wrap around in the product
        left = len(self) - offset
        if not 0 <= count * least_bytes <= left:
            expected = f"a count of {what} that fits in the {left} bytes left"
            raise self.error(offset, expected, str(count), binary=binary)
        return count


def open_source(path: str | os.PathLike[str], *, limit: int = DEFAULT_LIMIT) -> Source:
    """Open, unpack and hold a regular file of at most `limit` unpacked bytes.

    gzip is recognised by content. Raises ReadError for everything else that a path can name (folder, fifo,
    device, socket, loop of links, nothing), for an empty file and for a damaged or oversized one.
    """
    name = os.fsdecode(path)
    try:
        # Look before opening: opening some devices acts on them. Look again after, for the path may have
        # changed hands in between; O_NONBLOCK keeps a fifo put there meanwhile from blocking us.
        _require_regular_file(name, _status(name))
        handle = os.open(name, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with FileIO(handle) as file:
            status = os.fstat(handle)
            _require_regular_file(name, status)
            packed = file.read(len(_GZIP)) == _GZIP
            file.seek(0)
            data = _unpacked(name, file, limit) if packed else _plain(name, file, status.st_size, limit)
    except OSError as error:
        raise ReadError(name, "", "a readable file", (error.strerror or str(error)).lower()) from error
    opened = _without_mark(name, data)
    if not len(opened):
        raise ReadError(name, "", "a mesh", "an empty file")
    return opened


def _status(name: str) -> os.stat_result:
    try:
        return Path(name).stat()
    except ValueError as error:  # a NUL in the name, or a character that file names cannot spell
        raise ReadError(name, "", "the name of a file", str(error)) from error


def _require_regular_file(name: str, status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        kinds = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a fifo", stat.S_IFSOCK: "a socket"}
        raise ReadError(name, "", "a file", kinds.get(stat.S_IFMT(status.st_mode), "a device"))


def _plain(name: str, file: FileIO, size: int, limit: int) -> NDArray[np.uint8]:
    """All bytes of an unpacked file: a copy of a small one, a map of a large one.

    Reading a map of a file that someone cuts meanwhile kills the process (SIGBUS), a copy cannot be hurt.
    From `_COPIED` on a map is worth that: its pages are the system's to drop, so a mesh of many gigabytes
    is held once, and not at all when memory is short.
    """
    if size > limit:
        raise ReadError(name, "", f"a file of at most {limit} bytes", f"{size} bytes")
    cut = ReadError(name, "", f"{size} bytes", "an earlier end: the file was cut while being read")
    if size >= _COPIED:
        try:
            return np.frombuffer(mmap.mmap(file.fileno(), size, access=mmap.ACCESS_READ), np.uint8)
        except ValueError as error:
            raise cut from error
    data = np.empty(size, np.uint8)
    filled = 0
    while got := file.readinto(data.data[filled:]):
        filled += got
    if filled < size:
        raise cut
    return data


def _unpacked(name: str, file: FileIO, limit: int) -> NDArray[np.uint8]:
    """What a gzip file of any number of members unpacks to; trailing zeros are padding."""
    out = bytearray()  # grows in place where the allocator can, by an eighth at a time
    member = zlib.decompressobj(wbits=31)
    consumed = 0
    begun = False
    while packed := file.read(_PACKED_CHUNK):
        while packed:
            if not begun:
                rest = packed.lstrip(b"\0") if consumed else packed
                consumed += len(packed) - len(rest)
                if not rest:
                    break
                if rest[:1] != _GZIP[:1]:
                    found = f"'{rest[:8].decode('latin-1')}'"
                    raise ReadError(name, f"packed byte {consumed}", "end of file or more gzip data", found)
                member, packed, begun = zlib.decompressobj(wbits=31), rest, True
            try:
                out += member.decompress(packed, _CHUNK)
            except zlib.error as error:
                raise ReadError(name, f"packed byte {consumed}", "intact gzip data", str(error)) from error
            rest = member.unused_data if member.eof else member.unconsumed_tail
            consumed += len(packed) - len(rest)
            packed, begun = rest, not member.eof
            if len(out) > min(limit, _FREE + _RATIO * consumed):
                expected = f"gzip data that unpacks to at most {limit} bytes and {_RATIO} times its size"
                found = f"{len(out)} bytes from the first {consumed}"
                raise ReadError(name, f"packed byte {consumed}", expected, found)
    if begun:
        raise ReadError(name, f"packed byte {consumed}", "more gzip data", "end of file")
    return np.frombuffer(out, np.uint8)


def _without_mark(name: str, data: NDArray[np.uint8]) -> Source:
    """The source behind a UTF-8 byte order mark; UTF-16 text is refused in words that name the way out."""
    head = data[:64].tobytes()
    if head.startswith(_UTF8_MARK):
        return Source(name, data[len(_UTF8_MARK) :], len(_UTF8_MARK))
    if head[:2] in _UTF16:
        # A binary file may begin so by chance, but its first numbers hold zeros and control codes.
        units = np.frombuffer(head[2 : len(head) // 2 * 2], _UTF16[head[:2]])
        if np.all((units >= 32) | np.isin(units, (9, 10, 13))):
            raise ReadError(name, "", "text in ASCII or UTF-8", "text in UTF-16 (it begins with a byte order mark)")
    return Source(name, data)
