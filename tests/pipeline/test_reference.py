"""The reference frame, from which L0, the RV, the radii and the blocks of a map come."""

import shutil

import numpy as np
import pytest

import scanfab
from scanfab import Packing, ReadError, Settings, SettingsError
from scanfab.base.errors import NoReferenceError, ScanfabNote
from scanfab.pipeline.inspection import inspect_series
from tests.helpers.dumps import dump_text, write
from tests.helpers.lattices import shaken_cubic
from tests.pipeline.test_compute import numbers

SCAN = {"directions": 9, "spacing": "0.5rmin", "variants": "ac"}
BOX = ((0, 30),) * 3


def rows_of(frame: int) -> list[tuple[object, ...]]:
    """A bed that sinks and is squeezed, of grains that grow by 2 % a frame; nothing in frame 0."""
    if frame == 0:
        return []
    position, radius = shaken_cubic(np.random.default_rng(1), 5)
    position = position * [1, 1, 1 - 0.03 * frame] + [5, 5, 20 - 4 * frame]
    numbers = zip(position.tolist(), (radius * 1.02**frame).tolist(), strict=True)
    return [(row, 1, *place, size) for row, (place, size) in enumerate(numbers, start=1)]


@pytest.fixture
def bed(tmp_path):
    """A folder of four frames."""
    folder = tmp_path / "bed"
    folder.mkdir()
    for frame in range(4):
        text = dump_text(rows_of(frame), step=100 * frame, box=BOX)
        write(folder / f"dump_{100 * frame}.txt", text)
    return folder


@pytest.mark.parametrize("reference", [3, -1])
def test_lengths_come_from_the_reference_frame(bed, tmp_path, reference):
    shutil.copy(bed / "dump_300.txt", tmp_path / "alone.txt")
    (whole, inner) = scanfab.compute(scanfab.read_series(tmp_path / "alone.txt"), **SCAN)
    series = scanfab.read_series(bed)
    found = scanfab.compute(series, reference=reference, frames=-1, **SCAN)
    assert [numbers(row) for row in found] == [numbers(whole), numbers(inner)]
    # a part of the series has the same reference
    part = scanfab.compute(series[2:], reference=reference, strain="grains", **SCAN)
    assert part.select(frame=3)[0].strain == 0
    assert part.select(frame=2)[0].strain == pytest.approx(1 - 0.94 / 0.91, rel=0.01)
    # by default the RV lies where the bed was in frame 1, and r_min is that of frame 1
    with pytest.warns(ScanfabNote, match="frame 3: the RV .* holds no centre"):
        usual = scanfab.compute(series, frames=-1, **SCAN)
    assert usual[1].grains == 0
    assert usual[0].cutoff == pytest.approx(whole.cutoff / 1.02**2)


@pytest.mark.parametrize(
    ("reference", "error", "words"),
    [
        (4, NoReferenceError, "reference: there is no frame 4: .*bed has 4 frames"),
        (-5, NoReferenceError, "reference: there is no frame -5"),
        (0, NoReferenceError, "reference: frame 0 of .*bed has no grains"),
        (2, ReadError, "dump_200.txt"),
        ("last", SettingsError, "reference: expected the number of a frame, .*found 'last'"),
    ],
)
def test_a_frame_that_cannot_be_the_reference_is_an_error(bed, reference, error, words):
    (bed / "dump_200.txt").write_text((bed / "dump_200.txt").read_text()[:-40])
    with pytest.raises(error, match=words):
        scanfab.compute(scanfab.read_series(bed), reference=reference, on_error="skip", **SCAN)


def test_streams_wait_for_their_reference(bed):
    packings = [Packing(*shaken_cubic(np.random.default_rng(k), 4)) for k in range(3)]
    stream = [Packing(np.zeros((0, 3)), np.zeros(0)), *packings]
    table = scanfab.compute(iter(stream), reference=1, contact_tolerance=0.1, **SCAN)
    assert table == scanfab.compute(iter(stream), contact_tolerance=0.1, **SCAN)
    for source, reference, told in (
        (iter(stream), 2, "expected 1, found 2"),
        (iter(packings), -1, "counts from the end"),
        (iter(stream[:1]), 7, "there is no frame 7"),
        (scanfab.follow_series(bed, seconds=0.1), -1, "counts from the end"),
    ):
        with pytest.raises(NoReferenceError, match=told):
            scanfab.compute(source, reference=reference, **SCAN)


def test_the_plane_is_that_of_the_reference(tmp_path):
    """The first frame is a layer of spheres, as a bed begins that is poured."""
    flat = [(k, 1, k % 5, k // 5, 0.0, 0.4) for k in range(20)]
    for step, rows in ((0, flat), (1, rows_of(1))):
        write(tmp_path / f"dump_{step}.txt", dump_text(rows, step=step, box=BOX))
    (whole, _) = scanfab.compute(scanfab.read_series(tmp_path), reference=1, frames=1, **SCAN)
    assert whole.gvs_zz > 0.2


def test_calibrate_map_and_inspect_take_it(bed):
    series = scanfab.read_series(bed)
    options = {"reference": -1, "directions": 9, "spacing": "0.5rmin"}
    table = scanfab.fabric_map(series, slices=2, frames=-1, **options)
    assert sum(table["grains"]) == 125
    reports = list(inspect_series(series, Settings(reference=-1)))
    assert reports[3].grains_in_rv > 0
    assert reports[1].rv_center == reports[3].rv_center
