"""Contacts from geometry, where the dump lists none."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanfab.errors import PackingError, SettingsError
from scanfab.kernels.neighbours import overlapping_pairs
from scanfab.packing import ContactList, Packing

__all__ = ["find_contacts"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


def find_contacts(packing: Packing, tolerance: float = 0.0) -> Packing:
    """
    Find the contacts of a packing from positions and radii.

    Two grains (or a grain and a periodic image) are in contact if their distance is below
    (r1 + r2)(1 + tolerance).

    Parameters
    ----------
    packing : Packing
        Its own contacts, if any, are replaced.
    tolerance : float, optional
        Relative, dimensionless. Lattices and text files with 6 digits need about 1e-4: at 0,
        exact ties are decided by rounding.

    Returns
    -------
    Packing
        The same grains, with ``contacts.source == "geometric"``.

    Raises
    ------
    SettingsError
        If the tolerance is not a number >= 0.
    PackingError
        If the cell is tilted.

    Examples
    --------
    >>> from scanfab import Packing, find_contacts
    >>> line = Packing([[0, 0, 0], [1.9, 0, 0], [3.8, 0, 0]], 1.0)
    >>> find_contacts(line).contacts.pairs
    array([[0, 1],
           [1, 2]])
    """
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise SettingsError(f"contact tolerance: expected a number >= 0, found {tolerance}")
    if packing.is_periodic:
        pairs, image = _periodic_pairs(packing, 1.0 + tolerance)
    else:
        pairs = _pairs(packing.position, packing.radius, 1.0 + tolerance, len(packing))
        image = np.zeros((len(pairs), 3), np.int64)
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return packing.with_contacts(ContactList(pairs[order], image[order], source="geometric"))


def _periodic_pairs(packing: Packing, scale: float) -> tuple[IntArray, IntArray]:
    """Pairs among the grains and their images just outside the cell, each once."""
    cell = packing.cell
    assert cell is not None
    if not cell.is_orthogonal:
        raise PackingError("contacts by geometry in a tilted cell are not supported yet")
    count = len(packing)
    reach = 2.0 * packing.radius.max(initial=0.0) * scale
    ghosts, row, image = cell.images(packing.position, reach)
    pairs = _pairs(
        np.concatenate([packing.position, ghosts]),
        np.concatenate([packing.radius, packing.radius[row]]),
        scale,
        count,
    )
    rows = np.concatenate([np.arange(count), row])
    images = np.concatenate([np.zeros((count, 3), np.int64), image])
    first, second = pairs[:, 0], rows[pairs[:, 1]]
    # a contact through a face is met from both of its grains: the Packing keeps one of them
    return np.column_stack([first, second]), images[pairs[:, 1]]


def _pairs(position: FloatArray, radius: FloatArray, scale: float, owners: int) -> IntArray:
    """Overlapping pairs of which the first sphere is one of the first ``owners``."""
    if owners == 0:
        return np.zeros((0, 2), np.int64)
    low = position.min(axis=0)
    extent = position.max(axis=0) - low
    edge = 2.0 * radius.max() * scale
    # not more bins than twice the spheres, in memory as in time
    edge = max(edge, float(np.cbrt(np.prod(np.maximum(extent, edge)) / (2 * len(radius)))))
    shape = (extent / edge).astype(np.int64) + 1
    room = 8 * len(radius)
    while True:
        pairs = np.empty((room, 2), np.int64)
        found = overlapping_pairs(position, radius, scale, owners, low, edge, shape, pairs)
        if found <= room:
            return pairs[:found]
        room = found
