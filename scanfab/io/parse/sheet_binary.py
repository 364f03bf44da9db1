"""Tables that are no text: Parquet, NumPy's NPZ, and ``.xyzd``. None of them runs what it holds."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.files import check_memory, plain
from scanfab.io.unpacking import check_times

Arrays = dict[str, npt.NDArray[Any]]

IS_PARQUET = b"PAR1"
IS_NPZ = b"PK"
# x, y, z and the diameter of a grain
XYZD = np.dtype("<f8")
# members of an archive, each with a header of its own
MOST_MEMBERS = 1000
MOST_HEADER = 10_000


def parquet_names(path: Path) -> list[str]:
    """The names of the columns of a Parquet file."""
    return list(_parquet(path).schema_arrow.names)


def read_parquet(path: Path) -> Arrays:
    """The columns of a Parquet file, without those that are neither numbers nor text."""
    import pyarrow

    file = _parquet(path)
    names = list(file.schema_arrow.names)
    room = 8.0 * file.metadata.num_rows * len(names)
    check_times(path, plain(path).stat().st_size, room)
    check_memory(path, 2.0 * room)
    try:
        table = file.read()
        found = {
            name: _plain_column(column)
            for name, column in zip(names, table.columns, strict=True)
            if not pyarrow.types.is_nested(column.type)
        }
    except (pyarrow.ArrowException, OSError, ValueError, MemoryError) as error:
        raise _damaged(path, "Parquet", error) from None
    return {name: values for name, values in found.items() if values.dtype.kind in "biufU"}


def _parquet(path: Path) -> Any:
    import pyarrow
    from pyarrow import parquet

    try:
        return parquet.ParquetFile(plain(path), thrift_string_size_limit=1 << 20)
    except (pyarrow.ArrowException, OSError, ValueError, MemoryError) as error:
        raise _damaged(path, "Parquet", error) from None


def _plain_column(column: Any) -> npt.NDArray[Any]:
    values = column.to_numpy()
    return np.array(values, dtype=np.str_) if values.dtype == object else values


def npz_shapes(path: Path) -> dict[str, tuple[int, ...]]:
    """The shapes of the arrays of numbers and text in an NPZ file, by name."""
    with _archive(path) as archive:
        return {name: shape for name, shape, _ in _members(path, archive)}


def read_npz(path: Path, wanted: Iterable[str] | None = None) -> Arrays:
    """The arrays of numbers and text in an NPZ file, those wanted; pickled objects are refused."""
    names = None if wanted is None else set(wanted)
    found: Arrays = {}
    with _archive(path) as archive:
        members = [one for one in _members(path, archive) if names is None or one[0] in names]
        room = float(sum(info.file_size for _, _, info in members))
        check_times(path, plain(path).stat().st_size, room)
        check_memory(path, 2.0 * room)
        for name, _, info in members:
            with archive.open(info) as stream:
                found[name] = np.lib.format.read_array(
                    stream, allow_pickle=False, max_header_size=MOST_HEADER
                )
    return found


class _Archive(zipfile.ZipFile):
    """A zip file whose damages are ReadErrors."""

    def __init__(self, path: Path) -> None:
        self.path = path
        super().__init__(plain(path))

    def __exit__(self, kind: Any, value: Any, trace: Any) -> None:
        super().__exit__(kind, value, trace)
        if isinstance(value, Exception) and not isinstance(value, ReadError):
            raise _damaged(self.path, "NPZ", value) from None


def _archive(path: Path) -> _Archive:
    try:
        return _Archive(path)
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise _damaged(path, "NPZ", error) from None


def _members(
    path: Path, archive: zipfile.ZipFile
) -> list[tuple[str, tuple[int, ...], zipfile.ZipInfo]]:
    """Name and shape of each array of numbers or text, and where it is."""
    infos = archive.infolist()
    if len(infos) > MOST_MEMBERS:
        raise ReadError(f"{path}: expected some arrays, found {len(infos)} files in the archive")
    found = []
    for info in infos:
        if not info.filename.endswith(".npy"):
            continue
        name = info.filename.removesuffix(".npy")
        with archive.open(info) as stream:
            shape, dtype = _header(path, stream, name)
            header = stream.tell()
        if dtype.hasobject:
            raise ReadError(
                f"{path}: the array {name} holds pickled objects, which can run programs and are "
                f"not read: save plain arrays of numbers"
            )
        # a count that lies would have numpy ask for any memory
        if min(shape, default=0) < 0 or header + dtype.itemsize * math.prod(shape) != (
            info.file_size
        ):
            raise ReadError(
                f"{path}: the array {name} of shape {shape} does not have the "
                f"{info.file_size:,} bytes that are there: the file is damaged"
            )
        if dtype.kind in "biufU":
            found.append((name, shape, info))
    return found


def _header(path: Path, stream: IO[bytes], name: str) -> tuple[tuple[int, ...], Any]:
    """Shape and kind of an array."""
    version = np.lib.format.read_magic(stream)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(stream, MOST_HEADER)
    elif version == (2, 0):
        shape, _, dtype = np.lib.format.read_array_header_2_0(stream, MOST_HEADER)
    else:
        raise ReadError(f"{path}: the array {name} is of version {version}, which is not known")
    return shape, dtype


def read_xyzd(path: Path) -> FloatArray:
    """
    The rows of a ``.xyzd`` file, shape (N, 4): little-endian doubles, x y z and the diameter.

    Raises
    ------
    ReadError
        If the file is no whole number of rows.
    """
    file = plain(path)
    size = file.stat().st_size
    if size % (4 * XYZD.itemsize):
        raise ReadError(
            f"{path}: expected rows of four doubles, 32 bytes each, found {size} bytes: the file "
            f"is no .xyzd, or incomplete"
        )
    check_memory(path, 3.0 * size)
    return np.fromfile(file, XYZD).reshape(-1, 4).astype(np.float64)


def _damaged(path: Path, kind: str, error: Exception) -> ReadError:
    reason = str(error).partition("\n")[0][:200] or type(error).__name__
    return ReadError(f"{path}: cannot be read as {kind}: {reason}")
