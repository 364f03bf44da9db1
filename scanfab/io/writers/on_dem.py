"""Packings as ON-DEM's VTKHDF, draft 0.1; what the draft has no name for has a name of ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.io.writer import Left
from scanfab.io.written import contact_arrays, frame_arrays, own_columns, standard_columns
from scanfab.packing.packing import Packing

SCENE = "ONDEM/Scene"
# stands for / in the names of columns, which would make a group
STROKE = "\u2215"
# attributes of the scene
NAMES = {"step": "iteration", "origin": "cell_origin", "periodic": "cell_periodic"}


def write_on_dem(packing: Packing, path: Path) -> Left:
    """Write one frame; it holds everything."""
    import h5py

    own, notes = own_columns(packing)
    count = len(packing)
    standard = standard_columns(packing)
    columns = {"body_id": standard.pop("id"), "radius": packing.radius, **standard, **own}
    # in memory first: on a full disk HDF5 ends the process
    with h5py.File(path, "w", driver="core", backing_store=False, track_order=True) as file:
        file.attrs["file_format"] = "ON-DEM VTKHDF"
        file.attrs["file_format_version"] = "0.1-draft"
        file.attrs["source_code"] = "scanfab"
        # PolyData with a vertex at each point, so that ParaView shows them
        group = file.create_group("VTKHDF", track_order=True)
        group.attrs.create("Type", np.bytes_("PolyData"))
        group.attrs.create("Version", np.array([2, 0]))
        group["NumberOfPoints"] = np.array([count])
        group["Points"] = packing.position
        for section in ("Vertices", "Lines", "Polygons", "Strips"):
            filled = count if section == "Vertices" else 0
            group[f"{section}/NumberOfCells"] = np.array([filled])
            group[f"{section}/NumberOfConnectivityIds"] = np.array([filled])
            group[f"{section}/Connectivity"] = np.arange(filled)
            group[f"{section}/Offsets"] = np.arange(filled + 1)
        points = group.create_group("PointData", track_order=True)
        # VTK reads no texts at points
        texts = {name: values for name, values in columns.items() if values.dtype.kind == "U"}
        if texts:
            _write(file.create_group("ONDEM/Bodies/sphere"), {"body_id": packing.id, **texts})
        _write(points, {name: values for name, values in columns.items() if name not in texts})
        scene = file.create_group(SCENE)
        scene.attrs["scanfab"] = 1
        for name, value in frame_arrays(packing).items():
            # readers know truths as whole numbers
            scene.attrs[NAMES.get(name, name)] = np.int8(value) if name == "periodic" else value
        if packing.contacts is not None:
            _write(file.create_group("ONDEM/Interactions"), _interactions(packing))
            file["ONDEM/Interactions"].attrs["count"] = len(packing.contacts)
        file.flush()
        image = file.id.get_file_image()
    path.write_bytes(image)
    return Left(no_step=False, notes=tuple(notes))


def _write(group: Any, columns: dict[str, npt.NDArray[Any]]) -> None:
    import h5py

    for name, values in columns.items():
        plain = name.replace("/", STROKE)
        if values.dtype.kind == "U":
            group.create_dataset(plain, data=values.astype(object), dtype=h5py.string_dtype())
        else:
            group[plain] = values.astype(np.uint8) if values.dtype.kind == "b" else values


def _interactions(packing: Packing) -> dict[str, npt.NDArray[Any]]:
    """Contacts as the draft has them, and the whole force, which no rounding has touched."""
    contacts = packing.contacts
    assert contacts is not None
    ids = packing.id[contacts.pairs]
    table = {
        "id1": ids[:, 0],
        "id2": ids[:, 1],
        **contact_arrays(packing),
        "normal": contacts.normal,
        "contact_point": contacts.point,
        "virtual": np.zeros(len(contacts), np.int8),
    }
    table.pop("force_n", None)
    if contacts.force_n is not None:
        table["normal_force"] = contacts.force_n
    if contacts.force is not None and contacts.force_n is not None:
        table["shear_force"] = contacts.force - contacts.force_n[:, None] * contacts.normal
    return table
