"""What turning, scaling, reordering, moving and mirroring a packing do to its fabric."""

import numpy as np
import pytest

from scanfab import Packing, compute, void_fabric
from scanfab.scan.directions import direction_rule
from scanfab.scan.lines import line_triads
from tests.helpers.lattices import Spheres, poisson_spheres, rotation, shaken_cubic
from tests.helpers.scanning import scan_triads, solids_of

WINDOW, SPACING, CUTOFF = 3.0, 0.3, 0.4
RULE = direction_rule("lebedev:9")
# columns of numbers that depend on no unit, order or place
SCALARS = ("grains", "rattlers", "contacts", "coordination", "lines", "segments", "alpha_c")
SCALARS += ("solid_fraction", "alpha_vs", "alpha_vs_axial", "alpha_c_axial")
LOOK = {"directions": "lebedev:9", "spacing": "0.3rmin", "cutoff": "0.8rmin"}


@pytest.fixture(scope="module")
def spheres():
    return poisson_spheres(np.random.default_rng(5), 0.15, 5.0)


def tensors(spheres, frames, variants="abcd"):
    """Tensor of each variant, one replicate with given frames; every third grain is removed."""
    removed = np.arange(len(spheres.radius)) % 3 == 0
    offsets = np.random.default_rng(1).random((len(frames), 2))
    solids = solids_of(spheres, WINDOW, removed)
    sums = scan_triads(solids, frames, offsets, SPACING, CUTOFF, variants)
    fabrics = [void_fabric(sums.axes, RULE.weights, *sums.kept(name)) for name in variants]
    return np.array([fabric.tensor.matrix for fabric in fabrics]), sums


GRAINS = shaken_cubic(np.random.default_rng(0), 6)
ORDER = np.random.default_rng(2).permutation(len(GRAINS.radius))


@pytest.mark.parametrize(
    ("changed", "unit"),
    [
        (GRAINS.scaled(1e-9), 1e-9),
        (GRAINS.scaled(50.0), 50.0),
        (Spheres(*(part[ORDER] for part in GRAINS)), 1.0),
        (GRAINS.moved([7.5, -3.25, 100.0]), 1.0),
    ],
    ids=["small unit", "large unit", "another order", "moved"],
)
def test_the_table_of_the_same_packing_in_another_unit_order_or_place(changed, unit):
    """Contacts, defaults of the RV and lengths relative to radii included; the RV moves along."""
    before, after = compute(Packing(*GRAINS), **LOOK), compute(Packing(*changed), **LOOK)
    for name in SCALARS:
        assert after[name] == pytest.approx(before[name], rel=1e-9, abs=1e-12, nan_ok=True), name
    assert after["mean_length"] == pytest.approx(before["mean_length"] * unit, rel=1e-9, abs=0)


TURNS = [rotation(np.random.default_rng(seed)) for seed in range(5)]
MIRRORS = [np.diag(np.where(np.arange(3) == axis, -1.0, 1.0)) for axis in range(3)]


@pytest.mark.parametrize("turn", TURNS + MIRRORS)
def test_packing_directions_and_offsets_turned_or_mirrored_together(spheres, turn):
    """G becomes Q G Qᵀ to rounding, in all variants."""
    frames = line_triads(RULE.axes)
    before, sums = tensors(spheres, frames)
    after, turned_sums = tensors(spheres.turned(turn), frames @ turn.T)
    assert np.array_equal(turned_sums.segments, sums.segments)
    assert np.abs(after - turn @ before @ turn.T).max() < 1e-12
