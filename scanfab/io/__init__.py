"""
From files, as users name them, to series of frames.

These names are what a reader of another package may import; see docs/adding-a-reader.md. Where they
are defined may change.
"""

from scanfab.io.files import plain
from scanfab.io.formats.columns import grain_table
from scanfab.io.formats.join import join_ids, join_positions
from scanfab.io.reader import (
    Carries,
    FileKind,
    GrainTable,
    JoinedContacts,
    Reader,
    ReadOptions,
    Snapshot,
)

__all__ = [
    "Carries",
    "FileKind",
    "GrainTable",
    "JoinedContacts",
    "ReadOptions",
    "Reader",
    "Snapshot",
    "grain_table",
    "join_ids",
    "join_positions",
    "plain",
]
