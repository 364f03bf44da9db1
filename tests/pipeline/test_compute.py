"""compute(): empty and changing frames, chosen frames, lengths, strain, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabWarning, SettingsError
from scanfab.packing.packing import Packing
from scanfab.pipeline.frames import Frames
from scanfab.pipeline.settings import Settings
from scanfab.viz.scene import look_at
from tests.helpers.dumps import NAMES, dump_text, write

SCAN = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin"}
COUNT = 110
BOX = ((0, 10),) * 3


def heap(count=COUNT, squeeze=1.0, seed=5):
    """Rows of a dump: spheres about the points of a lattice, type 2 on the lowest layer."""
    random = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(5.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    order = random.permutation(len(grid))[:count]
    position = (grid + random.uniform(-0.05, 0.05, grid.shape))[order] + 2
    position[:, 2] *= squeeze
    radius = random.uniform(0.42, 0.62, len(grid))[order]
    type = np.where(grid[order, 2] == 0, 2, 1)
    return [
        (id + 1, kind, *place, size)
        for id, (kind, place, size) in enumerate(
            zip(type.tolist(), position.tolist(), radius.tolist(), strict=True)
        )
    ]


def packing_of(rows, **arguments):
    values = np.array(rows)
    return Packing(
        values[:, 2:5], values[:, 5], id=values[:, 0], columns={"type": values[:, 1]}, **arguments
    )


def series_of(folder, frames):
    """A file of snapshots; steps are 100 for each frame."""
    texts = [dump_text(rows, NAMES, step=100 * k, box=BOX) for k, rows in enumerate(frames)]
    return scanfab.read_series(write(folder / "dump.txt", "".join(texts)))


def without(row, *names):
    return {key: value for key, value in row.items() if key not in names}


SHRINKING = [heap(squeeze=factor) for factor in (1.0, 0.95, 0.9, 0.85)]


@pytest.fixture(scope="module")
def shrinking(tmp_path_factory):
    return series_of(tmp_path_factory.mktemp("series"), SHRINKING)


@pytest.fixture(scope="module")
def whole_table(shrinking):
    return scanfab.compute(shrinking, **SCAN)


@pytest.mark.parametrize("variants", ["a", "bd"])
def test_each_variant_is_the_same_alone(variants):
    packing = packing_of(heap())
    everything = scanfab.compute(packing, **SCAN)
    assert [row.variant for row in everything] == ["a", "b", "c", "d"]
    assert {(row.frame, row.source, row.contacts_from) for row in everything} == {
        (0, "", "geometric")
    }
    alone = scanfab.compute(packing, variants=variants, **SCAN)
    expected = [row for row in everything if row.variant in variants]
    for name in ("grains", "rattlers", "contacts", "coordination", "gc_xx", "cutoff"):
        assert alone[name].tolist() == [row[name] for row in expected]


@pytest.mark.parametrize(("frames", "numbers"), [("1:3", [1, 2]), ("::-2", [1, 3])])
def test_chosen_frames_have_the_rows_that_they_have_among_all(
    shrinking, whole_table, frames, numbers
):
    table = scanfab.compute(shrinking, frames=frames, **SCAN)
    assert table.rows == tuple(row for row in whole_table if row.frame in numbers)
    assert [row.step for row in table.select(variant="a")] == [100 * k for k in numbers]


@pytest.mark.parametrize("frames", ["4:", "-9:-5"])
def test_no_frames_at_all_are_an_error(shrinking, frames):
    found = rf"^frames: the series has no frame in .*: {shrinking.name} has 4 frames, 0 to 3$"
    with pytest.raises(SettingsError, match=found):
        scanfab.compute(shrinking, frames=frames, **SCAN)
    with pytest.raises(SettingsError, match="the series has no frame in"):
        scanfab.compute(shrinking[1:1], **SCAN)


@pytest.mark.parametrize(
    ("part", "frames", "alone"), [(slice(1, None), "1:", "2:"), (slice(0, 3), "::-1", "0:3")]
)
def test_a_part_of_a_series_has_the_rows_of_its_frames(shrinking, part, frames, alone):
    """Strain, RV and rmin as well: they are those of the first frame of the whole."""
    own = scanfab.compute(shrinking[part], frames=frames, **SCAN)
    assert own == scanfab.compute(shrinking, frames=alone, **SCAN)
    assert len(own) > 0


def test_a_part_looks_for_its_first_frame_with_grains_in_the_whole(shrinking):
    """As calibrate and view do, whose frame is one of the part."""
    frames = Frames(shrinking[1:3], Settings(frames=slice(-1, None)))
    assert [number for number, _ in frames.due()] == [2]
    assert frames.reference()[0] == 0
    look = look_at(shrinking[1:3], Settings(**SCAN), -1)
    whole = look_at(shrinking, Settings(**SCAN), 2)
    assert look.number == whole.number == 2
    assert look.strains == whole.strains
    assert look.plan.window.radius == whole.plan.window.radius


def test_a_packing_is_a_series_of_one_frame():
    assert len(scanfab.compute(packing_of(heap()), frames="-1", **SCAN)) == 4
    with pytest.raises(SettingsError, match="no frame in"):
        scanfab.compute(packing_of(heap()), frames="1:", **SCAN)
    with pytest.raises(SettingsError, match="expected frames, found none in the source"):
        scanfab.compute([])


@pytest.mark.parametrize("strain", ["auto", "grains", "boundary"])
def test_empty_first_frames_have_rows_without_values(tmp_path, strain):
    """They need no columns of the boundary; strains are those from the first with grains."""
    write(tmp_path / "dump_0.txt", dump_text([], "id x y z radius", box=BOX))
    for step, rows in enumerate([[], *SHRINKING], start=1):
        write(tmp_path / f"dump_{step}.txt", dump_text(rows, NAMES, step=step, box=BOX))
    series = scanfab.read_series(tmp_path)
    words = {"boundary": "type=2", "strain": strain, "axis": "x", "variants": "ac", **SCAN}
    table = scanfab.compute(series, **words)
    for row in table[:4]:
        assert (row.grains, row.contacts, row.segments, row.lines) == (0, 0, None, None)
        assert row.step == row.frame
        assert row.strain is row.alpha_vs is row.alpha_c is row.solid_fraction is None
    (tmp_path / "full").mkdir()
    expected = scanfab.compute(series_of(tmp_path / "full", SHRINKING), **words)
    of_place = ("frame", "step", "source")
    assert [without(row, *of_place) for row in table[4:]] == [
        without(row, *of_place) for row in expected
    ]
    for frames, rows in (("-1", table.rows[-2:]), ("0", table.rows[:2])):
        assert scanfab.compute(series, frames=frames, **words).rows == rows
    with pytest.warns(ScanfabWarning, match="no frame has any grains"):
        nothing = scanfab.compute(series_of(tmp_path, [[], []]), **SCAN)
    assert [row.alpha_vs for row in nothing] == [None] * 8


def test_only_rattlers_leave_an_rv_without_a_fabric():
    packing = packing_of(heap(), contacts=[])
    with pytest.warns(
        ScanfabWarning, match=r"variant d: no grain is left, all \d+ that reach into"
    ):
        solid, empty = scanfab.compute(packing, variants="cd", **SCAN)
    assert solid.alpha_vs is not None
    assert solid.contacts == solid.coordination == 0
    assert solid.alpha_c is solid.gc_xx is None
    assert (empty.grains, empty.rattlers, empty.solid_fraction) == (0, solid.grains, 0.0)
    assert empty.mean_length is empty.alpha_vs is empty.alpha_vs_axial_sample_se is None


def test_a_class_that_encloses_the_rest_is_a_warning():
    random = np.random.default_rng(3)
    shell = random.normal(size=(200, 3))
    shell *= 6 / np.linalg.norm(shell, axis=1, keepdims=True)
    rows = [(*row[:2], *(np.array(row[2:5]) - 4), row[5]) for row in heap(125)]
    rows = [(id, 1, *rest) for id, _, *rest in rows]
    rows += [(1000 + k, 3, *place, 0.5) for k, place in enumerate(shell)]
    with pytest.warns(ScanfabWarning, match=r'type=3 enclose the others.*`boundary="type=3"`') as e:
        scanfab.compute(packing_of(rows), variants="a", **SCAN)
    assert len(e) == 1
    table = scanfab.compute(packing_of(rows), variants="a", boundary="type=3", **SCAN)
    assert table[0].grains == 125


def test_what_may_be_clumps_is_warned_of_once_and_computed(tmp_path):
    # two grains of a column are one molecule
    rows = [(*row, 100 * round(row[2]) + 10 * round(row[3]) + round(row[4]) // 2) for row in heap()]
    texts = [dump_text(rows, f"{NAMES} mol", step=k, box=BOX) for k in range(2)]
    series = scanfab.read_series(write(tmp_path / "dump.txt", "".join(texts)))
    with pytest.warns(ScanfabWarning, match="the column mol names") as told:
        assert len(scanfab.compute(series, variants="a", **SCAN)) == 2
    found = [str(one.message)[:9] for one in told if "mol" in str(one.message)]
    assert found == ["frame 0: ", "frames 0 "]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"executor": 4}, "executor: expected a concurrent.futures.Executor, found 4"),
        ({"strain": 3}, "strain: expected auto, cell, boundary, grains or a CSV file .* found 3"),
        ({"rv": -1}, "rv: expected"),
        ({"boundary": "radius>0"}, "no grain is left"),
    ],
)
def test_options_that_cannot_be_used_are_named(options, told):
    with pytest.raises(SettingsError, match=told):
        scanfab.compute(Packing([[0, 0, 0]], 1.0), **options)
