"""The frames of scan lines."""

import numpy as np
import pytest

from scanfab import direction_rule
from scanfab.scan.lines import line_frames


def test_frames_are_orthonormal_and_right_handed():
    frames = line_frames(direction_rule("lebedev:41").axes)
    assert np.abs(frames @ frames.transpose(0, 2, 1) - np.eye(3)).max() < 1e-14
    assert np.linalg.det(frames) == pytest.approx(np.ones(len(frames)))
    assert np.array_equal(frames[:, 2], direction_rule("lebedev:41").axes)
