"""What is told of frames without a scan, and of a series: each note once, in the end its frames."""

import re
import warnings

import numpy as np
import pytest

import scanfab
from scanfab import Packing
from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.inspection import inspect_series
from scanfab.pipeline.settings import Settings
from tests.helpers.dumps import ROWS, dump_text, write, yade_spheres
from tests.helpers.lattices import shaken_cubic


def reports(folder, texts, **options):
    write(folder / "dump.txt", "".join(texts))
    return list(scanfab.inspect(scanfab.read_series(folder), **options))


def test_a_frame_without_grains_has_no_numbers(tmp_path):
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


def test_options_that_do_not_exist_or_fit_are_refused_at_once(tmp_path):
    series = scanfab.read_series(write(tmp_path / "dump.txt", dump_text()))
    for function in (scanfab.inspect, scanfab.samples):
        with pytest.raises(TypeError, match="did you mean 'boundary'"):
            function(series, boundry="type=2")
        with pytest.raises(scanfab.SettingsError, match="boundary"):
            function(series, boundary="mask")
    with pytest.raises(TypeError, match="option 'cell': it is an option of read_series"):
        scanfab.compute(series, cell=(1, 1, 1))


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


SCAN = {"directions": 9, "spacing": "0.5rmin", "variants": "a", "contact_tolerance": 0.1}


def bed(stretch=(1.0, 1.0, 1.0), grow=1.0, apart=1.0):
    position, radius = shaken_cubic(np.random.default_rng(1), 5)
    return Packing(apart * position * stretch, grow * radius)


def texts(caught, kind):
    return [str(one.message) for one in caught if issubclass(one.category, kind)]


def told(packings, kind=ScanfabNote, **options):
    """The notes, or the warnings, of a computation."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scanfab.compute(packings, **{**SCAN, **options})
    return texts(caught, kind)


def test_a_warning_comes_once_and_its_frames_in_the_end():
    gas, dense = bed(apart=2.0), bed()
    found = told([dense, gas, gas, dense, gas], ScanfabWarning, boundary=(), frames="1:")
    words = [one for one in found if "no contact at all" in one]
    assert [one.partition(":")[0] for one in words] == ["frame 1", "frames 1 to 2, 4"]
    assert words[1] == "frames 1 to 2, 4: as in frame 1, no contact at all by geometry"
    found = told([dense, gas], ScanfabWarning, cutoffs="50,60,70")
    assert [one[:16] for one in found if "as in frame 0, no void" in one] == ["frames 0 to 1, v"]
    # nothing is said of a frame that nobody asked for
    found = told([gas, dense, dense], ScanfabWarning, frames="1:")
    assert not any("no contact" in one for one in found)


def test_the_frames_are_told_too_if_the_run_is_stopped():
    rows = compute_rows([bed(apart=2.0)] * 3, scanfab.Settings(workers=1, **SCAN))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        next(rows)
        next(rows)
        rows.close()
    said = "frames 0 to 1: as in frame 0, no contact at all by geometry"
    assert said in texts(caught, ScanfabWarning)


SQUEEZED = [bed(), bed(stretch=(1, 1, 0.98))]
# along x and z, so that grains touch along y
STRETCHED = [bed(stretch=(1.15, 1, 1.15))]
FEW = 2 * [Packing([[0, 0, 0], [1.9, 0, 0], [0, 1.9, 0], [0, 0, 1.9]], 1.0)]


NOTES = [
    ([bed(), bed(grow=1.02)], {}, "1rmin.* in frame 0.*`reference`", 1),
    ([bed(), bed(grow=1.005)], {}, "1rmin", 0),
    (SQUEEZED, {}, 'column strain is empty.*strain="grains"', 1),
    (SQUEEZED, {"strain": "grains"}, "strain is empty", 0),
    (SQUEEZED, {"frames": 0}, "strain is empty", 0),
    (STRETCHED, {}, 'of the contact fabric, y: choose `axis="y"`', 1),
    (STRETCHED, {"axis": "y"}, "loading axis", 0),
    (FEW, {"cutoff": 0}, "^frame(s 0 to 1| 0), .*fewer than 10 grains", 2),
]


@pytest.mark.parametrize(("packings", "options", "words", "count"), NOTES)
def test_what_is_worth_a_note(packings, options, words, count):
    notes = told(packings, **options)
    assert sum(re.search(words, one) is not None for one in notes) == count


def test_grains_off_the_plane_of_all_others_are_named():
    position = np.array([(k % 20, k // 20, 0.1 * (k in (7, 42))) for k in range(400)])
    found = told([Packing(position, 0.5)], ScanfabWarning)
    assert any("but those of 2 grains (id 7, 42)" in one for one in found)
    with pytest.raises(scanfab.PackingError, match=r"2 grains \(id 7, 42\).*`dim=3`"):
        Packing(position, 0.5, dim=2)
