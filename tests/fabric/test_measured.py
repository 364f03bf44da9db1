"""The fabrics of the package, asked by name with sums and normals that a test made up."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.fabric.jackknife import BLOCKS, BlockedSums
from scanfab.fabric.measured import Measured
from scanfab.fabric.registry import OWN_FABRICS

ALONG_X, ALONG_Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def measured(length=(1.0, 1.0, 2.0), normals=8 * (ALONG_X,), meets_solids=True, turns=2):
    """Three axes along x, y and z, one segment each, of which each block holds an eighth."""
    axes, lengths = np.tile(np.eye(3), (turns, 1, 1)), np.tile(np.array(length), (turns, 1))
    number, weights = (lengths > 0).astype(float), np.full(3, 1 / 3)
    rest = (7 / 8 * lengths, 7 / 8 * number)
    places = np.reshape(normals, (-1, 3))
    return Measured(
        axis=np.array(ALONG_Z),
        axes=axes,
        weights=weights,
        length=lengths,
        segments=number,
        meets_solids=meets_solids,
        blocked=BlockedSums(axes, weights, (lengths, number), BLOCKS * [rest]),
        normals=places,
        points=places,
        blocks=np.arange(len(places)) % BLOCKS,
    )


def values(found):
    return {name: one for each in OWN_FABRICS.values() for name, one in each.values(found).items()}


CASES = {
    "no void fabric": measured(meets_solids=False),
    "no segment along x": measured(length=(0.0, 1.0, 2.0)),
    "no contact": measured(normals=()),
    "neither": measured(normals=(), meets_solids=False),
    "one replicate": measured(turns=1),
    "all": measured(),
}


def test_both_tensors_and_the_angle_between_their_axes():
    """ℓ = 1, 1, 2 along x, y, z: G = 1/4, 1/4, 1/2; all contacts along x."""
    found = values(measured())
    assert (found["gvs_xx"], found["gvs_yy"], found["gvs_zz"]) == (0.25, 0.25, 0.5)
    assert (found["mean_length"], found["alpha_vs"]) == (pytest.approx(4 / 3), 0.25)
    assert (found["alpha_vs_axial"], found["alpha_vs_axial_se"]) == (0.25, 0.0)
    assert (found["gc_xx"], found["alpha_c"], found["alpha_c_axial"]) == (1.0, 1.0, -0.5)
    assert [found[f"gvs_axis_{one}"] for one in "xyz"] == [0, 0, 1]
    assert [found[f"gc_axis_{one}"] for one in "xyz"] == [1, 0, 0]
    assert found["coaxiality_deg"] == pytest.approx(90)


def test_blocks_that_are_alike_leave_the_anisotropies_as_they_are():
    found = values(measured())
    for block in range(1, BLOCKS + 1):
        assert found[f"alpha_vs_axial_without_{block}"] == pytest.approx(0.25, abs=1e-15)
        assert found[f"alpha_c_axial_without_{block}"] == pytest.approx(-0.5, abs=1e-15)
        assert found[f"alpha_vs_axial_half_{block}"] == pytest.approx(0.0, abs=1e-15)
    assert found["alpha_c_axial_sample_se"] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("what", CASES)
def test_what_does_not_exist_is_empty_and_every_column_has_a_value(what):
    found = values(CASES[what])
    columns = [one.name for fabric in OWN_FABRICS.values() for one in fabric.columns]
    assert sorted(found) == sorted(columns)
    void, contact = what in ("all", "one replicate", "no contact"), "contact" not in what
    contact &= what != "neither"
    for name, value in found.items():
        if name == "coaxiality_deg":
            assert (value is not None) == (void and contact)
        elif name in ("gvs_xx", "mean_length", "alpha_vs_axial_without_3", "alpha_vs_axial_half_8"):
            assert (value is not None) == void
        elif name.startswith(("gc_", "alpha_c")):
            assert (value is not None) == contact, name
