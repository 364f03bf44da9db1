"""fabric_map(): the fabric of a packing or of a series, block by block."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from typing import Any

from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.frames import Source
from scanfab.pipeline.maps.settings import MapSettings
from scanfab.table.table import Table


def fabric_map(
    source: Source,
    *,
    grid: str | Sequence[int] | None = None,
    slices: int | None = None,
    shells: int | None = None,
    executor: Executor | None = None,
    **options: Any,
) -> Table:
    """
    Compute the fabric of a packing or of a series block by block.

    A void segment belongs to the block that holds its middle, a contact to the block of its contact
    point, and a grain to the block of its centre. Blocks tile the box around the grains in the
    first frame; along periodic vectors they tile the cell, and for variants c and d the box around
    the RV. The tolerance holds for the median block. A warning reports √F, the scatter of the
    blocks relative to their errors, and its p-value.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        As for :func:`scanfab.compute`.
    grid : str or three ints, optional
        Number of blocks along x, y and z.
    slices : int, optional
        Number of slices of equal thickness along `axis`.
    shells : int, optional
        Number of shells about the centre, out to half the smallest extent, or to the reach of the
        RV.
    executor : concurrent.futures.Executor, optional
        As for :func:`scanfab.compute`.
    **options
        Options of :func:`scanfab.compute` except `cutoffs` and `with_`; `variants` is ``"a"`` by
        default.

    Returns
    -------
    Table
        A row for each frame, variant and block; lengths in the dump's unit, fabric dimensionless.

    Raises
    ------
    ScanfabError
        If a frame cannot be read, the settings do not fit the packing, or blocks are smaller than
        a grain.
    TypeError
        If there is no such option; the message suggests the most similar name.

    Examples
    --------
    >>> import warnings
    >>> import numpy as np
    >>> from scanfab import Cell, Packing, fabric_map, find_contacts
    >>> place = np.random.default_rng(0).uniform(0, 12, (400, 3))
    >>> packing = find_contacts(Packing(place, 0.7, cell=Cell([12.0] * 3)))
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     table = fabric_map(packing, slices=2, directions="lebedev:11", spacing=0.5)
    >>> str(told[-1].message)
    'frame 0, variant a: too few blocks to tell whether the sample is homogeneous'
    >>> table["z"].tolist(), int(table["grains"].sum())
    ([3.0, 9.0], 400)
    """
    settings = MapSettings(grid=grid, slices=slices, shells=shells, **options)
    return Table(compute_rows(source, settings, executor=executor), settings.columns)
