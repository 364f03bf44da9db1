"""Grains in the text dumps of LIGGGHTS and LAMMPS, which are the same for both."""

from __future__ import annotations

import re
from functools import partial

from scanfab.io.formats.columns import grain_table, has_radius, room_for_columns
from scanfab.io.parse.text_dump import read_columns, row_word
from scanfab.io.reader import FileKind, GrainTable, ReadOptions, Snapshot

__all__ = ["dump_kind", "read_dump_grains"]


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
    return grain_table(snapshot.path, columns, cell, options, f", step {snapshot.step}")
