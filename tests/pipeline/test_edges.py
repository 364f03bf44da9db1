"""Windows by each edge rule at their surface, and several of them in one pass."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, ScanfabWarning, compute, find_contacts
from tests.helpers.lattices import ball_points

pytestmark = pytest.mark.filterwarnings("ignore:.* leave the sample")
FIXED = {"spacing": "0.3rmin", "directions": "lebedev:5", "workers": 1, "cutoff": "0.5rmin"}
FRACTIONS = (0.4, 0.55, 0.7)


@pytest.fixture(scope="module")
def ball():
    random = np.random.default_rng(0)
    return find_contacts(Packing(ball_points(random, 800, 6.5), random.uniform(0.5, 0.7, 800)))


def columns(table, *names):
    return [[row.get(name) for name in names] for row in table]


def by_rules(packing, **options):
    words = {**FIXED, "variants": "ac", **options}
    return [compute(packing, edge=edge, **words) for edge in ("clip", "start", "ends")]


def test_rows_say_by_which_rule_they_are(ball):
    clip, start, ends = by_rules(ball, rv=0.35)
    assert list(clip.names) == list(scanfab.COLUMNS)
    assert [name for name in start.names if name not in scanfab.COLUMNS] == ["edge", "left_out"]
    assert [row.edge for row in start] == ["clip", "start"]
    assert [row.left_out is None for row in start] == [True, False]
    assert columns(ends, "edge", "left_out") == [["ends", None]] * 2
    # the whole changes by ends alone, and its grains and contacts never; another kernel rounds
    # the last digit otherwise on some processors
    assert start[0].mean_length == pytest.approx(clip[0].mean_length, rel=1e-14)
    assert all(e.mean_length != c.mean_length for e, c in zip(ends, clip, strict=True))
    for name in ("grains", "contacts", "alpha_c"):
        assert columns(ends, name) == columns(clip, name)


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
    with pytest.warns(ScanfabWarning, match="of the void segments of the RV leave the sample"):
        table = compute(ball, variants="c", edge="start", rv=0.98, **FIXED)
    assert table[0].left_out > 0.01


def test_a_whole_without_an_ellipsoid_has_no_void_fabric():
    packing = Packing([[0.0, 0, 0], [1.1, 0, 0], [0, 1.1, 0]], 0.5)
    with pytest.warns(ScanfabWarning, match="flat or too small for `edge=ends`"):
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
    for fraction in FRACTIONS[1:]:
        for row in compute(ball, rv=fraction, **FIXED)[2:]:
            (own,) = several.select(rv=fraction, variant=row.variant)
            # without the whole beside it, sums are added up in another order
            assert own.alpha_vs_axial == pytest.approx(row.alpha_vs_axial, rel=1e-9)
            assert own.alpha_vs_axial_se == pytest.approx(row.alpha_vs_axial_se, rel=1e-9)


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
