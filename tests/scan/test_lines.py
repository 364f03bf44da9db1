"""The triads of scan lines."""

import numpy as np
import pytest

from scanfab import direction_rule
from scanfab.scan.lines import line_triads


def test_triads_are_orthonormal_and_right_handed():
    triads = line_triads(direction_rule("lebedev:41").axes)
    assert np.abs(triads @ triads.transpose(0, 2, 1) - np.eye(3)).max() < 1e-14
    assert np.linalg.det(triads) == pytest.approx(np.ones(len(triads)))
    assert np.array_equal(triads[:, 2], direction_rule("lebedev:41").axes)
