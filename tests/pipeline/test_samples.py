"""Samples frame by frame: those of compute(), without a scan."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ScanfabWarning, SettingsError
from tests.helpers.dumps import dump_text, write


@pytest.fixture
def series(tmp_path):
    for step in range(4):
        write(tmp_path / f"dump_{step}.txt", dump_text(step=step))
    return scanfab.read_series(tmp_path)


def test_particles_are_told_apart_by_the_options_of_compute(series):
    (found,) = scanfab.samples(series[2].read(), boundary="type=2", min_contacts=1)
    number, sample = found
    assert number == 0
    np.testing.assert_array_equal(sample.boundary, sample.packing.columns["type"] == 2)
    assert sample.contacts.source == "geometric"
    assert not sample.rattlers.any()


def test_frames_are_chosen_and_damaged_ones_left_out(series, tmp_path):
    chosen = scanfab.samples(series[1:], frames="1:")
    assert [(number, sample.packing.step) for number, sample in chosen] == [(2, 2), (3, 3)]
    write(tmp_path / "dump_1.txt", dump_text(step=1)[:50])
    with pytest.raises(scanfab.ReadError, match="dump_1"):
        list(scanfab.samples(series))
    with pytest.warns(ScanfabWarning, match="frame 1"):
        assert [number for number, _ in scanfab.samples(series, on_error="skip")] == [0, 2, 3]


def test_a_wrong_option_is_told_at_once(series):
    with pytest.raises(TypeError, match="did you mean 'boundary'"):
        scanfab.samples(series, boundry="type=2")
    with pytest.raises(SettingsError, match="boundary"):
        scanfab.samples(series, boundary="type")
