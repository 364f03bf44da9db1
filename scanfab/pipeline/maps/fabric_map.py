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
    The fabric of a packing or of a series by place.

    A void segment belongs to the block in which its middle lies, a contact to that of its point, a
    grain to that of its centre. Blocks tile the box of the grains' surfaces in the first frame (of
    variants c and d that of the RV; along the vectors of a periodic cell the cell). The tolerance
    holds for the median block. Whether the blocks scatter more than their errors is told as a
    warning.

    Parameters
    ----------
    source : Packing, Series or iterable of Packing
        As for :func:`scanfab.compute`.
    grid : str or three ints, optional
        So many blocks along x, y and z.
    slices : int, optional
        So many slices of equal thickness along `axis`.
    shells : int, optional
        So many shells about the centre, up to half the smallest extent, or the reach of the RV.
    executor : concurrent.futures.Executor, optional
        As for :func:`scanfab.compute`.
    **options
        Those of :func:`scanfab.compute` but `cutoffs` and `with_`; `variants` is ``"a"`` by
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
        If there is no such option; names the nearest that there is.

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
