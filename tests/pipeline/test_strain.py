"""Axial strain by each mode or from a file, and shear of periodic cells, which may be flipped."""

import re

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, ReadError, SettingsError, compute
from scanfab.pipeline.strain import cell_strains
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.lattices import rotation, simple_cubic
from tests.helpers.truth import SHEAR

POSITION = simple_cubic(4).position
PLATES = (POSITION[:, 2] == POSITION[:, 2].min()) | (POSITION[:, 2] == POSITION[:, 2].max())
SCAN = {"variants": "a", "directions": 9, "spacing": "1rmin", "cutoff": 0}
OBLIQUE = (3**-0.5,) * 3
ALL, TWO, NONE = (True, True, True), (True, True, False), (False, False, False)


pytestmark = pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning")


def frame(stretch, plates, cell=None, periodic=ALL, step=None):
    """Grains stretched by one factor and plates by another, in a cell that leans."""
    if cell is not None:
        vectors = np.array([[1.0, 0, 0], [0.2, 1, 0], [0.3, 0.1, 1]])
        cell = Cell(9.0 * cell * vectors, periodic)
    position = POSITION * np.where(PLATES, plates, stretch)[:, None]
    return Packing(position, 0.5, columns={"type": 1 + PLATES}, cell=cell, step=step)


def strain(periodic=None, boundary="type=2", **options):
    """Of grains by 1 - 0.9, of plates by 1 - 0.8, of the cell by 1 - 0.7 along z, 0.6 along y."""
    cells = [None, None] if periodic is None else [1.0, np.array([[0.5], [0.6], [0.7]])]
    frames = [frame(1.0, 1.0, cells[0], periodic), frame(0.9, 0.8, cells[1], periodic)]
    return compute(frames, boundary=boundary, **SCAN, **options)["strain"][1]


STRAINS = [
    (ALL, {}, 0.3), (ALL, {"axis": "y"}, 0.4), (TWO, {}, 0.2), (NONE, {"strain": "cell"}, 0.3),
    (ALL, {"strain": "boundary"}, 0.2), (NONE, {"axis": OBLIQUE}, 0.2), (None, {}, 0.2),
    (None, {"strain": "grains"}, 0.1), (None, {"boundary": ()}, np.nan),
]  # fmt: skip


@pytest.mark.parametrize(("periodic", "options", "expected"), STRAINS)
def test_strain_is_by_the_cell_that_repeats_else_by_the_boundary(periodic, options, expected):
    """A cell by its diagonal entry, particles by the extent of their centres along the axis."""
    assert strain(periodic, **options) == pytest.approx(expected, nan_ok=True)


NOT_THERE = [
    (None, {"strain": "cell"}, "the dump has no cell"),
    (ALL, {"strain": "cell", "axis": OBLIQUE}, "the axis is not x, y or z"),
    (None, {"strain": "boundary", "boundary": ()}, "no boundary particles: name them"),
]


@pytest.mark.parametrize(("periodic", "options", "message"), NOT_THERE)
def test_what_is_not_there_cannot_be_measured(periodic, options, message):
    asked = f"strain: {options['strain']} was asked for.*{message}"
    with pytest.raises(SettingsError, match=asked):
        strain(periodic, **options)


FILES = [
    ("step,strain\n0,0.0\n1000,0.05\n", [0.0, 0.05, np.nan]),
    ("frame,strain\n0,0.0\n1,0.05\n", [0.0, 0.05, np.nan]),
    # steps come before frames
    ("frame,step,strain\n0,1000,0.25\n", [np.nan, 0.25, np.nan]),
]


@pytest.mark.parametrize(("text", "expected"), FILES)
def test_a_file_names_strains_by_step_or_frame(tmp_path, recwarn, text, expected):
    frames = [frame(1.0, 1.0, step=step) for step in (0, 1000, None)]
    file = write(tmp_path / "s.csv", text)
    found = compute(frames, strain=file, **SCAN)["strain"]
    assert any("has no row for this frame" in str(one.message) for one in recwarn) == (
        np.nan in expected
    )
    np.testing.assert_array_equal(found, expected)


NO_STRAINS = [
    ("step,epsilon\n1,2\n", ": expected the columns step or frame, and strain, found step, eps"),
    *((f"step,strain\n0,0\n{row}\n", ", line 3: expected")
      for row in ("10,high", "10.7,0.1", "10,inf")),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), NO_STRAINS)
def test_a_file_that_is_no_table_of_strains_is_an_error_by_its_line(tmp_path, text, message):
    file = write(tmp_path / "s.csv", text)
    with pytest.raises(ReadError, match=rf"s\.csv{message}"):
        compute(frame(1.0, 1.0), strain=file, **SCAN)


FIRST = Cell(np.array([[2.0, 0, 0], [0, 3, 0], [0.2, 0.1, 4]]))


@pytest.mark.parametrize("gamma", [-0.3, 1e-6, 0.5, 4.0])
def test_simple_shear_has_its_known_strain_from_wherever_it_is_seen(gamma):
    """Principal logarithmic stretches ± asinh(γ/2), 0; F = I + γ x⊗y of all of space."""
    vectors = FIRST.vectors @ (np.eye(3) + gamma * np.outer([0, 1, 0], [1, 0, 0]))
    known = 2 / np.sqrt(3) * np.arcsinh(abs(gamma) / 2)
    expected = pytest.approx((known, 0.0), rel=1e-9, abs=1e-12)
    assert cell_strains(Cell(vectors), FIRST) == expected
    turn = rotation(np.random.default_rng(2))
    assert cell_strains(Cell(vectors @ turn), Cell(FIRST.vectors @ turn)) == expected


def test_triaxial_compression_has_its_known_strain():
    """Stretches -e, e/2, e/2 give √(2/3 · 3/2) e; what the volume does does not count."""
    gradient = 1.7 * np.diag(np.exp([0.05, 0.05, -0.1]))
    found = cell_strains(Cell(FIRST.vectors @ gradient), FIRST)
    assert found == pytest.approx((0.1, -3 * np.log(1.7)), rel=1e-9)
    assert cell_strains(FIRST, FIRST) == (0.0, 0.0)


@pytest.mark.parametrize("cell", [None, Cell(FIRST.vectors, TWO)])
def test_without_a_cell_that_repeats_in_all_directions_there_is_none(cell):
    assert cell_strains(cell, FIRST) == cell_strains(FIRST, cell) == (None, None)


def test_the_sample_has_the_strain_of_its_deck():
    series = scanfab.read_series(sorted(SHEAR.glob("shear.*.lammpstrj.gz")))
    table = compute(series, **SCAN, frames="::2")
    # of erate 0.5 for 0, 0.8 and 1.6 s less the ten steps of rest before each frame
    expected = 2 / np.sqrt(3) * np.arcsinh(np.array([0.0, 0.4, 0.8]) / 2)
    assert table["shear_strain"] == pytest.approx(expected, rel=1e-3, abs=0)
    assert set(table["strain"]) == {0.0}


def tilted_series(folder, tilts, edge=4.0):
    """Snapshots as LAMMPS writes them: the bounds are those of the box about the cell."""
    texts = []
    for step, lean in enumerate(edge * np.array(tilts)):
        box = ((min(0, lean), edge + max(0, lean), lean), (0, edge, 0), (0, edge, 0))
        texts.append(dump_text(cubic_rows(), step=step, box=box, flags=" xy xz yz pp pp pp"))
    return scanfab.read_series(write(folder / "dump.txt", "".join(texts)))


ONCE = [0.0, 0.2, 0.45, -0.35, -0.2]


FLIPS = [
    (ONCE, ":", ["2 and 3"]), (ONCE, "::-1", ["2 and 3"]), (ONCE, "1::2", ["1 and 3"]),
    (ONCE, ":3", []), ([0.2, 0.45, -0.35, 0.45], ":", ["1 and 2", "2 and 3"]),
    # what leans further than programs let it is no flip, although its lattice is nearer
    ([0.0, 0.4, 0.65, 1.2], ":", []),
]  # fmt: skip


@pytest.mark.parametrize(("tilts", "frames", "told"), FLIPS)
def test_each_flip_of_a_cell_under_way_is_a_warning(tmp_path, recwarn, tilts, frames, told):
    compute(tilted_series(tmp_path, tilts), **SCAN, frames=frames, workers=2)
    flips = [str(one.message) for one in recwarn if "flipped" in str(one.message)]
    found = [re.findall("flipped between the frames (.*?): ", one) for one in flips]
    assert found == [[one] for one in told]
