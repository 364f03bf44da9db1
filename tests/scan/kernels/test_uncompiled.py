"""The kernels as plain Python: they equal their slow twins, and no index is out of range."""

import os
import subprocess
import sys

from tests.conftest import ROOT

CHECKS = """
import numpy as np
from scanfab.packing import search
from scanfab.scan.kernels import axes
from tests.packing import test_search
from tests.scan import test_blocks, test_edges
from tests.scan.kernels import test_axes, test_periodic

assert not hasattr(axes.scan_axes, "py_func")
assert not hasattr(search.find_pairs, "py_func")
np.seterr(invalid="ignore")
random = np.random.default_rng
for kind in test_axes.KINDS:
    test_axes.check_random_packing(kind, random(1))
    test_blocks.check_random_packing(kind, random(1))
test_axes.check_less_that_is_wanted(0)
test_axes.test_a_chord_that_reaches_back_past_the_last_gap()
test_blocks.check_only_what_is_wanted_is_added()
for periods in test_periodic.PERIODS:
    test_periodic.check_equals_naive(random([1, *periods]), periods)
for edge in ("start", "ends"):
    for seed in range(2):
        test_edges.check_open(test_axes.overlapping, random(seed), edge, ("cd", "c", "d"))
test_blocks.test_by_the_rule_start_each_end_is_in_its_own_block(0)
for seed in range(10):
    test_search.check_random_open(random(seed))
    test_search.check_random_periodic(random(seed))
"""


def test_kernels_equal_their_slow_twins_uncompiled():
    """All in one process, as loading the package takes longer than most of the checks."""
    done = subprocess.run(
        [sys.executable, "-c", CHECKS],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
