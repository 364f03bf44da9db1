"""What turning, scaling, reordering, moving and mirroring a packing do to its fabric."""

import numpy as np
import pytest

from scanfab import Packing, compute, contact_fabric, find_contacts, void_fabric
from scanfab.scan.directions import direction_rule
from scanfab.scan.lines import line_triads
from tests.helpers.lattices import Spheres, poisson_spheres, rotation, shaken_cubic
from tests.helpers.scanning import fabric, scan_triads, solids_of

WINDOW, SPACING, CUTOFF = 3.0, 0.3, 0.4
RULE = direction_rule("lebedev:9")
LOOK = {"directions": "lebedev:9", "spacing": "0.3rmin", "cutoff": "0.8rmin"}


@pytest.fixture(scope="module")
def spheres():
    return poisson_spheres(np.random.default_rng(5), 0.15, 5.0)


def tensors(spheres, frames, variants="abcd", unit=1.0):
    """Tensor of each variant, one replicate with given frames; every third grain is removed."""
    removed = np.arange(len(spheres.radius)) % 3 == 0
    offsets = np.random.default_rng(1).random((len(frames), 2))
    solids = solids_of(spheres, WINDOW * unit, removed)
    sums = scan_triads(solids, frames, offsets, SPACING * unit, CUTOFF * unit, variants)
    fabrics = [void_fabric(sums.axes, RULE.weights, *sums.kept(name)) for name in variants]
    return np.array([fabric.tensor.matrix for fabric in fabrics]), sums


def scalars(table):
    """Columns of numbers that do not depend on unit, order and place; NaN where there is none."""
    names = ["grains", "rattlers", "contacts", "coordination", "lines", "segments", "alpha_c"]
    names += ["solid_fraction", "alpha_vs", "alpha_vs_axial", "alpha_c_axial"]
    return {name: table[name] for name in names}


def assert_same(one, other, rel=1e-9):
    for name in one:
        assert other[name] == pytest.approx(one[name], rel=rel, abs=1e-12, nan_ok=True), name


def test_packing_directions_and_offsets_turned_together(spheres):
    """G becomes Q G Qᵀ to rounding, in all variants."""
    frames = line_triads(RULE.axes)
    before, sums = tensors(spheres, frames)
    for seed in range(5):
        turn = rotation(np.random.default_rng(seed))
        after, turned_sums = tensors(spheres.turned(turn), frames @ turn.T)
        assert np.array_equal(turned_sums.segments, sums.segments)
        assert np.abs(after - turn @ before @ turn.T).max() < 1e-12


def test_packing_turned_alone():
    """G becomes Q G Qᵀ within the standard error; the packing is anisotropic: a row of grains."""
    row = Spheres(np.array([[0.0, 0, 0.8 * k] for k in range(-3, 4)]), np.full(7, 0.6))
    turn = rotation(np.random.default_rng(3))
    options = {"rule": "design:9", "spacing": 0.1, "cutoff": 0.2, "replicates": range(32)}
    before = fabric(solids_of(row, 2.0), **options)
    after = fabric(solids_of(row.turned(turn), 2.0), seed=1, **options)
    back = turn.T @ after.replicates @ turn
    error = np.hypot(before.replicates.std(axis=0), back.std(axis=0)) / np.sqrt(32)
    assert before.tensor.alpha > 0.02
    assert np.all(np.abs(back.mean(axis=0) - before.tensor.matrix) < 4 * error)


@pytest.mark.parametrize("unit", [1e-9, 50.0])
def test_lengths_in_another_unit(spheres, unit):
    frames = line_triads(RULE.axes)
    before, sums = tensors(spheres, frames)
    after, scaled = tensors(spheres.scaled(unit), frames, unit=unit)
    assert np.array_equal(scaled.segments, sums.segments)
    assert np.abs(after - before).max() < 1e-13
    assert scaled.length == pytest.approx(sums.length * unit, rel=1e-10, abs=0)


@pytest.mark.parametrize("unit", [1e-9, 50.0])
def test_table_in_another_unit(unit):
    """Contacts, defaults of the RV and lengths relative to radii included."""
    spheres = shaken_cubic(np.random.default_rng(0), 6)
    before = compute(Packing(*spheres), **LOOK)
    after = compute(Packing(*spheres.scaled(unit)), **LOOK)
    assert_same(scalars(before), scalars(after))
    assert after["mean_length"] == pytest.approx(before["mean_length"] * unit, rel=1e-9, abs=0)


def test_grains_in_another_order(spheres):
    frames = line_triads(RULE.axes)
    before, sums = tensors(spheres, frames, "ac")
    order = np.random.default_rng(2).permutation(len(spheres.radius))
    after, shuffled = tensors(Spheres(*(part[order] for part in spheres)), frames, "ac")
    assert np.array_equal(shuffled.segments, sums.segments)
    assert np.abs(after - before).max() < 1e-13


def test_table_with_grains_in_another_order():
    spheres = shaken_cubic(np.random.default_rng(0), 6)
    order = np.random.default_rng(2).permutation(len(spheres.radius))
    shuffled = Packing(*(part[order] for part in spheres))
    before, after = compute(Packing(*spheres), **LOOK), compute(shuffled, **LOOK)
    assert_same(scalars(before), scalars(after))


def test_packing_moved():
    """The RV moves along; the lines of the whole do too, as far as rounding goes."""
    spheres = shaken_cubic(np.random.default_rng(0), 6)
    before = compute(Packing(*spheres), **LOOK)
    after = compute(Packing(*spheres.moved([7.5, -3.25, 100.0])), **LOOK)
    assert_same(scalars(before), scalars(after))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_packing_mirrored(spheres, axis):
    """Lines mirrored too: G is mirrored, its off-diagonal terms change their signs."""
    mirror = np.diag(np.where(np.arange(3) == axis, -1.0, 1.0))
    frames = line_triads(RULE.axes)
    before, sums = tensors(spheres, frames)
    after, mirrored = tensors(spheres.turned(mirror), frames @ mirror)
    assert np.array_equal(mirrored.segments, sums.segments)
    assert np.abs(after - mirror @ before @ mirror).max() < 1e-12


def test_contact_fabric_turns_scales_moves_and_mirrors_with_the_packing():
    spheres = shaken_cubic(np.random.default_rng(0), 6)

    def tensor(spheres):
        return contact_fabric(find_contacts(Packing(*spheres)).contacts.normal).matrix

    before = tensor(spheres)
    turn = rotation(np.random.default_rng(1))
    mirror = np.diag([1.0, 1.0, -1.0])
    assert np.abs(tensor(spheres.turned(turn)) - turn @ before @ turn.T).max() < 1e-12
    assert np.abs(tensor(spheres.turned(mirror)) - mirror @ before @ mirror).max() < 1e-12
    assert np.abs(tensor(spheres.scaled(1e-9)) - before).max() < 1e-9
    assert np.abs(tensor(spheres.moved([3.0, 4.0, 5.0])) - before).max() < 1e-12
