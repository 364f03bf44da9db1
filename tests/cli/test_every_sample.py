"""Clumps, discs and forces on the command line: what cannot be is one message, or is right."""

from __future__ import annotations

import numpy as np
import pytest

from tests.helpers.dumps import dump_text, write
from tests.helpers.truth import SAMPLE_DATA

FAST = ("--tolerance", "0.05", "--workers", "1", "--spacing", "0.1", "--directions", "6")
GRID = 2.0 * np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), -1).reshape(-1, 3) + 1
FLAT = np.column_stack([GRID[:16, 1:], np.zeros(16)])


@pytest.fixture
def compute(tmp_path, ask):
    """What is told of dumps with these positions."""

    def told(*frames, words=(), code=0):
        for step, position in enumerate(frames):
            rows = [(k + 1, *place, 1.02) for k, place in enumerate(position)]
            text = dump_text(rows, "id x y z radius", step=step, box=((0, 8),) * 3)
            write(tmp_path / f"dump.{step}", text)
        out = tmp_path / "table.csv"
        answer = ask("compute", tmp_path, *FAST, *words, "-o", out, code=code)
        assert code == 0 or not out.exists()
        return answer.told

    return told


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
        ((FLAT, GRID), "dump.1: the reference frame of the series has discs in the plane x-y"),
        ((GRID, FLAT), "all its centres lie in the plane x-y"),
        (
            (FLAT, FLAT[:, [0, 2, 1]]),
            "dump.1: the reference frame of the series has discs in the plane x-y",
        ),
    ],
)
def test_frames_of_mixed_dimension_are_an_error(compute, frames, words):
    assert words in compute(*frames, code=1)


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--with", "forces"), 1, "--with forces needs"),
        (("--with", "state"), 0, "the contacts have no forces: all columns that need the stress"),
        (("--rattlers", "force"), 1, "the rule --rattlers force needs the"),
    ],
)
def test_forces_that_are_not_there(compute, words, code, message):
    assert message in compute(GRID, words=words, code=code)
