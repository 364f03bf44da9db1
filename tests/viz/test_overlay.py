"""Around the sample in a 3D view: the camera's place and the scale."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.viz.figures.style import rounded_down
from scanfab.viz.overlay import BOTTOM, SIZE, TOP, Framing

UP, LOOK = np.array([0.0, 0.0, 1.0]), np.array([0.3, -1.0, 0.4])


@pytest.mark.parametrize("shape", [(1, 1, 1), (9, 1, 1), (1, 1, 9), (1, 9, 1)])
@pytest.mark.parametrize("size", [1e-4, 1.0, 1e5])
def test_all_balls_are_in_the_picture_and_fill_it(shape, size):
    rng = np.random.default_rng(0)
    points = size * (rng.uniform(-1, 1, (300, 3)) * shape + [5, 6, 7])
    radius = np.full(300, 0.1 * size)
    frame = Framing.about(points, radius, UP, LOOK)
    right = np.cross(frame.up, frame.look)
    high = (points - frame.middle) @ frame.up / frame.half
    wide = (points - frame.middle) @ right / frame.half * SIZE[1] / SIZE[0]
    reach = radius[0] / frame.half
    assert (high + reach).max() <= 1 - 2 * TOP + 1e-9
    assert (high - reach).min() >= -1 + 2 * BOTTOM - 1e-9
    assert wide.max() + wide.min() == pytest.approx(0, abs=1e-6)
    fills_height = np.ptp(high) + 2 * reach > 2 * (1 - TOP - BOTTOM) - 1e-6
    assert fills_height or np.ptp(wide) > 1.8


def test_nothing_to_draw_is_no_error():
    assert Framing.about(np.zeros((0, 3)), np.zeros(0), UP, LOOK).half > 0


@pytest.mark.parametrize(
    ("value", "length"), [(0.0129, 0.01), (0.49, 0.2), (0.5, 0.5), (7.0, 5.0), (1e-9, 1e-9)]
)
def test_scales_are_round(value, length):
    assert rounded_down(value) == pytest.approx(length)
