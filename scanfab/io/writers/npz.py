"""Packings as arrays of NumPy (``.npz``)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scanfab.io.writer import Left
from scanfab.io.written import own_columns, standard_columns
from scanfab.packing.packing import Packing

# which makes it a packing, and not any arrays; its value is the version of the layout
MARK = "scanfab_packing"
# before the names of the columns of the grains
COLUMN = "columns/"


class NpzWriter:
    """Arrays named as a :class:`scanfab.Packing` names them."""

    name = "npz"
    description = "arrays of NumPy, named as those of a Packing"
    extensions = (".npz",)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; it holds everything."""
        own, notes = own_columns(packing)
        arrays: dict[str, Any] = {
            MARK: 1,
            "position": packing.position,
            "radius": packing.radius,
            **standard_columns(packing),
            **{f"{COLUMN}{name}": values for name, values in own.items()},
        }
        if packing.step is not None:
            arrays["step"] = packing.step
        if packing.time is not None:
            arrays["time"] = packing.time
        if packing.cell is not None:
            arrays["cell"] = packing.cell.vectors
            arrays["origin"] = packing.cell.origin
            arrays["periodic"] = np.array(packing.cell.periodic)
        contacts = packing.contacts
        if contacts is not None:
            arrays["pairs"] = contacts.pairs
            arrays["image"] = contacts.image
            if contacts.force is not None:
                arrays["force"] = contacts.force
            elif contacts.force_n is not None:
                arrays["force_n"] = contacts.force_n
        with open(path, "wb") as stream:
            np.savez_compressed(stream, **arrays)
        return Left(no_step=False, notes=tuple(notes))
