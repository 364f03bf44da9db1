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
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError, ScanfabNote, ScanfabWarning
from scanfab.io.files import bare_name, check_memory, check_times, first_bytes, plain
from scanfab.packing.cell import Cell

Arrays = dict[str, npt.NDArray[Any]]

IS_PARQUET = b"PAR1"
IS_NPZ = b"PK"
# headers and members of an archive, of which sound ones have fewer
MOST_HEADER, MOST_MEMBERS = 10_000, 1000
# how packing.nfo names the numbers of a packing
NFO = re.compile(
    r"(?im)^\s*(dimensions|final porosity|theoretical porosity)\s*:?((?:[ \t]+[-+0-9.e]+)+)"
)
# arrays of an NPZ file that are centres
POSITIONS = ("position", "positions", "pos", "points", "centers", "centres")
# what libraries raise for damaged files
DAMAGED: tuple[type[Exception], ...] = (
    *(zipfile.BadZipFile, OSError, ValueError, MemoryError),
    *(NotImplementedError, EOFError, KeyError, RuntimeError, zlib.error, lzma.LZMAError),
)


@contextmanager
def _told(path: Path, kind: str) -> Iterator[None]:
    """Turn the errors of a library into those of the file."""
    try:
        yield
    except Exception as error:
        if not isinstance(error, DAMAGED) and not type(error).__module__.startswith("pyarrow"):
            raise
        reason = str(error).partition("\n")[0][:200] or type(error).__name__
        raise ReadError(f"{path}: cannot be read as {kind}: {reason}") from None


def binary_names(path: Path) -> list[str] | None:
    """The names of the columns of a binary table; None if the file is no such table."""
    head = first_bytes(path, 8)
    if is_xyzd(path):  # doubles may begin as any other file does
        return ["x", "y", "z", "diameter"]
    if head.startswith(IS_PARQUET):
        with _told(path, "Parquet"):
            return list(_parquet(path).schema_arrow.names)
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


def _read_parquet(path: Path) -> Arrays:
    with _told(path, "Parquet"):
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


def _parts(name: str, shape: tuple[int, ...]) -> list[str]:
    """The names of the columns of an array of an NPZ file; none if it cannot be columns."""
    if len(shape) == 2 and shape[1] <= 9:
        if name.lower() in POSITIONS:
            return list("xyz"[: shape[1]])
        if name.lower() in ("pairs", "contacts", "ids") and shape[1] == 2:
            return ["id1", "id2"]
        return [f"{name}_{axis}" for axis in ("xyz" if shape[1] == 3 else range(shape[1]))]
    return [name] if len(shape) == 1 else []


def npz_shapes(path: Path) -> dict[str, tuple[int, ...]]:
    """The shapes of the arrays of numbers and text in an NPZ file, by name."""
    with _told(path, "NPZ"), zipfile.ZipFile(plain(path)) as archive:
        return {name: shape for name, (shape, _) in _members(path, archive).items()}


def read_npz(path: Path, wanted: Iterable[str] | None = None) -> Arrays:
    """The arrays of numbers and text in an NPZ file, those wanted; pickled objects are refused."""
    with _told(path, "NPZ"), zipfile.ZipFile(plain(path)) as archive:
        members = {name: info for name, (_, info) in _members(path, archive).items()}
        if wanted is not None:
            members = {name: members[name] for name in members.keys() & set(wanted)}
        room = float(sum(info.file_size for info in members.values()))
        check_times(path, plain(path).stat().st_size, room)
        check_memory(path, 2.0 * room)
        arrays: Arrays = {}
        for name, info in members.items():
            with archive.open(info) as stream:
                arrays[name] = np.lib.format.read_array(
                    stream, allow_pickle=False, max_header_size=MOST_HEADER
                )
        return arrays


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
        raise ReadError(
            f"{path}: expected rows of four doubles, 32 bytes each, {found}: the file is no .xyzd, "
            f"or incomplete"
        )
    check_memory(path, 3.0 * size)
    x, y, z, diameter = np.fromfile(file, "<f8").reshape(-1, 4).astype(np.float64).T
    info = _nfo(path)
    if info is None:
        warnings.warn(
            f"{path}: there is no packing.nfo beside the file, which says by how much "
            f"PackingGeneration means diameters to be scaled: they are taken as they stand",
            ScanfabWarning,
            stacklevel=2,
        )
        return {"x": x, "y": y, "z": z, "diameter": diameter}
    # without a porosity, or with one that is no fraction, the factor is not finite
    final, theoretical = (
        1.0 - info.get(f"{one} porosity", [1.0])[0] for one in ("final", "theoretical")
    )
    factor = (final / theoretical) ** (1 / 3) if final > 0 and theoretical > 0 else np.nan
    if not 0.5 < factor < 2.0:
        raise ReadError(
            f"{path.with_name('packing.nfo')}: expected a theoretical and a final porosity between "
            f"0 and 1, by which the diameters of {path.name} are scaled"
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
    found: dict[str, list[float]] = {}
    for key, words in NFO.findall(info.read_bytes()[:10_000].decode("utf-8", "replace")):
        try:
            found.setdefault(key.lower(), [float(word) for word in words.split()])
        except ValueError:  # as if the line was not there
            continue
    return found
