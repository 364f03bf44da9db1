"""The option --bodies, on the command line."""

from __future__ import annotations

import warnings

import pytest

from scanfab.cli.main import run
from tests.helpers.truth import SAMPLE_DATA

FAST = ("--tolerance", "0.02", "--workers", "1", "--with", "state,invariants", "--contacts")


@pytest.fixture
def told(tmp_path, capsys):
    """The bytes of the table of a source, and what is told of it."""

    def compute(source, *words):
        out = tmp_path / f"{len(list(tmp_path.iterdir()))}.csv"
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            assert run(["compute", str(SAMPLE_DATA / source), *FAST, *words, "-o", str(out)]) == 0
        return out.read_bytes(), capsys.readouterr().err

    return compute


@pytest.mark.parametrize("source", ["liggghts_periodic", "yade_triaxial", "lammps_discs"])
def test_that_each_sphere_is_a_grain_can_be_said_of_spheres(told, source):
    words = ("geometric", "--frames", ":1")
    assert told(source, *words, "--bodies", "id")[0] == told(source, *words)[0]


def test_who_says_that_each_sphere_is_a_grain_is_told_of_no_clumps(told):
    words = ("geometric", "--frames", ":1", "--format", "liggghts")
    table, text = told("liggghts_clumps", *words, "--bodies", "id")
    assert "clump" not in text.replace("liggghts_clumps", "")
    assert table != told("liggghts_clumps", *words)[0]
