"""Packings that ask everything of a format, and in what two packings differ."""

from __future__ import annotations

from typing import Any

import numpy as np

from scanfab.io.written import flat
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList
from scanfab.packing.packing import Packing
from scanfab.packing.search import find_contacts

# no decimal number has these ids
LARGE = 2**60 + 1


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
    turned = Cell(cell.vectors @ _turn(), (True, True, True), (0, 0, 0))
    return {
        "plain": plain,
        "one grain": Packing([[0.25, -1e-9, 3e9]], 0.5, step=0),
        "everything": everything,
        "normal forces": tilted.with_contacts(normal),
        "a turned cell": Packing(position, radius, cell=turned, time=-1.5),
        "no contacts": plain.with_contacts(ContactList(np.zeros((0, 2), np.int64))),
        "no grains": Packing(np.zeros((0, 3)), np.zeros(0), step=3),
    }


def _turn() -> Any:
    """A turn about all axes."""
    turned, _ = np.linalg.qr(np.array([[1.0, 2, 3], [-1, 1, 0.5], [2, 0, 1]]))
    return turned * np.sign(np.linalg.det(turned))


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
    found = []
    for name in ("position", "radius", "id", "wall_contacts", "step", "time"):
        found += _different(name, getattr(one, name), getattr(two, name))
    for name in ("vectors", "origin", "periodic"):
        found += _different(f"cell: {name}", *(getattr(p.cell, name, None) for p in (one, two)))
    found += _different("bodies", *(getattr(p.bodies, "number", None) for p in (one, two)))
    for name in ("pairs", "image", "normal", "point", "force", "force_n"):
        found += _different(
            f"contacts: {name}", *(getattr(p.contacts, name, None) for p in (one, two))
        )
    columns, others = (flat(dict(packing.columns))[0] for packing in (one, two))
    for name, values in columns.items():
        if name not in others:
            found.append(f"the column {name} is not there")
        else:
            found += _different(f"the column {name}", values, others[name])
    return found


def _different(name: str, one: Any, two: Any) -> list[str]:
    if (one is None) != (two is None):
        return [f"{name}: {one!r} and {two!r}"]
    if one is None:
        return []
    first, second = np.asarray(one), np.asarray(two)
    if first.shape != second.shape:
        return [f"{name}: shapes {first.shape} and {second.shape}"]
    texts = "U" in (first.dtype.kind, second.dtype.kind)
    if texts and first.size:
        first, second = first.astype(str), second.astype(str)
    same = (first == second) | ((first != first) & (second != second))
    if np.all(same):
        return []
    place = np.unravel_index(int(np.argmin(same)), first.shape) if first.shape else ()
    return [f"{name}: {first[place]!r} and {second[place]!r} at {tuple(map(int, place))}"]
