"""What is told of each frame without a scan, and its sample."""

import warnings

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.pipeline.inspection import inspect_series
from scanfab.pipeline.settings import Settings
from tests.helpers.dumps import ROWS, dump_text, pairs_text, write, yade_spheres
from tests.helpers.truth import SAMPLE_DATA


def reports(folder, texts, **options):
    write(folder / "dump.txt", "".join(texts))
    return list(scanfab.inspect(scanfab.read_series(folder), **options))


def test_grains_contacts_and_rattlers_are_counted(tmp_path):
    write(tmp_path / "pairs.txt", pairs_text())
    (report,) = reports(tmp_path, [dump_text()])
    # three in a row: those at the ends have one contact
    assert (report.grains, report.contacts, report.rattlers) == (3, 2, 2)
    assert report.coordination == pytest.approx(4 / 3)
    assert (report.radius_min, report.radius_max) == (0.1, 0.1)
    assert report.contacts_from == "file"
    (tmp_path / "pairs.txt").unlink()
    (empty,) = reports(tmp_path, [dump_text([])])
    assert empty.grains == 0
    assert empty.radius_min is empty.radius_max is empty.coordination is None


def test_a_boundary_that_fits_nothing_in_any_frame_is_an_error_or_the_rule_is_told(tmp_path):
    message = "boundary: no particle of any frame has type=9 or id>7: type is 1 or 2; id is 1 or 2"
    with pytest.raises(scanfab.SettingsError, match=message):
        reports(tmp_path, [dump_text(), dump_text(step=1)], boundary=["type=9", "id>7"])
    with pytest.warns(ScanfabWarning, match="no particle of any frame has type=9: type is") as told:
        (report,) = reports(tmp_path, [dump_text()], boundary=["type=2", "type=9"])
    assert len(told) == 1
    assert (report.grains, report.boundary, report.warnings) == (2, 1, [])
    # a plate may be put in later
    texts = [dump_text(), dump_text([*ROWS, (4, 9, 0.9, 0.5, 0.5, 0.1)], step=1)]
    first, second = reports(tmp_path, texts, boundary="type=9")
    assert first.warnings == ["`boundary`: no particle has type=9: type is 1 or 2"]
    assert (first.boundary, second.boundary, second.warnings) == (0, 1, [])


def test_a_format_without_a_cell_is_always_told(tmp_path):
    """By a note: most samples are open, and nothing is wrong with them."""
    yade_spheres(tmp_path / "a-spheres-0.vtk", [[0, 0, 0], [5, 0, 0]], [1, 1])
    message = r"this format carries no cell; `cell=\(LX, LY, LZ\)` if the sample is periodic"
    with pytest.warns(ScanfabNote, match=message):
        (report,) = inspect_series(scanfab.read_series(tmp_path), Settings())
    assert report.warnings == []
    with_cell = scanfab.read_series(tmp_path, cell=(9.0, 9.0, 9.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error", ScanfabNote)
        assert next(inspect_series(with_cell, Settings())).warnings == []


def test_a_sheet_of_discs_is_no_doubt():
    sheet = SAMPLE_DATA / "lammps_discs" / "sheet.3000.lammpstrj"
    with pytest.warns(scanfab.ScanfabNote, match="read as discs"):
        (report,) = inspect_series(scanfab.read_series(sheet), Settings())
    assert report.warnings == []
    assert (report.periodic, report.low[2], report.high[2]) == ([True, True, False], 0.0, 0.0)
    assert report.rv_center[2] == 0.0


def test_options_that_do_not_exist_or_fit_are_refused_at_once(tmp_path):
    series = scanfab.read_series(write(tmp_path / "dump.txt", dump_text()))
    for function in (scanfab.inspect, scanfab.samples):
        with pytest.raises(TypeError, match="did you mean 'boundary'"):
            function(series, boundry="type=2")
        with pytest.raises(scanfab.SettingsError, match="boundary"):
            function(series, boundary="mask")


def test_samples_are_told_apart_by_the_options_of_compute(tmp_path):
    for step in range(4):
        write(tmp_path / f"dump_{step}.txt", dump_text(step=step))
    series = scanfab.read_series(tmp_path)
    packing = series[2].read()
    with pytest.raises(scanfab.SettingsError, match=r"inspect: expected a Series, .*found Packing"):
        scanfab.inspect(packing)
    ((number, sample),) = scanfab.samples(packing, boundary="type=2", min_contacts=1)
    assert number == 0
    np.testing.assert_array_equal(sample.boundary, sample.packing.columns["type"] == 2)
    assert sample.contacts.source == "geometric"
    assert not sample.rattlers.any()
    chosen = scanfab.samples(series[1:], frames="1:")
    assert [(number, sample.packing.step) for number, sample in chosen] == [(2, 2), (3, 3)]
    write(tmp_path / "dump_1.txt", dump_text(step=1)[:50])
    with pytest.raises(scanfab.ReadError, match="dump_1"):
        list(scanfab.samples(series))
    with pytest.warns(ScanfabWarning, match="frame 1"):
        assert [number for number, _ in scanfab.samples(series, on_error="skip")] == [0, 2, 3]


def test_the_rv_is_that_of_the_first_frame_whichever_frames_are_chosen(tmp_path):
    """A frame before the chosen ones may be damaged: then the next one decides."""
    shifted = [(id, type, x + 0.25, *rest) for id, type, x, *rest in ROWS]
    texts = [dump_text(), dump_text(shifted, step=1), dump_text(shifted, step=2)]
    every = reports(tmp_path, texts)
    (last,) = reports(tmp_path, texts, frames="2:")
    assert last.rv_center == every[0].rv_center
    (other,) = reports(tmp_path, texts, frames="2:", variants="ab")
    assert other == last
    flat = [(*ROWS[0][:5], 0.0), *ROWS[1:]]
    (last,) = reports(tmp_path, [dump_text(flat), *texts[1:]], frames="2:")
    assert last.rv_center[0] == pytest.approx(every[0].rv_center[0] + 0.25)
