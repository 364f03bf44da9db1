"""
From files, as users name them, to series of frames.

These names are what a reader of another package may import; see docs/adding-a-reader.md. Where they
are defined may change.
"""

from scanfab.io.columns import grain_table
from scanfab.io.contacts import join_ids, join_positions
from scanfab.io.files import file_inside, first_bytes, plain
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    Reader,
    ReadOptions,
    Snapshot,
)
from scanfab.io.writer import Left, Writer, more_columns
from scanfab.packing.contacts import ListedWallForces

__all__ = [
    "Carries",
    "FileKind",
    "GrainTable",
    "JoinedContacts",
    "Left",
    "ListedWallForces",
    "ReadOptions",
    "Reader",
    "Snapshot",
    "Writer",
    "file_inside",
    "first_bytes",
    "grain_table",
    "join_ids",
    "join_positions",
    "more_columns",
    "plain",
]
