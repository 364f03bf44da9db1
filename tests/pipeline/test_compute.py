"""compute(): empty and changing frames, chosen frames, and refusals."""

import pytest

import scanfab
from scanfab import Packing, ScanfabWarning, Settings, SettingsError
from scanfab.pipeline.frames import Frames
from scanfab.viz.scene import look_at
from tests.helpers.dumps import NAMES, cubic_rows, dump_text, write

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
    assert table.rows == tuple(row for row in whole if row.frame in chosen)
    assert [row.step for row in table.select(variant="a")] == [100 * k for k in chosen]


def test_no_frames_at_all_are_an_error(shrinking):
    none = "^frames: the series has no frame in "
    for frames in ("4:", "-9:-5"):
        with pytest.raises(SettingsError, match=f"{none}.*: {shrinking.name} has 4 frames, 0 to 3"):
            scanfab.compute(shrinking, frames=frames, **SCAN)
    for source, frames, told in (
        (shrinking[1:1], ":", none),
        (shrinking[0].read(), "1:", none),
        ([], ":", "expected frames, found none in the source"),
    ):
        with pytest.raises(SettingsError, match=told):
            scanfab.compute(source, frames=frames, **SCAN)


def test_a_part_looks_for_its_first_frame_with_grains_in_the_whole(shrinking):
    """As calibrate and view do, whose frame is one of the part."""
    frames = Frames(shrinking[1:3], Settings(frames=slice(-1, None)))
    assert [number for number, _ in frames.due()] == [2]
    assert frames.reference()[0] == 0
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
    table = scanfab.compute(series, **words)
    for row in table[:4]:
        assert (row.grains, row.contacts, row.segments, row.lines) == (0, 0, None, None)
        assert row.step == row.frame
        assert row.strain is row.alpha_vs is row.alpha_c is row.solid_fraction is None
    (tmp_path / "full").mkdir()
    expected = scanfab.compute(series_of(tmp_path / "full", SHRINKING), **words)
    assert [numbers(row) for row in table[4:]] == [numbers(row) for row in expected]
    for frames, rows in (("-1", table.rows[-2:]), ("0", table.rows[:2])):
        assert scanfab.compute(series, frames=frames, **words).rows == rows
    with pytest.warns(ScanfabWarning, match="no frame has any grains"):
        nothing = scanfab.compute(series_of(tmp_path, [[], []]), **SCAN)
    assert [row.alpha_vs for row in nothing] == [None] * 8


def test_what_is_no_executor_is_named():
    told = "executor: expected a concurrent.futures.Executor, found 4"
    with pytest.raises(SettingsError, match=told):
        scanfab.compute(Packing([[0, 0, 0]], 1.0), executor=4)
