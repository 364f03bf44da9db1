"""Binary files of arrays: Parquet, NPZ, ``.xyzd`` and HDF5. Reading them never runs code."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scanfab.base.errors import PackingError, ReadError, note, warn
from scanfab.base.typing import Columns
from scanfab.io.fence import fenced
from scanfab.io.files import bare_name, first_bytes, plain
from scanfab.io.writer import flat
from scanfab.packing.cell import Cell

IS_PARQUET = b"PAR1"
IS_NPZ = b"PK"
IS_HDF = b"\x89HDF\r\n\x1a\n"
# numpy's kinds of arrays with numbers or text
KINDS = "biufU"
# the lines of packing.nfo that are read: a name and numbers
NFO = re.compile(
    r"(?im)^\s*(dimensions|final porosity|theoretical porosity)\s*:?"
    r"((?:[ \t]+[-+]?[0-9]+\.?[0-9]*(?:e[-+]?[0-9]+)?(?![^\s,;]))+)"
)
POROSITIES = ("final porosity", "theoretical porosity")


def binary_names(path: Path) -> list[str] | None:
    """The names of the columns of a binary table; None if the file is not a binary table."""
    if is_xyzd(path):  # first, because its bytes may look like any other file
        return ["x", "y", "z", "diameter"]
    head = first_bytes(path, 8)
    if head.startswith(IS_PARQUET):
        return [*fenced(parquet_in_worker, path, 0)]
    return [*read_binary(path)] if head.startswith(IS_NPZ) else None


def read_binary(path: Path) -> Columns:
    """The columns of a binary table that hold numbers or text."""
    if is_xyzd(path):
        return _read_xyzd(path)
    if first_bytes(path, 8).startswith(IS_PARQUET):
        return fenced(parquet_in_worker, path, None)
    columns = flat(read_npz(path))
    # arrays that do not have one row per grain are left out
    rows = len(columns["x"]) if "x" in columns else max(map(len, columns.values()), default=0)
    return {name: values for name, values in columns.items() if len(values) == rows}


def parquet_in_worker(path: str, rows: int | None) -> Columns:
    """The columns of numbers or text in a Parquet file, in the worker process."""
    import polars

    columns: Columns = {}
    for column in polars.read_parquet(path, n_rows=rows):
        is_text = column.dtype == polars.String
        values = np.array(column.fill_null("").to_list(), str) if is_text else column.to_numpy()
        columns |= {column.name: values} if values.dtype.kind in KINDS else {}
    return columns


def read_npz(path: Path, *wanted: str) -> Columns:
    """The arrays of numbers and text in an NPZ file, or the wanted ones; never pickled objects."""
    return fenced(npz_in_worker, path, wanted)


def npz_in_worker(path: str, wanted: tuple[str, ...]) -> Columns:
    """The arrays in an NPZ file, in the worker process."""
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files if name in wanted or not wanted}
    return {name: values for name, values in arrays.items() if values.dtype.kind in KINDS}


def is_xyzd(path: Path) -> bool:
    """Whether the name ends in .xyzd; the content is plain doubles and cannot be recognised."""
    return bare_name(path).lower().endswith(".xyzd")


def _read_xyzd(path: Path) -> Columns:
    """The columns x, y, z and diameter of a binary packing of PackingGeneration."""
    file = plain(path)
    size = file.stat().st_size
    if size == 0 or size % 32:
        found = f"found {size} bytes" if size else "the file is empty"
        raise ReadError(f"{path}: expected whole rows of four doubles, 32 bytes each, {found}")
    x, y, z, diameter = np.fromfile(file, "<f8").reshape(-1, 4).astype(np.float64).T
    info = packing_info(path)
    if info is None:
        warn(f"{path}: diameters are not scaled, since there is no packing.nfo beside the file")
        return {"x": x, "y": y, "z": z, "diameter": diameter}
    note(f"{path}: diameters are multiplied by {info[0]:.6g}, from the porosities in packing.nfo")
    return {"x": x, "y": y, "z": z, "diameter": info[0] * diameter}


def packing_info(path: Path) -> tuple[float, Cell] | None:
    """
    The factor of the diameters, and the periodic cell, from ``packing.nfo``; None without the file.

    The program writes the initial diameters. The final diameters are larger by the factor
    ((1 - final porosity) / (1 - theoretical porosity))^(1/3).
    """
    info = path.with_name("packing.nfo")
    if not info.is_file():
        return None
    text = info.read_bytes()[:10_000].decode("utf-8", "replace")
    found = {key.lower(): [float(w) for w in words.split()] for key, words in NFO.findall(text)}
    try:
        final, theory = (1.0 - found[name][0] for name in POROSITIES)
        return max(final / theory, 0.0) ** (1 / 3), Cell(found["dimensions"])
    except (LookupError, ArithmeticError, PackingError) as error:
        raise ReadError(f"{info}: expected the dimensions and both porosities: {error}") from None


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
