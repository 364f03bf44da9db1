"""
Where the snapshots of a large file begin and end, kept for later runs.

A file of many GB is looked through once, not once in each run.
"""

from __future__ import annotations

import hashlib
import json
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scanfab.base.files import make_private, user_folder, whole_file
from scanfab.io.reader import Snapshot

if TYPE_CHECKING:
    from scanfab.io.reader import Reader


# bytes: smaller files are looked through as fast as their index is found
LARGE = 64 << 20
# of the end of a file, by which one that was written anew is told from the one before
END_BYTES = 1 << 12


def snapshots_of(reader: Reader, path: Path) -> list[Snapshot]:
    """
    The snapshots of a file, from an earlier run if the file is as it was then.

    Nothing is kept of a file that ends in an incomplete snapshot, of which each run is to warn, nor
    of readers of other packages, whose versions nobody knows.
    """
    kept = _place(reader, path)
    if kept is None:
        return reader.snapshots(path)
    stamp = _stamp(reader, path)
    # an index that is damaged, or not there, is made again
    with suppress(OSError, ValueError, LookupError, TypeError):
        found = json.loads(kept.read_bytes())
        if found["stamp"] == stamp:
            return [Snapshot(path, *of_one) for of_one in found["snapshots"]]
    snapshots = reader.snapshots(path)
    size = path.stat().st_size
    plain = all(type(one) is Snapshot and one.path == path for one in snapshots)
    if plain and max((one.stop or 0 for one in snapshots), default=0) == size:
        rows = [(one.step, one.time, one.start, one.stop, one.stepless) for one in snapshots]
        with suppress(OSError):
            make_private(kept.parent)
            with whole_file(kept) as part:
                part.write_text(json.dumps({"stamp": stamp, "snapshots": rows}), "utf-8")
    return snapshots


def _place(reader: Reader, path: Path) -> Path | None:
    """Where the index of a file would be kept; None if it is not."""
    own = type(reader).__module__.startswith("scanfab.")
    large = path.is_file() and path.stat().st_size >= LARGE
    folder = user_folder() if own and large else None
    if folder is None:
        return None
    name = hashlib.sha256(str(path.resolve()).encode(errors="surrogateescape")).hexdigest()
    return folder / "indexes" / f"{name[:24]}.json"


def _stamp(reader: Reader, path: Path) -> list[Any]:
    """What tells a file from the one that it was, and one way of reading from another."""
    with open(path, "rb") as file:
        status = path.stat()
        file.seek(max(status.st_size - END_BYTES, 0))
        end = hashlib.sha256(file.read()).hexdigest()
    return [version("scanfab"), reader.name, status.st_size, status.st_mtime_ns, end]
