"""Packings that several tests compute."""

import numpy as np
import pytest

from scanfab import Cell, Packing, find_contacts
from tests.helpers.lattices import shaken_cubic


@pytest.fixture(scope="session")
def packing():
    """216 grains of radii about 0.5 in a cube of about 6, some of which touch."""
    return find_contacts(Packing(*shaken_cubic(np.random.default_rng(0), 6)))


@pytest.fixture(scope="session")
def repeated(packing):
    """The same grains in a cell that repeats."""
    return find_contacts(Packing(packing.position, packing.radius, cell=Cell([6.0] * 3)))
