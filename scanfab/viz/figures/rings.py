"""Values around a polar angle: mean void lengths and contact normals over the azimuth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.fabric.contact import contact_fabric

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame

__all__ = ["Ring", "Rings", "contact_ring", "rings_of"]


REPLICATES = 16
# segments for each direction: mean lengths to about half a per cent
SEGMENTS = 20_000
# between azimuths of void lengths, and of the sectors that contacts are counted in, degrees
THETA_STEP = 15.0
CONTACT_STEP = 30.0


@dataclass(frozen=True, eq=False)
class Ring:
    """Values around one polar angle, relative to the mean over all directions."""

    phi: float
    """Polar angle, degrees."""
    theta: FloatArray
    """Azimuths, degrees."""
    value: FloatArray
    error: FloatArray
    """Standard error."""
    curve: Callable[[FloatArray], FloatArray] | None = None
    """A smooth curve beside them: value at azimuths in degrees."""


@dataclass(frozen=True, eq=False)
class Rings:
    """One frame: mean void length and contact normals over the azimuth."""

    title: str
    voids: Sequence[Ring]
    contacts: Sequence[Ring]


def rings_of(frame: ScannedFrame, angles: Sequence[float]) -> Rings:
    rings = {phi: _azimuths(phi) for phi in angles}
    axes = np.concatenate([_vectors(theta, phi) for phi, theta in rings.items()])
    value, error = _mean_lengths(frame, axes)
    place, voids = 0, []
    for phi, theta in rings.items():
        here = slice(place, place + len(theta))
        place += len(theta)
        voids.append(_around(phi, theta, value[here], error[here]))
    normals = frame.normals
    contacts = [contact_ring(normals, phi) for phi in angles] if len(normals) else []
    return Rings(frame.title, voids, contacts)


def _azimuths(phi: float) -> FloatArray:
    """At the equator θ and θ + 180° are one line."""
    return np.arange(0.0, 180.0 if phi == 90 else 360.0, THETA_STEP)


def _around(phi: float, theta: FloatArray, value: FloatArray, error: FloatArray) -> Ring:
    if phi == 90:
        theta = np.concatenate([theta, theta + 180.0])
        value, error = np.tile(value, 2), np.tile(error, 2)
    return Ring(phi, theta, value, error)


def _vectors(theta: FloatArray, phi: float) -> FloatArray:
    azimuth, polar = np.radians(theta), np.radians(phi)
    flat = np.sin(polar)
    return np.column_stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), np.full(len(theta), np.cos(polar))]
    )


def _mean_lengths(frame: ScannedFrame, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """ℓ of each axis over the mean of all directions, and its standard error, shape (D,)."""
    # compiled kernels, which those who draw something else do without
    from scanfab.scan.directions import DirectionRule
    from scanfab.scan.gaps import scan_gaps

    measured, variant, plan = frame.measurement, frame.variant, frame.measurement.plan
    # as many lines as give the wanted number of segments
    found = measured.sums.kept(variant)[1].mean()
    spacing = plan.spacing * np.sqrt(found * REPLICATES / SEGMENTS)
    rose = scan_gaps(
        measured.solids,
        DirectionRule("rose", axes, np.full(len(axes), 1 / len(axes)), None, turned=False),
        spacing=float(spacing),
        cutoffs=[plan.cutoff],
        blocks=measured.blocks,
        variants=variant,
        replicates=range(REPLICATES),
        seed=plan.seed,
        workers=plan.workers,
        most_steps=plan.max_chords,
    )
    sums_of, numbers = rose.kept(variant, 0, plan.moment)
    length, segments = measured.kept(variant)
    mean = length.sum() / segments.sum()
    with np.errstate(invalid="ignore", divide="ignore"):
        value = sums_of.sum(axis=0) / numbers.sum(axis=0) / mean
        scatter = np.nanstd(sums_of / numbers, axis=0, ddof=1) / mean
    return value, scatter / np.sqrt(REPLICATES)


def contact_ring(normals: FloatArray, phi: float) -> Ring:
    """Contact normals near a polar angle by azimuth, over what isotropy would give."""
    both = np.concatenate([normals, -normals])
    polar = np.degrees(np.arccos(np.clip(both[:, 2], -1, 1)))
    azimuth = np.degrees(np.arctan2(both[:, 1], both[:, 0])) % 360.0
    low, high = max(phi - 15.0, 0.0), phi + 15.0
    near = (polar >= low) & (polar < high)
    edges = np.arange(0.0, 361.0, CONTACT_STEP)
    count, _ = np.histogram(azimuth[near], edges)
    band = np.cos(np.radians(low)) - np.cos(np.radians(high))
    expected = len(both) * band / 2 * CONTACT_STEP / 360.0
    tensor = contact_fabric(normals)
    assert tensor is not None
    deviator = 7.5 * (tensor.matrix - np.eye(3) / 3)

    def density(theta: FloatArray) -> FloatArray:
        """Second-order density of the contact fabric, after Kanatani (1984)."""
        directions = _vectors(theta, phi)
        values: FloatArray = 1 + np.einsum("ni,ij,nj->n", directions, deviator, directions)
        return values

    middle = 0.5 * (edges[1:] + edges[:-1])
    return Ring(phi, middle, count / expected, np.sqrt(count) / expected, density)
