"""
The void fabric without a scan: as the window alone gives it, and as the contacts predict it.

**The window.** A line that is clipped to a window W loses long segments, the more the shorter its
piece in W is, so that ℓ(n) depends on the shape of W as it is seen along n. Freely overlapping
grains (a Poisson medium, Matheron 1975, Random Sets and Integral Geometry) have segments of the
mean length c + 1/β above a cut-off c, whatever the direction; clipped to W

    ℓ(n) = c + A₁ / (A₀ + β A₁),    A₁ = g(c; n),    A₀ = -dg/dz(c; n),

with g(z; n) the volume that W has in common with itself moved by z n; in a plane the area.

**The contacts.** In a medium that is the same everywhere the mean length of void segments is

    ℓ(n; c) = c + L / N,    N(n; c) = (Σ π r² - Σ 2 π R* |μ| (c |μ| + δ)⁺) / V,

with N the number of gaps of at least c along n, per volume and per cross-section of a line, and
L = φ - ∫ N dc from 0 to c the share of the volume in which a segment of length c along n may begin,
φ the porosity. The second sum goes over pairs of grains whose surfaces are near: μ = n·m with the
normal m, overlap δ (below 0: a gap), R* = r1 r2 / (r1 + r2), x⁺ = max(x, 0). An overlap removes
gaps, a contact adds short ones that the cut-off drops: both more along the normal than across it.
Of discs the sums are Σ 2 r and Σ 2 |μ| √(2 R* (c |μ| + δ)⁺), over an area.

The surfaces count as parabolas, so it holds for short gaps only: of sheared samples the anisotropy
is right within 15 % without a cut-off, and a quarter too large at 0.3 of the smallest radius.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from scanfab.base.column import numbers
from scanfab.base.convex import Convex
from scanfab.base.typing import FloatArray
from scanfab.fabric.tensor import axial, weighted_tensors
from scanfab.fabric.void import VoidFabric
from scanfab.packing.search import NearPairs
from scanfab.scan.directions import rule_of

# in smallest radii: for longer ones the surfaces are no parabolas
LONGEST_GAP = 0.3
# of the integral over all directions
AXES = 100

WINDOW_ALPHA, PREDICTED_ALPHA = numbers(
    {
        "window_alpha_vs_axial": "what the RV's shape alone would give an isotropic medium of the "
        "same mean length, as alpha_vs_axial; 0 for a sphere; empty for the second moment",
        "alpha_vs_axial_contacts": "alpha_vs_axial as overlaps and near contacts predict it, for "
        "cut-offs up to 0.3 of the smallest radius; empty for an open whole and for clumps",
    }
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


def predicted_alpha(
    pairs: NearPairs, porosity: float, cutoff: float, axis: npt.ArrayLike
) -> float | None:
    """
    Signed anisotropy of the void fabric along an axis, from the near pairs alone.

    Parameters
    ----------
    pairs : NearPairs
        All whose surfaces are no more than the cut-off apart.
    porosity : float
        φ, of the same region, dimensionless.
    cutoff : float
        Of the void segments, dump's length unit.
    axis : array_like, shape (3,)
        Unit vector.

    Returns
    -------
    float or None
        Dimensionless. None if in some direction no gap is left, so that the formula does not hold.

    References
    ----------
    Mean length of a stationary medium: Lu and Torquato, Lineal-path function for random
    heterogeneous materials, 1992, doi:10.1103/PhysRevA.45.922.

    Examples
    --------
    A chain of spheres that overlap along z loses gaps along z: the others are longer.

    >>> import numpy as np
    >>> from scanfab.fabric.predicted import predicted_alpha
    >>> from scanfab.packing.search import NearPairs
    >>> chain = NearPairs(np.eye(3)[2:], np.array([0.02]), np.array([0.25]), np.pi / 4, 0.98)
    >>> round(predicted_alpha(chain, 0.47, 0.0, (0, 0, 1)), 4)
    0.0051
    """
    rule = rule_of(AXES, pairs.space)
    number = np.empty(len(rule))
    share = np.empty(len(rule))
    for place, along in enumerate(rule.axes):
        removed, integral = _removed(pairs, np.abs(pairs.normal @ along), cutoff)
        number[place] = (pairs.shadow - removed) / pairs.volume
        share[place] = porosity - (cutoff * pairs.shadow - integral) / pairs.volume
    if np.any(number <= 0.0) or np.any(share <= 0.0):
        return None
    lengths = rule.weights * (cutoff + share / number)
    tensor = weighted_tensors(rule.axes[None], lengths[None])[0]
    return float(axial(tensor, axis, pairs.space))


def _removed(pairs: NearPairs, cosine: FloatArray, cutoff: float) -> tuple[float, float]:
    """Gaps shorter than the cut-off or closed by overlap along a line, and their integral to it."""
    opened = np.maximum(cutoff * cosine + pairs.overlap, 0.0)
    closed = np.maximum(pairs.overlap, 0.0)
    if pairs.space.is_plane:
        width = 2.0 * np.sqrt(2.0 * pairs.reduced_radius)
        integral = width * (opened**1.5 - closed**1.5) / 1.5
        return float(np.sum(width * cosine * np.sqrt(opened))), float(np.sum(integral))
    area = 2.0 * np.pi * pairs.reduced_radius
    integral = 0.5 * area * (opened**2 - closed**2)
    return float(np.sum(area * cosine * opened)), float(np.sum(integral))
