"""The RV in a periodic cell: it sees what the repeated packing shows, wherever the cell begins."""

from itertools import product

import numpy as np
import pytest

from scanfab import Cell, Packing, ScanfabNote, compute
from tests.helpers.lattices import Spheres

EDGES = np.array([6.0, 5.0, 7.0])
RV = {"rv_radius": 2.0, "variants": "cd"}
LOOK = {"directions": "lebedev:9", "spacing": 0.1, "cutoff": 0.2, **RV}
SAME = ("grains", "rattlers", "contacts", "lines", "segments")
CLOSE = ("coordination", "solid_fraction", "mean_length", "gvs_xx", "gvs_xy", "gvs_yz", "alpha_vs")
CLOSE += ("alpha_vs_axial", "alpha_vs_axial_se", "gc_xx", "gc_zz", "gc_xz", "alpha_c_axial_se")


@pytest.fixture(scope="module")
def spheres():
    """Loose enough to have rattlers, with grains of up to half the thinnest edge."""
    random = np.random.default_rng(8)
    radius = np.append(random.uniform(0.25, 0.6, 110), [1.2, 0.9])
    return Spheres(random.random((112, 3)) * EDGES, radius)


def table(spheres, center, origin=(0.0, 0, 0), periodic=(True, True, True)):
    packing = Packing(*spheres, cell=Cell(EDGES, periodic, origin))
    return compute(packing, rv_center=tuple(np.asarray(center, dtype=float)), **LOOK)


def repeated(spheres, periodic=(True, True, True)):
    """The packing as an open one, with the copies around it."""
    shifts = list(product(*([-1, 0, 1] if repeats else [0] for repeats in periodic)))
    position = np.concatenate([spheres.position + shift * EDGES for shift in np.array(shifts)])
    return Packing(position, np.tile(spheres.radius, len(shifts)))


def assert_same_tables(one, other):
    for name in SAME:
        assert np.array_equal(one[name], other[name]), name
    for name in CLOSE:
        assert one[name] == pytest.approx(other[name], rel=1e-9, abs=1e-12), name


@pytest.mark.parametrize(
    "periodic", [(True, True, True), (True, True, False), (False, True, False)]
)
def test_periodic_rv_equals_the_rv_of_the_repeated_packing(spheres, periodic):
    """
    Grains that reach in through faces are solids; rattlers and contacts are the same too.

    The RV crosses two faces of the cell, and two images of the largest grain reach into it.
    """
    center = spheres.position[110] + [0.0, 0.5 * EDGES[1], 0.0]
    assert spheres.radius[110] + RV["rv_radius"] > 0.5 * EDGES[1]
    here = table(spheres, center, periodic=periodic)
    there = compute(repeated(spheres, periodic), rv_center=tuple(center), **LOOK)
    assert here["rattlers"][1] > 0
    assert_same_tables(here, there)


def test_rattler_that_reaches_in_through_a_face_is_void_in_d():
    """The only solid of the RV is the image of a grain without contacts."""
    rattler = Spheres(np.array([[5.9, 2.5, 3.5]]), np.array([0.9]))
    packing = Packing(*rattler, cell=Cell(EDGES))
    options = {**LOOK, "rv_radius": 1.4, "rv_center": (1.5, 2.5, 3.5)}
    with pytest.warns(ScanfabNote, match="the RV .* holds no centre of a grain"):
        c, d = compute(packing, **options)
    assert c.solid_fraction > 0.02
    assert d.solid_fraction == pytest.approx(0.0, abs=1e-12)
    assert (c.grains, d.grains) == (0, 0)


CENTER = np.array([2.5, 2.3, 2.6])
SHIFT = np.array([0.9, 0.4, 2.1])
# by whole turns of the cell, as unwrapped dumps have them
TURNS = np.random.default_rng(0).integers(-3, 4, (112, 3)) * EDGES


@pytest.mark.parametrize(
    ("moved", "center", "origin"),
    [
        (SHIFT, CENTER + SHIFT, (0, 0, 0)),
        (0.0, CENTER, (-0.7, 0.2, -2.2)),
        (TURNS, CENTER, (0, 0, 0)),
    ],
    ids=["grains and RV shifted", "cell from another corner", "grains outside the cell"],
)
def test_the_same_medium_described_in_another_way(spheres, moved, center, origin):
    assert_same_tables(table(spheres, CENTER), table(spheres.moved(moved), center, origin=origin))
