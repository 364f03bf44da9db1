"""Read HDF5 files by h5py into arrays and attributes, by the paths of groups and datasets."""

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
    return head.startswith(MAGIC)


def read_hdf_file(path: Path, with_data: bool = True) -> HdfFile:
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
    return fenced(read_in_worker, path, with_data)


def read_in_worker(path: str, with_data: bool) -> HdfFile:
    """Read arrays and attributes, in the worker process; ValueError says what is wrong."""
    import h5py

    content = HdfFile({}, {})
    with h5py.File(path, "r") as file:
        waiting = [("", file)]
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
