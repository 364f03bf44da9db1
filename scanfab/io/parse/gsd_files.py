"""One frame of a GSD file (HOOMD's schema), by gsd; runs behind the fence."""

from __future__ import annotations

from typing import Any

import numpy as np

STEP = "configuration/step"
GROUPS = ("particles/", "configuration/", "log/particles/")


def read_gsd(path: str, most: int, frame: int | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """
    The chunks of a frame that were written, there or in the first frame.

    Parameters
    ----------
    path : str
        The file.
    most : int
        Bytes that the chunks may fill together.
    frame : int or None
        Which frame; None: the steps of all frames, and which chunks there are.

    Raises
    ------
    ValueError
        If it is no file of HOOMD's schema, or its chunks fill too much.
    """
    import gsd.fl

    arrays: dict[str, Any] = {}
    with gsd.fl.open(path, mode="r") as file:
        if file.schema != "hoomd":
            raise ValueError(f"its schema is {file.schema!r}, expected 'hoomd'")
        names = [name for name in file.find_matching_chunk_names("") if name.startswith(GROUPS)]
        words = {"frames": int(file.nframes), "names": names}
        for number in range(file.nframes) if frame is None else [frame]:
            for name in [STEP] if frame is None else names:
                # what does not change stands in the first frame alone
                where = next(
                    (one for one in (number, 0) if file.chunk_exists(frame=one, name=name)), None
                )
                if where is None:
                    continue
                values = np.asarray(file.read_chunk(frame=where, name=name))
                most -= values.nbytes
                if most < 0:
                    raise ValueError("its chunks fill more memory than such a file can hold")
                if values.dtype.kind in "biuf":
                    arrays[f"{number}" if frame is None else name] = values
    return arrays, words
