"""
Void fabric without a scan: as the window alone makes it, and as the contacts predict it.

**Window.** Clipping a line to a window W cuts long segments short, especially if the piece of the
line in W is short. Thus ℓ(n) depends on the shape of W along n even in an isotropic medium. In a
medium of freely overlapping grains (Poisson medium, Matheron 1975, Random Sets and Integral
Geometry) segments above a cut-off c have the mean length c + 1/β in every direction. Clipped to W,
they have

    ℓ(n) = c + A₁ / (A₀ + β A₁),    A₁ = g(c; n),    A₀ = -dg/dz(c; n),

where g(z; n) is the volume (in a plane the area) that W shares with a copy moved by z n.

**Contacts.** In a statistically homogeneous medium the mean length of void segments is

    ℓ(n; c) = c + L / N,    N(n; c) = (Σ π r² - Σ 2 π R* |μ| (c |μ| + δ)⁺) / V,

where N is the number of gaps of at least c along n, per volume and per cross-section of a line.
L = φ - ∫ N dc, from 0 to c and with the porosity φ, is the fraction of the volume in which a
segment of length c along n may begin. The second sum runs over pairs of grains whose surfaces are
near: μ = n·m with the normal m, overlap δ (negative: a gap), R* = r1 r2 / (r1 + r2) and
x⁺ = max(x, 0). An overlap removes gaps, and a contact adds short gaps, which the cut-off drops;
both happen more along the normal than across it. For discs the sums are Σ 2 r and
Σ 2 |μ| √(2 R* (c |μ| + δ)⁺), over an area.

The surfaces are approximated by parabolas, which holds for short gaps only. For sheared samples the
anisotropy is right within 15 % without a cut-off, and 25 % too large at a cut-off of 0.3 times the
smallest radius.
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

# longest cut-off, in smallest radii, for which the surfaces may be taken as parabolas
LONGEST_GAP = 0.3
# number of axes for the integral over all directions
AXES = 100

WINDOW_ALPHA, PREDICTED_ALPHA = numbers(
    {
        "window_alpha_vs_axial": "alpha_vs_axial of an isotropic medium of the same mean length in "
        "this RV, due to the shape of the RV alone; 0 for a sphere; empty for the second moment",
        "alpha_vs_axial_contacts": "alpha_vs_axial predicted from overlaps and near contacts, for "
        "cut-offs up to 0.3 smallest radii; empty for a whole sample that is not periodic and for "
        "clumps",
    }
)


def window_alpha(
    window: Convex, fabric: VoidFabric, cutoff: float, axis: FloatArray
) -> float | None:
    """
    Signed anisotropy that the window alone gives an isotropic medium of the same mean length.

    The medium's β follows from Σ w (c (A₀ + β A₁) + A₁) / Σ w (A₀ + β A₁) = mean length, where the
    sums run over the axes of the fabric.

    Parameters
    ----------
    window : Convex
        The window that clips the lines.
    fabric : VoidFabric
        Void fabric measured in this window, of the first moment.
    cutoff : float
        Cut-off of the void segments, dump's length unit.
    axis : ndarray, shape (3,)
        Loading axis.

    Returns
    -------
    float or None
        Dimensionless; None if no isotropic medium has this mean length.
    """
    if window.is_sphere:
        return 0.0
    shared, slope = (
        values.reshape(fabric.axes.shape[:2])
        for values in window.overlap(fabric.axes.reshape(-1, 3), cutoff)
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
    Signed anisotropy of the void fabric along an axis, predicted from near pairs of grains.

    Parameters
    ----------
    pairs : NearPairs
        All pairs of grains whose surfaces are at most the cut-off apart.
    porosity : float
        Porosity φ of the same region, dimensionless.
    cutoff : float
        Cut-off of the void segments, dump's length unit.
    axis : array_like, shape (3,)
        Unit vector.

    Returns
    -------
    float or None
        Dimensionless; None if no gap is left in some direction, where the formula does not hold.

    References
    ----------
    Mean length of a stationary medium: Lu and Torquato, Lineal-path function for random
    heterogeneous materials, 1992, doi:10.1103/PhysRevA.45.922.

    Examples
    --------
    Spheres that overlap along z have fewer gaps along z, so the remaining gaps are longer:

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
    """Gaps along a line that cut-off or overlap remove, and their integral up to the cut-off."""
    opened = np.maximum(cutoff * cosine + pairs.overlap, 0.0)
    closed = np.maximum(pairs.overlap, 0.0)
    if pairs.space.is_plane:
        width = 2.0 * np.sqrt(2.0 * pairs.reduced_radius)
        integral = width * (opened**1.5 - closed**1.5) / 1.5
        return float(np.sum(width * cosine * np.sqrt(opened))), float(np.sum(integral))
    area = 2.0 * np.pi * pairs.reduced_radius
    integral = 0.5 * area * (opened**2 - closed**2)
    return float(np.sum(area * cosine * opened)), float(np.sum(integral))
