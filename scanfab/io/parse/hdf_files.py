"""The arrays and attributes of an HDF5 file, by h5py; runs behind the fence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

# filters that HDF5 and h5py have themselves: another one would be looked for on the disk, and run
FILTERS = {1, 2, 3, 4, 5, 6, 32000}  # deflate, shuffle, fletcher32, szip, nbit, scaleoffset, lzf
MOST_OBJECTS = 100_000


def read_hdf(path: str, most: int, with_data: bool) -> tuple[dict[str, Any], dict[str, Any]]:
    """
    All datasets of numbers and texts by their paths, and the attributes of all groups.

    Parameters
    ----------
    path : str
        The file.
    most : int
        Bytes that the datasets may fill together.
    with_data : bool
        Without it all arrays are empty, but for their names and types.

    Raises
    ------
    ValueError
        If data stand in other files, are packed by foreign code, or fill too much.
    """
    import h5py

    arrays: dict[str, Any] = {}
    words: dict[str, Any] = {}
    left, met = most, 0

    def walk(group: Any, name: str) -> None:
        nonlocal left, met
        words[name] = _attributes(group)
        for key in group:
            met += 1
            if met > MOST_OBJECTS or name.count("/") > 32:
                raise ValueError("too many objects for a frame")
            link = group.get(key, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                raise ValueError(f"{name}/{key} stands in another file ({link.filename})")
            if isinstance(link, h5py.SoftLink):
                continue  # another name of what is met elsewhere
            here = f"{name}/{key}".lstrip("/")
            one = group[key]
            if isinstance(one, h5py.Group):
                walk(one, here)
            elif isinstance(one, h5py.Dataset):
                _check_own(one, here)
                left -= one.size * max(one.dtype.itemsize, 1) if one.size else 0
                if left < 0:
                    raise ValueError(f"its arrays fill more than {most:,} bytes")
                found = _values(one, with_data)
                if found is not None:
                    arrays[here] = found
                    words[here] = {"shape": [int(n) for n in one.shape], **_attributes(one)}

    with h5py.File(Path(path), "r") as file:
        walk(file, "")
    return arrays, words


def _check_own(one: Any, name: str) -> None:
    """ValueError if the data are in other files, or only foreign code can unpack them."""
    if one.is_virtual or one.external:
        raise ValueError(f"the data of {name} stand in another file")
    properties = one.id.get_create_plist()
    used = {properties.get_filter(k)[0] for k in range(properties.get_nfilters())}
    if not used <= FILTERS:
        raise ValueError(f"{name} is packed by a filter ({max(used - FILTERS)}) that is not HDF5's")


def _values(one: Any, with_data: bool) -> npt.NDArray[Any] | None:
    """Numbers as they are stored, texts as numpy has them; None for anything else."""
    import h5py

    if one.shape is None:
        return None
    text = h5py.check_string_dtype(one.dtype)
    if text is None and one.dtype.kind not in "biuf":
        return None
    if not with_data:
        return np.zeros(0, one.dtype if text is None else "U1")
    if text is not None:
        return np.array(one.asstr(errors="replace")[()], dtype=str)
    values: npt.NDArray[Any] = np.asarray(one[()])
    return values.astype(values.dtype.newbyteorder("="))


def _attributes(one: Any) -> dict[str, Any]:
    """Attributes that are numbers or texts."""
    found = {}
    for name in list(one.attrs)[:1000]:
        try:
            value = one.attrs[name]
        except (OSError, TypeError, ValueError):
            continue
        if isinstance(value, bytes):
            found[name] = value.decode("utf-8", "replace")
        elif isinstance(value, str):
            found[name] = value
        elif isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biuf":
            if value.size < 1000:
                found[name] = value.tolist()
        elif isinstance(value, np.bytes_):
            found[name] = value.decode("utf-8", "replace")
    return found
