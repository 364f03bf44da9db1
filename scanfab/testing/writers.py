"""What every writer of packings must do: what it writes is read back, to the last bit."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from pathlib import Path

from scanfab.base.errors import ScanfabNote
from scanfab.io.convert import save_packing
from scanfab.io.sources import read
from scanfab.io.writer import Writer
from scanfab.testing.packings import differences, made_up_packings


def check_writer(
    writer: Writer, folder: Path, *, format: str | None = None, leave: Iterable[str] = ()
) -> None:
    """
    Write packings of all kinds, and read them back.

    Parameters
    ----------
    writer : Writer
        The plugin; a reader of its format must be installed.
    folder : Path
        An empty folder, such as pytest's ``tmp_path``.
    format : str, optional
        Name of that reader; by content if not given.
    leave : iterable of str, optional
        Which of :func:`made_up_packings` to leave out.

    Raises
    ------
    AssertionError
        That says what got lost.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from scanfab.io.writer import writer_named
    >>> from scanfab.testing import check_writer
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     check_writer(writer_named("vtp"), Path(folder))
    """
    left_out = set(leave)
    for number, (name, packing) in enumerate(made_up_packings().items()):
        if name in left_out:
            continue
        own = folder / f"{number}"
        own.mkdir()
        path = own / f"packing_7{writer.extensions[0]}"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ScanfabNote)
            save_packing(packing, path, writer)
            again = read(path, format=format)
        found = differences(packing, again)
        assert not found, f"{writer.name}: of the packing {name!r} is lost: {'; '.join(found)}"
