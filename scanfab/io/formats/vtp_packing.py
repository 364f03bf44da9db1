"""What scanfab alone writes into VTK files: cell, step, images and forces of contacts."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError, ReadError
from scanfab.io.files import first_bytes
from scanfab.io.mesh import Mesh
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList

KNOWN = "scanfab_contacts"
MOMENT = re.compile(
    rb'Name="(TimeValue|scanfab_step)"[^>]*format="ascii"[^>]*>\s*([-+.\deE]{1,30})\s*<'
)
# the field data stand within so many bytes
HEAD = 1 << 14


def moment_of(path: Path) -> tuple[int | None, float | None]:
    """Step and time, where the head of an XML file names them as text."""
    found = dict(MOMENT.findall(first_bytes(path, HEAD)))
    try:
        step = int(found[b"scanfab_step"]) if b"scanfab_step" in found else None
        return step, float(found[b"TimeValue"]) if b"TimeValue" in found else None
    except ValueError:
        return None, None


def says_all(path: Path) -> bool:
    """Whether the head of a file is that of a packing, of which nothing else need be asked."""
    return KNOWN.encode() in first_bytes(path, HEAD)


def is_packing(mesh: Mesh) -> bool:
    """Whether the file says all that there is to say, contacts and cell as well."""
    return KNOWN in mesh.field_arrays


def cell_of(path: Path, mesh: Mesh) -> Cell | None:
    """The cell of a packing."""
    if "scanfab_cell" not in mesh.field_arrays:
        return None
    vectors = _numbers(path, mesh, "scanfab_cell", 9).reshape(3, 3)
    along = _numbers(path, mesh, "scanfab_periodic", 3) != 0
    try:
        return Cell(
            vectors,
            (bool(along[0]), bool(along[1]), bool(along[2])),
            _numbers(path, mesh, "scanfab_origin", 3),
        )
    except PackingError as error:
        raise ReadError(f"{path}: {error}") from None


def _numbers(path: Path, mesh: Mesh, name: str, count: int) -> npt.NDArray[Any]:
    values = mesh.field_arrays.get(name)
    if values is None or values.size != count or values.dtype.kind not in "iuf":
        raise ReadError(f"{path}: {name}: expected {count} numbers")
    return values.ravel()


def contacts_of(path: Path, mesh: Mesh) -> ContactList | None:
    """The contacts of a packing; None if they were not known."""
    if not _numbers(path, mesh, KNOWN, 1)[0]:
        return None
    arrays, count = mesh.line_arrays, len(mesh.lines)
    for name, shape in (("image", (count, 3)), ("force", (count, 3)), ("force_n", (count,))):
        if name in arrays and (arrays[name].shape != shape or arrays[name].dtype.kind not in "iuf"):
            raise ReadError(f"{path}: {name}: expected numbers of shape {shape}")
    force = arrays.get("force")
    image = arrays.get("image", np.zeros((count, 3), np.int64))
    return ContactList(
        mesh.lines,
        image.astype(np.int64),
        force,
        force_n=None if force is not None else arrays.get("force_n"),
    )
