"""Tables that are no text: Parquet, NPZ and ``.xyzd``. None of them runs what it holds."""

from __future__ import annotations

import lzma
import math
import re
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError, ScanfabNote, ScanfabWarning
from scanfab.io.files import bare_name, check_memory, check_times, plain
from scanfab.packing.cell import Cell

Arrays = dict[str, npt.NDArray[Any]]

IS_PARQUET = b"PAR1"
IS_NPZ = b"PK"
# headers and members of an archive, of which sound ones have fewer
MOST_HEADER, MOST_MEMBERS = 10_000, 1000
# what packing.nfo says of a packing
NFO = r"(?i)^\s*{}\s*:?\s*" + r"([-+0-9.e]+)[ \t]*" + r"(?:([-+0-9.e]+)[ \t]+([-+0-9.e]+))?"


# what libraries raise for damaged files
DAMAGED: tuple[type[Exception], ...] = (
    *(zipfile.BadZipFile, OSError, ValueError, MemoryError),
    *(NotImplementedError, EOFError, KeyError, RuntimeError, zlib.error, lzma.LZMAError),
)


@contextmanager
def _told(path: Path, kind: str, *more: type[Exception]) -> Iterator[None]:
    """Let errors of a library be those of the file."""
    try:
        yield
    except (*DAMAGED, *more) as error:
        reason = str(error).partition("\n")[0][:200] or type(error).__name__
        raise ReadError(f"{path}: cannot be read as {kind}: {reason}") from None


def parquet_names(path: Path) -> list[str]:
    """The names of the columns of a Parquet file."""
    import pyarrow

    with _told(path, "Parquet", pyarrow.ArrowException):
        return list(_parquet(path).schema_arrow.names)


def read_parquet(path: Path) -> Arrays:
    """The columns of a Parquet file, without those that are neither numbers nor text."""
    import pyarrow

    with _told(path, "Parquet", pyarrow.ArrowException):
        file = _parquet(path)
        names = list(file.schema_arrow.names)
        room = 8.0 * file.metadata.num_rows * len(names)
        check_times(path, plain(path).stat().st_size, room)
        check_memory(path, 2.0 * room)
        found = {}
        for name, column in zip(names, file.read().columns, strict=True):
            values = column.to_numpy()
            if values.dtype == object and all(isinstance(one, str | None) for one in values):
                values = np.array(["" if one is None else one for one in values], dtype=np.str_)
            if values.dtype.kind in "biufU":
                found[name] = values
        return found


def _parquet(path: Path) -> Any:
    from pyarrow import parquet

    return parquet.ParquetFile(plain(path), thrift_string_size_limit=1 << 20)


def npz_shapes(path: Path) -> dict[str, tuple[int, ...]]:
    """The shapes of the arrays of numbers and text in an NPZ file, by name."""
    with _told(path, "NPZ"), zipfile.ZipFile(plain(path)) as archive:
        return {name: shape for name, (shape, _) in _members(path, archive).items()}


def read_npz(path: Path, wanted: Iterable[str] | None = None) -> Arrays:
    """The arrays of numbers and text in an NPZ file, those wanted; pickled objects are refused."""
    names = None if wanted is None else set(wanted)
    with _told(path, "NPZ"), zipfile.ZipFile(plain(path)) as archive:
        members = {
            name: info
            for name, (_, info) in _members(path, archive).items()
            if names is None or name in names
        }
        room = float(sum(info.file_size for info in members.values()))
        check_times(path, plain(path).stat().st_size, room)
        check_memory(path, 2.0 * room)
        return {name: _array(archive.open(info)) for name, info in members.items()}


def _array(stream: IO[bytes]) -> npt.NDArray[Any]:
    with stream:
        array: npt.NDArray[Any] = np.lib.format.read_array(
            stream, allow_pickle=False, max_header_size=MOST_HEADER
        )
    return array


def _members(
    path: Path, archive: zipfile.ZipFile
) -> dict[str, tuple[tuple[int, ...], zipfile.ZipInfo]]:
    """Shape of each array of numbers or text, and where it is."""
    infos = archive.infolist()
    if len(infos) > MOST_MEMBERS:
        raise ReadError(f"{path}: expected some arrays, found {len(infos)} files in the archive")
    found = {}
    for info in infos:
        name = info.filename.removesuffix(".npy")
        if name == info.filename:
            continue
        with archive.open(info) as stream:
            headers: dict[Any, Callable[..., Any]] = {
                (1, 0): np.lib.format.read_array_header_1_0,
                (2, 0): np.lib.format.read_array_header_2_0,
            }
            shape, _, dtype = headers[np.lib.format.read_magic(stream)](stream, MOST_HEADER)
            header = stream.tell()
        if dtype.hasobject:
            raise ReadError(
                f"{path}: the array {name} holds pickled objects, which can run programs and are "
                f"not read: save plain arrays of numbers"
            )
        # numpy would ask for as much memory as a damaged count says
        if (
            min(shape, default=0) < 0
            or header + dtype.itemsize * math.prod(shape) != info.file_size
        ):
            raise ReadError(
                f"{path}: the array {name} of shape {shape} does not have the "
                f"{info.file_size:,} bytes that are there: the file is damaged"
            )
        if dtype.kind in "biufU":
            found[name] = shape, info
    return found


def is_xyzd(path: Path) -> bool:
    """By the ending: the content is nothing but doubles."""
    return bare_name(path).lower().endswith(".xyzd")


def read_xyzd(path: Path) -> Arrays:
    """
    The columns x, y, z and diameter of a binary packing of PackingGeneration.

    The program writes the diameters that it began with. Those that it ended with are larger by
    ((1 - final porosity) / (1 - theoretical porosity))^(1/3), which stand in ``packing.nfo``.
    """
    file = plain(path)
    size = file.stat().st_size
    if size == 0 or size % 32:
        found = f"found {size} bytes" if size else "the file is empty"
        raise ReadError(
            f"{path}: expected rows of four doubles, 32 bytes each, {found}: the file is no .xyzd, "
            f"or incomplete"
        )
    check_memory(path, 3.0 * size)
    x, y, z, diameter = np.fromfile(file, "<f8").reshape(-1, 4).astype(np.float64).T
    info, text = _nfo(path)
    if text is None:
        warnings.warn(
            f"{path}: there is no packing.nfo beside the file, which says by how much "
            f"PackingGeneration means diameters to be scaled: they are taken as they stand",
            ScanfabWarning,
            stacklevel=2,
        )
        return {"x": x, "y": y, "z": z, "diameter": diameter}
    final, theoretical = _numbers(text, "final porosity"), _numbers(text, "theoretical porosity")
    factor = np.nan
    if final and theoretical and final[0] < 1 and theoretical[0] < 1:
        factor = ((1.0 - final[0]) / (1.0 - theoretical[0])) ** (1.0 / 3.0)
    if not 0.5 < factor < 2.0:
        raise ReadError(
            f"{info}: expected a theoretical and a final porosity between 0 and 1, by which the "
            f"diameters of {path.name} are scaled"
        )
    if factor != 1.0:
        warnings.warn(
            f"{path}: diameters are multiplied by {factor:.6g}, from the porosities in packing.nfo",
            ScanfabNote,
            stacklevel=2,
        )
    return {"x": x, "y": y, "z": z, "diameter": factor * diameter}


def xyzd_cell(path: Path) -> Cell | None:
    """The cell by the dimensions in ``packing.nfo``, which repeats along all axes."""
    info, text = _nfo(path)
    edges = None if text is None else _numbers(text, "dimensions")
    if edges is None or len(edges) != 3:
        return None
    try:
        return Cell(edges)
    except PackingError as error:
        raise ReadError(f"{info}: Dimensions: {error}") from None


def _nfo(path: Path) -> tuple[Path, str | None]:
    """The file ``packing.nfo`` beside a packing, and its text if it is there."""
    info = path.with_name("packing.nfo")
    text = info.read_bytes()[:10_000].decode("utf-8", "replace") if info.is_file() else None
    return info, text


def _numbers(text: str, key: str) -> list[float] | None:
    """The numbers behind a word of ``packing.nfo``."""
    match = re.search(NFO.format(key), text, re.MULTILINE)
    try:
        return None if match is None else [float(word) for word in match.groups() if word]
    except ValueError:
        return None
