"""LF_DEM: the sheared cell, columns by their titles, and pairs that do not touch."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, ScanfabWarning
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


def test_images_above_are_shifted(tmp_path):
    grains = write(tmp_path / "par_a.dat", grains_text())
    pairs = write(tmp_path / "int_a.dat", pairs_text())
    series = scanfab.read_series(grains, contacts=str(pairs))
    packing = series[1].read()
    np.testing.assert_array_equal(packing.cell.vectors, [[10, 0, 0], [0, 8, 0], [1.5, 0, 6]])
    assert packing.cell.periodic == (True, True, True)
    np.testing.assert_array_equal(packing.radius, 1)
    assert packing.columns["velocity (x, y, z)"].shape == (3, 3)
    # the image of 1 stands right above 0, where the file has its normal
    assert packing.contacts.pairs.tolist() == [[0, 1]]
    np.testing.assert_allclose(packing.contacts.normal, [[0, 0, 1]])
    assert packing.contacts.force is None
    # frames of both files belong together by their strain
    with pytest.raises(ReadError, match="no contact file for time 0 among"):
        series[0].read()


def read_both(folder, texts):
    path = write(folder / "par_a.dat", texts[0])
    return scanfab.read(path, contacts=str(write(folder / "int_a.dat", texts[1])))


@pytest.mark.parametrize("pairs", [((0, 1), (1, 2)), ((1, 0), (2, 1)), ((1, 2), (1, 0))])
def test_a_grain_at_rest_between_two(tmp_path, pairs):
    """Its forces add up to nothing only with the right sign of each part, on the right grain."""
    contacts = read_both(tmp_path, chain_texts(pairs=pairs)).contacts
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
    packing = read_both(tmp_path, run_texts())
    contacts = packing.contacts
    branch = contacts.normal * packing.radius[contacts.pairs].sum(axis=1)[:, None]
    on_first = -contacts.force
    added = 3 * np.pi * (branch[:, 0] * on_first[:, 2] + branch[:, 2] * on_first[:, 0])
    np.testing.assert_allclose(np.sort(added), np.sort(RUN_VISCOSITY), rtol=2e-3)


def test_signs_of_pushes(tmp_path):
    def pull(size):
        return -size

    assert np.all(read_both(tmp_path, chain_texts(push=pull)).contacts.force_n < 0)
    with pytest.warns(ScanfabWarning, match="no sign of normal contact forces"):
        contacts = read_both(tmp_path, chain_texts(lubrication=UNSIGNED)).contacts
    assert np.all(contacts.force_n > 0)
    # a file with a pull has signs
    texts = chain_texts(lubrication=UNSIGNED, push=pull)
    assert np.all(read_both(tmp_path, texts).contacts.force_n < 0)
    with pytest.raises(ReadError, match="finite numbers as contact forces"):
        read_both(tmp_path, chain_texts(push=lambda size: np.inf))


def test_a_plane_is_not_periodic_across(tmp_path):
    path = write(tmp_path / "par_a.dat", grains_text(HEAD.replace("Ly 8", "Ly 0")))
    assert scanfab.read_series(path)[0].read().cell.periodic == (True, False, True)


@pytest.mark.parametrize("lost", [3, len(grains_text().splitlines()[-1]) + 1])
def test_a_last_frame_that_is_cut_is_left_out(tmp_path, lost):
    """In a row, and between two."""
    path = write(tmp_path / "par_a.dat", grains_text()[:-lost])
    with pytest.warns(ScanfabWarning, match="number 2, is incomplete"):
        assert len(scanfab.read_series(path)) == 1
