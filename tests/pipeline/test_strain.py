"""The axial strain in the table: what each mode measures, and strains from a file."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab import Cell, Packing, ReadError, SettingsError, compute
from tests.helpers.dumps import write
from tests.helpers.lattices import simple_cubic

POSITION = simple_cubic(4).position
PLATES = (POSITION[:, 2] == POSITION[:, 2].min()) | (POSITION[:, 2] == POSITION[:, 2].max())
SCAN = {"variants": "a", "directions": 9, "spacing": "1rmin", "cutoff": 0}
OBLIQUE = (3**-0.5,) * 3
ALL, TWO, NONE = (True, True, True), (True, True, False), (False, False, False)

WRONG = ["10,high", ",0.1", "10,", "10", "10.7,0.1", "1e999,0.1", "10,0.\0", f"10,{'9' * 140_000}"]

pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")


def frame(stretch, plates, cell=None, periodic=ALL, step=None):
    """Grains stretched by one factor and plates by another, in a cell that leans."""
    factor = np.where(PLATES, plates, stretch)[:, None]
    vectors = None if cell is None else np.array([[1.0, 0, 0], [0.2, 1, 0], [0.3, 0.1, 1]])
    return Packing(
        POSITION * factor,
        0.5,
        columns={"type": 1 + PLATES},
        cell=None if cell is None else Cell(9.0 * cell * vectors, periodic),
        step=step,
    )


def strain(periodic=None, boundary="type=2", **options):
    """Of grains by 1 - 0.9, of plates by 1 - 0.8, of the cell by 1 - 0.7 along z, 0.6 along y."""
    cells = [None, None] if periodic is None else [1.0, np.array([[0.5], [0.6], [0.7]])]
    frames = [
        frame(one, two, cell, periodic)
        for one, two, cell in zip((1.0, 0.9), (1.0, 0.8), cells, strict=True)
    ]
    return compute(frames, boundary=boundary, **SCAN, **options)["strain"][1]


@pytest.mark.parametrize(
    ("periodic", "options", "expected"),
    [
        (ALL, {}, 0.3),
        (ALL, {"axis": "y"}, 0.4),
        (TWO, {"axis": "x"}, 0.5),
        (TWO, {}, 0.2),
        (NONE, {"strain": "cell"}, 0.3),
        (ALL, {"strain": "boundary"}, 0.2),
        (NONE, {"axis": OBLIQUE}, 0.2),
        (None, {}, 0.2),
        (None, {"axis": "x"}, 0.2),
        (None, {"strain": "grains"}, 0.1),
        (None, {"boundary": ()}, np.nan),
    ],
)
def test_strain_is_by_the_cell_that_repeats_else_by_the_boundary(periodic, options, expected):
    """A cell by its diagonal entry, particles by the extent of their centres along the axis."""
    assert strain(periodic, **options) == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(
    ("periodic", "options", "message"),
    [
        (None, {"strain": "cell"}, "the dump has no cell"),
        (ALL, {"strain": "cell", "axis": OBLIQUE}, "the axis is not x, y or z"),
        (None, {"strain": "boundary", "boundary": ()}, "has none: name them with `boundary`"),
    ],
)
def test_what_is_not_there_cannot_be_measured(periodic, options, message):
    with pytest.raises(
        SettingsError, match=f"strain: {options['strain']} was asked for.*{message}"
    ):
        strain(periodic, **options)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("step,strain\n0,0.0\n1000,0.05\n", [0.0, 0.05, np.nan]),
        ("frame,strain\n0,0.0\n1,0.05\n", [0.0, 0.05, np.nan]),
        # steps come before frames
        ("frame,step,strain\n0,1000,0.25\n", [np.nan, 0.25, np.nan]),
        ("\ufeff stress , step , strain \r\n 5 , 1e3 , 0.5 \r\n", [np.nan, 0.5, np.nan]),
    ],
)
def test_a_file_names_strains_by_step_or_frame(tmp_path, text, expected):
    frames = [frame(1.0, 1.0, step=step) for step in (0, 1000, None)]
    file = write(tmp_path / "s.csv", text)
    found = compute(frames, strain=file, **SCAN)["strain"]
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected a table"),
        ("step,epsilon\n1,2\n", "expected the columns step or frame, and strain"),
        ("time,strain\n1,2\n", "expected the columns step or frame, and strain"),
        *((f"step,strain\n0,0\n{row}\n", "line 3: expected") for row in WRONG),
    ],
)
def test_a_file_that_is_no_table_of_strains_is_an_error_by_its_line(tmp_path, text, message):
    file = write(tmp_path / "s.csv", text)
    with pytest.raises(ReadError, match=rf"s\.csv(, |: ){message}.{{,100}}"):
        compute(frame(1.0, 1.0), strain=file, **SCAN)
