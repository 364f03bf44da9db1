"""Clumps, discs and forces on the command line: what cannot be is one message, or is right."""

from __future__ import annotations

import numpy as np
import pytest

from tests.helpers.dumps import dump_text, write
from tests.helpers.truth import SAMPLE_DATA

FAST = ("--tolerance", "0.05", "--workers", "1", "--spacing", "0.1", "--directions", "6")
GRID = 2.0 * np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), -1).reshape(-1, 3) + 1


def test_that_each_sphere_is_a_grain_can_be_said(ask):
    """Of spheres and discs that changes nothing; of clumps it does, and they are not told of."""
    words = ("--directions", "9", "--spacing", "1rmin", "--variants", "a", "--frames", ":1")
    words += ("--with", "state,invariants", "--contacts", "geometric")
    for source in ("liggghts_periodic", "lammps_discs", "liggghts_clumps/dump_*"):
        given = ask("compute", SAMPLE_DATA / source, *words)
        single = ask("compute", SAMPLE_DATA / source, *words, "--bodies", "id")
        has_clumps = "clumps" in source
        assert (single.out == given.out) != has_clumps
        assert not has_clumps or "clump" not in single.err.replace("liggghts_clumps", "")


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--with", "forces"), 1, "--with forces needs"),
        (("--with", "state"), 0, "the contacts have no forces: all columns that need the stress"),
        (("--rattlers", "force"), 1, "the rule --rattlers force needs the"),
    ],
)
def test_forces_that_are_not_there(tmp_path, ask, words, code, message):
    rows = [(k + 1, *place, 1.02) for k, place in enumerate(GRID)]
    write(tmp_path / "dump.0", dump_text(rows, "id x y z radius", box=((0, 8),) * 3))
    out = tmp_path / "table.csv"
    assert message in ask("compute", tmp_path, *FAST, *words, "-o", out, code=code).told
    assert code == 0 or not out.exists()
