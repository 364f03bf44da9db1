"""
LIGGGHTS: ``dump custom`` and ``dump local`` text, and its VTK files.

In ``dump local`` the column names say nothing. ``compute pair/gran/local`` and ``wall/gran/local``
write their values in an order of their own, whatever the order of the keywords.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.contacts import count_walls, join_ids, rows_of_ids
from scanfab.io.files import first_bytes
from scanfab.io.formats.binary_dump import names_of_binary
from scanfab.io.formats.ids import MOST_ROWS, are_ids, are_whole, named_places
from scanfab.io.formats.lammps import (
    DumpReader,
    form_of,
    id_column,
    is_restart,
    join_listed,
    read_contact_rows,
    whole_ids,
)
from scanfab.io.formats.lammps_data import is_data_file, of_liggghts
from scanfab.io.formats.text_dump import is_dump
from scanfab.io.formats.vtk import VtkReader, vectors
from scanfab.io.mesh import Mesh
from scanfab.io.reader import (
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)
from scanfab.packing.walls import ListedWallForces

# values of compute pair/gran/local in the order in which they are written, and how many
PAIR_VALUES = {"pos": 6, "vel": 6, "id": 3, "force": 3, "force_normal": 3, "force_tangential": 3}
PAIR_VALUES |= {"torque": 3, "torque_normal": 3, "torque_tangential": 3, "history": 3}
PAIR_VALUES |= {"contactArea": 1, "delta": 1, "contactPoint": 3, "ms_id": 2, "heatFlux": 1}
# damping makes the force of a few contacts attractive; the others push
PUSHES = 0.9


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


class LiggghtsReader(DumpReader):
    """Reader plugin for what LIGGGHTS dumps."""

    name = "liggghts"
    description = (
        "LIGGGHTS dump custom (text, binary), dump local, custom/vtk, local/gran/vtk, data files"
    )
    extensions = (".liggghts", ".dump", ".vtk", ".vtp", ".vtu", ".bin", ".data")

    other = LiggghtsVtkReader()

    def recognises(self, path: Path) -> bool:
        """An ``ITEM:`` dump, or a data file, restart or legacy VTK file that names LIGGGHTS."""
        head = first_bytes(path)
        if is_data_file(head) or is_restart(head):
            return of_liggghts(head)
        if head.startswith(b"# vtk DataFile"):
            return b"LIGGGHTS" in head.partition(b"\n")[2].partition(b"\n")[0]
        # LAMMPS' binary dumps name their columns, these are numbered
        return is_dump(head) or (names_of_binary(head) or [""])[0] == "1"

    def beside(self, path: Path) -> list[Path]:
        """A VTK file has its box beside it."""
        return self.other.beside(path)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        Pairs of ``pair/gran/local``, or grains of ``wall/gran/local``.

        Which column is what follows from ``contact_columns``, which are the keywords of the compute
        or names of columns; or from the values: two columns of ids, then the periodic flag 0 or 1.
        """
        path, told = snapshot.path, options.contact_columns
        if form_of(path) is None:
            return self.other.read_contacts(snapshot, options, grains)
        dump = read_contact_rows(snapshot, grains)
        if dump.rows == 0:
            return join_listed(path, dump, {}, grains)
        values = dump.values
        pair = id_column(values, grains, is_flagged=True)
        # also where `contact_columns` are named: those of the pairs
        walls = _walls(path, values, grains) if pair is None else None
        if walls is not None:
            return walls
        if told is not None and "=" in told:
            return join_listed(path, dump, named_places(path, told, dump), grains)
        places = {} if told is None else _keyword_places(path, told, values.shape[1])
        place = places.get("id", pair)
        if place is None:
            raise ReadError(
                f"{path}: cannot tell which columns are the two ids of a contact: the ids may "
                f"belong to another step; or name the keywords of the compute with "
                f'`contact_columns="pos id force ..."`, or the columns with '
                f'`contact_columns="id1=c_c[1],id2=c_c[2]"`, which are {", ".join(dump.names)}; a '
                f'dump of LAMMPS is read with `format="lammps"`'
            )
        if not places and _pushes(values, place, grains):
            places = {"force": place + 3}
        # the file has the forces on the first grain
        parts = {
            name: -values[:, places[name] : places[name] + 3]
            for name in ("force", "force_normal", "force_tangential")
            if name in places
        }
        force, normal = parts.get("force"), parts.get("force_normal")
        if force is None and normal is not None and "force_tangential" in parts:
            force = normal + parts["force_tangential"]
        ids = whole_ids(path, dump, [place, place + 1])
        return join_ids(path, grains, ids, force, walls=False, force_n=normal)


def _keyword_places(path: Path, told: str, width: int) -> dict[str, int]:
    """The first column of each keyword of the compute, as users name the keywords."""
    sizes, asked = dict(PAIR_VALUES), set()
    for word in told.split():
        name, _, count = word.partition(":")
        if name == "history" and count.isdecimal():
            sizes[name] = int(count)
        asked.add(name)
    if not asked <= sizes.keys() or "id" not in asked:
        raise ReadError(
            f"{path}: `contact_columns`: expected keywords of compute pair/gran/local, id among "
            f"them ({', '.join(sizes)}), found {told!r}"
        )
    places, place = {}, 0
    for name, size in sizes.items():
        if name in asked:
            places[name] = place
            place += size
    if place != width:
        raise ReadError(
            f"{path}: `contact_columns={told!r}` makes {place} columns, the file has {width}"
        )
    return places


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
    return bool(np.mean(np.sum(force * branch, axis=1) < 0) > PUSHES)


@np.errstate(over="ignore", invalid="ignore")
def _walls(path: Path, values: FloatArray, grains: GrainTable) -> JoinedContacts | None:
    """
    Contacts with walls of each grain, and their forces if the file has them; None if no such file.

    The id of the grain stands behind those of wall and triangle, and behind its centre. In front of
    the centre stands the contact point, and behind the id the force on the grain: these are told by
    their values, as the point lies on the grain's surface and the force pushes the grain off it.
    """
    for place in range(5, values.shape[1]):
        if not are_ids(values[:, place], grains) or not are_whole(values[:, place - 2 : place]):
            continue
        rows = rows_of_ids(grains, values[:, place])
        radius = grains.radius[rows]
        for start in range(place - 4):
            centre = values[:, start : start + 3]
            away = np.linalg.norm(centre - grains.position[rows], axis=1)
            if np.mean(away < 0.01 * radius) <= MOST_ROWS:
                continue
            if np.any(rows < 0):
                raise ReadError(
                    f"{path}: names the grain {values[np.argmin(rows), place]:g}, which is not in "
                    f"the grain file: do both files belong to the same step?"
                )
            point, force = values[:, max(start - 3, 0) : start], values[:, place + 1 : place + 4]
            forces = None
            if point.shape[1] == force.shape[1] == 3:
                distance = np.linalg.norm(centre - point, axis=1) / radius
                touches = (distance > 0.5) & (distance < 1.01)
                pushes = np.sum(force * (centre - point), axis=1) > 0
                if touches.mean() >= MOST_ROWS and pushes.mean() >= PUSHES:
                    forces = ListedWallForces(rows, point, force)
            return JoinedContacts(None, count_walls(rows, len(grains.radius)), forces)
    return None
