"""Writing a file so that it is there whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from meshwright.audit.errors import UsageError, printable

__all__ = ["check_new_folder", "check_writable", "new_folder", "replacing"]


def _cannot(path: Path, reason: str) -> UsageError:
    return UsageError(f"cannot write {printable(str(path), 200)}: {reason}")


def check_writable(path: str | Path) -> None:
    """UsageError where `replacing` could not succeed: asked before hours of work, not after."""
    target = Path(path).resolve()
    if target.is_dir():
        raise _cannot(Path(path), "it is a folder")
    if target.exists() and not target.is_file():
        return  # a device or a pipe is opened when its turn comes
    if not target.parent.is_dir():
        raise _cannot(Path(path), "its folder does not exist")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise _cannot(Path(path), "its folder is not writable")


@contextmanager
def replacing(path: str | Path) -> Iterator[BinaryIO]:
    """A binary stream whose content takes the place of `path` when the block ends without an exception.

    It is written beside the target, flushed to disk and renamed, so a reader sees the old file or the new one and
    an exception or a crash leaves the old one. Links are followed, permissions kept; a device or pipe is written
    directly. UsageError where the file system refuses.
    """
    target = Path(path).resolve()
    if target.exists() and not target.is_file() and not target.is_dir():
        try:
            with target.open("wb") as stream:
                yield stream
        except OSError as error:
            raise _cannot(Path(path), error.strerror or "input/output error") from None
        return
    temporary = ""
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=f".{target.name[:100]}.", suffix=".part", dir=target.parent)
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
            stream.flush()
            os.fchmod(stream.fileno(), _mode(target))
            os.fsync(stream.fileno())
        Path(temporary).replace(target)
        temporary = ""
    except OSError as error:
        raise _cannot(Path(path), error.strerror or "input/output error") from None
    finally:
        if temporary:
            Path(temporary).unlink(missing_ok=True)


def check_new_folder(path: Path) -> None:
    """UsageError where `path` is there: a folder is not replaced, since it may hold more than we would write."""
    if os.path.lexists(path):
        raise _cannot(path, "it is there already; choose another folder, or move that one away")


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """A folder to fill, which gets the name `path` when the block ends without an exception, and goes away else.

    Folders above are made. UsageError where `path` is there, or the file system refuses.
    """
    check_new_folder(path)
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{path.name[:100]}.", suffix=".part", dir=path.parent))
        yield temporary
        for file in temporary.iterdir():
            with file.open("rb") as stream:
                os.fsync(stream.fileno())
        mask = os.umask(0o077)
        os.umask(mask)
        temporary.chmod(0o777 & ~mask)
        temporary.rename(path)  # fails where a folder that is not empty has come there since
        temporary = None
    except OSError as error:
        raise _cannot(path, error.strerror or "input/output error") from None
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)


def _mode(target: Path) -> int:
    """Permissions of the file to be replaced, or what the user's umask gives a new one."""
    if target.exists():
        return target.stat().st_mode & 0o777
    mask = os.umask(0o077)
    os.umask(mask)
    return 0o666 & ~mask
