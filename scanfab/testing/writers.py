"""
The check of writers of packings: what they write must be read back to the last bit.

Also packings that need everything of a format, and the differences of two packings.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.errors import ScanfabNote
from scanfab.io.convert import save_packing
from scanfab.io.sources import read
from scanfab.io.writer import Writer, flat
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing
from scanfab.packing.search import find_contacts

# ids that no float can hold
LARGE = 2**60 + 1


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
        If something was lost; the message says what.

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


def made_up_packings() -> dict[str, Packing]:
    """
    Small packings by what is special in them.

    Returns
    -------
    dict of str to Packing
        Open and periodic ones, tilted cells, forces, bodies, contacts with walls, columns of
        texts and vectors, ids above 2^53, no contacts, no grains.

    Examples
    --------
    >>> from scanfab.testing import made_up_packings
    >>> packing = made_up_packings()["everything"]
    >>> len(packing), packing.cell.periodic, packing.contacts.force.shape[1]
    (40, (True, True, False), 3)
    """
    random = np.random.default_rng(7)
    cell = Cell(
        [[1.1, 0, 0], [0.3, 1.3, 0], [-0.2, 0.1, 0.9]], (True, True, False), (0.1, -1, 1 / 3)
    )
    position = random.random((40, 3)) @ cell.vectors + cell.origin
    radius = 0.13 + 0.1 * random.random(40)
    rows = np.arange(40)
    plain = Packing(position, radius)
    tilted = Packing(position, radius, cell=cell, id=random.permutation(40) + LARGE)
    found = find_contacts(tilted).contacts
    assert found is not None
    contacts = ContactList(found.pairs, found.image, random.normal(size=(len(found), 3)))
    columns = {
        "type": rows % 3 + 1,
        "velocity": random.normal(size=(40, 3)),
        "element": np.array(["Si", "quartz"])[rows % 2],
        "words, and more": np.array(["a b", 'c"d', "e,f", "é"])[rows % 4],
        "large": rows + LARGE,
        "tiny": random.random(40) * 1e-310,
    }
    everything = Packing(
        position,
        radius,
        id=tilted.id,
        cell=cell,
        columns=columns,
        bodies=np.where(rows % 5 == 0, rows // 10, -1),
        wall_contacts=rows % 3,
        contacts=contacts,
        step=123456789012,
        time=0.1 + 0.2,
    )
    normal = contacts._replace(force=None, force_n=random.normal(size=len(found)))
    # a turn about all axes
    turn, _ = np.linalg.qr(np.array([[1.0, 2, 3], [-1, 1, 0.5], [2, 0, 1]]))
    turned = Cell(cell.vectors @ turn * np.sign(np.linalg.det(turn)))
    return {
        "plain": plain,
        "one grain": Packing([[0.25, -1e-9, 3e9]], 0.5, step=0),
        "everything": everything,
        "normal forces": tilted.with_contacts(normal),
        "a turned cell": Packing(position, radius, cell=turned, time=-1.5),
        "no contacts": plain.with_contacts(ContactList(np.zeros((0, 2), np.int64))),
        "no grains": Packing(np.zeros((0, 3)), np.zeros(0), step=3),
    }


def differences(one: Packing, two: Packing) -> list[str]:
    """
    In what two packings differ, to the last bit; columns of several values are compared one by one.

    Parameters
    ----------
    one, two : Packing
        For instance a packing and what was read back; ``two`` may have more columns.

    Returns
    -------
    list of str
        Sentences; empty if they agree.
    """
    first, second = _values_of(one), _values_of(two)
    found = []
    for name, value in first.items():
        other = second.get(name)
        if value is None or other is None:
            found += [] if value is other else [f"{name}: {value!r} and {other!r}"]
            continue
        mine, theirs = np.asarray(value), np.asarray(other)
        if mine.shape != theirs.shape:
            found.append(f"{name}: shapes {mine.shape} and {theirs.shape}")
            continue
        if "U" in (mine.dtype.kind, theirs.dtype.kind) and mine.size:
            mine, theirs = mine.astype(str), theirs.astype(str)
        same = (mine == theirs) | ((mine != mine) & (theirs != theirs))
        if not np.all(same):
            place = np.unravel_index(int(np.argmin(same)), mine.shape) if mine.shape else ()
            where = tuple(map(int, place))
            found.append(f"{name}: {mine[place]!r} and {theirs[place]!r} at {where}")
    return found


def _values_of(packing: Packing) -> dict[str, Any]:
    """All that a packing holds, by names for messages; None for what it does not have."""
    parts = {
        "": ("position", "radius", "id", "wall_contacts", "step", "time"),
        "cell": ("vectors", "origin", "periodic"),
        "bodies": ("number",),
        "contacts": ("pairs", "image", "normal", "point", "force", "force_n"),
    }
    found: dict[str, Any] = {}
    for part, names in parts.items():
        owner = getattr(packing, part) if part else packing
        found |= {f"{part} {name}".strip(): getattr(owner, name, None) for name in names}
    return found | {f"column {name}": values for name, values in flat(packing.columns).items()}
