"""
What every writer of packings must do: what it writes is read back, to the last bit.

Packings that ask everything of a format, and in what two packings differ.
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

# no decimal number has these ids
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
    found = (_difference(name, value, second.get(name)) for name, value in first.items())
    return [difference for difference in found if difference]


def _values_of(packing: Packing) -> dict[str, Any]:
    """All that a packing holds, by the names of messages; None: it has no such thing."""
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


def _difference(name: str, one: Any, two: Any) -> str:
    """In words; empty if there is none."""
    if one is None or two is None:
        return "" if one is two else f"{name}: {one!r} and {two!r}"
    first, second = np.asarray(one), np.asarray(two)
    if first.shape != second.shape:
        return f"{name}: shapes {first.shape} and {second.shape}"
    if "U" in (first.dtype.kind, second.dtype.kind) and first.size:
        first, second = first.astype(str), second.astype(str)
    same = (first == second) | ((first != first) & (second != second))
    if np.all(same):
        return ""
    place = np.unravel_index(int(np.argmin(same)), first.shape) if first.shape else ()
    return f"{name}: {first[place]!r} and {second[place]!r} at {tuple(map(int, place))}"
