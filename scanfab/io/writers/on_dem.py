"""Packings as ON-DEM's VTKHDF, draft 0.1, with what the draft has no name for under ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scanfab.io.reader import BODIES, WALLS
from scanfab.io.writer import Left
from scanfab.io.written import own_columns, standard_columns
from scanfab.packing.packing import Packing

SCENE = "ONDEM/Scene"
# in the place of / in the names of columns
STROKE = "\u2215"
SECTIONS = ("Vertices", "Lines", "Polygons", "Strips")


def write_on_dem(packing: Packing, path: Path) -> Left:
    """Write one frame; it holds everything."""
    import h5py

    own, notes = own_columns(packing)
    with h5py.File(path, "w", track_order=True) as file:
        file.attrs["file_format"] = "ON-DEM VTKHDF"
        file.attrs["file_format_version"] = "0.1-draft"
        file.attrs["source_code"] = "scanfab"
        numbers = {name: values for name, values in own.items() if values.dtype.kind != "U"}
        _write_points(file.create_group("VTKHDF", track_order=True), packing, numbers)
        texts = {name: values for name, values in own.items() if name not in numbers}
        if texts:
            # VTK reads no texts at points
            group = file.create_group("ONDEM/Bodies/sphere")
            group["body_id"] = packing.id
            for name, values in texts.items():
                _write_column(group, name, values)
        _write_scene(file.create_group(SCENE), packing)
        if packing.contacts is not None:
            _write_contacts(file.create_group("ONDEM/Interactions"), packing)
    return Left(no_step=False, notes=tuple(notes))


def _write_points(group: Any, packing: Packing, own: dict[str, Any]) -> None:
    """PolyData with a vertex at each point, so that ParaView shows them."""
    count = len(packing)
    group.attrs.create("Type", np.bytes_("PolyData"))
    group.attrs.create("Version", np.array([2, 0]))
    group["NumberOfPoints"] = np.array([count])
    group["Points"] = packing.position
    for section in SECTIONS:
        filled = count if section == "Vertices" else 0
        cells = group.create_group(section)
        cells["NumberOfCells"] = np.array([filled])
        cells["NumberOfConnectivityIds"] = np.array([filled])
        cells["Connectivity"] = np.arange(filled)
        cells["Offsets"] = np.arange(filled + 1)
    data = group.create_group("PointData", track_order=True)
    standard = standard_columns(packing)
    data["body_id"] = standard.pop("id")
    data["radius"] = packing.radius
    for name in (BODIES, WALLS):
        if name in standard:
            data[name] = standard[name]
    for name, values in own.items():
        _write_column(data, name, values)


def _write_column(group: Any, name: str, values: Any) -> None:
    """A column; with / in its name it would be a group."""
    import h5py

    plain = name.replace("/", STROKE)
    if values.dtype.kind == "U":
        group.create_dataset(plain, data=values.astype(object), dtype=h5py.string_dtype())
    else:
        group[plain] = values.astype(np.uint8) if values.dtype.kind == "b" else values


def _write_scene(group: Any, packing: Packing) -> None:
    group.attrs["scanfab"] = 1
    if packing.time is not None:
        group.attrs["time"] = packing.time
    if packing.step is not None:
        group.attrs["iteration"] = packing.step
    if packing.cell is not None:
        group.attrs["cell"] = packing.cell.vectors
        group.attrs["cell_origin"] = packing.cell.origin
        group.attrs["cell_periodic"] = np.array(packing.cell.periodic, dtype=np.int8)


def _write_contacts(group: Any, packing: Packing) -> None:
    """Interactions as the draft has them, and the whole force, which no rounding has touched."""
    contacts = packing.contacts
    assert contacts is not None
    group.attrs["count"] = len(contacts)
    ids = packing.id[contacts.pairs]
    group["id1"], group["id2"] = ids[:, 0], ids[:, 1]
    group["image"] = contacts.image
    group["normal"] = contacts.normal
    group["contact_point"] = contacts.point
    group["virtual"] = np.zeros(len(contacts), np.int8)
    if contacts.force_n is not None:
        group["normal_force"] = contacts.force_n
    if contacts.force is not None and contacts.force_n is not None:
        group["shear_force"] = contacts.force - contacts.force_n[:, None] * contacts.normal
        group["force"] = contacts.force
