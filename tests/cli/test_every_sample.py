"""Clumps, discs and forces on the command line: what cannot be is one message, or is right."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.cli.main import run
from tests.helpers.dumps import dump_text
from tests.helpers.truth import SAMPLE_DATA

FAST = ("--tolerance", "0.05", "--workers", "1", "--spacing", "0.1", "--directions", "6")
EDGE = 4
GRID = 2.0 * np.stack(np.meshgrid(*[np.arange(EDGE)] * 3, indexing="ij"), -1).reshape(-1, 3) + 1
FLAT = np.column_stack([GRID[: EDGE**2, 1:], np.zeros(EDGE**2)])
BOX = ((0, 2 * EDGE),) * 3
DISCS = str(SAMPLE_DATA / "lammps_biaxial" / "discs.0.lammpstrj.gz")


@pytest.fixture
def compute(tmp_path, capsys):
    """The exit code and what is told of dumps in a folder."""

    def call(*words, source=None):
        out = tmp_path / "table.csv"
        code = run(["compute", str(source or tmp_path), *FAST, *words, "-o", str(out)])
        told = capsys.readouterr().err
        assert "Traceback" not in told
        assert code == 0 or not out.exists()
        return code, " ".join(told.split())

    def dump(step, position, bodies=None):
        bodies = np.full(len(position), -1) if bodies is None else bodies
        rows = [(k + 1, *p, 1.02, b) for k, (p, b) in enumerate(zip(position, bodies, strict=True))]
        text = dump_text(rows, "id x y z radius clump", step=step, box=BOX)
        (tmp_path / f"dump.{step}").write_text(text)

    def pairs(change=lambda rows: None, columns=6):
        near = [
            (i + 1, j + 1, 0, *(-0.5 * (GRID[j] - GRID[i])))
            for i in range(len(GRID))
            for j in range(i + 1, len(GRID))
            if np.linalg.norm(GRID[i] - GRID[j]) < 2.01
        ]
        names = " ".join(f"c_p[{k + 1}]" for k in range(columns))
        text = dump_text([row[:columns] for row in near], names, word="ENTRIES", box=BOX)
        lines = text.splitlines()
        change(lines)
        (tmp_path / "pairs.0").write_text("\n".join(lines) + "\n")

    call.dump, call.pairs = dump, pairs
    return call


def test_bodies_that_change_between_frames_are_told(compute):
    twos = np.arange(len(GRID)) // 2
    compute.dump(0, GRID, twos)
    compute.dump(1, GRID, (np.arange(len(GRID)) + 1) // 2)
    code, told = compute()
    assert code == 0
    assert "frame 1: other spheres are one body than in frame 0" in told


def test_grains_that_leave_are_told(compute):
    twos = np.arange(len(GRID)) // 2
    compute.dump(0, GRID, twos)
    compute.dump(1, GRID[:-4], twos[:-4] + 7)
    code, told = compute()
    assert code == 0
    assert "frame 1: 30 grains of 60 spheres, where frame 0 has 32 grains of 64 spheres" in told


def test_a_body_all_over_the_box_is_told(compute):
    bodies = np.arange(len(GRID)) // 2
    bodies[-1] = 0
    compute.dump(0, GRID, bodies)
    code, told = compute()
    assert code == 0
    assert "1 body of several spheres, such as number 0, reach through more than half" in told


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ((FLAT, GRID), "dump.1: the series is read as discs in the plane x-y"),
        ((GRID, FLAT), "all its centres lie in the plane x-y"),
        ((FLAT, FLAT[:, [0, 2, 1]]), "dump.1: the series is read as discs in the plane x-y"),
    ],
)
def test_frames_of_mixed_dimension_are_an_error(compute, frames, message):
    for step, position in enumerate(frames):
        compute.dump(step, position)
    code, told = compute()
    assert code == 1
    assert message in told


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--axis", "z"), "--axis: the axis z leads out of the plane x-y"),
        (("--axis", "0,1,1"), "leads out of the plane x-y"),
        (("--rv-shape", "cylinder"), "--rv-shape: cylinder is no window of discs"),
        (("--rv-shape", "box", "--rv-size", "1,1,1"), "--rv-size: expected two, A,B"),
        (("--rv-center", "7", "7", "3"), "--rv-center: lies outside the plane x-y"),
        (("--directions", "lebedev:11"), "--directions: lebedev:11 is a rule of three dimensions"),
    ],
)
def test_what_is_of_space_is_refused_of_discs(compute, words, message):
    code, told = compute(*words, "--contacts", "geometric", source=DISCS)
    # a place is right or wrong by the data, an option by the plane
    assert code == (1 if "--rv-center" in words else 2)
    assert message in told


@pytest.mark.parametrize(
    ("change", "columns", "words", "code", "message"),
    [
        (lambda rows: None, 6, ("--with", "forces"), 0, ""),
        (lambda rows: rows.pop(), 6, ("--with", "forces"), 1, "counts 144 rows, found 143"),
        (lambda rows: None, 3, ("--with", "forces"), 1, "--with forces needs the forces of cont"),
        (lambda rows: None, 3, ("--with", "state"), 0, "the contacts have no forces: stress"),
        (lambda rows: None, 3, ("--rattlers", "force"), 1, "the rule --rattlers force needs the"),
    ],
)
def test_forces_that_are_not_there(compute, change, columns, words, code, message):
    compute.dump(0, GRID)
    compute.pairs(change, columns)
    found, told = compute(*words)
    assert (found, message in told) == (code, True)


def _not_a_number(rows):
    rows[12] = " ".join([*rows[12].split()[:-1], "nan"])


@pytest.mark.parametrize(
    "words", [("--with", "forces"), ("--with", "state"), ("--rattlers", "force")]
)
def test_a_force_that_is_no_number_is_an_error(compute, words):
    compute.dump(0, GRID)
    compute.pairs(_not_a_number)
    code, told = compute(*words)
    assert code == 1
    assert "a force that is no finite number" in told


def test_forces_of_contacts_by_geometry_are_not_known(compute):
    compute.dump(0, GRID)
    code, told = compute("--with", "forces", "--contacts", "geometric")
    assert code == 1
    assert "--with forces needs the forces of contacts, but these are found by geometry" in told


def test_a_map_of_discs_is_refused(capsys):
    assert run(["map", DISCS, "--contacts", "geometric", "--grid", "2,2,1"]) == 1
    told = " ".join(capsys.readouterr().err.split())
    assert "spheres in space, but all grains are discs in the plane x-y" in told
