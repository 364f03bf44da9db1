"""Tables that are no text: Parquet, NPZ and ``.xyzd``. None of them runs what it holds."""

from __future__ import annotations

import lzma
import math
import re
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError, note, warn
from scanfab.io.files import bare_name, check_memory, check_times, first_bytes, plain
from scanfab.packing.cell import Cell

Arrays = dict[str, npt.NDArray[Any]]

IS_PARQUET = b"PAR1"
IS_NPZ = b"PK"
# headers and members of an archive, of which sound ones have fewer
MOST_HEADER, MOST_MEMBERS = 10_000, 1000
# kinds of arrays that hold numbers or text
KINDS = "biufU"
# how packing.nfo names the numbers of a packing
NFO = re.compile(
    r"(?im)^\s*(dimensions|final porosity|theoretical porosity)\s*:?"
    r"((?:[ \t]+[-+]?[0-9]+\.?[0-9]*(?:e[-+]?[0-9]+)?(?![^\s,;]))+)"
)
# arrays of an NPZ file that are centres, and those that are pairs
POSITIONS = ("position", "positions", "pos", "points", "centers", "centres")
PAIRS = ("pairs", "contacts", "ids")
# what libraries raise for damaged files
DAMAGED: tuple[type[Exception], ...] = (
    *(zipfile.BadZipFile, OSError, ValueError, MemoryError),
    *(NotImplementedError, EOFError, KeyError, RuntimeError, zlib.error, lzma.LZMAError),
)


def binary_names(path: Path) -> list[str] | None:
    """The names of the columns of a binary table; None if the file is no such table."""
    if is_xyzd(path):  # doubles may begin as any other file does
        return ["x", "y", "z", "diameter"]
    head = first_bytes(path, 8)
    if head.startswith(IS_PARQUET):
        with _parquet(path) as file:
            return list(file.schema_arrow.names)
    if head.startswith(IS_NPZ):
        return [part for name, shape in npz_shapes(path).items() for part in _parts(name, shape)]
    return None


def read_binary(path: Path) -> Arrays:
    """The columns of a binary table, without those that are neither numbers nor text."""
    if is_xyzd(path):
        return _read_xyzd(path)
    if first_bytes(path, 8).startswith(IS_PARQUET):
        return _read_parquet(path)
    columns = {}
    for name, values in read_npz(path).items():
        for place, part in enumerate(_parts(name, values.shape)):
            columns[part] = values if values.ndim == 1 else values[:, place]
    # arrays of another length than the grains are no columns of them
    rows = len(columns["x"]) if "x" in columns else max(map(len, columns.values()), default=0)
    return {name: values for name, values in columns.items() if len(values) == rows}


@contextmanager
def _told(path: Path, kind: str, *more: type[Exception]) -> Iterator[None]:
    """Turn the errors of a library into those of the file."""
    try:
        yield
    except (*DAMAGED, *more) as error:
        reason = str(error).partition("\n")[0][:200] or type(error).__name__
        raise ReadError(f"{path}: cannot be read as {kind}: {reason}") from None


@contextmanager
def _parquet(path: Path) -> Iterator[Any]:
    """An open file of Parquet."""
    from pyarrow import ArrowException, parquet

    with _told(path, "Parquet", ArrowException):
        yield parquet.ParquetFile(plain(path), thrift_string_size_limit=1 << 20)


def _read_parquet(path: Path) -> Arrays:
    found: Arrays = {}
    with _parquet(path) as file:
        names = file.schema_arrow.names
        _check_room(path, 8.0 * file.metadata.num_rows * len(names))
        for name, column in zip(names, file.read().columns, strict=True):
            values = column.to_numpy()
            if values.dtype == object and all(isinstance(one, str | None) for one in values):
                values = np.array([one or "" for one in values], dtype=np.str_)
            if values.dtype.kind in KINDS:
                found[name] = values
    return found


def _check_room(path: Path, room: float) -> None:
    """ReadError if what a file says that it holds is too much for its size or the memory."""
    check_times(path, plain(path).stat().st_size, room)
    check_memory(path, 2.0 * room)


def _parts(name: str, shape: tuple[int, ...]) -> list[str]:
    """The names of the columns of an array of an NPZ file; none if it cannot be columns."""
    if len(shape) != 2 or shape[1] > 9:
        return [name] if len(shape) == 1 else []
    if name.lower() in POSITIONS:
        return list("xyz"[: shape[1]])
    if name.lower() in PAIRS and shape[1] == 2:
        return ["id1", "id2"]
    return [f"{name}_{axis}" for axis in ("xyz" if shape[1] == 3 else range(shape[1]))]


def npz_shapes(path: Path) -> dict[str, tuple[int, ...]]:
    """The shapes of the arrays of numbers and text in an NPZ file; pickled objects are refused."""
    found = {}
    with _told(path, "NPZ"), zipfile.ZipFile(plain(path)) as archive:
        members = archive.infolist()
        if len(members) > MOST_MEMBERS:
            raise ValueError(f"expected some arrays, found {len(members)} files in the archive")
        for member in (one for one in members if one.filename.endswith(".npy")):
            name = member.filename.removesuffix(".npy")
            with archive.open(member) as stream:
                is_first = np.lib.format.read_magic(stream) == (1, 0)
                form: Any = np.lib.format
                read = form.read_array_header_1_0 if is_first else form.read_array_header_2_0
                shape, _, dtype = read(stream, MOST_HEADER)
                size = member.file_size - stream.tell()
            if dtype.hasobject:
                raise ValueError(f"{name} holds pickled objects, which can run programs")
            if size != dtype.itemsize * math.prod(shape):
                raise ValueError(f"{name} has {size} bytes, which are not of its shape {shape}")
            if dtype.kind in KINDS:
                found[name] = shape
    return found


def read_npz(path: Path, wanted: Iterable[str] | None = None) -> Arrays:
    """The arrays of numbers and text in an NPZ file, those wanted; pickled objects are refused."""
    names = [name for name in npz_shapes(path) if wanted is None or name in wanted]
    with _told(path, "NPZ"), np.load(plain(path), max_header_size=MOST_HEADER) as archive:
        _check_room(path, float(sum(member.file_size for member in archive.zip.infolist())))
        return {name: archive[name] for name in names}


def is_xyzd(path: Path) -> bool:
    """By the ending: the content is nothing but doubles."""
    return bare_name(path).lower().endswith(".xyzd")


def _read_xyzd(path: Path) -> Arrays:
    """
    The columns x, y, z and diameter of a binary packing of PackingGeneration.

    The program writes the diameters that it began with. Those that it ended with are larger by
    ((1 - final porosity) / (1 - theoretical porosity))^(1/3), which stand in ``packing.nfo``.
    """
    file = plain(path)
    size = file.stat().st_size
    if size == 0 or size % 32:
        found = f"found {size} bytes" if size else "the file is empty"
        raise ReadError(f"{path}: expected whole rows of four doubles, 32 bytes each, {found}")
    check_memory(path, 3.0 * size)
    x, y, z, diameter = np.fromfile(file, "<f8").reshape(-1, 4).astype(np.float64).T
    info = _nfo(path)
    if info is None:
        warn(f"{path}: diameters are not scaled, since there is no packing.nfo beside the file")
        return {"x": x, "y": y, "z": z, "diameter": diameter}
    solid = [1.0 - info.get(f"{one} porosity", [1.0])[0] for one in ("final", "theoretical")]
    factor = (solid[0] / solid[1]) ** (1 / 3) if min(solid) > 0 else np.nan
    if not 0.5 < factor < 2.0:
        raise ReadError(
            f"{path.with_name('packing.nfo')}: expected a theoretical and a final porosity "
            f"between 0 and 1, by which the diameters of {path.name} are scaled"
        )
    if factor != 1.0:
        told = f"diameters are multiplied by {factor:.6g}, from the porosities in packing.nfo"
        note(f"{path}: {told}")
    return {"x": x, "y": y, "z": z, "diameter": factor * diameter}


def xyzd_cell(path: Path) -> Cell | None:
    """The cell by the dimensions in ``packing.nfo``, which repeats along all axes."""
    edges = (_nfo(path) or {}).get("dimensions", [])
    try:
        return Cell(edges) if len(edges) == 3 else None
    except PackingError as error:
        raise ReadError(f"{path.with_name('packing.nfo')}: Dimensions: {error}") from None


def _nfo(path: Path) -> dict[str, list[float]] | None:
    """The numbers in ``packing.nfo`` beside a packing by their names; None without the file."""
    info = path.with_name("packing.nfo")
    if not info.is_file():
        return None
    found = NFO.findall(info.read_bytes()[:10_000].decode("utf-8", "replace"))
    return {key.lower(): [float(word) for word in words.split()] for key, words in found}
