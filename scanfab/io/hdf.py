"""HDF5 files by h5py: their arrays and attributes, by the paths of groups and datasets."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scanfab.base.typing import Columns
from scanfab.io.fence import fenced

MAGIC = b"\x89HDF\r\n\x1a\n"


class HdfFile(NamedTuple):
    """Arrays and attributes of a file, by the paths of their groups and datasets."""

    arrays: Columns
    attributes: dict[str, dict[str, Any]]

    def below(self, group: str) -> Columns:
        """The arrays that stand directly in a group, by their names; single numbers are none."""
        named = ((name, values) for name, values in self.arrays.items() if values.ndim)
        found = ((name.rpartition("/"), values) for name, values in named)
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
        If the file is damaged, or if data stand in other files.
    """
    return fenced(read_in_worker, path, with_data)


def read_in_worker(path: str, with_data: bool) -> HdfFile:
    """Arrays and attributes; ValueError says what cannot be read."""
    import h5py

    found = HdfFile({}, {})
    with h5py.File(path, "r") as file:
        waiting = [("", file)]
        while waiting:
            name, one = waiting.pop(0)
            if isinstance(one, h5py.Dataset) and one.shape is not None:
                _take(name, one, with_data, found.arrays)
            found.attributes[name] = _attributes(one)
            for key in one if isinstance(one, h5py.Group) else ():
                here, link = f"{name}/{key}".lstrip("/"), one.get(key, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    raise ValueError(f"{here} stands in another file ({link.filename})")
                if isinstance(link, h5py.HardLink):
                    waiting.append((here, one[key]))
    return found


def _take(name: str, one: Any, with_data: bool, arrays: Columns) -> None:
    """Put the values of a dataset into `arrays` if they are numbers or texts."""
    import h5py

    if one.is_virtual or one.external:
        raise ValueError(f"the data of {name} stand in another file")
    if h5py.check_string_dtype(one.dtype) is not None:
        arrays[name] = np.array(one.asstr(errors="replace")[()] if with_data else [], dtype=str)
    elif one.dtype.kind in "biuf":
        values = np.asarray(one[()]) if with_data else np.zeros(0, one.dtype)
        arrays[name] = values.astype(values.dtype.newbyteorder("="), copy=False)


def _attributes(one: Any) -> dict[str, Any]:
    """The attributes that are numbers or texts; h5py does not know all other types."""
    found: dict[str, Any] = {}
    for name in one.attrs:
        with suppress(OSError, TypeError, ValueError, AttributeError):
            value = one.attrs[name]
            if isinstance(value, bytes):
                found[name] = value.decode("utf-8", "replace")
            elif isinstance(value, str) or value.dtype.kind in "biuf":
                found[name] = value if isinstance(value, str) else value.tolist()
    return found
