"""Packings as ON-DEM's VTKHDF, draft 0.1; what the draft has no name for has a name of ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scanfab.io.writer import Columns, Left, as_arrays
from scanfab.packing.contacts import Contacts
from scanfab.packing.packing import Packing

SCENE = "ONDEM/Scene"
# stands for / in the names of columns, which would make a group
STROKE = "\u2215"
# attributes of the scene
NAMES = {"step": "iteration", "origin": "cell_origin", "periodic": "cell_periodic"}


def write_on_dem(packing: Packing, path: Path) -> Left:
    """Write one frame; it holds everything."""
    import h5py

    arrays, count = as_arrays(packing), len(packing)
    columns = {**arrays.grains, **arrays.own}
    columns["body_id"] = columns.pop("id")
    # VTK reads no texts at points
    texts = {name: values for name, values in columns.items() if values.dtype.kind == "U"}
    # in memory first: on a full disk HDF5 ends the process
    with h5py.File(path, "w", driver="core", backing_store=False, track_order=True) as file:
        file.attrs.update(file_format="ON-DEM VTKHDF", file_format_version="0.1-draft")
        file.attrs["source_code"] = "scanfab"
        # PolyData with a vertex at each point, so that ParaView shows them
        group = file.create_group("VTKHDF", track_order=True)
        group.attrs.update(Type=np.bytes_("PolyData"), Version=np.array([2, 0]))
        group["NumberOfPoints"] = np.array([count])
        group["Points"] = packing.position
        for section in ("Vertices", "Lines", "Polygons", "Strips"):
            filled = count if section == "Vertices" else 0
            group[f"{section}/NumberOfCells"] = np.array([filled])
            group[f"{section}/NumberOfConnectivityIds"] = np.array([filled])
            group[f"{section}/Connectivity"] = np.arange(filled)
            group[f"{section}/Offsets"] = np.arange(filled + 1)
        points = group.create_group("PointData", track_order=True)
        _write(points, {name: values for name, values in columns.items() if name not in texts})
        if texts:
            _write(file.create_group("ONDEM/Bodies/sphere"), {"body_id": packing.id, **texts})
        scene = file.create_group(SCENE)
        scene.attrs["scanfab"] = 1
        for name, value in arrays.frame.items():
            scene.attrs[NAMES.get(name, name)] = np.int8(value) if name == "periodic" else value
        if packing.contacts is not None:
            group = file.create_group("ONDEM/Interactions")
            group.attrs["count"] = len(packing.contacts)
            _write(group, _interactions(packing.contacts, arrays.contacts))
        file.flush()
        image = file.id.get_file_image()
    path.write_bytes(image)
    return Left(no_step=False, notes=tuple(arrays.notes))


def _write(group: Any, columns: Columns) -> None:
    import h5py

    for name, values in columns.items():
        plain = name.replace("/", STROKE)
        if values.dtype.kind == "U":
            group.create_dataset(plain, data=values.astype(object), dtype=h5py.string_dtype())
        else:
            group[plain] = values.astype(np.uint8) if values.dtype.kind == "b" else values


def _interactions(contacts: Contacts, arrays: Columns) -> Columns:
    """Contacts as the draft has them, and the whole force, which no rounding has touched."""
    table = {**arrays, "normal": contacts.normal, "contact_point": contacts.point}
    table["virtual"] = np.zeros(len(contacts), np.int8)
    table.pop("force_n", None)
    if contacts.force_n is not None:
        table["normal_force"] = contacts.force_n
    if contacts.force is not None and contacts.force_n is not None:
        table["shear_force"] = contacts.force - contacts.force_n[:, None] * contacts.normal
    return table
