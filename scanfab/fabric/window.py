"""
What a window alone gives an isotropic medium: its own anisotropy, which is not the sample's.

A line that is clipped to a window W loses long segments, the more the shorter its piece in W is, so
that ℓ(n) depends on the shape of W as it is seen along n. Freely overlapping grains (a Poisson
medium, Matheron 1975, Random Sets and Integral Geometry) have, whatever the direction, segments of
the mean length c + 1/β above a cut-off c; clipped to W

    ℓ(n) = c + A₁ / (A₀ + β A₁),    A₁ = g(c; n),    A₀ = -dg/dz(c; n),

with g(z; n) the volume that W has in common with itself moved by z n; in a plane the area.
"""

from __future__ import annotations

import numpy as np

from scanfab.base.column import Column
from scanfab.base.convex import Convex
from scanfab.base.typing import FloatArray
from scanfab.fabric.tensor import axial, weighted_tensors
from scanfab.fabric.void import VoidFabric

WINDOW_ALPHA = Column(
    "window_alpha_vs_axial",
    float,
    "",
    "what the RV's shape alone would give an isotropic medium of the same mean length, as "
    "alpha_vs_axial; 0 for a sphere; empty for the second moment",
)


def window_alpha(
    window: Convex, fabric: VoidFabric, cutoff: float, axis: FloatArray
) -> float | None:
    """
    Signed anisotropy of an isotropic medium with a fabric's mean length, in the same directions.

    β follows from Σ w (c (A₀ + β A₁) + A₁) / Σ w (A₀ + β A₁) = mean length, sums over all axes.

    Parameters
    ----------
    window : Convex
        What clips the lines.
    fabric : VoidFabric
        Measured with that window; its first moment.
    cutoff : float
        Dump's length unit.
    axis : ndarray, shape (3,)
        Loading axis.

    Returns
    -------
    float or None
        None if the mean length is that of no such medium.
    """
    if window.is_sphere:
        return 0.0
    shared, slope = (
        one.reshape(fabric.axes.shape[:2])
        for one in window.overlap(fabric.axes.reshape(-1, 3), cutoff)
    )
    long, whole = float((shared @ fabric.weights).sum()), float((slope @ fabric.weights).sum())
    beyond = fabric.mean_length - cutoff
    if beyond <= 0.0 or long <= 0.0:
        return None
    number = slope + (1.0 / beyond - whole / long) * shared
    if np.any(number <= 0.0):
        return None
    lengths = fabric.weights * (cutoff + shared / number)
    tensors = weighted_tensors(fabric.axes, lengths)
    return float(np.mean(axial(tensors, axis, fabric.tensor.space)))
