"""HDF5 files by h5py: their arrays and attributes, by the paths of groups and datasets."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scanfab.io.fence import fenced

MAGIC = b"\x89HDF\r\n\x1a\n"
# filters that are part of HDF5 and h5py; for any other one, HDF5 would load code from the disk
FILTERS = {1, 2, 3, 4, 5, 6, 32000}  # deflate, shuffle, fletcher32, szip, nbit, scaleoffset, lzf


class HdfFile(NamedTuple):
    """Arrays and attributes of a file, by the paths of their groups and datasets."""

    arrays: dict[str, npt.NDArray[Any]]
    attributes: dict[str, dict[str, Any]]

    def below(self, group: str) -> dict[str, npt.NDArray[Any]]:
        """The arrays that stand directly in a group, by their names."""
        found = ((name.rpartition("/"), values) for name, values in self.arrays.items())
        return {name: values for (place, _, name), values in found if place == group}

    def groups(self, group: str) -> list[str]:
        """The names of the groups that stand directly in a group."""
        found = (name.rpartition("/") for name in self.attributes if name not in self.arrays)
        return [name for place, _, name in found if place == group and name]


def is_hdf(head: bytes) -> bool:
    """Whether a file starts as HDF5 does."""
    return head.startswith(MAGIC)


def read_hdf_file(path: Path, with_data: bool = True) -> HdfFile:
    """
    All datasets of numbers and texts, and the attributes of all groups and datasets.

    Parameters
    ----------
    path : Path
        The file.
    with_data : bool
        If False, all arrays are empty; their names and types are those of the file.

    Raises
    ------
    ReadError
        If the file is damaged, if data stand in other files, or if foreign code would have to
        unpack them.
    """
    return fenced(read_in_worker, path, with_data)


def read_in_worker(path: str, with_data: bool) -> HdfFile:
    """Arrays and attributes; ValueError says what cannot be read."""
    import h5py

    arrays, attributes = HdfFile({}, {})
    with h5py.File(path, "r") as file:
        waiting = [("", file)]
        while waiting:
            name, group = waiting.pop(0)
            attributes[name] = _attributes(group)
            for key in group:
                here = f"{name}/{key}".lstrip("/")
                link = group.get(key, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    raise ValueError(f"{here} stands in another file ({link.filename})")
                one = None if isinstance(link, h5py.SoftLink) else group[key]
                if isinstance(one, h5py.Group):
                    waiting.append((here, one))
                elif isinstance(one, h5py.Dataset) and one.shape is not None:
                    _take(here, one, with_data, arrays)
                    attributes[here] = _attributes(one)
    return HdfFile(arrays, attributes)


def _take(name: str, one: Any, with_data: bool, arrays: dict[str, npt.NDArray[Any]]) -> None:
    """Put the values of a dataset into `arrays` if they are numbers or texts."""
    import h5py

    if one.is_virtual or one.external:
        raise ValueError(f"the data of {name} stand in another file")
    properties = one.id.get_create_plist()
    used = {properties.get_filter(k)[0] for k in range(properties.get_nfilters())}
    if not used <= FILTERS:
        raise ValueError(f"{name} is packed by a filter ({max(used - FILTERS)}) that is not HDF5's")
    if h5py.check_string_dtype(one.dtype) is not None:
        text = one.asstr(errors="replace")[()] if with_data else []
        arrays[name] = np.array(text, dtype=str)
    elif one.dtype.kind in "biuf":
        values = np.asarray(one[()]) if with_data else np.zeros(0, one.dtype)
        arrays[name] = values.astype(values.dtype.newbyteorder("="), copy=False)


def _attributes(one: Any) -> dict[str, Any]:
    """The attributes that are numbers or texts; h5py does not know all other types."""
    found: dict[str, Any] = {}
    for name in one.attrs:
        with suppress(OSError, TypeError, ValueError):
            value = one.attrs[name]
            if isinstance(value, bytes | str):
                found[name] = value if isinstance(value, str) else value.decode("utf-8", "replace")
            elif isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biuf":
                found[name] = value.tolist()
    return found
