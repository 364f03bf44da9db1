"""The variables of one frame of a NetCDF file, by netCDF4; runs behind the fence."""

from __future__ import annotations

from typing import Any

import numpy as np

FRAME = "frame"


def read_netcdf(path: str, most: int, frame: int | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """
    All variables of numbers, as they are stored, and the names of their dimensions.

    Parameters
    ----------
    path : str
        The file.
    most : int
        Bytes that the variables may fill together.
    frame : int or None
        Which record of the dimension ``frame``; None: those variables that have no other
        dimension, with all records.

    Raises
    ------
    ValueError
        If the variables fill too much, or there is no such record.
    """
    import netCDF4

    arrays: dict[str, Any] = {}
    words: dict[str, Any] = {"dimensions": {}, "scale": {}}
    with netCDF4.Dataset(path, "r") as file:
        # a fill value is what was never written: it must be seen as it is
        file.set_auto_maskandscale(False)
        words["convention"] = str(getattr(file, "Conventions", ""))
        words["program"] = str(getattr(file, "program", ""))
        count = len(file.dimensions[FRAME]) if FRAME in file.dimensions else 0
        words["frames"] = count
        if frame is not None and not 0 <= frame < count:
            raise ValueError(f"there is no frame {frame} among {count}")
        for name, variable in file.variables.items():
            kept = tuple(variable.dimensions)
            if variable.dtype is str or variable.dtype.kind not in "iuf":
                continue
            if (frame is None) != (kept == (FRAME,)) or kept[:1] != (FRAME,):
                words["dimensions"][name] = kept
                continue
            shape = variable.shape if frame is None else variable.shape[1:]
            most -= int(np.prod(shape, dtype=np.float64)) * variable.dtype.itemsize
            if most < 0:
                raise ValueError("its variables fill more memory than a file of this size can hold")
            values = np.asarray(variable[:] if frame is None else variable[frame])
            arrays[name] = values.astype(values.dtype.newbyteorder("="))
            words["dimensions"][name] = kept
            scale = getattr(variable, "scale_factor", None)
            if isinstance(scale, float | np.floating):
                words["scale"][name] = float(scale)
    return arrays, words
