"""RVs of every shape, size and place, by each edge rule at their surface, several in one pass."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, Settings, SettingsError, compute, find_contacts
from scanfab.packing.window import SurfaceBox
from scanfab.pipeline.measurement import measure
from scanfab.pipeline.plan import make_plan
from scanfab.pipeline.rv import rvs_of
from scanfab.scan.scan import scan_lines
from scanfab.scan.solids import Solids
from tests.helpers.lattices import ball_points, rotation, shaken_cubic
from tests.helpers.packed import sample_of
from tests.helpers.windows import corners_of_a_box, surface

pytestmark = pytest.mark.filterwarnings("ignore:.* leave the sample")
LINES = {"directions": "lebedev:5", "spacing": 0.3, "cutoff": 0.2}


@pytest.fixture(scope="module")
def flat():
    """Grains in a box of about 10 x 8 x 5."""
    position, radius = shaken_cubic(np.random.default_rng(0), 10)
    chosen = (position < [10.0, 8.0, 5.0]).all(axis=1)
    return sample_of(Packing(position[chosen], radius[chosen]))


def window_of(sample, **options):
    return rvs_of(Settings(**options), sample)[0].window


def test_sizes_are_fractions_of_the_half_extents(flat):
    box_ = SurfaceBox.of(flat.packing, flat.grains)
    half = 0.5 * box_.extents
    assert half == pytest.approx([5.0, 4.0, 2.5], abs=0.2)
    for shape in ("box", "ellipsoid"):
        window = window_of(flat, rv_shape=shape, rv=0.6)
        assert window.shape.high == pytest.approx(0.6 * half)
        assert window.shape.low == pytest.approx(-0.6 * half)
        assert window.center == pytest.approx(box_.center)
    # of both extents across the axis the smaller one
    for axis, sizes in (("x", (0, 2, 2)), ("y", (2, 1, 2)), ("z", (1, 1, 2))):
        window = window_of(flat, rv_shape="cylinder", rv_axis=axis)
        assert window.shape.high == pytest.approx(0.7 * half[[*sizes]])
    # an oblique one fits into the box
    random = np.random.default_rng(3)
    for _ in range(50):
        axis = tuple(rotation(random)[0])
        high = window_of(flat, rv_shape="cylinder", rv_axis=axis, rv=0.9).shape.high
        assert np.all(high <= 0.9 * half * (1 + 1e-9))
        assert np.any(high > 0.7 * half)
    given = window_of(flat, rv_shape="box", rv_size="1,2,3", rv_center="4 4 2")
    assert given.shape.high.tolist() == [0.5, 1.0, 1.5]
    assert given.center.tolist() == [4.0, 4.0, 2.0]


def test_a_surface_lies_where_its_file_says_or_about_the_centre_that_is_asked_for(flat, tmp_path):
    half, center = np.array([1.0, 1.5, 2.0]), np.array([4.0, 3.0, 2.5])
    file = surface(tmp_path / "box.ply", center + corners_of_a_box(half))
    window = window_of(flat, rv_shape=file)
    assert window.center == pytest.approx(center)
    assert window.shape.high == pytest.approx(half)
    assert window_of(flat, rv_shape=file, rv_center="5,4,2").center.tolist() == [5.0, 4.0, 2.0]
    notched = corners_of_a_box(np.ones(3)) * np.where(np.arange(8) == 0, 0.3, 1.0)[:, None]
    file = surface(tmp_path / "notch.ply", notched)
    words = r"rv_shape: .*notch.ply: .* not convex: .*expected a closed convex surface"
    with pytest.raises(SettingsError, match=words):
        window_of(flat, rv_shape=file)


TILTED = np.array([[6.0, 0.0, 0.0], [2.5, 6.0, 0.0], [-2.0, 1.5, 6.0]])


@pytest.fixture(scope="module")
def tilted():
    """Overlapping grains in a cell that leans."""
    random = np.random.default_rng(5)
    position = random.random((110, 3)) @ TILTED
    return sample_of(Packing(position, random.uniform(0.3, 0.8, 110), cell=Cell(TILTED)))


PERIODIC = {
    "box": {"rv_shape": "box"},
    "cylinder": {"rv_shape": "cylinder", "rv_axis": "1,1,1"},
    "ellipsoid": {"rv_shape": "ellipsoid"},
    # longer than a period, and clear of its images
    "long box": {"rv_shape": "box", "rv_size": "1.2,1.2,8.5"},
    "sphere": {},
}


@pytest.mark.parametrize("center", ["0.2 0.3 -0.1", "5.9,3,9"])
@pytest.mark.parametrize("name", PERIODIC)
def test_a_window_across_periodic_faces_is_that_of_the_repeated_packing(tilted, name, center):
    """The same grains and contacts inside, and along the same lines the same void segments."""
    settings = Settings(**PERIODIC[name], rv_center=center, variants="cd", seed=3, **LINES)
    plan = make_plan(settings, tilted)
    window, packing = plan.window, tilted.packing
    (found,) = measure(tilted, plan)
    shifts = np.array([[i, j, k] for i in range(-4, 5) for j in range(-4, 5) for k in range(-4, 5)])
    images = (packing.position[None] + (shifts @ TILTED)[:, None]).reshape(-1, 3)
    radius, removed = (np.tile(one, len(shifts)) for one in (packing.radius, tilted.rattlers))
    branch = images - window.center
    near = np.linalg.norm(branch, axis=1) < window.radius + radius
    solids = Solids(branch[near], radius[near], removed[near], window.shape)
    words = {"spacing": plan.spacing, "cutoff": 0.2, "variants": "cd", "seed": 3}
    sums = scan_lines(solids, plan.rule, replicates=range(plan.replicates), **words)
    assert np.array_equal(sums.segments, found.sums.segments)
    np.testing.assert_allclose(sums.length, found.sums.length, rtol=1e-9)
    inside = window.shape.contains(branch).reshape(len(shifts), -1)
    assert inside.sum(axis=0).max() <= 1
    assert np.array_equal(window.contains(packing.position, packing), inside.any(axis=0))
    meets = window.shape.may_meet(branch, radius).reshape(len(shifts), -1).any(axis=0)
    assert np.array_equal(window.may_meet(packing.position, packing.radius, packing), meets)


REFUSED = [
    ("flat", "ellipsoid", {"rv_size": "1e-12,1,1"}, "rv: the ellipsoid .* far too small for"),
    ("tilted", "box", {"rv_size": "6.1,1,1"}, r"overlaps its own image, \(.*\) away"),
    ("tilted", "cylinder", {"rv_size": "0.4,100"}, "overlaps its own image"),
    ("tilted", "box", {"rv_size": "1e9,1e9,1e9"}, "more than 10 periods"),
]


@pytest.mark.parametrize(("sample", "shape", "options", "words"), REFUSED)
def test_windows_that_say_nothing_are_refused(request, sample, shape, options, words):
    """Or that overlap themselves."""
    with pytest.raises(SettingsError, match=words):
        make_plan(Settings(rv_shape=shape, **options), request.getfixturevalue(sample))


IN_THE_AIR = [
    ("ellipsoid", {"rv_size": "2,2,5"}, "beyond the sample"),
    ("box", {"rv": 2.0}, "beyond the sample"),
    ("box", {"rv_size": "0.1,0.1,0.1", "rv_center": "10.8,8.8,5.8"}, "no centre of a grain"),
]


@pytest.mark.parametrize(("shape", "options", "words"), IN_THE_AIR)
@pytest.mark.parametrize("lines", [{**LINES, "spacing": 0.1}, {"tolerance": 0.01}])
def test_a_window_in_the_air_has_no_void_fabric(flat, shape, options, words, lines):
    """The whole sample has one."""
    with pytest.warns(scanfab.ScanfabNote, match=f"frame 0: the .*{words}.*`reference=-1`"):
        table = compute(flat.packing, rv_shape=shape, **options, **lines)
    for name in ("alpha_vs_axial", "mean_length"):
        assert [row[name] is None for row in table] == [False, False, True, True]


def test_a_window_that_follows_the_cell_is_deformed_as_the_cell(tilted):
    """Grains that move with the cell stay in it, or out of it."""
    gradient = np.array([[0.9, 0.2, 0.0], [0.1, 1.1, 0.0], [0.0, 0.3, 0.95]])
    plan = make_plan(Settings(rv_shape="box", rv_follows="strain"), tilted)
    assert plan.in_frame(tilted).window is plan.window
    cell = Cell(TILTED @ gradient.T, origin=[1.0, 2.0, 3.0])
    places = tilted.packing.position @ gradient.T + [1, 2, 3]
    after = sample_of(Packing(places, tilted.packing.radius, cell=cell))
    window = plan.in_frame(after).window
    assert window.shape.volume == pytest.approx(plan.window.shape.volume * np.linalg.det(gradient))
    assert window.center == pytest.approx(gradient @ plan.window.center + [1, 2, 3])
    before = plan.window.contains(tilted.packing.position, tilted.packing)
    assert 10 < before.sum() < 100
    assert np.array_equal(before, window.contains(after.packing.position, after.packing))


@pytest.mark.parametrize("mode", ["boundary", "grains"])
def test_a_window_follows_the_extents_along_three_axes(flat, mode):
    boundary = np.flatnonzero(np.abs(flat.packing.position[:, 0] - 5.0) > 4.0)
    first = sample_of(flat.packing, boundary)
    stretch, shift = np.array([1.1, 0.9, 0.8]), np.array([1.0, -2.0, 3.0])
    packing = Packing(flat.packing.position * stretch + shift, flat.packing.radius)
    plan = make_plan(Settings(rv_follows="strain", strain=mode, rv=0.5), first)
    window = plan.in_frame(sample_of(packing, boundary)).window
    assert window.center == pytest.approx(plan.window.center * stretch + shift)
    assert window.shape.high == pytest.approx(plan.window.radius * stretch)
    assert not window.shape.is_sphere


def test_a_window_that_has_nothing_to_follow_is_told_what_to_choose(flat):
    with pytest.raises(SettingsError, match=r'rv_follows: .*choose `strain="grains"`'):
        make_plan(Settings(rv_follows="strain"), flat)
    line = sample_of(Packing([[0, 0, 0], [0, 0, 2.0], [0, 0, 4.0]], 1.0))
    with pytest.raises(SettingsError, match="the grains to follow has no volume"):
        make_plan(Settings(rv_follows="strain", strain="grains", rv=0.3), line)


def test_the_column_of_the_window_alone_is_there_where_it_is_asked_for(flat):
    words, name = {"tolerance": 0.02, "variants": "ac"}, "window_alpha_vs_axial"
    plain = compute(flat.packing, **words)
    table = compute(flat.packing, rv_shape="box", **words)
    assert {*table.names} - {*plain.names} == {name}
    of_whole, of_window = table[name]
    assert np.isnan(of_whole)
    assert -0.01 < of_window < -0.003
    second = compute(flat.packing, rv_shape="box", moment=2, **words)
    assert np.isnan(second[name]).all()
    unbiased = compute(flat.packing, rv_shape="box", edge="ends", **words)
    assert unbiased[name][1] == 0.0


# what counts at their surface, and several of them

FIXED = {"spacing": "0.3rmin", "directions": "lebedev:5", "workers": 1, "cutoff": "0.5rmin"}
FRACTIONS = (0.4, 0.55, 0.7)


@pytest.fixture(scope="module")
def ball():
    random = np.random.default_rng(0)
    return find_contacts(Packing(ball_points(random, 800, 6.5), random.uniform(0.5, 0.7, 800)))


def by_rules(packing, **options):
    words = {**FIXED, "variants": "ac", **options}
    return [compute(packing, edge=edge, **words) for edge in ("clip", "start", "ends")]


def test_rows_say_by_which_rule_they_are(ball):
    clip, start, ends = by_rules(ball, rv=0.35)
    assert list(clip.names) == list(scanfab.COLUMNS)
    assert [name for name in start.names if name not in scanfab.COLUMNS] == ["edge", "left_out"]
    assert [row.edge for row in start] == ["clip", "start"]
    assert [row.edge for row in ends] == ["ends", "ends"]
    assert [row.left_out is None for row in (*start, *ends)] == [True, False, True, True]
    # the whole changes by ends alone, and its grains and contacts never; another kernel rounds
    # the last digit otherwise on some processors
    assert start[0].mean_length == pytest.approx(clip[0].mean_length, rel=1e-14)
    assert all(e.mean_length != c.mean_length for e, c in zip(ends, clip, strict=True))
    for name in ("grains", "contacts", "alpha_c"):
        assert ends[name].tolist() == clip[name].tolist()


def test_periodic_wholes_have_no_edge():
    random = np.random.default_rng(1)
    cell = Cell([6.0, 6.0, 6.0])
    packing = Packing(6 * random.random((150, 3)), np.full(150, 0.6), cell=cell)
    clip, start, ends = by_rules(packing, rv=0.8)
    for table in (start, ends):
        assert table[0].edge is None
        assert table[0].mean_length == clip[0].mean_length
        # what is cut is short
        assert table[1].mean_length > clip[1].mean_length
    assert start[1].left_out == 0.0


def test_an_rv_from_which_segments_leave_the_sample_is_told(ball):
    with pytest.warns(scanfab.ScanfabWarning, match="void segments of the RV leave the sample"):
        table = compute(ball, variants="c", edge="start", rv=0.98, **FIXED)
    assert table[0].left_out > 0.01


def test_a_whole_without_an_ellipsoid_has_no_void_fabric():
    packing = Packing([[0.0, 0, 0], [1.1, 0, 0], [0, 1.1, 0]], 0.5)
    with pytest.warns(scanfab.ScanfabWarning, match="flat or too small for `edge=ends`"):
        table = compute(packing, variants="a", edge="ends", **FIXED)
    assert table[0].mean_length is None


def without_rv(row):
    return {name: value for name, value in row.items() if name != "rv"}


RULES = [
    {"edge": "start", "variants": "c"},
    {"edge": "ends", "variants": "c"},
    {"rv_shape": "cylinder", "rv_axis": "x"},
    {"cutoffs": "0,0.5rmin,1rmin"},
    {"moment": 2},
    {"rv_center": (0.5, 0.0, -0.5), "rv_follows": "strain", "strain": "grains"},
]


@pytest.mark.parametrize("options", RULES)
def test_each_is_what_it_is_alone_along_the_same_lines(ball, options):
    words = {"variants": "cd", **FIXED, **options}
    several = compute(ball, rv=FRACTIONS, **words)
    for fraction in FRACTIONS:
        alone = compute(ball, rv=fraction, **words)
        assert "rv" not in alone.names
        chosen = [row for row in several if row.rv == fraction]
        assert [without_rv(row) for row in chosen] == [dict(row) for row in alone]


def test_the_whole_is_measured_beside_the_smallest(ball):
    several = compute(ball, rv=FRACTIONS, **FIXED)
    alone = compute(ball, rv=FRACTIONS[0], **FIXED)
    chosen = [row for row in several if row.rv in (None, FRACTIONS[0])]
    assert [without_rv(row) for row in chosen] == [dict(row) for row in alone]


def test_lines_are_closer_only_for_the_smallest(ball):
    """Its error is the largest; lines that suffice for it suffice for all."""
    words = {"variants": "c", "tolerance": 2e-3, "seed": 3, "workers": 1}
    several = compute(ball, rv=FRACTIONS, **words)
    (alone,) = compute(ball, rv=FRACTIONS[0], **words)
    assert without_rv(several[0]) == dict(alone)
    assert len({(row.spacing, row.directions, row.replicates) for row in several}) == 1
    assert all(row.alpha_vs_axial_se <= 2e-3 for row in several)
    assert [row.segments for row in several] == sorted(row.segments for row in several)


def test_doubts_name_the_rv(ball, recwarn):
    """No void segment of the smallest RV can be as long as it is wide."""
    smallest = 0.4 * 6.5
    compute(ball, rv="0.4,0.7", variants="ac", **{**FIXED, "cutoff": 2.2 * smallest})
    told = [str(one.message) for one in recwarn]
    assert any("variant c (RV 0.4): no void segment" in one for one in told), told
    assert any("variant c (RV 0.7): 10% of the directions" in one for one in told), told
