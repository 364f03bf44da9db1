"""The option ``edge`` from the settings to the table."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, ScanfabWarning, compute
from tests.helpers.lattices import ball_points

OPTIONS = {"spacing": "0.3rmin", "directions": "lebedev:5", "workers": 1, "cutoff": "0.5rmin"}
ALONE = {**OPTIONS, "variants": "ac"}


@pytest.fixture(scope="module")
def ball():
    """Overlapping grains in a ball: the RV keeps far from its surface."""
    random = np.random.default_rng(0)
    return Packing(ball_points(random, 1500, 8.0), random.uniform(0.5, 0.7, 1500))


def columns(table, *names):
    return [[row.get(name) for name in names] for row in table]


def test_rows_say_by_which_rule_they_are(ball):
    clip, start, ends = (
        compute(ball, edge=edge, rv=0.35, **ALONE) for edge in ("clip", "start", "ends")
    )
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
    clip, start, ends = (
        compute(packing, edge=edge, rv=0.8, **ALONE) for edge in ("clip", "start", "ends")
    )
    for table in (start, ends):
        assert table[0].edge is None
        assert table[0].mean_length == clip[0].mean_length
        # what is cut is short
        assert table[1].mean_length > clip[1].mean_length
    assert start[1].left_out == 0.0


def test_second_moment_is_that_of_full_lengths(ball):
    first, second = (
        compute(ball, variants="c", edge="start", moment=moment, rv=0.35, **OPTIONS)[0]
        for moment in (1, 2)
    )
    assert second.mean_length > first.mean_length


def test_an_rv_from_which_segments_leave_the_sample_is_told(ball):
    with pytest.warns(ScanfabWarning, match="of the void segments of the RV leave the sample"):
        table = compute(ball, variants="c", edge="start", rv=0.98, **OPTIONS)
    assert table[0].left_out > 0.01


def test_a_whole_without_an_ellipsoid_has_no_void_fabric():
    packing = Packing([[0.0, 0, 0], [1.1, 0, 0], [0, 1.1, 0]], 0.5)
    with pytest.warns(ScanfabWarning, match="flat or too small for `edge=ends`"):
        table = compute(packing, variants="a", edge="ends", **OPTIONS)
    assert table[0].mean_length is None
