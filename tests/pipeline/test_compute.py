"""compute(): empty and changing frames, chosen frames, the reference frame, and refusals."""

import shutil

import numpy as np
import pytest

import scanfab
from scanfab import Packing, PackingError, ReadError, Settings, SettingsError
from scanfab.base.errors import NoReferenceError, ScanfabNote
from scanfab.pipeline.inspection import inspect_series
from scanfab.viz.scene import look_at
from tests.helpers.dumps import NAMES, cubic_rows, dump_text, write
from tests.helpers.lattices import shaken_cubic

SCAN = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin"}
BOX = ((0, 4),) * 3
SHRINKING = [cubic_rows(squeeze=factor) for factor in (1.0, 0.95, 0.9, 0.85)]


def series_of(folder, frames):
    """A file of snapshots; steps are 100 for each frame."""
    texts = [dump_text(rows, step=100 * k, box=BOX) for k, rows in enumerate(frames)]
    return scanfab.read_series(write(folder / "dump.txt", "".join(texts)))


def numbers(row):
    """What a row says of the sample, whichever frame it is."""
    return {key: value for key, value in row.items() if key not in ("frame", "step", "source")}


@pytest.fixture(scope="module")
def shrinking(tmp_path_factory):
    return series_of(tmp_path_factory.mktemp("series"), SHRINKING)


@pytest.mark.parametrize(("frames", "chosen"), [("1:3", [1, 2]), ("::-2", [1, 3])])
def test_chosen_frames_have_the_rows_that_they_have_among_all(shrinking, frames, chosen):
    whole = scanfab.compute(shrinking, **SCAN)
    table = scanfab.compute(shrinking, frames=frames, **SCAN)
    assert tuple(table) == tuple(row for row in whole if row.frame in chosen)
    assert [row.step for row in table.select(variant="a")] == [100 * k for k in chosen]


def test_no_frames_at_all_are_an_error(shrinking):
    none = "^the series has no frame in "
    for frames in ("4:", "-9:-5"):
        with pytest.raises(SettingsError, match=f"{none}.*: {shrinking.name} has 4 frames, 0 to 3"):
            scanfab.compute(shrinking, frames=frames, **SCAN)
    for source, frames, told in (
        (shrinking[1:1], ":", none),
        (shrinking[0].read(), "1:", none),
        (iter([shrinking[0].read()]), "7:9", r"no frame in 7:9: .*has 1 frame, 0"),
        ([], ":", "expected frames, found none in the source"),
    ):
        with pytest.raises(SettingsError, match=told):
            scanfab.compute(source, frames=frames, **SCAN)


def test_a_part_looks_for_its_first_frame_with_grains_in_the_whole(shrinking):
    """As calibrate and view do, whose frame is one of the part."""
    part = scanfab.compute(shrinking[1:3], frames=-1, **SCAN)
    assert part == scanfab.compute(shrinking, frames=2, **SCAN)
    look = look_at(shrinking[1:3], Settings(**SCAN), -1)
    whole = look_at(shrinking, Settings(**SCAN), 2)
    assert look.number == whole.number == 2
    assert look.strain == whole.strain
    assert look.plan.window.radius == whole.plan.window.radius


@pytest.mark.parametrize("strain", ["auto", "grains", "boundary"])
def test_empty_first_frames_have_rows_without_values(tmp_path, strain):
    """They need no columns of the boundary; strains are those from the first with grains."""
    write(tmp_path / "dump_0.txt", dump_text([], "id x y z radius", box=BOX))
    for step, rows in enumerate([[], *SHRINKING], start=1):
        write(tmp_path / f"dump_{step}.txt", dump_text(rows, NAMES, step=step, box=BOX))
    series = scanfab.read_series(tmp_path)
    words = {"boundary": "id<=16", "strain": strain, "axis": "y", "variants": "ac", **SCAN}
    words["rv"] = (0.5, 0.7)
    table = scanfab.compute(series, **words)
    assert [(row.variant, row.rv) for row in table[:3]] == [("a", None), ("c", 0.5), ("c", 0.7)]
    for row in table[:6]:
        assert (row.grains, row.contacts, row.segments, row.lines) == (0, 0, None, None)
        assert row.step == row.frame
        assert row.strain is row.alpha_vs is row.alpha_c is row.solid_fraction is None
    (tmp_path / "full").mkdir()
    expected = scanfab.compute(series_of(tmp_path / "full", SHRINKING), **words)
    assert [numbers(row) for row in table[6:]] == [numbers(row) for row in expected]
    for frames, rows in (("-1", table[-3:]), ("0", table[:3])):
        assert scanfab.compute(series, frames=frames, **words) == rows
    with pytest.raises(PackingError, match="no frame has any grains"):
        scanfab.compute(series_of(tmp_path, [[], []]), **SCAN)


LINES = {"directions": 9, "spacing": "0.5rmin", "variants": "ac"}
HIGH = ((0, 30),) * 3


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
        text = dump_text(rows_of(frame), step=100 * frame, box=HIGH)
        write(folder / f"dump_{100 * frame}.txt", text)
    return folder


@pytest.mark.parametrize("reference", [3, -1])
def test_lengths_come_from_the_reference_frame(bed, tmp_path, reference):
    shutil.copy(bed / "dump_300.txt", tmp_path / "alone.txt")
    (whole, inner) = scanfab.compute(scanfab.read_series(tmp_path / "alone.txt"), **LINES)
    series = scanfab.read_series(bed)
    found = scanfab.compute(series, reference=reference, frames=-1, **LINES)
    assert [numbers(row) for row in found] == [numbers(whole), numbers(inner)]
    # a part of the series has the same reference
    part = scanfab.compute(series[2:], reference=reference, strain="grains", **LINES)
    assert part.select(frame=3)[0].strain == 0
    assert part.select(frame=2)[0].strain == pytest.approx(1 - 0.94 / 0.91, rel=0.01)
    # by default the RV lies where the bed was in frame 1, and r_min is that of frame 1
    with pytest.warns(ScanfabNote, match="frame 3: the RV .* holds no centre"):
        usual = scanfab.compute(series, frames=-1, **LINES)
    assert usual[1].grains == 0
    assert usual[0].cutoff == pytest.approx(whole.cutoff / 1.02**2)


NO_REFERENCES = [
    (4, NoReferenceError, "reference: there is no frame 4: .*bed has 4 frames"),
    (-5, NoReferenceError, "reference: there is no frame -5"),
    (0, NoReferenceError, "reference: frame 0 of .*bed has no grains"),
    (2, ReadError, "dump_200.txt"),
    ("last", SettingsError, "reference: expected the number of a frame, .*found 'last'"),
]


@pytest.mark.parametrize(("reference", "error", "words"), NO_REFERENCES)
def test_a_frame_that_cannot_be_the_reference_is_an_error(bed, reference, error, words):
    (bed / "dump_200.txt").write_text((bed / "dump_200.txt").read_text()[:-40])
    with pytest.raises(error, match=words):
        scanfab.compute(scanfab.read_series(bed), reference=reference, on_error="skip", **LINES)


def test_streams_wait_for_their_reference(bed):
    packings = [Packing(*shaken_cubic(np.random.default_rng(k), 4)) for k in range(3)]
    stream = [Packing(np.zeros((0, 3)), np.zeros(0)), *packings]
    table = scanfab.compute(iter(stream), reference=1, contact_tolerance=0.1, **LINES)
    assert table == scanfab.compute(iter(stream), contact_tolerance=0.1, **LINES)
    for source, reference, told in (
        (iter(stream), 2, "expected 1, found 2"),
        (iter(packings), -1, "counts from the end"),
        (iter(stream[:1]), 7, "there is no frame 7"),
        (scanfab.follow_series(bed, seconds=0.1), -1, "counts from the end"),
    ):
        with pytest.raises(NoReferenceError, match=told):
            scanfab.compute(source, reference=reference, **LINES)


def test_the_plane_is_that_of_the_reference(tmp_path):
    """The first frame is a layer of spheres, as a bed begins that is poured."""
    flat = [(k, 1, k % 5, k // 5, 0.0, 0.4) for k in range(20)]
    for step, rows in ((0, flat), (1, rows_of(1))):
        write(tmp_path / f"dump_{step}.txt", dump_text(rows, step=step, box=HIGH))
    (whole, _) = scanfab.compute(scanfab.read_series(tmp_path), reference=1, frames=1, **LINES)
    assert whole.gvs_zz > 0.2


def test_calibrate_map_and_inspect_take_it(bed):
    series = scanfab.read_series(bed)
    options = {"reference": -1, "directions": 9, "spacing": "0.5rmin"}
    table = scanfab.fabric_map(series, slices=2, frames=-1, **options)
    assert sum(table["grains"]) == 125
    reports = list(inspect_series(series, Settings(reference=-1)))
    assert reports[3].grains_in_rv > 0
    assert reports[1].rv_center == reports[3].rv_center
