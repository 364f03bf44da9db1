"""A packing that several tests compute."""

import numpy as np
import pytest

from scanfab import Packing, find_contacts
from tests.helpers.lattices import shaken_cubic


@pytest.fixture(scope="session")
def packing():
    """216 grains of radii about 0.5 in a cube of about 6, some of which touch."""
    return find_contacts(Packing(*shaken_cubic(np.random.default_rng(0), 6)))
