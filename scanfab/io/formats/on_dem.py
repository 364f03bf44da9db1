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
from scanfab.io.files import first_bytes
from scanfab.io.formats.columns import grain_table, whole_numbers
from scanfab.io.formats.join import join_ids
from scanfab.io.parse.vtk_data import FlawError, Mesh, mesh_of
from scanfab.io.parse.vtk_hdf import HdfFile, content_of, is_hdf, read_hdf_file
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

# what a positive normal force means, by draft: +1 compression
SIGNS = {"0.1": 1.0, "0.2": -1.0}
INTERACTIONS = "ONDEM/Interactions"


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
        try:
            mesh = mesh_of(content_of(file))
        except FlawError as flaw:
            raise ReadError(f"{path}: cannot be read as VTKHDF: {flaw}") from None
        columns = _bodies(path, file, mesh)
        grains = grain_table(path, columns, _cell(path, file), options)
        joined = _contacts(path, file, grains)
        if joined is None:
            return grains
        walls = joined.wall_contacts
        if grains.wall_contacts is not None:
            walls = grains.wall_contacts
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


def _bodies(path: Path, file: HdfFile, mesh: Mesh) -> dict[str, npt.NDArray[Any]]:
    """The arrays of the points that are spheres: all others have no radius."""
    arrays = dict(mesh.point_arrays)
    radius = arrays.get("radius")
    if radius is None or radius.dtype.kind not in "iuf" or radius.ndim != 1:
        raise ReadError(f"{path}: expected numbers as radius in PointData, found {list(arrays)}")
    id = arrays.pop("body_id", None)
    if id is not None:
        id = whole_numbers(path, id)
        arrays = {**_more(file, id), **arrays}
    spheres = ~np.isnan(doubles(radius))
    # their place again
    arrays.pop("position", None)
    columns = {name.replace(STROKE, "/"): values[spheres] for name, values in arrays.items()}
    columns["position"] = mesh.points[spheres]
    return columns if id is None else {"id": id[spheres], **columns}


def _more(file: HdfFile, id: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    """The columns of the group of spheres (draft 0.2), in the order of the points."""
    own = file.below("ONDEM/Bodies/sphere")
    listed = own.pop("body_id", np.zeros(0, np.int64))
    if listed.size == 0 or len(np.unique(listed)) != len(listed):
        return {}
    order = np.argsort(listed)
    place = np.minimum(np.searchsorted(listed[order], id), len(listed) - 1)
    rows = order[place]
    known = listed[rows] == id
    found = {}
    for name, values in own.items():
        if len(values) != len(listed):
            continue
        column = values[rows]
        if not known.all():
            # other bodies, which are left out later
            empty = {"f": np.nan, "U": ""}.get(values.dtype.kind, -1)
            column[~known] = empty
        found[name] = column
    return found


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
    # draft 0.2 has a group for each type
    groups = [INTERACTIONS, *(f"{INTERACTIONS}/{one}" for one in file.groups(INTERACTIONS))]
    parts = [own for group in groups if "id1" in (own := file.below(group))]
    if grains.id is None:
        raise ReadError(f"{path}: names grains by id, but the points have no body_id")
    listed = [_real(path, own) for own in parts]
    names = set(listed[0]).intersection(*listed) if listed else set()
    table = {name: np.concatenate([one[name] for one in listed]) for name in names}
    if not table:
        ids = np.zeros((0, 2), np.int64)
        return join_ids(path, grains, ids, None, walls=True)
    ids = np.column_stack([whole_numbers(path, table[name]) for name in ("id1", "id2")])
    force = _force(path, file, table)
    image = table.get("image")
    walls = ~np.isin(ids, grains.id)
    both = walls.all(axis=1)
    if both.any():
        # two bodies that are no spheres
        ids, walls = ids[~both], walls[~both]
        force = None if force is None else force[~both]
        image = None if image is None else image[~both]
    force_n = None
    if force is None and "normal_force" in table:
        force_n = _sign(path, file) * table["normal_force"][~both]
    if image is not None:
        image = whole_numbers(path, image.ravel()).reshape(-1, 3)
    return join_ids(path, grains, ids, force, walls=True, image=image, force_n=force_n)


def _real(path: Path, own: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """The rows that are no virtual interactions, of the columns that matter."""
    count = len(own["id1"])
    shapes = {
        "id1": (count,),
        "id2": (count,),
        "normal": (count, 3),
        "normal_force": (count,),
        "shear_force": (count, 3),
        "virtual": (count,),
        "force": (count, 3),
        "image": (count, 3),
    }
    found = {}
    for name, shape in shapes.items():
        values = own.get(name)
        if values is None:
            continue
        if values.shape != shape or values.dtype.kind not in "biuf":
            raise ReadError(f"{path}: {INTERACTIONS}: {name}: expected numbers of shape {shape}")
        found[name] = values
    if "id2" not in found:
        raise ReadError(f"{path}: {INTERACTIONS}: expected id1 and id2, found id1 alone")
    virtual = found.pop("virtual", np.zeros(count))
    return {name: values[virtual <= 0] for name, values in found.items()}


def _force(path: Path, file: HdfFile, table: dict[str, npt.NDArray[Any]]) -> FloatArray | None:
    """The force on the second body; as YADE's exporter writes it, or whole, as scanfab does."""
    if "force" in table:
        return doubles(table["force"])
    if not {"normal", "normal_force", "shear_force"} <= table.keys():
        return None
    normal = _sign(path, file) * table["normal_force"][:, None] * table["normal"]
    force: FloatArray = (normal + table["shear_force"]).astype(np.float64)
    return force


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
