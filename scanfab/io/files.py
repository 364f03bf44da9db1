"""One file: opened, decompressed, told from others, and what it may take of disk and memory."""

from __future__ import annotations

import lzma
import os
import re
import shutil
import sys
import tempfile
import zlib
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path
from threading import Lock, get_ident
from types import ModuleType
from typing import Any, Protocol

from scanfab.base.ending import at_end
from scanfab.base.errors import ReadError
from scanfab.base.files import check_file, free_memory

COMPRESSED_SUFFIXES = (".gz", ".bz2", ".xz", ".zst", ".lz4")
# part of Python since 3.14
ZSTD = "compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd"
DECOMPRESSORS = {
    b"\x1f\x8b": "gzip",
    b"BZh": "bz2",
    b"\xfd7zXZ\x00": "lzma",
    b"\x28\xb5\x2f\xfd": ZSTD,
    b"\x50\x2a\x4d\x18": ZSTD,  # a frame to skip, with which pzstd begins
    b"\x04\x22\x4d\x18": "lz4.frame",
}
"""The module that opens a file, by the first bytes of the file."""
MAGIC_BYTES = max(map(len, DECOMPRESSORS))
# how many times its compressed size a file may grow to, and bytes that any file may grow to
MOST_TIMES = 1000.0
ANYWAY = 64 << 20
# bytes of a line of text
LONGEST_LINE = 16 << 20
# decompressed copies that are kept for each thread that reads: a frame needs few
KEPT = 4
# bytes that are copied at a time
PART = 4 << 20
# bytes that a copy leaves free on the disk, and bytes of a copy that need not leave them
RESERVE, SMALL = 1 << 30, 64 << 20
# of the name of the folder that holds the copies of a process
PREFIX = "scanfab-"
Stamp = tuple[str, int, int, int]
"""What tells a file from others, and from itself after it was changed."""
_times: ContextVar[float | None] = ContextVar("times", default=None)
_copies: OrderedDict[Stamp, Path] = OrderedDict()
_threads: set[int] = set()
_lock = Lock()
_folder: list[str] = []


class Readable(Protocol):
    """What can be read piece by piece."""

    def read(self, size: int, /) -> bytes:
        """So many bytes, or fewer; none at the end."""
        ...


def _forget_copies() -> None:
    """Forget the copies in a forked process: they belong to its parent, which still needs them."""
    global _lock
    _lock = Lock()  # a thread of the parent may hold the other
    _copies.clear()
    _threads.clear()
    _folder.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_copies)


def bare_name(path: Path) -> str:
    """The file name without the ending of a compression program."""
    return path.stem if path.suffix in COMPRESSED_SUFFIXES else path.name


def stamp_of(path: Path) -> Stamp:
    """Place, number, size and time of change; a relative path may come to mean another file."""
    status = path.stat()
    return os.path.abspath(path), status.st_ino, status.st_size, status.st_mtime_ns


def first_bytes(path: Path, count: int = 4096) -> bytes:
    """The first bytes of the decompressed file; ReadError if it cannot be opened."""
    head = _head(path, max(count, MAGIC_BYTES))
    if _decompressor(head) is None:
        return head[:count]
    with unpacked(path) as stream:
        return stream.read(count)


def plain(path: Path) -> Path:
    """The file itself, or a decompressed temporary copy that keeps its bare name."""
    if _decompressor(_head(path, MAGIC_BYTES)) is None:
        return path
    key = stamp_of(path)
    with _lock:
        _threads.add(get_ident())
        if key in _copies:
            _copies.move_to_end(key)
            return _copies[key]
    with unpacked(path) as stream:
        copy = temporary_copy(stream, bare_name(path))
    with _lock:
        _copies[key] = copy
        surplus = max(len(_copies) - KEPT * len(_threads), 0)
        oldest = [_copies.popitem(last=False)[1] for _ in range(surplus)]
    for one in oldest:
        shutil.rmtree(one.parent, ignore_errors=True)
    return copy


@contextmanager
def unpacked(path: Path) -> Iterator[Readable]:
    """The decompressed content of a file, as a stream that raises nothing but ReadError."""
    module = _decompressor(_head(path, MAGIC_BYTES))
    opener = open if module is None else module.open
    with _read_errors(path, module):
        file = opener(path, "rb")
    with file:
        yield _Unpacked(path, file, module)


class _Unpacked:
    """A stream of decompressed bytes, which ends in a ReadError where there are far too many."""

    def __init__(self, path: Path, stream: Readable, module: ModuleType | None) -> None:
        self._path, self._stream, self._module = path, stream, module
        self._packed, self._unpacked = path.stat().st_size, 0

    def read(self, size: int, /) -> bytes:
        with _read_errors(self._path, self._module):
            part = self._stream.read(size)
        self._unpacked += len(part)
        check_times(self._path, self._packed, self._unpacked)
        return part


@contextmanager
def unpacking_up_to(times: float | None) -> Iterator[None]:
    """
    Inside the block, let files grow to so many times their size, and lines have any length.

    None changes nothing.
    """
    token = _times.set(_times.get() if times is None else times)
    try:
        yield
    finally:
        _times.reset(token)


def check_times(path: Path, packed: int, unpacked: float) -> None:
    """ReadError if a file would unpack to far more than one so small can hold."""
    times = _times.get() or MOST_TIMES
    if unpacked > max(ANYWAY, times * packed):
        raise ReadError(
            f"{path}: its {packed:,} bytes unpack to more than {times:g} times as many, expected "
            f"no dump that is so empty: if it is one, allow more with `max_unpacked`"
        )


def check_lines(path: Path, plain: Path) -> None:
    """
    ReadError if a line of a text is longer than any table has them.

    Parameters
    ----------
    path, plain : Path
        As users know the file, and the same decompressed.
    """
    if _times.get() is not None:
        return
    with open(plain, "rb") as stream:
        size, begin = stream.seek(0, 2), 0
        while begin + LONGEST_LINE < size:
            stream.seek(begin)
            ends = stream.read(LONGEST_LINE).rfind(b"\n") + 1
            if not ends:
                raise ReadError(
                    f"{path}: a line is longer than {LONGEST_LINE >> 20} MiB (it begins at byte "
                    f"{begin:,}), expected rows of a table: if it is one, allow it with "
                    f"`max_unpacked`"
                )
            begin += ends


def check_memory(path: Path, needed: float) -> None:
    """ReadError if there are not so many bytes for what a file holds."""
    free = free_memory()
    if needed > free:
        raise ReadError(
            f"{path}: needs about {needed / 1e9:.1f} GB of memory to be read, and "
            f"{free / 1e9:.1f} GB are free"
        )


def file_inside(index: Path, name: str) -> Path:
    """
    The file that another one names, which must lie in its folder or below.

    Raises
    ------
    ReadError
        If it lies elsewhere, or is not there: whoever hands on a list of files must not be able to
        make others read what they like.
    """
    folder = os.path.abspath(index.parent)
    file = os.path.normpath(os.path.join(folder, name.replace("\\", "/")))
    if "\0" in name or os.path.commonpath([folder, file]) != folder or file == folder:
        raise ReadError(
            f"{index}: names {name!r}, which does not lie in its folder: move the files together"
        )
    path = index.parent / os.path.relpath(file, folder)
    # a name may be too long for any file
    if not os.path.isfile(path):
        raise ReadError(f"{index}: names {name[:200]!r}, but there is no such file")
    return path


def temporary_copy(stream: Readable, name: str) -> Path:
    """
    What a stream holds, as a file that is deleted at the end of the process.

    Raises
    ------
    ReadError
        If it would fill the disk: a few bytes can be decompressed to any number.
    """
    folder = ""
    try:
        if not _folder:
            _folder.append(tempfile.mkdtemp(prefix=PREFIX))
            at_end(_remove_copies)
        folder = tempfile.mkdtemp(dir=_folder[0])
        copy, size = Path(folder) / name, 0
        with open(copy, "wb") as file:
            while part := stream.read(PART):
                size += file.write(part)
                disk = shutil.disk_usage(folder)
                if size > SMALL and disk.free < min(RESERVE, disk.total // 20):
                    raise ReadError(
                        f"{name}: its content fills the disk of {_temporary()}, with {size:,} "
                        f"bytes so far: make room, or name another folder for temporary files by "
                        f"TMPDIR"
                    )
        return copy
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError):
            raise ReadError(
                f"{name}: its content cannot be written to {_temporary()}: {_reason(error)}: name "
                f"another folder for temporary files by TMPDIR"
            ) from None
        raise


def without_temporary(text: str) -> str:
    """
    A text in which temporary copies go by the names of what they are copies of.

    Examples
    --------
    >>> from io import BytesIO
    >>> from scanfab.io.files import temporary_copy, without_temporary
    >>> without_temporary(f"{temporary_copy(BytesIO(), 'standard input')}: no grains")
    'standard input: no grains'
    """
    folder = re.escape(os.path.join(_temporary(), PREFIX))
    return re.sub(rf"{folder}\w+[/\\]tmp\w+[/\\]", "", text)


def _temporary() -> str:
    """The folder for temporary files, which may be none at all."""
    try:
        return tempfile.gettempdir()
    except OSError:
        return "a temporary file"


def _remove_copies() -> None:
    """Delete all temporary copies, at the end of the process."""
    for folder in _folder:
        # under another name no thread that is still reading can put a copy into it
        last = f"{folder}-removed"
        with suppress(OSError):
            os.rename(folder, last)
        shutil.rmtree(last, ignore_errors=True)


def _decompressor(head: bytes) -> Any:
    """The module that opens a file that begins with these bytes; None if it is not compressed."""
    name = next((one for key, one in DECOMPRESSORS.items() if head.startswith(key)), None)
    return None if name is None else import_module(name)


def _head(path: Path, count: int) -> bytes:
    """The first bytes as they stand there."""
    check_file(path)
    with _read_errors(path, None), open(path, "rb") as stream:
        return stream.read(count)


@contextmanager
def _read_errors(path: Path, module: ModuleType | None) -> Iterator[None]:
    """Turn what can go wrong when a file is opened or decompressed into ReadError."""
    zstd_error = getattr(module, "ZstdError", OSError)
    try:
        yield
    except (OSError, EOFError, RuntimeError, zlib.error, lzma.LZMAError, zstd_error) as error:
        verb = "read" if module is None else "decompressed"
        raise ReadError(f"{path}: cannot be {verb}: {_reason(error)}") from None


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.errno is not None:
        return os.strerror(error.errno)
    return str(error) or "the file ends too early"
