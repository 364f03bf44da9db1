"""Moved to scanfab.io.binary_tables."""

from scanfab.io.binary_tables import IS_NPZ as IS_NPZ
from scanfab.io.binary_tables import npz_shapes as npz_shapes
from scanfab.io.binary_tables import read_npz as read_npz
