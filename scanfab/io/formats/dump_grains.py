"""Grains in the dumps of LIGGGHTS and LAMMPS, text and binary, which are the same for both."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

from scanfab.base.errors import ReadError
from scanfab.io.formats.columns import grain_table, has_radius, room_for_columns
from scanfab.io.parse.binary_dump import names_of_binary, read_binary
from scanfab.io.parse.text_dump import read_columns, row_word
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot

# LAMMPS called ids so until 2008
OLD_ID = "tag"


def dump_kind(head: bytes) -> FileKind:
    """Grains are ATOMS; whatever else a text dump counts are contacts."""
    if row_word(head) != "ATOMS":
        return "contacts"
    names = re.search(rb"^ITEM: ATOMS(.*)$", head, re.MULTILINE)
    columns = names[1].decode("utf-8", "replace").split() if names else []
    return "grains" if has_radius(columns) else "points"


def read_dump_grains(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """Columns in any order and any subset that suffices; of repeated names the first counts."""
    columns, cell = read_columns(snapshot, partial(room_for_columns, options))
    where = f", step {snapshot.step}"
    if columns and "1" in columns:
        _refuse_unnamed(snapshot.path, "dump", len(columns), options)
        options = _numbered(options)
    elif OLD_ID in columns and "id" not in {*columns, *options.columns}:
        options = replace(options, columns={"id": OLD_ID, **options.columns})
    return grain_table(snapshot.path, columns, cell, options, where)


def _refuse_unnamed(path: Path, what: str, width: int, options: ReadOptions) -> None:
    """Users must say what the columns are."""
    if not options.columns:
        raise ReadError(
            f"{path}: this {what} does not name its {width} columns: name them as the deck "
            f'lists them, by their numbers from 1: `columns="id=1,type=2,x=3,y=4,z=5,radius=6"`'
        )


def _numbered(options: ReadOptions) -> ReadOptions:
    """Numbers of columns as their names."""
    named = {what: str(own) for what, own in options.columns.items()}
    return replace(options, columns=named)


def binary_kind(head: bytes) -> FileKind:
    """Grains; without names of columns, which users then give, nobody can tell more."""
    names = names_of_binary(head)
    return "points" if isinstance(names, list) and not has_radius(names) else "grains"


def read_binary_grains(snapshot: Snapshot, options: ReadOptions) -> GrainTable:
    """Columns by their names; by their numbers from 1 where the file has no names."""
    path, dump = snapshot.path, read_binary(snapshot)
    width = dump.values.shape[1]
    names = dump.names or [f"{place + 1}" for place in range(width)]
    if dump.names is None:
        _refuse_unnamed(path, "binary dump", width, options)
    columns = {name: dump.values[:, names.index(name)] for name in names}
    return grain_table(path, columns, dump.cell, _numbered(options), f", step {snapshot.step}")
