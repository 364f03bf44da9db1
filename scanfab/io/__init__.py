"""
Reading and writing of files: users name files, scanfab makes series of frames of them.

Readers in other packages may import the names below (see docs/extending/reader.md). The modules
that define these names may change.
"""

from scanfab.io.columns import grain_table as grain_table
from scanfab.io.contacts import join_ids as join_ids
from scanfab.io.contacts import join_positions as join_positions
from scanfab.io.files import file_inside as file_inside
from scanfab.io.files import first_bytes as first_bytes
from scanfab.io.files import plain as plain
from scanfab.io.reader import Carries as Carries
from scanfab.io.reader import FileKind as FileKind
from scanfab.io.reader import GrainTable as GrainTable
from scanfab.io.reader import JoinedContacts as JoinedContacts
from scanfab.io.reader import Reader as Reader
from scanfab.io.reader import ReadOptions as ReadOptions
from scanfab.io.reader import Snapshot as Snapshot
from scanfab.io.writer import Left as Left
from scanfab.io.writer import Writer as Writer
from scanfab.io.writer import more_columns as more_columns
from scanfab.packing.contacts import WallForces as WallForces
