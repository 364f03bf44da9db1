"""scanfab compute --cutoffs and --moment: rows for each cut-off from one pass, also resumed."""

import numpy as np
import pytest

from scanfab import Packing, compute, direction_rule, find_contacts
from scanfab.scan.lines import line_triads, turned_triads
from tests.helpers import naive
from tests.helpers.interruptions import interrupted_at_row
from tests.helpers.lattices import shaken_cubic
from tests.helpers.truth import TRIAXIAL

FILES = sorted(str(path) for path in TRIAXIAL.glob("*0000000[012].vtk.gz"))
LINES = ("--directions", "lebedev:5", "--spacing", "0.7rmin", "--boundary", "mask=3")


def test_a_resumed_run_finds_the_rows_of_all_cutoffs(ask, tmp_path, monkeypatch):
    """Equal cut-offs too: every frame has as many rows as were asked for."""
    chosen = ("--cutoffs", "1rmin,0.0005,1rmin", "--variants", "cd", "--seed", "3")
    words = ("compute", *FILES, *LINES, *chosen)
    whole, output = tmp_path / "whole.csv", tmp_path / "table.csv"
    ask(*words, "-o", whole)
    assert len(whole.read_text().splitlines()) == 1 + 3 * 2 * 3
    with interrupted_at_row(monkeypatch, 10):
        ask(*words, "-o", output, code=130)
    ask(*words, "-o", output, "--resume")
    assert output.read_bytes() == whole.read_bytes()


def test_second_moment_is_that_of_the_slow_twin():
    """ℓ² = Σ l² / Σ l over all lines of a direction, and the tensor of those."""
    packing = find_contacts(Packing(*shaken_cubic(np.random.default_rng(0), 5)))
    rule, spacing, cutoff = direction_rule("lebedev:5"), 0.6, 0.3
    options = {"rv_radius": 1.5, "rv_center": (2.5, 2.5, 2.5), "variants": "c"}
    row = compute(packing, directions=rule, spacing=spacing, cutoff=cutoff, moment=2, **options)[0]
    assert row.replicates == 1
    frames, offsets = turned_triads(rule, line_triads(rule.axes), 0, 0)
    over, under = np.zeros(len(rule)), np.zeros(len(rule))
    for axis in range(len(rule)):
        _, window = naive.void_segments(
            packing.position - 2.5, packing.radius, frames[axis], offsets[axis], spacing, 1.5
        )
        lengths = np.array([one.length for one in window if one.length >= cutoff])
        over[axis], under[axis] = np.sum(lengths**2), np.sum(lengths)
    tensor = naive.void_tensor(frames[:, 2], rule.weights, over / under)
    assert row.gvs_xy == pytest.approx(tensor[0, 1], abs=1e-12)
    assert row.alpha_vs_axial == pytest.approx(naive.axial(tensor, (0, 0, 1)), abs=1e-12)
    assert row.mean_length == pytest.approx((rule.weights @ over) / (rule.weights @ under))
