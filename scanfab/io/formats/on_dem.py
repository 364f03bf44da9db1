"""
ON-DEM's exchange format (VTKHDF with a group ONDEM), read and written.

Of drafts 0.1 and 0.2, which differ in more than names: the normal force is positive in compression
in the first, and in traction in the second.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.arrays import doubles
from scanfab.base.errors import PackingError, ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.columns import grain_table, whole_numbers
from scanfab.io.contacts import join_ids
from scanfab.io.files import first_bytes
from scanfab.io.hdf import HdfFile, is_hdf, read_hdf_file
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.io.writer import Left
from scanfab.io.writers.on_dem import SCENE, STROKE, write_on_dem
from scanfab.packing.cell import Cell
from scanfab.packing.packing import Packing

Arrays = dict[str, npt.NDArray[Any]]

# what a positive normal force means, by draft: +1 compression
SIGNS = {"0.1": 1.0, "0.2": -1.0}
INTERACTIONS = "ONDEM/Interactions"
# the columns of interactions that matter, and their values for each
COLUMNS = {"id1": 1, "id2": 1, "normal_force": 1, "normal": 3, "shear_force": 3, "force": 3}
COLUMNS |= {"image": 3, "virtual": 1}


class OnDemReader:
    """Reader and writer plugin for ON-DEM's VTKHDF."""

    name = "on-dem"
    description = "ON-DEM's VTKHDF (drafts 0.1 and 0.2): spheres and contacts with forces"
    extensions: tuple[str, ...] = (".vtkhdf",)
    lists_contacts = True

    def recognises(self, path: Path) -> bool:
        """By the groups VTKHDF and ONDEM."""
        if not is_hdf(first_bytes(path, 8)):
            return False
        head = read_hdf_file(path, with_data=False)
        return {"ONDEM", "VTKHDF"} <= head.attributes.keys()

    def kind(self, path: Path) -> FileKind:
        """Grains with their contacts, if it is of this format at all."""
        return "grains" if self.recognises(path) else "other"

    def snapshots(self, path: Path) -> list[Snapshot]:
        """One, at the time of the scene."""
        scene = read_hdf_file(path, with_data=False).attributes.get(SCENE, {})
        step, time = scene.get("iteration", scene.get("step")), scene.get("time")
        return [
            Snapshot(
                path,
                int(step) if isinstance(step, int) else None,
                float(time) if isinstance(time, int | float) else None,
                stepless="scanfab" in scene and step is None,
            )
        ]

    def carries(self, path: Path) -> Carries:
        """The drafts have no cell; what scanfab writes says whether there is one."""
        head = read_hdf_file(path, with_data=False)
        return "cell" if "scanfab" in head.attributes.get(SCENE, {}) else "nothing"

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """The bodies with a radius, and the interactions between them."""
        path = snapshot.path
        file = read_hdf_file(path)
        grains = grain_table(path, _spheres(path, file), _cell(path, file), options)
        joined = _contacts(path, file, grains)
        if joined is None:
            return grains
        walls = joined.wall_contacts if grains.wall_contacts is None else grains.wall_contacts
        return grains._replace(contacts=joined.contacts, wall_contacts=walls)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """Those of the file, joined to other grains by their ids."""
        joined = _contacts(snapshot.path, read_hdf_file(snapshot.path), grains)
        if joined is None:
            raise ReadError(f"{snapshot.path}: lists no interactions")
        return joined

    def write(self, packing: Packing, path: Path) -> Left:
        """Write one frame; it holds everything, what the draft has no name for under ours."""
        return write_on_dem(packing, path)


def _spheres(path: Path, file: HdfFile) -> Arrays:
    """The columns of the bodies that have a radius: no other body is a sphere."""
    blocks = [f"VTKHDF/{name}" for name in file.groups("VTKHDF")]
    blocks = [one for one in ("VTKHDF", *blocks) if f"{one}/Points" in file.arrays]
    parts = [_points(path, file, one) for one in blocks]
    if not parts or not all("radius" in one for one in parts):
        raise ReadError(f"{path}: expected Points with a radius in PointData, found {blocks}")
    names = [name for name in parts[0] if all(name in one for one in parts)]
    columns = {name: np.concatenate([one[name] for one in parts]) for name in names}
    radius = columns["radius"]
    if radius.dtype.kind not in "iuf" or radius.ndim != 1:
        raise ReadError(f"{path}: expected numbers as radius, found {radius.dtype}")
    spheres = ~np.isnan(doubles(radius))
    columns = {name.replace(STROKE, "/"): values[spheres] for name, values in columns.items()}
    if "body_id" not in columns:
        return columns
    id = whole_numbers(path, columns.pop("body_id"))
    return {"id": id, **_more(file, id), **columns}


def _points(path: Path, file: HdfFile, block: str) -> Arrays:
    """The arrays of the points of one block, and their position."""
    if f"{block}/Steps" in file.attributes:
        raise ReadError(f"{path}: {block} holds steps in time: write one file for each")
    points = file.arrays[f"{block}/Points"]
    counts = file.arrays.get(f"{block}/NumberOfPoints", np.array(len(points)))
    if points.shape[1:] != (3,) or counts.sum() != len(points):
        raise ReadError(
            f"{path}: {block}: expected Points of three coordinates and as many as NumberOfPoints "
            f"({counts.tolist()}), found the shape {points.shape}"
        )
    columns = {"position": doubles(points)}
    for name, values in file.below(f"{block}/PointData").items():
        if len(values) != len(points):
            raise ReadError(f"{path}: {block}: {name} has {len(values)} of {len(points)} rows")
        if name != "position":
            columns[name] = values[:, 0] if values.shape[1:] == (1,) else values
    return columns


def _more(file: HdfFile, id: npt.NDArray[Any]) -> Arrays:
    """The columns of the group of spheres (draft 0.2), if it lists them all, in our order."""
    own = file.below("ONDEM/Bodies/sphere")
    listed = own.pop("body_id", np.zeros(0, np.int64))
    order = np.argsort(listed)
    if len(np.unique(listed)) != len(listed) or not np.all(np.isin(id, listed)):
        return {}
    rows = order[np.searchsorted(listed[order], id)]
    return {name: one[rows] for name, one in own.items() if len(one) == len(listed)}


def _cell(path: Path, file: HdfFile) -> Cell | None:
    scene = file.attributes.get(SCENE, {})
    if "cell" not in scene:
        return None
    try:
        along = [bool(one) for one in scene.get("cell_periodic", [])]
        if len(along) != 3:
            raise PackingError("cell_periodic: expected three truths")
        return Cell(
            np.array(scene["cell"], dtype=np.float64),
            (along[0], along[1], along[2]),
            scene.get("cell_origin", [0.0, 0.0, 0.0]),
        )
    except (PackingError, TypeError, ValueError) as error:
        raise ReadError(f"{path}: {SCENE}: {error}") from None


def _contacts(path: Path, file: HdfFile, grains: GrainTable) -> JoinedContacts | None:
    """Real interactions; those of bodies that are no spheres are contacts with walls."""
    if INTERACTIONS not in file.attributes:
        return None
    if grains.id is None:
        raise ReadError(f"{path}: names grains by id, but the points have no body_id")
    # draft 0.2 has a group for each type
    groups = [INTERACTIONS, *(f"{INTERACTIONS}/{one}" for one in file.groups(INTERACTIONS))]
    parts = [_real(path, own) for one in groups if "id1" in (own := file.below(one))]
    if not parts:
        return join_ids(path, grains, np.zeros((0, 2), np.int64), None, walls=True)
    names = set(parts[0]).intersection(*parts)
    table = {name: np.concatenate([one[name] for one in parts]) for name in names}
    ids = np.column_stack([whole_numbers(path, table[name]) for name in ("id1", "id2")])
    # two bodies that are no spheres are none of ours
    ours = np.isin(ids, grains.id).any(axis=1)
    table = {name: values[ours] for name, values in table.items()}
    force, force_n = _force(path, file, table)
    image = table.get("image")
    if image is not None:
        image = whole_numbers(path, image.ravel()).reshape(-1, 3)
    return join_ids(path, grains, ids[ours], force, walls=True, image=image, force_n=force_n)


def _real(path: Path, own: Arrays) -> Arrays:
    """The rows that are no virtual interactions, of the columns that matter."""
    count = len(own["id1"])
    found = {name: own[name] for name in COLUMNS if name in own}
    for name, values in found.items():
        shape = (count, 3) if COLUMNS[name] == 3 else (count,)
        if values.shape != shape or values.dtype.kind not in "biuf":
            raise ReadError(f"{path}: {INTERACTIONS}: {name}: expected numbers of shape {shape}")
    if "id2" not in found:
        raise ReadError(f"{path}: {INTERACTIONS}: expected id1 and id2, found id1 alone")
    virtual = found.pop("virtual", np.zeros(count))
    return {name: values[virtual <= 0] for name, values in found.items()}


def _force(path: Path, file: HdfFile, table: Arrays) -> tuple[FloatArray | None, FloatArray | None]:
    """The force on the second body, or else its normal part alone."""
    if "force" in table:  # as scanfab writes it
        return doubles(table["force"]), None
    if "normal_force" not in table:
        return None, None
    normal = _sign(path, file) * table["normal_force"]
    if not {"normal", "shear_force"} <= table.keys():
        return None, normal
    return doubles(normal[:, None] * table["normal"] + table["shear_force"]), None


def _sign(path: Path, file: HdfFile) -> float:
    """Of a normal force that pushes the grains apart."""
    version = str(file.attributes.get("", {}).get("file_format_version", ""))
    sign = SIGNS.get(version[:3])
    if sign is None:
        raise ReadError(
            f"{path}: file_format_version is {version!r}, expected 0.1 or 0.2, which differ in the "
            f'sign of the normal force: leave the contacts alone by `contacts="geometric"`, or '
            f"convert the file"
        )
    return sign
