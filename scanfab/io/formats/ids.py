"""Ids in the columns of a contact dump, which has numbers only and names that say nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.typing import FloatArray
from scanfab.io.formats.join import rows_of_ids
from scanfab.io.reader import GrainTable

__all__ = ["MOST_ROWS", "are_ids", "are_whole", "refuse_rounded_ids"]


# of the rows of a contact file: enough to know a column by its values
MOST_ROWS = 0.5


def are_whole(values: FloatArray) -> bool:
    """Whether all are whole numbers."""
    return bool(np.all(values == np.rint(values)))


def are_ids(values: FloatArray, grains: GrainTable) -> bool:
    """Whether nearly all are ids of grains: a wrong one among them is reported by its name."""
    return are_whole(values) and bool(np.mean(rows_of_ids(grains, values) >= 0) > MOST_ROWS)


def refuse_rounded_ids(path: Path, values: FloatArray, grains: GrainTable) -> None:
    """%g keeps six digits: from a million on ids may be rounded."""
    assert grains.id is not None
    longer = grains.id[grains.id >= 1_000_000]
    digits = 10 ** (np.floor(np.log10(np.maximum(longer, 1))).astype(np.int64) - 5)
    longer = longer[longer % digits != 0]
    large = np.any(values >= 1e6, axis=0) & np.all(values == np.rint(values), axis=0)
    if longer.size and large.any() and not np.isin(values[:, large], longer).any():
        raise ReadError(
            f"{path}: ids above 999999 are rounded to six digits, so contacts name wrong grains: "
            f'write them with dump_modify ... format "%.0f ..."'
        )
