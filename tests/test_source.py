"""The guarded byte source: what it refuses, what it unpacks, and whether its words point at the right place."""

import gzip
import os
import re
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshwright.audit.errors import ReadError
from meshwright.audit.readers import source
from meshwright.audit.readers.source import Source, open_source

TEXT = b"".join(b"%d %.17g\n" % (i, i / 7) for i in range(400))


def of(data: bytes) -> Source:
    return Source("mesh.msh", np.frombuffer(data, np.uint8))


def refusal(path: Path | str, **options: int) -> str:
    with pytest.raises(ReadError) as caught:
        open_source(path, **options)
    return str(caught.value).removeprefix(f"{path}: ")


# --- what a path can name ------------------------------------------------------------------------------------


@pytest.fixture
def zoo(tmp_path: Path) -> Iterator[Path]:
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "zero").symlink_to("/dev/zero")
    (tmp_path / "link-to-fifo").symlink_to("fifo")
    (tmp_path / "loop").symlink_to("pool")
    (tmp_path / "pool").symlink_to("loop")
    (tmp_path / "dangling").symlink_to("nowhere")
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "file").write_bytes(TEXT)
    with socket.socket(socket.AF_UNIX) as server:
        here = Path.cwd()
        os.chdir(tmp_path)  # the names of sockets must be short
        server.bind("socket")
        os.chdir(here)
        yield tmp_path


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("fifo", "expected a file, found a fifo"),
        ("link-to-fifo", "expected a file, found a fifo"),
        ("zero", "expected a file, found a device"),
        ("socket", "expected a file, found a socket"),
        ("folder", "expected a file, found a folder"),
        ("loop", "expected a readable file, found too many levels of symbolic links"),
        ("dangling", "expected a readable file, found no such file or directory"),
        ("missing", "expected a readable file, found no such file or directory"),
        ("file/below", "expected a readable file, found not a directory"),
        ("x" * 300, "expected a readable file, found file name too long"),
        ("nul\0byte", "expected the name of a file, found embedded null byte"),
        ("empty", "expected a mesh, found an empty file"),
    ],
)
def test_what_is_not_a_file_with_bytes_is_refused_at_once(zoo: Path, name: str, message: str):
    with pytest.raises(ReadError) as caught:
        open_source(str(zoo / name))
    error = caught.value
    assert f"expected {error.expected}, found {error.found}" == message
    assert (error.path, error.place) == (str(zoo / name), "")


def test_a_fifo_put_there_after_the_first_look_does_not_block(zoo: Path, monkeypatch: pytest.MonkeyPatch):
    decoy = (zoo / "file").stat()
    monkeypatch.setattr(source, "_status", lambda name: decoy)
    done: list[str] = []
    thread = threading.Thread(target=lambda: done.append(refusal(zoo / "fifo")), daemon=True)
    thread.start()
    thread.join(5)
    assert done == ["expected a file, found a fifo"]


def test_a_file_that_may_not_be_read_is_refused(zoo: Path):
    secret = zoo / "secret"
    secret.write_bytes(TEXT)
    secret.chmod(0)
    user = os.geteuid()
    if user == 0:  # the superuser may read everything, so step down for a moment
        os.seteuid(65534)
    try:
        message = refusal(secret)
    finally:
        os.seteuid(user)
    assert message == "expected a readable file, found permission denied"


def test_links_bytes_and_path_objects_all_name_the_file(zoo: Path):
    (zoo / "link").symlink_to("file")
    for name in (zoo / "link", str(zoo / "link"), os.fsencode(zoo / "link")):
        opened = open_source(name)
        assert opened.data.tobytes() == TEXT
        assert opened.path == str(zoo / "link")


def test_no_file_stays_open(zoo: Path):
    before = len(list(Path("/proc/self/fd").iterdir())) if Path("/proc/self/fd").exists() else 0
    for name in ("fifo", "zero", "folder", "empty", "missing"):
        refusal(zoo / name)
    held = [open_source(zoo / "file") for _ in range(5)]
    after = len(list(Path("/proc/self/fd").iterdir())) if Path("/proc/self/fd").exists() else 0
    assert (after, len(held)) == (before, 5)


# --- plain files ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mapped", [False, True])
def test_the_bytes_are_the_files_and_cannot_be_written(zoo: Path, monkeypatch: pytest.MonkeyPatch, mapped: bool):
    if mapped:
        monkeypatch.setattr(source, "_COPIED", 1)
    opened = open_source(zoo / "file")
    assert opened.data.tobytes() == TEXT
    assert len(opened) == len(TEXT)
    assert opened.data.flags.c_contiguous
    assert opened.data.dtype == np.uint8
    with pytest.raises(ValueError, match="read-only"):
        opened.data[0] = 0


def test_a_small_file_that_is_cut_later_keeps_its_bytes(zoo: Path):
    opened = open_source(zoo / "file")
    os.truncate(zoo / "file", 10)
    assert opened.data.tobytes() == TEXT


@pytest.mark.parametrize("copied", [1 << 30, 1])
def test_a_file_that_is_cut_while_being_read_is_refused(zoo: Path, monkeypatch: pytest.MonkeyPatch, copied: int):
    monkeypatch.setattr(source, "_COPIED", copied)
    expected = f"expected {len(TEXT) + 1} bytes, found an earlier end: the file was cut while being read"
    with FileIO(zoo / "file") as file, pytest.raises(ReadError, match=expected):
        source._plain("x", file, len(TEXT) + 1, 1 << 40)


def test_a_file_over_the_limit_is_refused_unread(tmp_path: Path):
    path = tmp_path / "big"
    path.touch()
    os.truncate(path, 10 << 30)  # a hole: takes no room
    assert refusal(path, limit=1 << 30) == "expected a file of at most 1073741824 bytes, found 10737418240 bytes"
    path.write_bytes(TEXT)
    assert len(open_source(path, limit=len(TEXT))) == len(TEXT)
    assert f"found {len(TEXT)} bytes" in refusal(path, limit=len(TEXT) - 1)


# --- byte order marks ----------------------------------------------------------------------------------------


def test_a_utf8_mark_is_skipped_and_offsets_still_point_into_the_file(tmp_path: Path):
    path = tmp_path / "mesh"
    for content in (b"\xef\xbb\xbfab\ncd", gzip.compress(b"\xef\xbb\xbfab\ncd")):
        path.write_bytes(content)
        opened = open_source(path)
        assert opened.data.tobytes() == b"ab\ncd"
        assert opened.error(3, "x").place == "line 2"
        assert opened.error(3, "x", binary=True).place == "byte 6"
    path.write_bytes(b"\xef\xbb\xbf")
    assert refusal(path) == "expected a mesh, found an empty file"


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("text", ["$MeshFormat\r\n2.2 0 8\r\n", "é", "網格 1\n", "x" * 100])
def test_utf16_text_is_refused_by_name(tmp_path: Path, encoding: str, text: str):
    path = tmp_path / "mesh"
    path.write_bytes(("\ufeff" + text).encode(encoding))
    wanted = "expected text in ASCII or UTF-8, found text in UTF-16 (it begins with a byte order mark)"
    assert refusal(path) == wanted


def test_binary_counts_that_look_like_a_utf16_mark_are_left_to_the_readers(tmp_path: Path):
    path = tmp_path / "mesh.lb8.ugrid"
    for n_points in (0xFEFF, 0x1FEFF, 0x1FFEFF):
        content = np.array([n_points, 10, 20, 300, 0, 0, 7], "<i4").tobytes() + bytes(100)
        path.write_bytes(content)
        assert open_source(path).data.tobytes() == content


# --- places and quotes ---------------------------------------------------------------------------------------


@given(st.lists(st.sampled_from([b"a", b"\n", b"\r", b"\r\n"])).map(b"".join), st.integers(1, 6))
@settings(max_examples=300, deadline=None)
def test_lines_are_counted_by_lf_crlf_and_lone_cr(data: bytes, chunk: int):
    ends = [found.end() for found in re.finditer(rb"\r\n|\r|\n", data)]
    with changed(source, "_CHUNK", chunk):
        for offset in range(len(data) + 2):
            assert of(data).line(offset) == 1 + sum(end <= offset for end in ends), offset


@contextmanager
def changed(module: object, name: str, value: object) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, name, value)
        yield


@given(st.integers(4080, 4110), st.binary(max_size=12), st.binary(min_size=1, max_size=4), st.integers(0, 4120))
@settings(max_examples=300, deadline=None)
def test_find_agrees_with_bytes_find_across_the_pieces_it_reads(at: int, noise: bytes, pattern: bytes, start: int):
    data = bytes(at) + noise + pattern + noise * 400 + pattern
    for stop in (None, 0, at, at + len(noise) + len(pattern), at + len(noise) + len(pattern) - 1, len(data)):
        assert of(data).find(pattern, start, stop) == data.find(pattern, start, stop)


def test_find_sees_a_pattern_that_lies_across_two_pieces():
    for at in (*range(4085, 4105), *range(4096 + 8192 - 10, 4096 + 8192 + 10)):
        data = bytes(at) + b"(45 " + bytes(20_000)
        assert [of(data).find(b"(45 ", start) for start in (0, 1, 2, 3)] == [at] * 4


def test_find_reaches_the_far_end_of_a_long_file():
    data = bytes(5_000_000) + b"(45 " + bytes(9)
    assert of(data).find(b"(45 ") == 5_000_000
    assert of(data).find(b"(45 ", 5_000_001) == -1
    assert of(data).find(b"(45 ", 0, 5_000_003) == -1
    assert of(data).find(b"(45 ", 0, 5_000_004) == 5_000_000


@pytest.mark.parametrize(
    ("data", "offset", "quote"),
    [
        (b"abc def\nghi", 4, "'def'"),
        (b"abc\rghi", 0, "'abc'"),
        (b"abc", 3, "end of file"),
        (b"abc", 99, "end of file"),
        (b"abc\r\n", 3, "end of line"),
        (b"x" * 100, 0, "'" + "x" * 40 + "'"),
        ("größe".encode(), 0, "'größe'"),
        (b"a\xffb", 0, "'a\\xffb'"),
    ],
)
def test_a_quote_shows_the_rest_of_the_line(data: bytes, offset: int, quote: str):
    assert of(data).quote(offset) == quote


@given(st.binary(max_size=100), st.integers(0, 110))
@settings(max_examples=200, deadline=None)
def test_messages_are_one_short_printable_line_whatever_the_bytes(data: bytes, offset: int):
    message = str(of(data).error(offset, "a node"))
    assert message.isprintable()
    assert len(message) < 160
    assert re.match(r"mesh.msh: line \d+: expected a node, found ('.*…?|end of (file|line))", message)


def test_an_error_names_the_line_or_the_byte_and_what_was_found():
    data = of(b"one\ntwo\nthree")
    assert str(data.error(4, "a number")) == "mesh.msh: line 2: expected a number, found 'two'"
    assert str(data.error(4, "a number", "a word")) == "mesh.msh: line 2: expected a number, found a word"
    assert str(data.error(4, "a number", binary=True)) == "mesh.msh: byte 4: expected a number, found 'two'"
    assert str(data.error(13, "a number")) == "mesh.msh: line 3: expected a number, found end of file"


def test_text_keeps_every_byte():
    data = bytes(range(256))
    assert of(data).text(0, 256).encode("latin-1") == data
    assert of(data).text(65, 68) == "ABC"


def test_a_count_must_fit_in_the_bytes_left():
    data = of(bytes(100))
    assert data.checked_count(10, 10, 0, "nodes") == 10
    assert data.checked_count(9, 10, 10, "nodes") == 9
    assert data.checked_count(0, 10, 100, "nodes") == 0
    for count in (10, -1, 2**62, np.int64(2**62), np.int64(2**61)):
        with pytest.raises(ReadError) as caught:
            data.checked_count(count, 8, 24, "nodes")
        assert str(caught.value).endswith(f"expected a count of nodes that fits in the 76 bytes left, found {count}")
    with pytest.raises(ReadError, match="byte 24: expected a count of nodes"):
        data.checked_count(10, 8, 24, "nodes", binary=True)
