"""What files are packed with, and how much may come out of them."""

from __future__ import annotations

import bz2
import gzip
import lzma
import sys
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from scanfab.base.errors import ReadError

COMPRESSED_SUFFIXES = (".gz", ".bz2", ".xz", ".zst", ".lz4")
MAGIC_BYTES = 6
# part of Python since 3.14
ZSTD = "compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd"
# times its packed size that a file may unpack to, and bytes that any file may
MOST_TIMES = 1000.0
ANYWAY = 64 << 20
# bytes of a line of text
LONGEST_LINE = 16 << 20
# of the end of such a stretch, where nearly every text has a line that ends
TAIL = 1 << 16
_times: ContextVar[float | None] = ContextVar("times", default=None)


class Readable(Protocol):
    """What can be read piece by piece."""

    def read(self, size: int, /) -> bytes:
        """So many bytes, or fewer; none at the end."""
        ...


def _open_zstd(path: Path, mode: str) -> Any:
    return import_module(ZSTD).open(path, mode)


def _open_lz4(path: Path, mode: str) -> Any:
    import lz4.frame

    return lz4.frame.open(path, mode)


OPENERS: dict[bytes, Callable[..., Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
    b"\x28\xb5\x2f\xfd": _open_zstd,
    b"\x50\x2a\x4d\x18": _open_zstd,  # a frame to skip, with which pzstd begins
    b"\x04\x22\x4d\x18": _open_lz4,
}


def opener_for(magic: bytes) -> Callable[..., Any]:
    """What opens a file that begins with these bytes; the usual ``open`` if it is not packed."""
    return next((opener for key, opener in OPENERS.items() if magic.startswith(key)), open)


def unpacking_errors(opener: Callable[..., Any]) -> tuple[type[Exception], ...]:
    """What a packed file can end in; RuntimeError is that of lz4."""
    known = (OSError, EOFError, lzma.LZMAError, zlib.error)
    if opener is _open_lz4:
        return (*known, RuntimeError)
    if opener is _open_zstd:
        return (*known, import_module(ZSTD).ZstdError)
    return known


@contextmanager
def unpacking_up_to(times: float | None) -> Iterator[None]:
    """
    Let files unpack to so many times their size, and have lines of any length, inside of this.

    None leaves it as it is.
    """
    token = _times.set(_times.get() if times is None else times)
    try:
        yield
    finally:
        _times.reset(token)


def bounded(path: Path, stream: Readable, packed: int) -> Readable:
    """The stream, which ends in a ReadError where it is far longer than a file so small can be."""
    return _Bounded(path, stream, packed)


class _Bounded:
    def __init__(self, path: Path, stream: Readable, packed: int) -> None:
        self._path, self._stream, self._packed = path, stream, packed
        self._times = _times.get() or MOST_TIMES
        self._left = max(ANYWAY, self._times * packed)

    def read(self, size: int, /) -> bytes:
        part = self._stream.read(size)
        self._left -= len(part)
        if self._left < 0:
            raise _too_much(self._path, self._packed, self._times)
        return part


def check_times(path: Path, packed: int, unpacked: float) -> None:
    """ReadError if a file would unpack to far more than one so small can hold."""
    times = _times.get() or MOST_TIMES
    if unpacked > max(ANYWAY, times * packed):
        raise _too_much(path, packed, times)


def _too_much(path: Path, packed: int, times: float) -> ReadError:
    return ReadError(
        f"{path}: its {packed:,} bytes unpack to more than {times:g} times as many, expected no "
        f"dump that is so empty: if it is one, allow more with `max_unpacked`"
    )


def check_lines(path: Path, plain: Path) -> None:
    """
    ReadError if a line of a text is longer than any table has them.

    Parameters
    ----------
    path, plain : Path
        As users know the file, and the same unpacked.
    """
    if _times.get() is not None:
        return
    with open(plain, "rb") as stream:
        size, begin = stream.seek(0, 2), 0
        while begin + LONGEST_LINE < size:
            stream.seek(begin + LONGEST_LINE - TAIL)
            place = stream.read(TAIL).rfind(b"\n")
            if place >= 0:
                begin += LONGEST_LINE - TAIL + place + 1
                continue
            stream.seek(begin)
            place = stream.read(LONGEST_LINE).rfind(b"\n")
            if place < 0:
                raise ReadError(
                    f"{path}: a line is longer than {LONGEST_LINE >> 20} MiB (it begins at byte "
                    f"{begin:,}), expected rows of a table: if it is one, allow it with "
                    f"`max_unpacked`"
                )
            begin += place + 1
