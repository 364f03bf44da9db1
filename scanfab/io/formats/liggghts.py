"""
LIGGGHTS: ``dump custom`` and ``dump local`` text, and its VTK files.

The column names in ``dump local`` have no meaning. ``compute pair/gran/local`` and
``wall/gran/local`` write their values in a fixed order, whatever the order of the keywords.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.contacts import branches, count_walls, rows_of_ids
from scanfab.io.formats.dump_contacts import MOST_ROWS, Places, are_ids, are_whole, id_column
from scanfab.io.formats.lammps import FORMS, DumpReader
from scanfab.io.formats.vtk import VtkReader
from scanfab.io.reader import GrainTable, JoinedContacts
from scanfab.packing.contacts import ListedWallForces

# at least this share of contact forces is repulsive; damping makes a few attractive
PUSHES = 0.9


class LiggghtsVtk(VtkReader):
    """Reads VTK files, in which contacts are between grains only."""

    walls = False
    # the force acts on the first grain
    force_arrays = ("force", "force_normal", "force_tangential")
    sign = -1.0


class LiggghtsReader(DumpReader):
    """Reader plugin for the dumps of LIGGGHTS."""

    name = "liggghts"
    description = (
        "LIGGGHTS dump custom (text, binary), dump local, custom/vtk, local/gran/vtk, data files"
    )
    extensions = (".liggghts", ".dump", ".vtk", ".vtp", ".vtu", ".bin", ".data")

    lists_walls = True
    forms = (*FORMS, LiggghtsVtk())

    @np.errstate(over="ignore", invalid="ignore")
    def found(
        self, path: Path, values: FloatArray, grains: GrainTable
    ) -> Places | JoinedContacts | None:
        """
        Recognise the columns of ``pair/gran/local``: two ids, then the periodic flag 0 or 1.

        The next three columns are the force if they push the grains apart. If there are no pairs,
        the list is tried as contacts with walls.
        """
        place = id_column(values, grains, is_flagged=True)
        if place is None:
            return _walls(path, values, grains)
        force = [place + 3, place + 4, place + 5]
        is_force = False
        if place + 6 <= values.shape[1]:
            branch = branches(grains, rows_of_ids(grains, values[:, place : place + 2]))
            along = np.sum(values[:, force] * branch, axis=1)
            is_force = bool(np.mean(along < 0) > PUSHES)
        return Places([place, place + 1], [force] if is_force else [])


@np.errstate(over="ignore", invalid="ignore")
def _walls(path: Path, values: FloatArray, grains: GrainTable) -> JoinedContacts | None:
    """
    Number of contacts with walls of each grain, and forces if there are any; None for other files.

    The columns are: contact point, centre of the grain, ids of wall, triangle and grain, force on
    the grain. Point and force are optional and recognised by their values: the point lies on the
    surface of the grain, and the force pushes the grain away from it.
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
                name = f"the grain {values[np.argmin(rows), place]:g}"
                raise ReadError(f"{path}: names {name}, which is not in the grain file")
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
