"""compute(): empty and changing frames, chosen frames, lengths, strain, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ScanfabNote, ScanfabWarning, SettingsError
from scanfab.packing.packing import Packing
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.frames import Frames
from scanfab.pipeline.settings import Settings
from scanfab.viz.scene import look_at
from tests.helpers.dumps import dump_text, pairs_text, write

SCAN = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin"}
COUNT = 110
NAMES = "id type x y z radius"
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


# one frame


@pytest.mark.parametrize("variants", ["a", "d", "bc"])
def test_each_variant_is_the_same_alone(variants):
    packing = packing_of(heap())
    everything = scanfab.compute(packing, **SCAN)
    assert [row.variant for row in everything] == ["a", "b", "c", "d"]
    assert {(row.frame, row.source, row.contacts_from) for row in everything} == {
        (0, "", "geometric")
    }
    for row in scanfab.compute(packing, variants=variants, **SCAN):
        expected = everything.select(variant=row.variant)[0]
        for name in ("grains", "rattlers", "contacts", "coordination", "gc_xx", "cutoff"):
            assert getattr(row, name) == getattr(expected, name)


def test_the_same_seed_gives_the_same_bytes_with_any_number_of_workers():
    packing = packing_of(heap())
    tables = [scanfab.compute(packing, workers=n, seed=3, **SCAN).rows for n in (1, 2, 5)]
    assert tables[0] == tables[1] == tables[2]


def test_rows_come_as_soon_as_their_frame_is_done(shrinking):
    rows = compute_rows(shrinking, Settings(**SCAN))
    assert [next(rows).frame for _ in range(5)] == [0, 0, 0, 0, 1]


# series


@pytest.mark.parametrize(
    ("frames", "numbers"),
    [
        ("1:3", [1, 2]),
        ("2", [2]),
        ("-3:-1", [1, 2]),
        ("::-2", [1, 3]),
        ("2:100", [2, 3]),
    ],
)
def test_chosen_frames_have_the_rows_that_they_have_among_all(
    shrinking, whole_table, frames, numbers
):
    table = scanfab.compute(shrinking, frames=frames, **SCAN)
    assert table.rows == tuple(row for row in whole_table if row.frame in numbers)
    assert [row.step for row in table.select(variant="a")] == [100 * k for k in numbers]


@pytest.mark.parametrize("frames", ["4:", "2:1", "-9:-5"])
def test_no_frames_at_all_are_an_error(shrinking, frames):
    found = rf"^frames: the series has no frame in .*: {shrinking.name} has 4 frames, 0 to 3$"
    with pytest.raises(SettingsError, match=found):
        scanfab.compute(shrinking, frames=frames, **SCAN)
    with pytest.raises(SettingsError, match="the series has no frame in"):
        scanfab.compute(shrinking[1:1], **SCAN)


@pytest.mark.parametrize(
    ("part", "frames", "alone"),
    [
        (slice(-2, None), None, "-2:"),
        (slice(1, None), "1:", "2:"),
        (slice(0, 3), "::-1", "0:3"),
    ],
)
def test_a_part_of_a_series_has_the_rows_of_its_frames(shrinking, part, frames, alone):
    """Strain, RV and rmin as well: they are those of the first frame of the whole."""
    series = shrinking
    own = scanfab.compute(series[part], frames=frames, **SCAN)
    assert own == scanfab.compute(series, frames=alone, **SCAN)
    assert len(own) > 0


def test_a_part_looks_for_its_first_frame_with_grains_in_the_whole(shrinking):
    """As calibrate and view do, whose frame is one of the part."""
    frames = Frames(shrinking[1:3], Settings(frames=slice(-1, None)))
    assert [number for number, _ in frames.due()] == [2]
    assert frames.reference()[0] == 0
    look = look_at(shrinking[1:3], Settings(**SCAN), -1)
    whole = look_at(shrinking, Settings(**SCAN), 2)
    assert look.number == whole.number == 2
    assert look.plan.window.radius == whole.plan.window.radius
    assert look.strains == whole.strains


def test_a_packing_is_a_series_of_one_frame():
    assert len(scanfab.compute(packing_of(heap()), frames="-1", **SCAN)) == 4
    with pytest.raises(SettingsError, match="no frame in"):
        scanfab.compute(packing_of(heap()), frames="1:", **SCAN)
    with pytest.raises(SettingsError, match="expected frames, found none in the source"):
        scanfab.compute([])


@pytest.mark.parametrize("strain", ["auto", "grains", "boundary"])
def test_empty_first_frames_have_rows_without_values(tmp_path, strain):
    series = series_of(tmp_path, [[], [], *SHRINKING])
    table = scanfab.compute(series, boundary="type=2", strain=strain, axis="x", **SCAN)
    (tmp_path / "full").mkdir()
    full = series_of(tmp_path / "full", SHRINKING)
    expected = scanfab.compute(full, boundary="type=2", strain=strain, axis="x", **SCAN)
    for row in table[:8]:
        assert (row.grains, row.contacts, row.segments, row.lines) == (0, 0, None, None)
        assert row.step == 100 * row.frame
        assert row.strain is None
        assert row.alpha_vs is None
        assert row.alpha_c is None
        assert row.solid_fraction is None
    shifted = [without(row, "frame", "step", "source") for row in table[8:]]
    assert shifted == [without(row, "frame", "step", "source") for row in expected]
    assert [row.frame for row in table[8:]] == [row.frame + 2 for row in expected]


def test_chosen_frames_start_from_the_first_frame_with_grains(tmp_path):
    series = series_of(tmp_path, [[], *SHRINKING])
    everything = scanfab.compute(series, strain="grains", **SCAN)
    last = scanfab.compute(series, strain="grains", frames="-1", **SCAN)
    assert last.rows == everything.rows[-4:]
    only_empty = scanfab.compute(series, strain="grains", frames="0", **SCAN)
    assert only_empty.rows == everything.rows[:4]


def test_a_series_without_any_grains_has_rows_without_values(tmp_path):
    with pytest.warns(scanfab.ScanfabWarning, match="no frame has any grains"):
        table = scanfab.compute(series_of(tmp_path, [[], []]), **SCAN)
    assert len(table) == 8
    assert np.isnan(table["alpha_vs"]).all()


def test_an_empty_frame_does_not_need_the_columns_of_the_boundary(tmp_path):
    write(tmp_path / "s_0.txt", dump_text([], "id x y z radius", step=0, box=BOX))
    write(tmp_path / "s_1.txt", dump_text(heap(), NAMES, step=1, box=BOX))
    table = scanfab.compute(scanfab.read_series(tmp_path), boundary="type=2", **SCAN)
    assert np.isnan(table["alpha_vs"][:4]).all()
    assert np.isfinite(table["alpha_vs"][4:]).all()


@pytest.mark.parametrize("lines", [SCAN, {"tolerance": 3e-5}], ids=["fixed", "auto"])
def test_the_rv_is_that_of_the_first_frame(tmp_path, lines):
    large = [(id, type, x, y, z, 1.2 * r) for id, type, x, y, z, r in heap()]
    frames = [heap(), [(id, type, x + 20, y, z, r) for id, type, x, y, z, r in large]]
    with pytest.warns(ScanfabNote, match=r"frame 1: the RV .* holds no centre of a grain"):
        table = scanfab.compute(series_of(tmp_path, frames), variants="c", **lines)
    assert table[0].grains > 0
    assert table[1].grains == 0
    # the fabric of an empty window would be that of no sample
    assert table[1].solid_fraction == 0
    assert table[1].mean_length is table[1].gvs_xx is table[1].alpha_vs is None


def test_contacts_by_geometry_stand_in_for_a_missing_file(tmp_path):
    for step in (1, 2):
        write(tmp_path / f"dump_{step}.txt", dump_text(heap(), NAMES, step=step, box=BOX))
    write(tmp_path / "pairs_1.txt", pairs_text([], step=1))
    with pytest.warns(ScanfabWarning, match="contacts are found by geometry"):
        table = scanfab.compute(scanfab.read_series(tmp_path), variants="a", **SCAN)
    assert table["contacts_from"].tolist() == ["file", "geometric"]
    assert table["contacts"][0] == 0
    assert table["contacts"][1] > 0


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


# strain


def test_strain_is_measured_from_the_first_frame(shrinking, whole_table):
    """Along the axis; of a boundary by its centres; unknown without boundary or periodic cell."""

    def strains(**options):
        return scanfab.compute(shrinking, variants="a", **options, **SCAN)["strain"]

    np.testing.assert_allclose(strains(strain="grains"), [0, 0.05, 0.1, 0.15], atol=1e-12)
    np.testing.assert_allclose(strains(strain="grains", axis="x"), 0, atol=1e-12)
    first, last = (np.ptp([row[4] for row in SHRINKING[k] if row[1] == 2]) for k in (0, 3))
    assert strains(boundary="type=2")[-1] == pytest.approx(1 - last / first)
    assert {row.strain for row in whole_table} == {None}


@pytest.mark.parametrize(("key", "values"), [("step", [0, 200]), ("frame", [0, 2])])
def test_strain_from_a_file_is_empty_where_the_file_says_nothing(tmp_path, shrinking, key, values):
    text = f"{key},strain\n{values[0]},0.0\n{values[1]},0.125\n"
    path = write(tmp_path / "strain.csv", text)
    table = scanfab.compute(shrinking, strain=path, variants="a", **SCAN)
    assert [row.strain for row in table] == [0.0, None, 0.125, None]


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


def test_settings_are_checked_before_a_frame_is_read(tmp_path):
    series = series_of(tmp_path, [heap()])
    (tmp_path / "dump.txt").unlink()
    with pytest.raises(SettingsError, match="rv: expected"):
        scanfab.compute(series, rv=-1)


def test_a_boundary_that_is_everything_is_refused(tmp_path):
    with pytest.raises(SettingsError, match="no grain is left"):
        scanfab.compute(series_of(tmp_path, [heap()]), boundary="radius>0", **SCAN)


def test_a_boundary_that_only_a_later_frame_has_is_fine(tmp_path):
    grains = [row for row in heap() if row[1] == 1]
    series = series_of(tmp_path, [grains, heap(squeeze=0.9)])
    table = scanfab.compute(series, boundary="type=2", variants="a", **SCAN)
    assert len(table) == 2


def test_what_may_be_clumps_is_warned_of_once_and_computed(tmp_path):
    # two grains of a column are one molecule
    rows = [(*row, 100 * round(row[2]) + 10 * round(row[3]) + round(row[4]) // 2) for row in heap()]
    texts = [dump_text(rows, f"{NAMES} mol", step=k, box=BOX) for k in range(2)]
    series = scanfab.read_series(write(tmp_path / "dump.txt", "".join(texts)))
    with pytest.warns(ScanfabWarning, match="the column mol names") as told:
        assert len(scanfab.compute(series, variants="a", **SCAN)) == 2
    assert [str(one.message)[:9] for one in told if "mol" in str(one.message)] == [
        "frame 0: ", "frames 0 ",
    ]  # fmt: skip


WRONG = [
    ({"executor": 4}, "executor: expected a concurrent.futures.Executor, found 4"),
    ({"strain": 3}, "strain: expected auto, cell, boundary, grains or a CSV file .* found 3"),
]


@pytest.mark.parametrize(("options", "told"), WRONG)
def test_a_value_of_another_kind_is_told_by_its_option(options, told):
    with pytest.raises(SettingsError, match=told):
        scanfab.compute(Packing([[0, 0, 0]], 1.0), **options)


def test_the_forms_of_options_are_in_the_help():
    told = " ".join(scanfab.compute.__doc__.split())
    for form in ("stop|skip", "auto|cell|boundary|grains|FILE.csv", "A:B:C", "x|y|z|X,Y,Z"):
        assert f"Written as ``{form}``." in told


def test_a_grain_that_flew_away_is_told_of_once_in_a_series():
    grid = np.stack(np.meshgrid(*3 * [np.arange(5.0)]), axis=-1).reshape(-1, 3)
    frames = [Packing(np.vstack([grid, [x, 2.0, 2.0]]), 0.5) for x in (20.0, 25.0, 30.0)]
    with pytest.warns(ScanfabWarning) as told:
        scanfab.compute(frames, variants="a", directions=9, spacing="2rmin", contact_tolerance=1e-4)
    assert [str(one.message)[:7] for one in told if "flown away" in str(one.message)] == ["frame 0"]
