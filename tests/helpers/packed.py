"""Samples and rows of grains for tests."""

import numpy as np

from scanfab import Sample, find_contacts


def sample_of(packing, boundary=(), *more, **options):
    """A sample, with contacts by geometry if it has none; the rows of its boundary are named."""
    packing = packing if packing.contacts is not None else find_contacts(packing)
    return Sample(packing, np.isin(np.arange(len(packing)), boundary), *more, **options)


def along_x(x):
    """Positions along x."""
    x = np.asarray(x, dtype=float)
    return np.column_stack([x, 0 * x, 0 * x])
