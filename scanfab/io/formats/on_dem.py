"""
ON-DEM's exchange format (VTKHDF with a group ONDEM).

Drafts 0.1 and 0.2 are read, and draft 0.1 is written. They differ in names and
in the sign of the normal force: compression is positive in 0.1 and negative in 0.2.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.arrays import doubles
from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns, FloatArray
from scanfab.io.binary_files import HdfFile, is_hdf, read_hdf_file
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids, rows_of_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly
from scanfab.io.mesh import joined_arrays
from scanfab.io.reader import Carries, GrainTable, ReadOptions, Snapshot
from scanfab.io.writer import Left, are_numbers, as_arrays, split, stated_cell
from scanfab.packing.packing import Packing

# groups of ON-DEM, and the attributes of its scene for the names in writer.Arrays
SCENE, BODIES, INTERACTIONS = "ONDEM/Scene", "ONDEM/Bodies/sphere", "ONDEM/Interactions"
SCENE_NAMES = {"step": "iteration", "time": "time", "cell": "cell"}
SCENE_NAMES |= {"origin": "cell_origin", "periodic": "cell_periodic"}
# replaces / in names of columns, because / would create a group
STROKE = "\u2215"
# sign of the normal force in compression, by draft
SIGNS = {"0.1": 1.0, "0.2": -1.0}
# the columns of interactions that are read, and the shape of a value in each
COLUMNS: dict[str, tuple[int, ...]] = {"id1": (), "id2": (), "virtual": (), "normal_force": ()}
COLUMNS |= dict.fromkeys(("normal", "shear_force", "force", "image"), (3,))
NONE: Columns = {"id1": np.zeros(0), "id2": np.zeros(0)}


class OnDemReader(GrainsOnly):
    """Reader and writer plugin for ON-DEM's VTKHDF."""

    name = "on-dem"
    description = "ON-DEM's VTKHDF (drafts 0.1 and 0.2): spheres and contacts with forces"
    extensions: tuple[str, ...] = (".vtkhdf",)

    def recognises(self, path: Path) -> bool:
        """Recognised by the groups VTKHDF and ONDEM."""
        if not is_hdf(first_bytes(path, 8)):
            return False
        return {"ONDEM", "VTKHDF"} <= read_hdf_file(path, with_data=False).attributes.keys()

    def snapshots(self, path: Path) -> list[Snapshot]:
        """The only snapshot, with the step and time of the scene."""
        scene = read_hdf_file(path, with_data=False).attributes.get(SCENE, {})
        step, time = scene.get("iteration", scene.get("step")), scene.get("time")
        step = step if isinstance(step, int) else None
        time = float(time) if isinstance(time, int | float) else None
        return [Snapshot(path, step, time, stepless="scanfab" in scene and step is None)]

    def carries(self, path: Path) -> Carries:
        """The drafts have no cell; files of scanfab state whether there is one."""
        scene = read_hdf_file(path, with_data=False).attributes.get(SCENE, {})
        return "cell" if "scanfab" in scene else "nothing"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The bodies with a radius as grains, and their interactions as contacts."""
        path, file = snapshot.path, read_hdf_file(snapshot.path)
        scene = file.attributes.get(SCENE, {})
        arrays = {name: scene[key] for name, key in SCENE_NAMES.items() if key in scene}
        grains = grain_table(path, _spheres(path, file), stated_cell(path, arrays), options)
        return grains if INTERACTIONS not in file.attributes else _joined(path, file, grains)

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; the file holds all data of the packing but columns of texts."""
        import h5py

        arrays, count = as_arrays(packing), len(packing)
        own, left = split(arrays.own, are_numbers)
        columns = {**arrays.grains, **own}
        columns["body_id"] = columns.pop("id")
        # in memory first, because HDF5 ends the process if the disk is full
        with h5py.File(path, "w", driver="core", backing_store=False, track_order=True) as file:
            file.attrs.update(file_format="ON-DEM VTKHDF", file_format_version="0.1-draft")
            file.attrs["source_code"] = "scanfab"
            # PolyData with a vertex at each point, so that ParaView shows the points
            group = file.create_group("VTKHDF", track_order=True)
            group.attrs.update(Type=np.bytes_("PolyData"), Version=np.array([2, 0]))
            group["NumberOfPoints"] = np.array([count])
            group["Points"] = packing.position
            for cells in ("Vertices", "Lines", "Polygons", "Strips"):
                filled = count if cells == "Vertices" else 0
                group[f"{cells}/NumberOfCells"] = np.array([filled])
                group[f"{cells}/NumberOfConnectivityIds"] = np.array([filled])
                group[f"{cells}/Connectivity"] = np.arange(filled)
                group[f"{cells}/Offsets"] = np.arange(filled + 1)
            points = group.create_group("PointData", track_order=True)
            _write(points, columns)
            scene = file.create_group(SCENE)
            scene.attrs["scanfab"] = 1
            for name, value in arrays.frame.items():
                scene.attrs[SCENE_NAMES[name]] = np.int8(value) if name == "periodic" else value
            if (contacts := packing.contacts) is not None:
                group = file.create_group(INTERACTIONS)
                group.attrs["count"] = len(contacts)
                # the parts of the force that the draft names, and the exact total force
                table = {**arrays.contacts, "virtual": np.zeros(len(contacts), np.int8)}
                table |= {"normal": contacts.normal, "contact_point": contacts.point}
                table.pop("force_n", None)
                if contacts.force_n is not None:
                    table["normal_force"] = contacts.force_n
                if contacts.force is not None and contacts.force_n is not None:
                    normal_part = contacts.force_n[:, None] * contacts.normal
                    table["shear_force"] = contacts.force - normal_part
                _write(group, table)
            file.flush()
            image = file.id.get_file_image()
        path.write_bytes(image)
        return Left(columns=left, no_step=False, notes=tuple(arrays.notes))


def _spheres(path: Path, file: HdfFile) -> Columns:
    """The columns of the bodies with a radius; bodies without one are not spheres."""
    parts = []
    for block in ["VTKHDF", *(f"VTKHDF/{name}" for name in file.groups("VTKHDF"))]:
        if f"{block}/Steps" in file.attributes:
            raise ReadError(f"{path}: {block} holds steps in time: write one file for each")
        if (points := file.below(block).get("Points")) is not None:
            parts.append({**file.below(f"{block}/PointData"), "position": points})
    columns = joined_arrays(parts or [{}])
    shapes = {name: values.shape for name, values in columns.items()}
    radius = columns.get("radius", np.zeros(0, str))
    if radius.dtype.kind not in "iuf" or {shape[:1] for shape in shapes.values()} != {radius.shape}:
        raise ReadError(f"{path}: expected Points, and a radius for each in PointData: {shapes}")
    spheres = ~np.isnan(doubles(radius))
    columns = {name.replace(STROKE, "/"): values[spheres] for name, values in columns.items()}
    if "body_id" not in columns:
        return columns
    id = whole_numbers(path, columns.pop("body_id"))
    # draft 0.2 has further columns in a group of spheres, in another order: match by id
    more = file.below(BODIES)
    listed, rows = np.unique(more.pop("body_id", np.zeros(0, np.int64)), return_index=True)
    if len(listed) and np.all(np.isin(id, listed)):
        rows = rows[np.searchsorted(listed, id)]
        more = {name: values[rows] for name, values in more.items() if len(values) == len(listed)}
        columns = {**more, **columns}
    return {"id": id, **columns}


def _joined(path: Path, file: HdfFile, grains: GrainTable) -> GrainTable:
    """The grains with contacts; interactions with bodies that are not spheres are with walls."""
    # draft 0.2 has a group for each type of interaction
    groups = [INTERACTIONS, *(f"{INTERACTIONS}/{group}" for group in file.groups(INTERACTIONS))]
    parts = [own for group in groups if "id1" in (own := file.below(group))] or [NONE]
    parts = [{"virtual": np.zeros(len(part["id1"])), **part} for part in parts]
    table = {name: values for name, values in joined_arrays(parts).items() if name in COLUMNS}
    for name in {"id2", *table}:
        values, shape = table.get(name, np.zeros(0)), (len(table["id1"]), *COLUMNS[name])
        if values.shape != shape or values.dtype.kind not in "biuf":
            raise ReadError(f"{path}: {INTERACTIONS}: {name}: expected numbers of shape {shape}")
    ids = np.column_stack([whole_numbers(path, table[name]) for name in ("id1", "id2")])
    # leave out interactions without any sphere
    ours = np.any(rows_of_ids(grains, ids) >= 0, axis=1) & (table["virtual"] <= 0)
    table = {name: values[ours] for name, values in table.items()}
    image = table.get("image")
    if image is not None:
        image = whole_numbers(path, image.ravel()).reshape(-1, 3)
    force, force_n = _force(path, file, table)
    joined = join_ids(path, grains, ids[ours], force, walls=True, image=image, force_n=force_n)
    walls = joined.wall_contacts if grains.wall_contacts is None else grains.wall_contacts
    return grains._replace(contacts=joined.contacts, wall_contacts=walls)


def _force(
    path: Path, file: HdfFile, table: Columns
) -> tuple[FloatArray | None, FloatArray | None]:
    """The force on the second body and None, or None and its normal part if there is only that."""
    if "force" in table:  # as scanfab writes it
        return doubles(table["force"]), None
    if "normal_force" not in table:
        return None, None
    version = str(file.attributes.get("", {}).get("file_format_version", ""))
    if version[:3] not in SIGNS:
        expected = "expected 0.1 or 0.2, which define the sign of the normal force"
        advice = 'use `contacts="geometric"`'
        raise ReadError(f"{path}: file_format_version is {version!r}, {expected}: {advice}")
    normal = SIGNS[version[:3]] * table["normal_force"]
    if not {"normal", "shear_force"} <= table.keys():
        return None, normal
    return doubles(normal[:, None] * table["normal"] + table["shear_force"]), None


def _write(group: Any, columns: Columns) -> None:
    for name, values in columns.items():
        is_truth = values.dtype.kind == "b"
        group[name.replace("/", STROKE)] = values.astype(np.uint8) if is_truth else values
