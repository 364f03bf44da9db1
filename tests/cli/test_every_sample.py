"""Clumps, discs and forces on the command line: what cannot be is one message, or is right."""

from __future__ import annotations

import numpy as np
import pytest

from tests.helpers.dumps import dump_text
from tests.helpers.truth import SAMPLE_DATA

FAST = ("--tolerance", "0.05", "--workers", "1", "--spacing", "0.1", "--directions", "6")
EDGE = 4
GRID = 2.0 * np.stack(np.meshgrid(*[np.arange(EDGE)] * 3, indexing="ij"), -1).reshape(-1, 3) + 1
FLAT = np.column_stack([GRID[: EDGE**2, 1:], np.zeros(EDGE**2)])
TWOS = np.arange(len(GRID)) // 2
BOX = ((0, 2 * EDGE),) * 3
DISCS = str(SAMPLE_DATA / "lammps_biaxial" / "discs.0.lammpstrj.gz")


@pytest.fixture
def compute(tmp_path, ask):
    """What is told of the dumps in a folder."""

    def told(*words, code=0):
        out = tmp_path / "table.csv"
        answer = ask("compute", tmp_path, *FAST, *words, "-o", out, code=code)
        assert code == 0 or not out.exists()
        return answer.told

    return told


@pytest.fixture
def dump(tmp_path):
    def dump(step, position, bodies=None):
        bodies = np.full(len(position), -1) if bodies is None else bodies
        rows = [(k + 1, *p, 1.02, b) for k, (p, b) in enumerate(zip(position, bodies, strict=True))]
        text = dump_text(rows, "id x y z radius clump", step=step, box=BOX)
        (tmp_path / f"dump.{step}").write_text(text)

    return dump


@pytest.fixture
def pairs(tmp_path):
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

    return pairs


@pytest.mark.parametrize("source", ["liggghts_periodic", "yade_triaxial", "lammps_discs"])
def test_that_each_sphere_is_a_grain_can_be_said_of_spheres(ask, source):
    words = ("compute", SAMPLE_DATA / source, "--tolerance", "0.02", "--workers", "1")
    words += ("--with", "state,invariants", "--contacts", "geometric", "--frames", ":1")
    assert ask(*words, "--bodies", "id").out == ask(*words).out


def test_who_says_that_each_sphere_is_a_grain_is_told_of_no_clumps(ask):
    words = ("compute", SAMPLE_DATA / "liggghts_clumps", "--format", "liggghts", "--frames", ":1")
    words += ("--tolerance", "0.02", "--contacts", "geometric")
    single = ask(*words, "--bodies", "id")
    assert "clump" not in single.err.replace("liggghts_clumps", "")
    assert single.out != ask(*words).out


@pytest.mark.parametrize(
    ("frames", "words"),
    [
        ((FLAT, GRID), "dump.1: the series is read as discs in the plane x-y"),
        ((GRID, FLAT), "all its centres lie in the plane x-y"),
        ((FLAT, FLAT[:, [0, 2, 1]]), "dump.1: the series is read as discs in the plane x-y"),
    ],
)
def test_frames_of_mixed_dimension_are_an_error(compute, dump, frames, words):
    for step, position in enumerate(frames):
        dump(step, position)
    assert words in compute(code=1)


def _not_a_number(rows):
    rows[12] = " ".join([*rows[12].split()[:-1], "nan"])


@pytest.mark.parametrize(
    ("change", "columns", "words", "code", "message"),
    [
        (lambda rows: None, 6, ("--with", "forces"), 0, ""),
        (lambda rows: rows.pop(), 6, ("--with", "forces"), 1, "counts 144 rows, found 143"),
        (lambda rows: None, 3, ("--with", "forces"), 1, "--with forces needs the forces of cont"),
        (lambda rows: None, 3, ("--with", "state"), 0, "the contacts have no forces: stress"),
        (lambda rows: None, 3, ("--rattlers", "force"), 1, "the rule --rattlers force needs the"),
        (lambda rows: None, 6, ("--with", "forces", "--contacts", "geometric"), 1, "by geometry"),
        (_not_a_number, 6, ("--with", "forces"), 1, "a force that is no finite number"),
    ],
)
def test_forces_that_are_not_there(compute, dump, pairs, change, columns, words, code, message):
    dump(0, GRID)
    pairs(change, columns)
    assert message in compute(*words, code=code)
