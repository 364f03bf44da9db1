"""Binary files of arrays: Parquet, NPZ, ``.xyzd`` and HDF5. Reading them never runs code."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scanfab.base.errors import PackingError, ReadError, note, warn
from scanfab.base.typing import Columns
from scanfab.io.fence import fenced
from scanfab.io.files import bare_name, check_memory, check_times, first_bytes, plain
from scanfab.packing.cell import Cell

IS_PARQUET = b"PAR1"
IS_NPZ = b"PK"
IS_HDF = b"\x89HDF\r\n\x1a\n"
# longest header of an array, in characters
MOST_HEADER = 10_000
# numpy's kinds of arrays with numbers or text
KINDS = "biufU"
# the lines of packing.nfo that are read: a name and numbers
NFO = re.compile(
    r"(?im)^\s*(dimensions|final porosity|theoretical porosity)\s*:?"
    r"((?:[ \t]+[-+]?[0-9]+\.?[0-9]*(?:e[-+]?[0-9]+)?(?![^\s,;]))+)"
)
POROSITIES = ("final porosity", "theoretical porosity")
# names of arrays in an NPZ file that hold centres, and names of arrays that hold pairs
POSITIONS = ("position", "positions", "pos", "points", "centers", "centres")
PAIRS = ("pairs", "contacts", "ids")


def binary_names(path: Path) -> list[str] | None:
    """The names of the columns of a binary table; None if the file is not a binary table."""
    if is_xyzd(path):  # first, because its bytes may look like any other file
        return ["x", "y", "z", "diameter"]
    head = first_bytes(path, 8)
    if head.startswith(IS_PARQUET):
        with _told(path, "Parquet"):
            return list(_open_parquet(path).schema_arrow.names)
    if head.startswith(IS_NPZ):
        return [part for name, shape in npz_shapes(path).items() for part in _parts(name, shape)]
    return None


def read_binary(path: Path) -> Columns:
    """The columns of a binary table that hold numbers or text."""
    if is_xyzd(path):
        return _read_xyzd(path)
    if first_bytes(path, 8).startswith(IS_PARQUET):
        with _told(path, "Parquet"):
            return _read_parquet(path)
    columns: Columns = {}
    for name, values in read_npz(path).items():
        parts = _parts(name, values.shape)
        columns |= dict(zip(parts, values.T if values.ndim == 2 else [values], strict=False))
    # arrays that do not have one row per grain are left out
    rows = len(columns["x"]) if "x" in columns else max(map(len, columns.values()), default=0)
    return {name: values for name, values in columns.items() if len(values) == rows}


@contextmanager
def _told(path: Path, kind: str) -> Iterator[None]:
    """Turn any error of a library into a ReadError that names the file."""
    try:
        yield
    except ReadError:
        raise
    # for a damaged file, libraries raise errors of any type
    except Exception as error:
        reason = str(error).partition("\n")[0][:200] or type(error).__name__
        raise ReadError(f"{path}: cannot be read as {kind}: {reason}") from None


def _open_parquet(path: Path) -> Any:
    from pyarrow import parquet

    return parquet.ParquetFile(plain(path), thrift_string_size_limit=1 << 20)


def _read_parquet(path: Path) -> Columns:
    columns: Columns = {}
    file = _open_parquet(path)
    names = file.schema_arrow.names
    _check_room(path, 8.0 * file.metadata.num_rows * len(names))
    for name, column in zip(names, file.read().columns, strict=True):
        values = column.to_numpy()
        if values.dtype == object and all(isinstance(word, str | None) for word in values):
            values = np.array([word or "" for word in values], dtype=np.str_)
        if values.dtype.kind in KINDS:
            columns[name] = values
    return columns


def _check_room(path: Path, room: float) -> None:
    """ReadError if a file claims more bytes than its size or the memory allows."""
    check_times(path, plain(path).stat().st_size, room)
    check_memory(path, 2.0 * room)


def _parts(name: str, shape: tuple[int, ...]) -> list[str]:
    """The names of the columns in an array of an NPZ file; empty if its shape fits no table."""
    if len(shape) != 2 or shape[1] > 9:
        return [name] if len(shape) == 1 else []
    axes = list("xyz"[: shape[1]]) if shape[1] < 4 else [f"{k}" for k in range(shape[1])]
    is_pair = name.lower() in PAIRS and shape[1] == 2
    parts = axes if name.lower() in POSITIONS else ["id1", "id2"] if is_pair else None
    return parts or [f"{name}_{axis}" for axis in axes]


def npz_shapes(path: Path) -> dict[str, tuple[int, ...]]:
    """The shapes of the arrays of numbers and text in an NPZ file."""
    shapes, form = {}, np.lib.format
    read = {(1, 0): form.read_array_header_1_0, (2, 0): form.read_array_header_2_0}
    with _told(path, "NPZ"), zipfile.ZipFile(plain(path)) as archive:
        for name in (member for member in archive.namelist() if member.endswith(".npy")):
            with archive.open(name) as stream:
                shape, _, dtype = read[form.read_magic(stream)](stream, MOST_HEADER)
            if dtype.kind in KINDS:
                shapes[name.removesuffix(".npy")] = shape
    return shapes


def read_npz(path: Path, wanted: Iterable[str] | None = None) -> Columns:
    """The arrays of numbers and text in an NPZ file, or the wanted ones; never pickled objects."""
    names = [name for name in npz_shapes(path) if wanted is None or name in wanted]
    with _told(path, "NPZ"), np.load(plain(path), max_header_size=MOST_HEADER) as archive:
        _check_room(path, float(sum(member.file_size for member in archive.zip.infolist())))
        return {name: archive[name] for name in names}


def is_xyzd(path: Path) -> bool:
    """Whether the name ends in .xyzd; the content is plain doubles and cannot be recognised."""
    return bare_name(path).lower().endswith(".xyzd")


def _read_xyzd(path: Path) -> Columns:
    """
    The columns x, y, z and diameter of a binary packing of PackingGeneration.

    The program writes the initial diameters. The final diameters are larger by the factor
    ((1 - final porosity) / (1 - theoretical porosity))^(1/3); ``packing.nfo`` has both porosities.
    """
    file = plain(path)
    size = file.stat().st_size
    if size == 0 or size % 32:
        found = f"found {size} bytes" if size else "the file is empty"
        raise ReadError(f"{path}: expected whole rows of four doubles, 32 bytes each, {found}")
    check_memory(path, 3.0 * size)
    x, y, z, diameter = np.fromfile(file, "<f8").reshape(-1, 4).astype(np.float64).T
    info, factor = _nfo(path), 1.0
    if info is None:
        warn(f"{path}: diameters are not scaled, since there is no packing.nfo beside the file")
    else:
        final, theory = (1.0 - info.get(name, [1.0])[0] for name in POROSITIES)
        factor = (final / theory) ** (1 / 3) if min(final, theory) > 0 else np.nan
        if not 0.5 < factor < 2.0:
            expected = "theoretical and final porosities between 0 and 1 to scale the diameters"
            raise ReadError(f"{path.with_name('packing.nfo')}: expected {expected}")
    if factor != 1.0:
        change = f"diameters are multiplied by {factor:.6g}, from the porosities in packing.nfo"
        note(f"{path}: {change}")
    return {"x": x, "y": y, "z": z, "diameter": factor * diameter}


def xyzd_cell(path: Path) -> Cell | None:
    """The cell, periodic along all axes, from the dimensions in ``packing.nfo``."""
    edges = (_nfo(path) or {}).get("dimensions", [])
    try:
        return Cell(edges) if len(edges) == 3 else None
    except PackingError as error:
        raise ReadError(f"{path.with_name('packing.nfo')}: Dimensions: {error}") from None


def _nfo(path: Path) -> dict[str, list[float]] | None:
    """The numbers in the file ``packing.nfo`` of a packing, by name; None without the file."""
    info = path.with_name("packing.nfo")
    if not info.is_file():
        return None
    matches = NFO.findall(info.read_bytes()[:10_000].decode("utf-8", "replace"))
    return {key.lower(): [float(word) for word in words.split()] for key, words in matches}


class HdfFile(NamedTuple):
    """Arrays and attributes of a file, by the paths of their groups and datasets."""

    arrays: Columns
    attributes: dict[str, dict[str, Any]]

    def below(self, group: str) -> Columns:
        """The arrays directly in a group, by name, without single numbers."""
        named = ((name, values) for name, values in self.arrays.items() if values.ndim)
        placed = ((name.rpartition("/"), values) for name, values in named)
        return {name: values for (place, _, name), values in placed if place == group}

    def groups(self, group: str) -> list[str]:
        """The names of the groups directly in a group."""
        placed = (name.rpartition("/") for name in self.attributes if name not in self.arrays)
        return [name for place, _, name in placed if place == group and name]


def is_hdf(head: bytes) -> bool:
    """Whether a file starts with the mark of HDF5."""
    return head.startswith(IS_HDF)


def read_hdf_file(path: Path, with_data: bool = True, group: str = "") -> HdfFile:
    """
    Read all datasets of numbers and texts, and the attributes of all groups and datasets.

    Parameters
    ----------
    path : Path
        The file.
    with_data : bool
        If False, all arrays are empty, but have the names and types of the file.

    Raises
    ------
    ReadError
        If the file is damaged, or if its data are in other files.
    """
    return fenced(read_in_worker, path, with_data, group)


def read_in_worker(path: str, with_data: bool, group: str) -> HdfFile:
    """Read arrays and attributes, in the worker process; ValueError says what is wrong."""
    import h5py

    content = HdfFile({}, {})
    with h5py.File(path, "r") as file:
        waiting = [(group, file[group or "/"])]
        while waiting:
            name, node = waiting.pop(0)
            if isinstance(node, h5py.Dataset) and node.shape is not None:
                _take(name, node, with_data, content.arrays)
            content.attributes[name] = _attributes(node)
            for key in node if isinstance(node, h5py.Group) else ():
                here, link = f"{name}/{key}".lstrip("/"), node.get(key, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    raise ValueError(f"{here} is in another file ({link.filename})")
                if isinstance(link, h5py.HardLink):
                    waiting.append((here, node[key]))
    return content


def _take(name: str, dataset: Any, with_data: bool, arrays: Columns) -> None:
    """Add the values of a dataset to `arrays` if they are numbers or texts."""
    import h5py

    if dataset.is_virtual or dataset.external:
        raise ValueError(f"the data of {name} are in another file")
    if h5py.check_string_dtype(dataset.dtype) is not None:
        arrays[name] = np.array(dataset.asstr(errors="replace")[()] if with_data else [], dtype=str)
    elif dataset.dtype.kind in "biuf":
        values = np.asarray(dataset[()]) if with_data else np.zeros(0, dataset.dtype)
        arrays[name] = values.astype(values.dtype.newbyteorder("="), copy=False)


def _attributes(node: Any) -> dict[str, Any]:
    """The attributes that are numbers or texts; h5py cannot read some other types."""
    attributes: dict[str, Any] = {}
    for name in node.attrs:
        with suppress(OSError, TypeError, ValueError, AttributeError):
            value = node.attrs[name]
            if isinstance(value, bytes):
                attributes[name] = value.decode("utf-8", "replace")
            elif isinstance(value, str) or value.dtype.kind in "biuf":
                attributes[name] = value if isinstance(value, str) else value.tolist()
    return attributes
