"""LAMMPS: ``dump custom``, ``dump local``, ``dump yaml``, ``dump netcdf`` and ``write_data``."""

from __future__ import annotations

import re
from pathlib import Path

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
    are_ids,
    are_whole,
    gaps,
    named_force,
    named_places,
    refuse_rounded_ids,
    touching_pairs,
)
from scanfab.io.formats.join import join_ids, rows_of_ids
from scanfab.io.formats.lammps_data import is_data_file, of_liggghts, read_data_grains, step_of_data
from scanfab.io.formats.lammps_netcdf import (
    index_netcdf,
    is_netcdf,
    netcdf_kind,
    read_netcdf_grains,
)
from scanfab.io.formats.lammps_yaml import index_yaml, is_yaml, read_yaml_grains, yaml_kind
from scanfab.io.parse.binary_dump import index_binary, is_binary, names_of_binary
from scanfab.io.parse.text_dump import DumpBlock, index_dump, read_block, row_word
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    ReadOptions,
    Snapshot,
)

# LIGGGHTS writes neither of these items, and its bounds with six digits
LAMMPS_ITEMS = re.compile(
    rb"^ITEM: (?:UNITS|TIME)[ \t]*\r?$"
    rb"|^ITEM: BOX BOUNDS[^\n]*\n-?\d\.\d{16}e[-+]\d+ "
    rb"|^ITEM: BOX BOUNDS abc origin",
    re.MULTILINE,
)

# in r1 + r2: pairs that LAMMPS lists are not further apart, unless the columns are no ids
NEIGHBOURS = 2.0
# of the rows of a list of neighbours
NEARLY_ALL = 0.98


class LammpsReader:
    """Reader plugin for what LAMMPS dumps."""

    name = "lammps"
    description = "LAMMPS dump custom (text, binary, yaml, netcdf), dump local (text), write_data"
    extensions = (".lammpstrj", ".lmp", ".data", ".local", ".bin", ".yaml", ".nc")

    def recognises(self, path: Path) -> bool:
        """What LAMMPS writes and LIGGGHTS does not: units, time, bounds with all digits."""
        head = first_bytes(path)
        # the old layout without names is LIGGGHTS' as well
        is_new = isinstance(names_of_binary(head), list)
        return (
            is_new
            or is_yaml(head)
            or is_netcdf(head)
            or (is_data_file(head) and not of_liggghts(head))
            or (row_word(head) is not None and LAMMPS_ITEMS.search(head) is not None)
        )

    def kind(self, path: Path) -> FileKind:
        """Grains are ATOMS; whatever else a text dump counts are contacts."""
        head = first_bytes(path, 1 << 16)
        if is_data_file(head):
            return "grains"
        if is_yaml(head):
            return yaml_kind(head)
        if is_netcdf(head):
            return netcdf_kind(path)
        if is_binary(head):
            return binary_kind(head)
        return "other" if row_word(head) is None else dump_kind(head)

    def snapshots(self, path: Path) -> list[Snapshot]:
        """By ``ITEM: TIMESTEP``; a data file is one."""
        head = first_bytes(path)
        if is_data_file(head):
            return [Snapshot(path, step=step_of_data(head))]
        if is_yaml(head):
            return index_yaml(path)
        if is_netcdf(head):
            return index_netcdf(path)
        return index_binary(path) if is_binary(head) else index_dump(path)

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        """Columns by their names; of a data file by the atom style."""
        head = first_bytes(snapshot.path)
        if is_data_file(head):
            return read_data_grains(snapshot, options)
        if is_yaml(head):
            return read_yaml_grains(snapshot, options)
        if is_netcdf(head):
            return read_netcdf_grains(snapshot, options)
        if is_binary(head):
            return read_binary_grains(snapshot, options)
        return read_dump_grains(snapshot, options)

    def carries(self, path: Path) -> Carries:
        """A data file has a box without boundary flags."""
        return "box" if is_data_file(first_bytes(path)) else "cell"

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        """
        Pairs of ``compute property/local`` that touch, with the force of ``compute pair/local``.

        Which column is what follows from ``contact_columns``; without it the ids are found by
        their values, if there is no doubt, and no force is read.
        """
        path = snapshot.path
        head = first_bytes(path)
        if is_data_file(head) or is_yaml(head) or is_netcdf(head):
            raise ReadError(f"{path}: a file of this kind holds no contacts")
        if is_binary(head):
            raise ReadError(
                f"{path}: contacts are read from text: dump local to a file without .bin"
            )
        block = read_block(snapshot)
        if len(block.values) == 0:
            return join_ids(path, grains, np.zeros((0, 2), np.int64), None, walls=False)
        if grains.id is None:
            raise ReadError(f"{path}: names grains by id, but the grain file has no ids")
        refuse_rounded_ids(path, block.values, grains)
        places = named_places(path, options.contact_columns, block)
        ids = _ids(path, block, places, grains)
        force = named_force(block, places)
        touch = touching_pairs(grains, rows_of_ids(grains, ids), force)
        if force is not None:
            force = force[touch]
        return join_ids(path, grains, ids[touch], force, walls=False)


def _ids(path: Path, block: DumpBlock, places: dict[str, int], grains: GrainTable) -> IntArray:
    """Both ids of each row, shape (M, 2)."""
    columns = [places[key] for key in IDS] if places else _id_columns(block.values, grains)
    if columns is None:
        raise ReadError(
            f"{path}: cannot tell which columns are the two ids of a contact: the ids may belong "
            f"to another step; or name them with "
            f'`contact_columns="id1=NAME,id2=NAME"`; the columns are {", ".join(block.names)}'
        )
    listed = block.values[:, columns]
    if not (are_whole(listed) and np.all(np.abs(listed) < 2.0**53)):
        raise ReadError(
            f"{path}: expected ids in the columns {columns[0] + 1} and {columns[1] + 1}"
        )
    return listed.astype(np.int64)


def _id_columns(values: FloatArray, grains: GrainTable) -> list[int] | None:
    """Two neighbouring columns that name neighbouring grains; None unless there is one choice."""
    found = [
        [place, place + 1]
        for place in range(values.shape[1] - 1)
        if _name_neighbours(values[:, place : place + 2], grains)
    ]
    return found[0] if len(found) == 1 else None


@np.errstate(over="ignore", invalid="ignore")
def _name_neighbours(values: FloatArray, grains: GrainTable) -> bool:
    """Whether they are ids of grains that lie side by side, and hardly any pair occurs twice."""
    if not all(are_ids(values[:, k], grains) for k in range(2)):
        return False
    # a pair through several images occurs as often; two types of grains do all the time
    if len(np.unique(np.sort(values, axis=1), axis=0)) < 0.5 * len(values):
        return False
    rows = rows_of_ids(grains, values)
    gap = gaps(grains, rows[(rows >= 0).all(axis=1)])
    return bool(np.mean(gap < NEIGHBOURS - 1.0) > NEARLY_ALL)
