"""gzip files: unpacked by content, wherever they are cut, and refused when damaged, padded with garbage or bombs."""

import gzip
import re
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from meshwright.audit.errors import ReadError
from meshwright.audit.readers import source
from meshwright.audit.readers.source import open_source

TEXT = b"".join(b"%d %.17g\n" % (i, i / 7) for i in range(400))
PACKED = gzip.compress(TEXT, mtime=0)


def refusal(path: Path | str, **options: int) -> str:
    with pytest.raises(ReadError) as caught:
        open_source(path, **options)
    return str(caught.value).removeprefix(f"{path}: ")


def test_gzip_is_told_by_content_and_unpacked(tmp_path: Path):
    for name in ("mesh.msh", "mesh.msh.gz"):
        (tmp_path / name).write_bytes(PACKED)
        assert open_source(tmp_path / name).data.tobytes() == TEXT
    (tmp_path / "plain.gz").write_bytes(TEXT)
    assert open_source(tmp_path / "plain.gz").data.tobytes() == TEXT


def test_members_and_padding_are_joined_wherever_the_reads_cut_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "mesh.gz"
    path.write_bytes(PACKED + b"\0" * 7 + gzip.compress(b"") + PACKED + b"\0" * 512)
    for chunk in (1, 2, 3, 7, 64, len(PACKED), len(PACKED) + 3, 1 << 16):
        monkeypatch.setattr(source, "_PACKED_CHUNK", chunk)
        monkeypatch.setattr(source, "_CHUNK", 1000)
        assert open_source(path).data.tobytes() == TEXT + TEXT


def test_gzip_cut_anywhere_is_refused(tmp_path: Path):
    path = tmp_path / "mesh.gz"
    cuts = [*range(3, len(PACKED), 50), *range(len(PACKED) - 12, len(PACKED))]
    for cut in cuts:
        path.write_bytes(PACKED[:cut])
        assert refusal(path) == f"packed byte {cut}: expected more gzip data, found end of file"
        path.write_bytes(PACKED + PACKED[:cut])
        assert refusal(path).startswith(f"packed byte {len(PACKED) + cut}: expected more gzip data")


def unpacked(path: Path) -> bytes | ReadError:
    try:
        return open_source(path).data.tobytes()
    except ReadError as error:
        return error


def test_a_changed_byte_in_gzip_is_refused_or_changes_nothing(tmp_path: Path):
    path = tmp_path / "mesh.gz"
    idle = []
    for at in range(3, len(PACKED)):
        path.write_bytes(PACKED[:at] + bytes([PACKED[at] ^ 0x10]) + PACKED[at + 1 :])
        outcome = unpacked(path)
        if isinstance(outcome, ReadError):
            assert "gzip data" in outcome.expected
            assert outcome.place.startswith("packed byte ")
        else:
            assert outcome == TEXT, at
            idle.append(at)
    # Only the header's date, flags and system, and the bits that fill the last byte, say nothing about the bytes.
    assert set(idle) <= {*range(3, 10), len(PACKED) - 9}


@pytest.mark.parametrize("tail", [b"x", b"\x1f", b"\x1f\x8b\x07garbage", b"\0\0\0garbage", b"\x1e\x8b\x08"])
def test_garbage_behind_gzip_is_refused(tmp_path: Path, tail: bytes):
    path = tmp_path / "mesh.gz"
    path.write_bytes(PACKED + tail)
    message = refusal(path)
    where = int(re.match(r"packed byte (\d+): expected .*gzip data", message)[1])
    assert len(PACKED) <= where <= len(PACKED) + len(tail)


def test_an_empty_gzip_file_is_empty(tmp_path: Path):
    path = tmp_path / "mesh.gz"
    path.write_bytes(gzip.compress(b""))
    assert refusal(path) == "expected a mesh, found an empty file"


def test_gzip_inside_gzip_is_unpacked_once(tmp_path: Path):
    path = tmp_path / "mesh.gz"
    path.write_bytes(gzip.compress(PACKED))
    assert open_source(path).data.tobytes() == PACKED


def test_the_limit_holds_for_unpacked_bytes(tmp_path: Path):
    path = tmp_path / "mesh.gz"
    path.write_bytes(PACKED)
    assert len(open_source(path, limit=len(TEXT))) == len(TEXT)
    assert "unpacks to at most" in refusal(path, limit=len(TEXT) - 1)


def test_a_bomb_is_refused_before_it_fills_the_memory(tmp_path: Path):
    path = tmp_path / "bomb.gz"
    packer = zlib.compressobj(wbits=31)
    zeros = bytes(1 << 20)
    path.write_bytes(b"".join([packer.compress(zeros) for _ in range(400)] + [packer.flush()]))
    program = """
import resource, sys
from meshwright.audit.errors import ReadError
from meshwright.audit.readers.source import open_source
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    open_source(sys.argv[1])
except ReadError as error:
    print(error)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""
    done = subprocess.run([sys.executable, "-c", program, path], capture_output=True, text=True, check=True, timeout=60)
    message, grown = done.stdout.splitlines()
    assert "and 200 times its size, found" in message
    assert int(grown) < 48 << 10  # KiB
