"""What public objects say of themselves: a few lines, no array, numbers of few digits."""

import re
from dataclasses import fields

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, Settings
from scanfab.pipeline.calibration import Calibration
from scanfab.viz.report.report import Report
from tests.conftest import SAMPLE
from tests.helpers.dumps import dump_text, pairs_text, write
from tests.helpers.lattices import shaken_cubic

THIRD = 1.0 / 3.0


def test_of_a_series_and_its_frames(tmp_path):
    for step in (0, 10, 20):
        write(tmp_path / f"dump_{step}.txt", dump_text(step=step))
        write(tmp_path / f"pairs_{step}.txt", pairs_text(step=step))
    series = scanfab.read_series(tmp_path)
    head = f"Series {series.name}: "
    files = " dump_*.txt (liggghts), contacts of pairs_*.txt"
    assert repr(series) == f"{head}3 files{files}"
    assert repr(series[:2:2]) == f"{head}frames 0:2:2 of 3 files{files}"
    assert repr(series[-1]) == f"Frame 2 of {series.name}: dump_20.txt, step 20"


ROW = [[0, 0, 0], [1, 0, 0], [2.1, 0, 0]]
LARGE = Packing(ROW, [0.5, 0.5, THIRD], contacts=[[0, 1]], step=7, cell=Cell([9, 9, 9]))
# beside what the examples of their docstrings show
OBJECTS = [
    (Packing(ROW, 0.5), "Packing: 3 particles of radius 0.5, contacts not known"),
    (
        LARGE,
        "Packing: 3 particles of radius 0.3333 to 0.5, 1 contact from file, step 7\n"
        "  Cell: 9 x 9 x 9 from (0, 0, 0), periodic",
    ),
    (Packing(np.zeros((0, 3)), 1.0), "Packing: 0 particles, contacts not known"),
    (
        Cell([[1, 0, 0], [0.5, 1, 0], [0, 0, 1]], (False,) * 3),
        "Cell: (1, 0, 0), (0.5, 1, 0), (0, 0, 1) from (0, 0, 0), not periodic",
    ),
    (
        Calibration((), ("A sentence.", "Another."), {"spacing": "0.25rmin"}),
        "Calibration: 0 rows\n  A sentence.\n  Another.\n  recommended: spacing='0.25rmin'",
    ),
    (Report("x" * 1_234_567, True), "Report: an HTML page of 1.2 MB, with void fabric"),
]


@pytest.mark.parametrize(("one", "shown"), OBJECTS, ids=[shown[:40] for _, shown in OBJECTS])
def test_an_object_says_what_it_is(one, shown):
    assert repr(one) == shown


@pytest.mark.parametrize(
    ("options", "shown"),
    [
        ({"variants": "cd", "cutoff": "0.5rmin"}, "Settings(variants='cd', cutoff='0.5rmin')"),
        ({"boundary": ["type=2", "id>7"]}, "Settings(boundary=['type=2', 'id>7'])"),
        ({"frames": slice(2, None)}, "Settings(frames='2:')"),
        ({"directions": 25, "rv": 0.7}, "Settings(directions='25')"),
        ({"cutoffs": "0,1rmin"}, "Settings(cutoffs=[0.0, '1rmin'])"),
        ({"axis": (0, 3, 4)}, "Settings(axis=(0.0, 0.6, 0.8))"),
        ({"rv_center": (0, 0, THIRD)}, f"Settings(rv_center=[0.0, 0.0, {THIRD!r}])"),
    ],
)
def test_of_settings_what_differs_which_makes_the_same_again(options, shown):
    settings = Settings(**options)
    assert repr(settings) == shown
    again = eval(shown, {"Settings": Settings})
    for one in fields(Settings):
        if one.name != "directions":
            assert getattr(again, one.name) == getattr(settings, one.name)


def test_of_none_is_as_long_as_its_arrays():
    """Public objects, made of a real frame, say what they are in at most a few lines."""
    spheres = shaken_cubic(np.random.default_rng(0), 6)
    packing = scanfab.find_contacts(Packing(spheres.position, spheres.radius))
    table = scanfab.compute(packing, variants="c", tolerance=0.01)
    series = scanfab.read_series(SAMPLE)
    for one in (packing, packing.contacts, table, table[0], table.compare(), series, series[0]):
        assert len(repr(one).splitlines()) <= 15, repr(one)
        assert not re.search(r"array\(|[1-9]\d*\.\d{6}|0\.0*[1-9]\d{5}", repr(one)), repr(one)
