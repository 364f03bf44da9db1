"""Files as readers want them: plain, whatever they are packed with."""

from __future__ import annotations

import math
import os
import re
import shutil
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock, get_ident
from typing import IO, Any

from scanfab.base.ending import at_end
from scanfab.base.errors import ReadError
from scanfab.base.memory import free_memory
from scanfab.base.streams import check_file
from scanfab.io.unpacking import (
    COMPRESSED_SUFFIXES,
    MAGIC_BYTES,
    Readable,
    bounded,
    opener_for,
    unpacking_errors,
    unpacking_up_to,
)

# decompressed copies of the files used last, for each thread that reads: a frame needs few
KEPT = 4
# bytes that are copied at a time, and those that are left to other programs
PART = 4 << 20
RESERVE = 1 << 30
# a copy up to this size is no reason to ask how full the disk is
SMALL = 64 << 20
# of the folder that holds the copies of a process
PREFIX = "scanfab-"
Stamp = tuple[str, int, int, int]
"""What tells a file from others, and from itself when it was changed."""
_copies: OrderedDict[Stamp, Path] = OrderedDict()
# files that were unpacked once, and whose copies may have been removed since
_sound: set[Stamp] = set()
_threads: set[int] = set()
_lock = Lock()
_folder: list[str] = []


def _forget_copies() -> None:
    """A forked process has no copies: those that it knows are its parent's, who needs them."""
    global _lock
    _lock = Lock()  # a thread of the parent's may hold the other
    _copies.clear()
    _threads.clear()
    _folder.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_copies)


def bare_name(path: Path) -> str:
    """The file name without the ending of a compression program."""
    return path.stem if path.suffix in COMPRESSED_SUFFIXES else path.name


def first_bytes(path: Path, count: int = 4096) -> bytes:
    """The first bytes of the decompressed file; ReadError if it cannot be opened."""
    head = _head(path, max(count, MAGIC_BYTES))
    opener = opener_for(head)
    if opener is open:
        return head[:count]
    try:
        with opener(path, "rb") as stream:
            unpacked: bytes = stream.read(count)
            return unpacked
    except unpacking_errors(opener) as error:
        raise ReadError(f"{path}: cannot be read: {_reason(error)}") from None


def stamp_of(path: Path) -> Stamp:
    """Place, number, size and time of change; a relative path may come to mean another file."""
    status = path.stat()
    return os.path.abspath(path), status.st_ino, status.st_size, status.st_mtime_ns


def plain(path: Path) -> Path:
    """The file itself, or a decompressed temporary copy that keeps its bare name."""
    opener = _opener(path)
    if opener is open:
        return path
    key = stamp_of(path)
    with _lock:
        _threads.add(get_ident())
        if key in _copies:
            _copies.move_to_end(key)
            return _copies[key]
    with unpacking_up_to(math.inf if key in _sound else None), unpacked(path) as stream:
        copy = temporary_copy(stream, bare_name(path))
    _sound.add(key)
    with _lock:
        _copies[key] = copy
        surplus = max(len(_copies) - KEPT * len(_threads), 0)
        oldest = [_copies.popitem(last=False)[1] for _ in range(surplus)]
    for one in oldest:
        shutil.rmtree(one.parent, ignore_errors=True)
    return copy


@contextmanager
def unpacked(path: Path) -> Iterator[Readable]:
    """The content of a file, as a stream; ReadError if it cannot be read or decompressed."""
    opener = _opener(path)
    try:
        with opener(path, "rb") as stream:
            yield stream if opener is open else bounded(path, stream, path.stat().st_size)
    except unpacking_errors(opener) as error:
        verb = "read" if opener is open else "decompressed"
        raise ReadError(f"{path}: cannot be {verb}: {_reason(error)}") from None


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


def check_memory(path: Path, needed: float) -> None:
    """ReadError if there are not so many bytes for what a file holds."""
    free = free_memory()
    if needed > free:
        raise ReadError(
            f"{path}: needs about {needed / 1e9:.1f} GB of memory to be read, and "
            f"{free / 1e9:.1f} GB are free"
        )


def temporary_copy(stream: Readable, name: str) -> Path:
    """
    What a stream holds, as a file that goes with the process.

    Raises
    ------
    ReadError
        If it would fill the disk: a few bytes can be decompressed to any number.
    """
    copy = _new_folder(name) / name
    try:
        with _of_copy(name):
            file = open(copy, "wb", buffering=0)  # noqa: SIM115
        with file:
            size = 0
            while part := stream.read(PART):
                _check_disk(copy, size)
                _write(copy, file, part)
                size += len(part)
    except BaseException:
        shutil.rmtree(copy.parent, ignore_errors=True)
        raise
    return copy


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


def _new_folder(name: str) -> Path:
    """An empty folder for the copy of this name."""
    with _of_copy(name):
        if not _folder:
            _folder.append(tempfile.mkdtemp(prefix=PREFIX))
            at_end(_remove_copies)
        return Path(tempfile.mkdtemp(dir=_folder[0]))


def _check_disk(copy: Path, size: int) -> None:
    if size < SMALL:
        return
    with _of_copy(copy.name):
        disk = shutil.disk_usage(copy.parent)
    if disk.free < min(RESERVE, disk.total // 20) + PART:
        raise ReadError(
            f"{copy.name}: its content fills the disk of {tempfile.gettempdir()}, with {size:,} "
            f"bytes so far: make room, or name another folder for temporary files by TMPDIR"
        )


def _write(copy: Path, file: IO[bytes], part: bytes) -> None:
    with _of_copy(copy.name):
        left = memoryview(part)
        while left:
            left = left[file.write(left) :]


@contextmanager
def _of_copy(name: str) -> Iterator[None]:
    """Let errors of the system be those of the copy: the file that is read is as it should be."""
    try:
        yield
    except OSError as error:
        raise ReadError(
            f"{name}: its content cannot be written to {_temporary()}: {_reason(error)}: name "
            f"another folder for temporary files by TMPDIR"
        ) from None


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


def _opener(path: Path) -> Callable[..., Any]:
    return opener_for(_head(path, MAGIC_BYTES))


def _head(path: Path, count: int) -> bytes:
    """The first bytes as they stand there."""
    check_file(path)
    try:
        with open(path, "rb") as stream:
            return stream.read(count)
    except OSError as error:
        raise ReadError(f"{path}: cannot be read: {_reason(error)}") from None


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.errno is not None:
        return os.strerror(error.errno)
    return str(error) or "the file ends too early"
