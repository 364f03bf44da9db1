"""LF_DEM: the sheared cell, columns by their legend, and pairs that do not touch."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, ScanfabWarning
from scanfab.io.registry import reader_named
from scanfab.testing import check_reader
from tests.helpers.dumps import write
from tests.helpers.made.lf_dem import (
    HEAD,
    RUN_VISCOSITY,
    THROUGH,
    UNSIGNED,
    chain_texts,
    grains_text,
    pairs_text,
    run_texts,
)


@pytest.fixture
def run(tmp_path):
    write(tmp_path / "par_a.dat", grains_text())
    write(tmp_path / "int_a.dat", pairs_text())
    return tmp_path


def test_images_above_are_shifted(run):
    series = scanfab.read_series(run / "par_a.dat", contacts=str(run / "int_a.dat"))
    packing = series[1].read()
    np.testing.assert_array_equal(packing.cell.vectors, [[10, 0, 0], [0, 8, 0], [1.5, 0, 6]])
    assert packing.cell.periodic == (True, True, True)
    np.testing.assert_array_equal(packing.radius, 1)
    assert packing.columns["velocity (x, y, z)"].shape == (3, 3)
    # the image of 1 stands right above 0, where the file has its normal
    assert packing.contacts.pairs.tolist() == [[0, 1]]
    np.testing.assert_allclose(packing.contacts.normal, [[0, 0, 1]])
    assert packing.contacts.force is None


def read_chain(folder, **others):
    grains, pairs = chain_texts(**others)
    path = write(folder / "par_a.dat", grains)
    return scanfab.read(path, contacts=str(write(folder / "int_a.dat", pairs)))


@pytest.mark.parametrize("pairs", [((0, 1), (1, 2)), ((1, 0), (2, 1)), ((1, 2), (1, 0))])
def test_a_grain_at_rest_between_two(tmp_path, pairs):
    """Its forces add up to nothing only with the right sign of each part, on the right grain."""
    contacts = read_chain(tmp_path, pairs=pairs).contacts
    on_middle = {
        frozenset(pair): force if pair[1] == 1 else -force
        for pair, force in zip(contacts.pairs.tolist(), contacts.force, strict=True)
    }
    np.testing.assert_allclose(on_middle[frozenset((0, 1))], THROUGH, atol=1e-15)
    np.testing.assert_allclose(on_middle[frozenset((1, 2))], -THROUGH, atol=1e-15)
    # both contacts are pushed together
    assert np.all(contacts.force_n > 0)


def test_what_the_program_says_its_contacts_add_to_the_viscosity(tmp_path):
    """3 pi (r_x f_z + r_z f_x) with the force on particle 1, in its units; friction matters."""
    grains, pairs = run_texts()
    path = write(tmp_path / "par_a.dat", grains)
    packing = scanfab.read(path, contacts=str(write(tmp_path / "int_a.dat", pairs)))
    contacts = packing.contacts
    branch = contacts.normal * packing.radius[contacts.pairs].sum(axis=1)[:, None]
    on_first = -contacts.force
    added = 3 * np.pi * (branch[:, 0] * on_first[:, 2] + branch[:, 2] * on_first[:, 0])
    np.testing.assert_allclose(np.sort(added), np.sort(RUN_VISCOSITY), rtol=2e-3)


def test_a_pull_keeps_its_sign(tmp_path):
    contacts = read_chain(tmp_path, push=lambda size: -size).contacts
    assert np.all(contacts.force_n < 0)


def test_a_push_whose_sign_may_be_lost_is_told(tmp_path):
    with pytest.warns(ScanfabWarning, match="write normal contact forces without their sign"):
        contacts = read_chain(tmp_path, lubrication=UNSIGNED).contacts
    assert np.all(contacts.force_n > 0)
    # a file with a pull has signs
    assert np.all(
        read_chain(tmp_path, lubrication=UNSIGNED, push=lambda f: -f).contacts.force_n < 0
    )


def test_a_force_that_is_no_number(tmp_path):
    with pytest.raises(ReadError, match="finite numbers as contact forces"):
        read_chain(tmp_path, push=lambda size: np.inf)


def test_contacts_go_by_the_strain(run):
    series = scanfab.read_series(run / "par_a.dat", contacts=str(run / "int_a.dat"))
    with pytest.raises(ReadError, match="no contact file for time 0 among"):
        series[0].read()


def test_a_plane_does_not_repeat_across(tmp_path):
    path = write(tmp_path / "par_a.dat", grains_text(HEAD.replace("Ly 8", "Ly 0")))
    assert scanfab.read_series(path)[0].read().cell.periodic == (True, False, True)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("# Lz 6", "# Lz", "expected lines '# Lx'"),
        ("#2: radius", "#2: size", "no reader knows|expected points with a radius"),
        ("0 1 0 0 2.5 9", "0 1 0 0 2.5 9 9", "the number of columns changed"),
        ("#6-8:", "#0:", "expected 5 columns of particles, found 8"),
        ("#6-8:", "#6-9:", "expected 9 columns of particles, found 8"),
    ],
)
def test_what_is_wrong(tmp_path, old, new, message):
    text = grains_text()
    assert old in text
    with pytest.raises(scanfab.ScanfabError, match=message):
        scanfab.read_series(write(tmp_path / "par_a.dat", text.replace(old, new)))[1].read()


def test_a_count_that_no_frame_has(tmp_path):
    path = write(tmp_path / "par_a.dat", grains_text().replace("# np 3", "# np 4"))
    with pytest.warns(ScanfabWarning, match="is left out: 3 rows of 4"):
        first = scanfab.read_series(path)[0]
    with pytest.raises(scanfab.ScanfabError, match="the header counts 4 particles, found 3"):
        first.read()


@pytest.mark.parametrize("lost", [3, len(grains_text().splitlines()[-1]) + 1])
def test_a_last_frame_that_is_cut_is_left_out(tmp_path, lost):
    """In a row, and between two."""
    path = write(tmp_path / "par_a.dat", grains_text()[:-lost])
    with pytest.warns(ScanfabWarning, match="number 2, is incomplete"):
        assert len(reader_named("lf-dem").snapshots(path)) == 1


def test_the_kit(run):
    check_reader(reader_named("lf-dem"), [run / "par_a.dat"], run / "damaged")
