"""
ON-DEM's exchange format (VTKHDF with a group ONDEM).

Drafts 0.1 and 0.2 are read, and 0.1 is written (by `writers.vtk`). They differ in more than names:
the normal force is positive in compression in the first, and in traction in the second.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.arrays import doubles
from scanfab.base.errors import ReadError
from scanfab.base.typing import Columns, FloatArray
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids, rows_of_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats.shared import GrainsOnly
from scanfab.io.hdf import HdfFile, is_hdf, read_hdf_file
from scanfab.io.mesh import joined_arrays
from scanfab.io.reader import Carries, GrainTable, ReadOptions, Snapshot
from scanfab.io.writer import cell_of
from scanfab.io.writers.vtk import BODIES, INTERACTIONS, SCENE, SCENE_NAMES, STROKE, write_on_dem

# what a positive normal force means, by draft: +1 compression
SIGNS = {"0.1": 1.0, "0.2": -1.0}
# the columns of interactions that matter, and the shapes of their values
COLUMNS: dict[str, tuple[int, ...]] = {"id1": (), "id2": (), "virtual": (), "normal_force": ()}
COLUMNS |= dict.fromkeys(("normal", "shear_force", "force", "image"), (3,))
NONE: Columns = {"id1": np.zeros(0), "id2": np.zeros(0)}


class OnDemReader(GrainsOnly):
    """Reader and writer plugin for ON-DEM's VTKHDF."""

    name = "on-dem"
    description = "ON-DEM's VTKHDF (drafts 0.1 and 0.2): spheres and contacts with forces"
    extensions: tuple[str, ...] = (".vtkhdf",)
    lists_contacts = True
    write = staticmethod(write_on_dem)

    def recognises(self, path: Path) -> bool:
        """By the groups VTKHDF and ONDEM."""
        if not is_hdf(first_bytes(path, 8)):
            return False
        return {"ONDEM", "VTKHDF"} <= read_hdf_file(path, with_data=False).attributes.keys()

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, at the time of the scene."""
        scene = _scene(path)
        step, time = scene.get("iteration", scene.get("step")), scene.get("time")
        step = step if isinstance(step, int) else None
        time = float(time) if isinstance(time, int | float) else None
        return [Snapshot(path, step, time, stepless="scanfab" in scene and step is None)]

    def carries(self, path: Path) -> Carries:
        """The drafts have no cell; what scanfab writes says whether there is one."""
        return "cell" if "scanfab" in _scene(path) else "nothing"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The bodies with a radius, and the interactions between them."""
        path, file = snapshot.path, read_hdf_file(snapshot.path)
        scene = file.attributes.get(SCENE, {})
        arrays = {name: scene[own] for name, own in SCENE_NAMES.items() if own in scene}
        grains = grain_table(path, _spheres(path, file), cell_of(path, arrays), options)
        return grains if INTERACTIONS not in file.attributes else _joined(path, file, grains)


def _scene(path: Path) -> dict[str, Any]:
    return read_hdf_file(path, with_data=False).attributes.get(SCENE, {})


def _spheres(path: Path, file: HdfFile) -> Columns:
    """The columns of the bodies that have a radius: no other body is a sphere."""
    parts = []
    for block in ["VTKHDF", *(f"VTKHDF/{name}" for name in file.groups("VTKHDF"))]:
        if f"{block}/Steps" in file.attributes:
            raise ReadError(f"{path}: {block} holds steps in time: write one file for each")
        if (points := file.below(block).get("Points")) is not None:
            parts.append({**file.below(f"{block}/PointData"), "position": points})
    columns = joined_arrays(parts or [{}])
    shapes = {name: one.shape for name, one in columns.items()}
    radius = columns.get("radius", np.zeros(0, str))
    if radius.dtype.kind not in "iuf" or {one[:1] for one in shapes.values()} != {radius.shape}:
        raise ReadError(f"{path}: expected Points, and a radius for each in PointData: {shapes}")
    spheres = ~np.isnan(doubles(radius))
    columns = {name.replace(STROKE, "/"): values[spheres] for name, values in columns.items()}
    if "body_id" not in columns:
        return columns
    id = whole_numbers(path, columns.pop("body_id"))
    # draft 0.2 has more columns in a group of spheres, which has an order of its own
    own = file.below(BODIES)
    listed, rows = np.unique(own.pop("body_id", np.zeros(0, np.int64)), return_index=True)
    if len(listed) and np.all(np.isin(id, listed)):
        rows = rows[np.searchsorted(listed, id)]
        own = {name: one[rows] for name, one in own.items() if len(one) == len(listed)}
        columns = {**own, **columns}
    return {"id": id, **columns}


def _joined(path: Path, file: HdfFile, grains: GrainTable) -> GrainTable:
    """The grains with their contacts: interactions with bodies that are no spheres are walls'."""
    # draft 0.2 has a group for each type
    groups = [INTERACTIONS, *(f"{INTERACTIONS}/{one}" for one in file.groups(INTERACTIONS))]
    parts = [own for one in groups if "id1" in (own := file.below(one))] or [NONE]
    parts = [{"virtual": np.zeros(len(one["id1"])), **one} for one in parts]
    table = {name: one for name, one in joined_arrays(parts).items() if name in COLUMNS}
    for name in {"id2", *table}:
        values, shape = table.get(name, np.zeros(0)), (len(table["id1"]), *COLUMNS[name])
        if values.shape != shape or values.dtype.kind not in "biuf":
            raise ReadError(f"{path}: {INTERACTIONS}: {name}: expected numbers of shape {shape}")
    ids = np.column_stack([whole_numbers(path, table[name]) for name in ("id1", "id2")])
    # two bodies that are no spheres are none of ours
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
    """The force on the second body, or else its normal part alone."""
    if "force" in table:  # as scanfab writes it
        return doubles(table["force"]), None
    if "normal_force" not in table:
        return None, None
    version = str(file.attributes.get("", {}).get("file_format_version", ""))
    if version[:3] not in SIGNS:
        expected = "expected 0.1 or 0.2, which tell the sign of the normal force"
        advice = 'use `contacts="geometric"`'
        raise ReadError(f"{path}: file_format_version is {version!r}, {expected}: {advice}")
    normal = SIGNS[version[:3]] * table["normal_force"]
    if not {"normal", "shear_force"} <= table.keys():
        return None, normal
    return doubles(normal[:, None] * table["normal"] + table["shear_force"]), None
