"""What chance makes of the lobes in pictures of all directions."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from scanfab.base.space import SPACE
from scanfab.fabric.contact import axial_error
from scanfab.fabric.distribution import direction_points, fit_even
from scanfab.viz.figures.hemisphere import Hemisphere, disk, smoothed_density
from scanfab.viz.figures.lobe_noise import contact_noise, noise_notes, void_noise


def frame_of(number=0, **columns):
    """A frame of which nothing but some columns of its row is known."""
    return SimpleNamespace(space=SPACE, row=columns, number=number)


def unit_vectors(rng, *shape):
    vectors = rng.standard_normal((*shape, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_the_noise_of_the_scan_is_that_of_fits_to_noise():
    """Mean lengths that differ from line to line alone, fitted as those of a scan are."""
    rng = np.random.default_rng(1)
    points, weights = direction_points()
    second = 1.5 * points[:, 2] ** 2 - 0.5
    alphas, deviations = [], []
    for _ in range(25):
        axes = unit_vectors(rng, 150)
        fitted = fit_even(axes, 1 + 0.1 * rng.standard_normal(150), np.ones(150))
        deviation = fitted(points) / (weights @ fitted(points)) - 1
        alphas.append(weights @ (deviation * second))
        deviations.append(deviation)
    row = {"alpha_vs_axial_se": float(np.std(alphas)), "alpha_vs_axial_sample_se": 0.0}
    noise = void_noise(row)
    assert noise == pytest.approx(100 * np.std(deviations), rel=0.25)


def test_the_noise_of_contacts_is_that_of_isotropic_ones():
    rng = np.random.default_rng(2)
    _, directions = disk()
    some = directions[::8, ::12]
    deviations = [smoothed_density(unit_vectors(rng, 500), some) - 1 for _ in range(40)]
    alone = axial_error(unit_vectors(rng, 500), (0, 0, 1))
    row = {"contacts": 500, "alpha_c_axial_se": alone}
    noise = contact_noise({**row, "alpha_c_axial_sample_se": alone})
    assert noise == pytest.approx(100 * np.std(deviations), rel=0.1)
    # as neighbours are not independent, less of it is chance
    half = contact_noise({**row, "alpha_c_axial_sample_se": 0.5 * alone})
    assert half == pytest.approx(0.5 * noise)


@pytest.mark.parametrize(("largest", "is_noise"), [(1.0, True), (4.0, False)])
def test_lobes_below_the_noise_are_called_so(largest, is_noise):
    frame = frame_of(3, alpha_vs_axial_se=0.0, alpha_vs_axial_sample_se=2e-3)
    text = noise_notes([frame], [Hemisphere("", np.array([-largest, 0.5]), None)])
    assert text.startswith(
        f"Frame 3: lobes of void lengths reach {largest:g} %, one standard error"
    )
    assert "is 1 %" in text
    assert text.endswith("so they are noise.") == is_noise


def test_without_the_sample_s_part_nothing_is_said():
    frame = frame_of(alpha_vs_axial_se=1e-4, alpha_vs_axial_sample_se=None)
    assert noise_notes([frame], [Hemisphere("", np.zeros(2), None)]) == ""
