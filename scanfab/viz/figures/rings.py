"""Values around a polar angle: mean void lengths and contact normals over the azimuth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.contact import contact_fabric
from scanfab.fabric.invariants import fabric_deviator

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame


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
    space: Space = SPACE
    """The plane of the frame, if its grains are discs."""


def rings_of(frame: ScannedFrame, angles: Sequence[float]) -> Rings:
    """What the figure rose shows of a frame, at some polar angles in degrees."""
    space, normals = frame.space, frame.normals
    # at the equator θ and θ + 180° are one line
    rings = {phi: np.arange(0.0, 180.0 if phi == 90 else 360.0, THETA_STEP) for phi in angles}
    axes = np.concatenate([_vectors(theta, phi, space) for phi, theta in rings.items()])
    value, error = _mean_lengths(frame, axes)
    ends, voids = np.cumsum([len(theta) for theta in rings.values()])[:-1], []
    parts = zip(rings.items(), np.split(value, ends), np.split(error, ends), strict=True)
    for (phi, theta), own, own_error in parts:
        if phi == 90:
            theta = np.concatenate([theta, theta + 180.0])
            own, own_error = np.tile(own, 2), np.tile(own_error, 2)
        voids.append(Ring(phi, theta, own, own_error))
    contacts = [contact_ring(normals, phi, space) for phi in angles] if len(normals) else []
    return Rings(frame.title, voids, contacts, space)


def _vectors(theta: FloatArray, phi: float, space: Space) -> FloatArray:
    azimuth, polar = np.radians(theta), np.radians(phi)
    if space.is_plane:
        return np.column_stack([np.cos(azimuth), np.sin(azimuth)]) @ _sides(space)
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
    spacing = plan.spacing * plan.space.apart(found * REPLICATES / SEGMENTS)
    weights = np.full(len(axes), 1 / len(axes))
    rose = scan_gaps(
        measured.solids,
        DirectionRule("rose", axes, weights, None, turned=False, space=plan.space),
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


def _sides(space: Space) -> FloatArray:
    """The coordinates of a plane, from the first of which angles are counted, shape (2, 3)."""
    sides: FloatArray = np.eye(3)[sorted(space.along)]
    return sides


def _near(both: FloatArray, phi: float, space: Space) -> tuple[FloatArray, float]:
    """Azimuths of the vectors near a polar angle, and the share of all that isotropy has there."""
    if space.is_plane:
        x, y = _sides(space) @ both.T
        return np.degrees(np.arctan2(y, x)) % 360.0, 1.0
    polar = np.degrees(np.arccos(np.clip(both[:, 2], -1, 1)))
    azimuth = np.degrees(np.arctan2(both[:, 1], both[:, 0])) % 360.0
    low, high = max(phi - 15.0, 0.0), phi + 15.0
    band = np.cos(np.radians(low)) - np.cos(np.radians(high))
    return azimuth[(polar >= low) & (polar < high)], band / 2


def contact_ring(normals: FloatArray, phi: float, space: Space = SPACE) -> Ring:
    """Contact normals near a polar angle by azimuth, over what isotropy would give."""
    both = np.concatenate([normals, -normals])
    azimuth, share = _near(both, phi, space)
    edges = np.arange(0.0, 361.0, CONTACT_STEP)
    count, _ = np.histogram(azimuth, edges)
    expected = len(both) * share * CONTACT_STEP / 360.0
    tensor = contact_fabric(normals, space)
    assert tensor is not None
    deviator = fabric_deviator(tensor.matrix, space)

    def density(theta: FloatArray) -> FloatArray:
        """Second-order density of the contact fabric, after Kanatani (1984)."""
        directions = _vectors(theta, phi, space)
        values: FloatArray = 1 + np.einsum("ni,ij,nj->n", directions, deviator, directions)
        return values

    middle = 0.5 * (edges[1:] + edges[:-1])
    return Ring(phi, middle, count / expected, np.sqrt(count) / expected, density)
