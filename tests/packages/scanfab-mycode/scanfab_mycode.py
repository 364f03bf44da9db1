"""Reads and writes the dumps of My Code: a line ``MYCODE N``, and N lines ``id x y z radius``."""

from pathlib import Path

import numpy as np

from scanfab import Packing, ReadError
from scanfab.io import (
    GrainTable,
    JoinedContacts,
    Left,
    ReadOptions,
    Snapshot,
    first_bytes,
    grain_table,
    more_columns,
    plain,
)

NAMES = ("id", "x", "y", "z", "radius")


class MyCode:
    name = "mycode"
    description = "the dumps of My Code"
    extensions = (".mycode",)

    def recognises(self, path: Path) -> bool:
        return first_bytes(path, 7) == b"MYCODE "

    def kind(self, path: Path):
        return "grains"  # or "contacts", or "other" for walls and boxes

    def snapshots(self, path: Path) -> list[Snapshot]:
        return [Snapshot(path)]  # one frame; scanfab takes the step from the file's name

    def read_grains(self, snapshot: Snapshot, options: ReadOptions) -> GrainTable:
        path = snapshot.path
        head, *lines = plain(path).read_bytes().split(b"\n")
        rows = [line.split() for line in lines[:-1]]  # a line without an end is incomplete
        try:
            count = int(head.split()[1])
            if len(rows) != count or any(len(row) != len(NAMES) for row in rows):
                raise ValueError(f"expected {count} rows of {len(NAMES)} numbers")
            columns = {
                name: np.array([(int if name == "id" else float)(row[place]) for row in rows])
                for place, name in enumerate(NAMES)
            }
        except (ValueError, IndexError, OverflowError) as error:
            raise ReadError(f"{path}: cannot be read as a dump of My Code: {error}") from None
        return grain_table(path, columns, None, options)

    def read_contacts(
        self, snapshot: Snapshot, options: ReadOptions, grains: GrainTable
    ) -> JoinedContacts:
        raise ReadError(f"{snapshot.path}: My Code writes no contacts")

    def write(self, packing: Packing, path: Path) -> Left:
        columns = (packing.id, *packing.position.T, packing.radius)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        text = "".join(f"{id} {x!r} {y!r} {z!r} {r!r}\n" for id, x, y, z, r in rows)
        path.write_text(f"MYCODE {len(packing)}\n{text}")
        # contacts, cell, step and columns are written beside the file, and found there again
        return Left(contacts=True, frame=True, columns=tuple(more_columns(packing)))
