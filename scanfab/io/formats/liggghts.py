"""
LIGGGHTS: ``dump custom`` and ``dump local`` text, and its VTK files.

In ``dump local`` the column names say nothing. ``compute pair/gran/local`` and ``wall/gran/local``
write their values in an order of their own, whatever the order of the keywords.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.files import first_bytes
from scanfab.io.formats.dump_grains import (
    binary_kind,
    dump_kind,
    read_binary_grains,
    read_dump_grains,
)
from scanfab.io.formats.ids import (
    IDS,
    MOST_ROWS,
    are_ids,
    are_whole,
    named_force,
    named_places,
    refuse_rounded_ids,
    touching_pairs,
)
from scanfab.io.formats.join import count_walls, join_ids, rows_of_ids
from scanfab.io.formats.lammps_data import is_data_file, of_liggghts, read_data_grains
from scanfab.io.formats.vtk import VtkReader, vectors
from scanfab.io.parse.binary_dump import index_binary, is_binary, names_of_binary
from scanfab.io.parse.text_dump import DumpBlock, index_dump, read_block, row_word
from scanfab.io.parse.vtk_data import Mesh
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.packing.walls import ListedWallForces

# values of compute pair/gran/local in the order in which they are written, and how many
PAIR_VALUES = {
    "pos": 6,
    "vel": 6,
    "id": 3,
    "force": 3,
    "force_normal": 3,
    "force_tangential": 3,
    "torque": 3,
    "torque_normal": 3,
    "torque_tangential": 3,
    "history": 3,
    "contactArea": 1,
    "delta": 1,
    "contactPoint": 3,
    "ms_id": 2,
    "heatFlux": 1,
}


class LiggghtsVtkReader(VtkReader):
    """The VTK files of LIGGGHTS."""

    # a contact list names grains only
    walls = False
    says_sign = True

    def force_on_second(self, mesh: Mesh) -> FloatArray | None:
        """The file has the force on the first grain, at times its normal and tangential part."""
        force = vectors(mesh, "force")
        normal, tangential = vectors(mesh, "force_normal"), vectors(mesh, "force_tangential")
        if force is None and normal is not None and tangential is not None:
            force = normal + tangential
        return None if force is None else -force

    def normal_force(self, mesh: Mesh) -> FloatArray | None:
        """The normal part acts on the first grain, too."""
        force = vectors(mesh, "force_normal")
        return None if force is None else -force


class LiggghtsReader:
    """Reader plugin for what LIGGGHTS dumps."""

    name = "liggghts"
    description = (
        "LIGGGHTS dump custom (text, binary), dump local, custom/vtk, local/gran/vtk, data files"
    )
    extensions = (".liggghts", ".dump", ".vtk", ".vtp", ".vtu", ".bin", ".data")

    def __init__(self) -> None:
        self._vtk = LiggghtsVtkReader()

    def recognises(self, path: Path) -> bool:
        """An ``ITEM:`` dump, or a data file or legacy VTK file that names LIGGGHTS."""
        head = first_bytes(path)
        return (
            _is_text(head)
            or names_of_binary(head) is None
            or (is_data_file(head) and of_liggghts(head))
            or (
                head.startswith(b"# vtk DataFile")
                and b"LIGGGHTS" in head.partition(b"\n")[2].partition(b"\n")[0]
            )
        )

    def kind(self, path: Path) -> FileKind:
        """Grains are ATOMS; whatever else a text dump counts are contacts."""
        head = first_bytes(path, 1 << 16)
        if is_data_file(head):
            return "grains"
        if is_binary(head):
            return binary_kind(head)
        return dump_kind(head) if _is_text(head) else self._vtk.kind(path)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """By ``ITEM: TIMESTEP``; a VTK file is one."""
        head = first_bytes(path)
        if is_binary(head):
            return index_binary(path)
        if is_data_file(head):
            return [Snapshot(path)]
        return index_dump(path) if _is_text(head) else self._vtk.snapshots(path)

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns in any order and any subset that suffices; of repeated names the first counts."""
        head = first_bytes(snapshot.path)
        if is_binary(head):
            return read_binary_grains(snapshot, options)
        if is_data_file(head):
            return read_data_grains(snapshot, options)
        if not _is_text(head):
            return self._vtk.read_grains(snapshot, options)
        return read_dump_grains(snapshot, options)

    def carries(self, path: Path) -> Carries:
        """A dump says which directions are periodic, a VTK or data file does not."""
        head = first_bytes(path)
        if is_data_file(head):
            return "box"
        return "cell" if _is_text(head) or is_binary(head) else self._vtk.carries(path)

    def beside(self, path: Path) -> list[Path]:
        """A VTK file has its box beside it."""
        return self._vtk.beside(path)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        Pairs of ``pair/gran/local``, or grains of ``wall/gran/local``.

        Which column is what follows from ``contact_columns``, which are the keywords of the compute
        or names of columns; or from the values: two columns of ids, then the periodic flag 0 or 1.
        """
        path = snapshot.path
        if is_data_file(first_bytes(path)):
            raise ReadError(f"{path}: a data file holds no contacts")
        if not _is_text(first_bytes(path)):
            return self._vtk.read_contacts(snapshot, options, grains)
        block = read_block(snapshot)
        if len(block.values) == 0:
            pairs = np.zeros((0, 2), np.int64)
            return join_ids(path, grains, pairs, None, walls=False)
        if grains.id is None:
            raise ReadError(f"{path}: names grains by id, but the grain file has no ids")
        refuse_rounded_ids(path, block.values, grains)
        pair = _pair_column(block.values, grains)
        wall = _wall_columns(block.values, grains) if pair is None else None
        if wall is not None:
            # also where `contact_columns` are named: those of the pairs
            return _joined_walls(path, block.values, wall, grains)
        if "=" in (options.contact_columns or ""):
            return _named_contacts(path, options.contact_columns, block, grains)
        places = _given_places(path, options.contact_columns, block)
        place = places.get("id")
        if place is None:
            place = pair
            if place is not None and _pushes(block.values, place, grains):
                places = {"force": place + 3}
        if place is None:
            raise ReadError(
                f"{path}: cannot tell which columns are the two ids of a contact: the ids may "
                f"belong to another step; or name the keywords of the compute with "
                f'`contact_columns="pos id force ..."`, or the columns with '
                f'`contact_columns="id1=c_c[1],id2=c_c[2]"`, which are {", ".join(block.names)}; a '
                f'dump of LAMMPS is read with `format="lammps"`'
            )
        ids = _ids(path, block, [place, place + 1])
        force, force_n = _forces(block.values, places)
        return join_ids(path, grains, ids, force, walls=False, force_n=force_n)


def _is_text(head: bytes) -> bool:
    # a step of thousands of digits leaves no room for the count: what reads the dump complains
    is_long = len(head) >= 4096 and head.startswith(b"ITEM: TIMESTEP")
    return is_long or row_word(head) is not None


def _ids(path: Path, block: DumpBlock, places: list[int]) -> IntArray:
    """Two columns of ids, shape (M, 2)."""
    listed = block.values[:, places]
    if not (are_whole(listed) and np.all(np.abs(listed) < 2.0**53)):
        raise ReadError(f"{path}: expected ids in the columns {places[0] + 1} and {places[1] + 1}")
    return listed.astype(np.int64)


def _named_contacts(
    path: Path, text: str | None, block: DumpBlock, grains: GrainTable
) -> JoinedContacts:
    """Contacts in columns of any compute, which the user names one by one."""
    places = named_places(path, text, block)
    ids = _ids(path, block, [places[key] for key in IDS])
    force = named_force(block, places)
    touch = touching_pairs(grains, rows_of_ids(grains, ids), force)
    force = None if force is None else force[touch]
    return join_ids(path, grains, ids[touch], force, walls=False)


def _given_places(path: Path, keywords: str | None, block: DumpBlock) -> dict[str, int]:
    """The first column of each keyword of the compute; empty if they are not given."""
    if keywords is None:
        return {}
    words = keywords.split()
    sizes = dict(PAIR_VALUES)
    for word in words:
        match = re.fullmatch(r"history:(\d+)", word)
        if match:
            sizes["history"] = int(match[1])
    asked = {word.partition(":")[0] for word in words}
    unknown = asked - set(sizes)
    if unknown or "id" not in asked:
        raise ReadError(
            f"{path}: `contact_columns`: expected keywords of compute pair/gran/local, id among "
            f"them ({', '.join(sizes)}), found {keywords!r}"
        )
    places, place = {}, 0
    for word, size in sizes.items():
        if word in asked:
            places[word] = place
            place += size
    if place != block.values.shape[1]:
        raise ReadError(
            f"{path}: `contact_columns={keywords!r}` makes {place} columns, the file has "
            f"{block.values.shape[1]}"
        )
    return places


def _forces(
    values: FloatArray, places: dict[str, int]
) -> tuple[FloatArray | None, FloatArray | None]:
    """The force on the second grain and its normal part, where the file has those on the first."""
    force, normal, tangential = (
        -values[:, places[name] : places[name] + 3] if name in places else None
        for name in ("force", "force_normal", "force_tangential")
    )
    if force is None and normal is not None and tangential is not None:
        force = normal + tangential
    return force, normal


def _pair_column(values: FloatArray, grains: GrainTable) -> int | None:
    """First of the three columns id1, id2, periodic flag; None if there is not just one choice."""
    candidates = [
        place
        for place in range(values.shape[1] - 2)
        if np.isin(values[:, place + 2], (0, 1)).all()
        and are_ids(values[:, place], grains)
        and are_ids(values[:, place + 1], grains)
        and np.all(values[:, place] != values[:, place + 1])
    ]
    return candidates[0] if len(candidates) == 1 else None


@np.errstate(over="ignore", invalid="ignore")
def _pushes(values: FloatArray, place: int, grains: GrainTable) -> bool:
    """Whether the three columns behind the periodic flag push the first grain off the second."""
    force = values[:, place + 3 : place + 6]
    if force.shape[1] < 3:
        return False
    first, second = rows_of_ids(grains, values[:, place : place + 2]).T
    branch = grains.position[second] - grains.position[first]
    if grains.cell is not None:
        branch = branch + grains.cell.nearest_image(branch) @ grains.cell.vectors
    pushed = np.sum(force * branch, axis=1) < 0
    # damping makes the force of a few contacts attractive
    return bool(pushed.mean() > 0.9)


class _WallColumns(NamedTuple):
    """Where a file of wall/gran/local has what."""

    id: int
    """Of the grain."""
    centre: int
    """Where the grain is, in three columns."""


@np.errstate(over="ignore", invalid="ignore")
def _wall_columns(values: FloatArray, grains: GrainTable) -> _WallColumns | None:
    """The ids of grains stand behind wall and triangle, and behind a listed centre."""
    for place in range(5, values.shape[1]):
        if not are_ids(values[:, place], grains) or not are_whole(values[:, place - 2 : place]):
            continue
        rows = rows_of_ids(grains, values[:, place])
        centres, size = grains.position[rows], grains.radius[rows]
        for start in range(place - 4):
            distance = np.linalg.norm(values[:, start : start + 3] - centres, axis=1)
            if np.mean(distance < 0.01 * size) > MOST_ROWS:
                return _WallColumns(place, start)
    return None


def _joined_walls(
    path: Path, values: FloatArray, columns: _WallColumns, grains: GrainTable
) -> JoinedContacts:
    """Contacts with walls of each grain, and their forces if the file has them."""
    ids = values[:, columns.id]
    rows = rows_of_ids(grains, ids)
    if np.any(rows < 0):
        raise ReadError(
            f"{path}: names the grain {ids[np.argmin(rows)]:g}, which is not in the grain file: "
            f"do both files belong to the same step?"
        )
    forces = _wall_forces(values, columns, rows, grains)
    return JoinedContacts(None, count_walls(rows, len(grains.radius)), forces)


@np.errstate(over="ignore", invalid="ignore")
def _wall_forces(
    values: FloatArray, columns: _WallColumns, rows: IntArray, grains: GrainTable
) -> ListedWallForces | None:
    """
    The force behind the ids and the point before the centre, if they are what they seem to be.

    The point lies on the grain's surface, and the force pushes the grain off it.
    """
    point = values[:, max(columns.centre - 3, 0) : columns.centre]
    force = values[:, columns.id + 1 : columns.id + 4]
    if point.shape[1] < 3 or force.shape[1] < 3:
        return None
    inwards = values[:, columns.centre : columns.centre + 3] - point
    distance = np.linalg.norm(inwards, axis=1) / grains.radius[rows]
    touches = (distance > 0.5) & (distance < 1.01)
    pushes = np.sum(force * inwards, axis=1) > 0
    # damping makes the force of a few contacts attractive
    if touches.mean() < MOST_ROWS or pushes.mean() < 0.9:
        return None
    return ListedWallForces(rows, point, force)
