"""Groups of further columns, as users ask for them: what is there, what is said where it is not."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, ContactList, Packing
from scanfab.base.errors import PackingError
from scanfab.fabric.registry import GROUPS
from scanfab.pipeline.values import GROUP_NAMES
from scanfab.table.columns import COLUMNS
from tests.helpers.lattices import shaken_cubic
from tests.helpers.truth import CELL, SAMPLE_DATA, TRIAXIAL

FAST = {"directions": 13, "spacing": "2rmin", "workers": 1, "variants": "a"}
YADE = SAMPLE_DATA / "yade_forces" / "forces.xml.bz2"


@pytest.fixture(scope="module")
def yade():
    return scanfab.read(YADE)


def names(*groups):
    return [one.name for group in GROUP_NAMES if group in groups for one in GROUPS[group].columns]


@pytest.mark.parametrize("asked", ["forces,state", ["state", "forces"]])
def test_several_groups_stand_behind_the_others_in_one_order(yade, asked):
    row = scanfab.compute(yade, with_=asked, **{**FAST, "spacing": "1rmin"})[0]
    assert list(row) == [*COLUMNS[:-24], *names("state", "forces"), *COLUMNS[-24:]]
    assert None not in [row[name] for name in names("state", "forces")]


def test_without_forces_their_columns_are_an_error_and_stress_is_empty_with_one_note():
    packing = scanfab.read(YADE, contacts="geometric")
    with pytest.raises(PackingError, match=r"forces of contacts, but these are found by geometry"):
        scanfab.compute(packing, with_="forces", **FAST)
    with pytest.warns(scanfab.ScanfabWarning) as told:
        found = scanfab.compute(packing, with_="state", **{**FAST, "variants": "ac"})
    (text,) = [str(one.message) for one in told if "stress" in str(one.message)]
    assert "variants a, c: the contacts have no forces" in text
    for row in found:
        assert row.void_ratio > 0
        assert row.coordination_mechanical > 2
        known = {name for name in names("state") if row[name] is not None}
        assert known <= {"void_ratio", "coordination_mechanical", "volumetric_strain"}


POOR_FORCES = [
    (lambda one: {"force_n": one.force_n}, "normal part of", ("ft", "stress")),
    (lambda one: {"force": -one.force}, "the mean normal force is tension", ("fn", "ft")),
]


@pytest.mark.parametrize(("force", "told", "empty"), POOR_FORCES)
def test_forces_that_do_not_suffice_leave_columns_empty(yade, force, told, empty):
    contacts = yade.contacts
    packing = yade.with_contacts(ContactList(contacts.pairs, contacts.image, **force(contacts)))
    with pytest.warns(scanfab.ScanfabWarning, match=told):
        row = scanfab.compute(packing, with_="forces,state", **FAST)[0]
    full = scanfab.compute(yade, with_="forces,state", **FAST)[0]
    for name in names("forces"):
        if any(one in name for one in empty):
            assert row[name] is None
        elif "gc_" not in name or "stress" in empty:
            assert row[name] == pytest.approx(full[name], abs=1e-12)
    assert (row.stress_xx is None) == ("stress" in empty)


def test_a_force_that_is_no_number_is_named_and_no_contacts_are_no_error(yade):
    contacts, force = yade.contacts, yade.contacts.force.copy()
    force[3, 1] = np.nan
    packing = yade.with_contacts(ContactList(contacts.pairs, contacts.image, force))
    with pytest.raises(PackingError, match="has a force that is no finite number"):
        scanfab.compute(packing, with_="forces", **FAST)
    spheres = shaken_cubic(np.random.default_rng(1), 4, overlap=0.6)
    packing = Packing(*spheres, contacts=[], cell=Cell([4.0, 4.0, 4.0]))
    row = scanfab.compute(packing, with_="forces,state", **FAST)[0]
    assert row.fn_xx is None
    assert row.void_ratio > 0


def test_strain_and_directions_of_a_series():
    fine = {**FAST, "spacing": "1rmin", "frames": "::4"}
    found = scanfab.compute(scanfab.read_series(CELL), with_="state", **fine)
    first, last = found
    assert first.volumetric_strain == 0.0
    assert abs(last.volumetric_strain) < 1e-5
    assert abs(first.q) < 0.02 * first.p
    assert last.angle_c_stress < 10
    assert last.acst_vs_se > 0


def test_an_open_whole_has_no_volume_and_says_so():
    packing, words = scanfab.read_series(TRIAXIAL)[0].read(), {**FAST, "variants": "ac"}
    with pytest.warns(scanfab.ScanfabWarning, match="they need the volume of an RV"):
        a, c = scanfab.compute(packing, with_="state", boundary="mask=3", **words)
    assert a.void_ratio is a.stress_zz is None
    assert c.p == pytest.approx(200e3, rel=0.2)
    assert 0.4 < c.void_ratio < 0.8
