"""Open and decompress one file, check its size against the memory, and note if it still grows."""

from __future__ import annotations

import lzma
import os
import re
import shutil
import sys
import tempfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, suppress
from contextvars import ContextVar
from functools import cache, lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any
from weakref import finalize

from scanfab.base.errors import ReadError, warn, within
from scanfab.base.files import at_end, check_file

COMPRESSED_SUFFIXES = (".gz", ".bz2", ".xz", ".zst", ".lz4")
# zstd is in the standard library since Python 3.14
ZSTD = "compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd"
DECOMPRESSORS = {b"\x1f\x8b": "gzip", b"BZh": "bz2", b"\xfd7zXZ\x00": "lzma"}
# zstd, and the skippable frame with which files of pzstd begin
DECOMPRESSORS |= {b"\x28\xb5\x2f\xfd": ZSTD, b"\x50\x2a\x4d\x18": ZSTD}
DECOMPRESSORS |= {b"\x04\x22\x4d\x18": "lz4.frame"}
"""First bytes of a compressed file, and the module that opens it."""
MAGIC_BYTES = max(map(len, DECOMPRESSORS))
# how many times its compressed size a file may grow to; ANYWAY bytes are always allowed
MOST_TIMES = 1000.0
ANYWAY = 64 << 20
# number of decompressed copies that are kept for later reads
KEPT = 16
# bytes that are copied in one piece
PART = 4 << 20
# names of the folders of decompressed copies begin with this
PREFIX = "scanfab-"
Stamp = tuple[str, int, int, int]
"""Identifies a file in its present state: path, inode, size and time of change."""
_grows: ContextVar[bool] = ContextVar("grows", default=False)
_times: ContextVar[float] = ContextVar("times", default=MOST_TIMES)


class _Copy(type(Path())):  # type: ignore[misc]
    """The path of a temporary copy, which is deleted with the last reference to the path."""


def bare_name(path: Path) -> str:
    """The file name without the ending of a compression program."""
    return path.stem if path.suffix in COMPRESSED_SUFFIXES else path.name


def stamp_of(path: Path) -> Stamp:
    """The stamp of a file; the path is absolute, as the current folder may change."""
    status = path.stat()
    return os.path.abspath(path), status.st_ino, status.st_size, status.st_mtime_ns


def first_bytes(path: Path, count: int = 4096) -> bytes:
    """The first bytes of the decompressed file; ReadError if it cannot be opened."""
    return next(pieces(path, count), b"")


def plain(path: Path) -> Path:
    """
    The file itself, or a decompressed temporary copy with its bare name.

    The copy exists as long as something refers to the returned path. The last few copies stay
    longer, so that a reader that opens its file several times decompresses it once.
    """
    if _decompressor(path) is None:
        return path
    return _copy_of(path, stamp_of(path), os.getpid())


@lru_cache(KEPT)
def _copy_of(path: Path, stamp: Stamp, process: int) -> Path:
    """A decompressed copy of a file in the state of its stamp; a forked process makes its own."""
    copy: Path = _Copy(temporary_copy(pieces(path), bare_name(path)))
    finalize(copy, _remove, os.path.dirname(copy), process)
    return copy


def _remove(folder: str, process: int) -> None:
    """Delete the folder of a copy, but not from a forked process: the parent still needs it."""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


def pieces(path: Path, size: int = PART) -> Iterator[bytes]:
    """The decompressed content of a file, ``size`` bytes at a time; raises only ReadError."""
    module = _decompressor(path)
    zstd_error, unpacked, times = getattr(module, "ZstdError", OSError), 0, _times.get()
    try:
        with open(path, "rb") as packed, packed if module is None else module.open(packed) as file:
            while piece := file.read(size):
                unpacked += len(piece)
                # checked while reading, so that a decompression bomb is found early
                if unpacked > max(ANYWAY, times * packed.tell()):
                    problem = f"decompress to more than {times:g} times their size"
                    advice = "if it is a dump, allow more with `max_unpacked`"
                    raise ReadError(f"{path}: {packed.tell():,} bytes of it {problem}: {advice}")
                yield piece
    except (OSError, EOFError, RuntimeError, zlib.error, lzma.LZMAError, zstd_error) as error:
        verb = "read" if module is None else "decompressed"
        raise ReadError(f"{path}: cannot be {verb}: {_reason(error)}") from None


def unpacking_up_to(times: float | None) -> AbstractContextManager[float]:
    """Inside the block, files may decompress to this many times their size; None: no change."""
    return within(_times, times or _times.get())


def file_inside(index: Path, name: str) -> Path:
    """
    The path of a file that an index file names; it must be in the folder of the index or below.

    Raises
    ------
    ReadError
        If the file is elsewhere or does not exist. An index from a stranger must not make scanfab
        read arbitrary files.
    """
    folder = os.path.abspath(index.parent)
    file = os.path.normpath(os.path.join(folder, name.replace("\\", "/")))
    if "\0" in name or os.path.commonpath([folder, file]) != folder or file == folder:
        problem = "which is outside the folder of this file: move the files together"
        raise ReadError(f"{index}: names {name!r}, {problem}")
    path = index.parent / os.path.relpath(file, folder)
    # isfile also copes with a name that is too long
    if not os.path.isfile(path):
        raise ReadError(f"{index}: names {name[:200]!r}, but there is no such file")
    return path


def temporary_copy(content: Iterable[bytes], name: str) -> Path:
    """
    Write content to a file that is deleted at the end of the process.

    Raises
    ------
    ReadError
        If the file cannot be written, for instance to a full disk.
    """
    folder = ""
    try:
        folder = tempfile.mkdtemp(dir=_folder(os.getpid()))
        copy = Path(folder) / name
        with open(copy, "wb") as file:
            file.writelines(content)
        return copy
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError):
            advice = f"{_reason(error)}: make room there, or name another folder by TMPDIR"
            place = tempfile.tempdir or "any folder"
            raise ReadError(f"{name}: cannot be written to {place}: {advice}") from None
        raise


@cache
def _folder(process: int) -> str:
    """The folder for the copies of a process; it is removed at the end of the process."""
    folder = tempfile.mkdtemp(prefix=PREFIX)

    def remove() -> None:
        # renamed first, so that a thread that is still reading cannot add a copy
        with suppress(OSError):
            os.rename(folder, f"{folder}-removed")
        shutil.rmtree(f"{folder}-removed", ignore_errors=True)

    at_end(remove)
    return folder


def without_temporary(text: str) -> str:
    """
    A text with the original names in place of the paths of temporary copies.

    Examples
    --------
    >>> from scanfab.io.files import temporary_copy, without_temporary
    >>> without_temporary(f"{temporary_copy([], 'standard input')}: no grains")
    'standard input: no grains'
    """
    # tempfile.tempdir is set once there is a copy
    folder = re.escape(os.path.join(tempfile.tempdir or "", PREFIX))
    return re.sub(rf"{folder}\w+[/\\]tmp\w+[/\\]", "", text)


def _decompressor(path: Path) -> Any:
    """The module that opens a compressed file, by its first bytes; None for any other file."""
    check_file(path)
    try:
        with open(path, "rb") as stream:
            head = stream.read(MAGIC_BYTES)
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {_reason(error)}") from None
    name = next((module for key, module in DECOMPRESSORS.items() if head.startswith(key)), None)
    return name and import_module(name)


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.errno is not None:
        return os.strerror(error.errno)
    return str(error) or "the file ends too early"


def growing() -> AbstractContextManager[bool]:
    """Inside the block, files may still be growing: an incomplete end draws no warning."""
    return within(_grows, True)


def grows() -> bool:
    """Whether files may still be growing."""
    return _grows.get()


def leave_out_last(path: Path, complete: int, reason: str) -> None:
    """Warn that an incomplete last snapshot is left out; ReadError if none is complete."""
    if complete == 0:
        raise ReadError(f"{path}: {reason}: the file is incomplete")
    if not grows():
        text = f"{path}: the last snapshot, number {complete + 1}, is incomplete and is left out"
        warn(f"{text}: {reason}")
