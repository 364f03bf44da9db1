"""Discs in a plane: what decides that, what settings mean there, and what is refused."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, PackingError, SettingsError, compute
from scanfab.base.space import SPACE, Space
from tests.helpers.dumps import dump_text
from tests.helpers.truth import SAMPLE_DATA

XY, YZ, ZX = Space(2), Space(0), Space(1)
FAST = {"tolerance": 0.05, "workers": 1}


@pytest.fixture
def discs():
    """Discs at random places of a square."""
    random = np.random.default_rng(2)
    return random.random((200, 2)) * 14.0, random.uniform(0.3, 0.6, 200)


def series_of(tmp_path, *heights, **options):
    """Frames whose grains lie at these heights, on a grid in x and y."""
    for step, z in enumerate(heights):
        rows = [(k + 1, 2.0 * (k % 4), 2.1 * (k // 4), one, 1.0) for k, one in enumerate(z)]
        (tmp_path / f"dump.{step}").write_text(dump_text(rows, "id x y z radius", step=step))
    return scanfab.read_series(tmp_path, **options)


FRAMES = [
    ([[0.5] * 10], "auto", XY), ([[0.5] * 9], "auto", SPACE),
    ([[0.5] * 9], 2, XY), ([[0.5] * 10], 3, SPACE),
    # the first frame that has grains decides for all, whichever is read first
    ([[], [0.5] * 12, [0.7] * 2], "auto", XY),
    ([[0.5] * 16, [*[0.5] * 15, 0.6]], "auto", r"dump.1: .* do not lie in one coordinate plane"),
    ([[*[0.5] * 15, 0.6]], 2, "do not lie in one coordinate plane"),
]  # fmt: skip


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
@pytest.mark.parametrize(("heights", "dim", "found"), FRAMES)
def test_the_first_frame_decides(tmp_path, heights, dim, found):
    series = series_of(tmp_path, *heights, dim=dim)
    if isinstance(found, str):
        with pytest.raises(PackingError, match=found):
            series[-1].read()
    else:
        assert series[-1].read().space == series[0].read().space == found


def test_frames_of_mixed_dimension_are_an_error(discs):
    position, radius = discs
    flat = Packing(position, radius)
    ball = Packing(np.column_stack([position, np.arange(200.0) % 14]), radius)
    for frames in ([flat, ball], [ball, flat]):
        with pytest.raises(PackingError, match="the first frame that has grains lies in"):
            compute(frames, variants="a", **FAST)


def test_positions_with_two_coordinates_are_discs(discs):
    position, radius = discs
    packing = Packing(position, radius)
    assert (packing.space, packing.position[:, 2].any()) == (XY, False)
    assert Packing(packing.position, radius).space == SPACE
    assert Packing(packing.position, radius, dim=2).space == XY
    for words, told in (
        ({"dim": 3}, "dim: expected 2"),
        ({"dim": 4}, "dim: expected 2 or 3, found 4"),
        ({"cell": Cell([[14.0, 0, 1.0], [0, 14, 0], [0, 0, 3]])}, "two of them in the plane"),
    ):
        with pytest.raises(PackingError, match=told):
            Packing(position, radius, **words)


def test_the_period_across_the_plane_is_ignored(discs):
    """Also one that is thinner than a disc, or leans."""
    one, *others = (
        compute(Packing(*discs, cell=Cell(vectors)), variants="ac", **FAST)
        for vectors in ([14, 14, 0.1], [14, 14, 50], [[14, 0, 0], [0, 14, 0], [3, 2, 1.0]])
    )
    assert others == [one, one]


MEANINGLESS = [
    ({"axis": "z"}, "axis: the axis z leads out of the plane x-y.*choose x, y"),
    ({"rv_shape": "cylinder"}, "rv_shape: cylinder is no window for discs"),
    ({"rv_shape": "box", "rv_size": "1,2,3"}, "expected A,B in the plane .*full edges"),
    ({"directions": "lebedev:11"}, "directions: lebedev:11 is a rule for three dim.*as 16"),
    ({"rv_center": (7, 7, 3)}, "rv_center: lies outside the plane x-y.*z = 0, found 3"),
]


@pytest.mark.parametrize(("options", "message"), MEANINGLESS)
def test_what_has_no_meaning_in_a_plane_is_an_error(discs, options, message):
    with pytest.raises(SettingsError, match=message):
        compute(Packing(*discs), **FAST, **options)


def test_rv_sizes_and_solid_fraction():
    """ν of discs without overlap is the sum of their areas over that of the cell."""
    grid = np.stack(np.meshgrid(np.arange(12.0), np.arange(10.0)), axis=-1).reshape(-1, 2)
    packing = Packing(grid + 0.5, 0.4, cell=Cell([12, 10, 1]))
    words = {"rv_shape": "box", "rv_size": "6,4", "cutoff": 0.1, "contact_tolerance": 0.3}
    one, other = compute(packing, variants="ac", **{**FAST, **words, "tolerance": 5e-3})
    assert one.solid_fraction == pytest.approx(np.pi * 0.16, rel=2e-3)
    assert (other.grains, one.coordination) == (24, 4.0)
    assert one.gc_xx == pytest.approx(0.5)


@pytest.mark.parametrize("follows", ["cell", "grains"])
def test_the_rv_follows_the_strain(discs, follows):
    position, radius = discs
    frames = [
        Packing(position * squeeze, radius, cell=Cell([*(14 * squeeze), 1.0]))
        for squeeze in (np.ones(2), np.array([1.1, 0.9]))
    ]
    first, last = compute(frames, variants="c", rv_follows="strain", strain=follows, **FAST)
    assert last.grains == pytest.approx(first.grains, abs=3)
    assert last.strain == pytest.approx(0.1, abs=1e-9)
    # half the difference of the principal strains, as the deviator stress works on it
    assert last.shear_strain == pytest.approx(0.5 * np.log(1.1 / 0.9))


@pytest.mark.parametrize(("variants", "tolerance"), [("a", 5e-5), ("ac", 1e-4)])
@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_an_auto_scan_meets_its_tolerance_and_goes_little_further(variants, tolerance):
    """The goal is the error in the plane, 2 a·G·a - 1, which is 4/3 of that in space."""
    run = SAMPLE_DATA / "lammps_biaxial"
    packing = scanfab.read(run / "discs.60000.lammpstrj.gz", contacts=run / "pairs.60000.local.gz")
    table = compute(packing, variants=variants, tolerance=tolerance, workers=1)
    assert 0.6 * tolerance < max(row.alpha_vs_axial_se for row in table) <= tolerance


@pytest.mark.parametrize(("steps", "known"), [(2, []), (4, [2, 4])])
def test_harmonics_need_more_directions_than_the_tensor(discs, steps, known):
    position, radius = discs
    words = {**FAST, "directions": steps, "with_": "harmonics", "variants": "a"}
    row = compute(Packing(position, radius, dim=2), **words)[0]
    assert row["alpha_vs_axial"] is not None
    assert [order for order in (2, 4) if row[f"vs_a{order}"] is not None] == known
