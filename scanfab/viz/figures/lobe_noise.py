"""How large the lobes in pictures of all directions are by chance alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import HIGHEST_DEGREE, direction_points, harmonics_of
from scanfab.table.row import number_of, total_error
from scanfab.viz.figures.hemisphere import CONCENTRATION, Hemisphere

if TYPE_CHECKING:
    from scanfab.viz.scanned_frames import ScannedFrame


# where nothing but noise is, the largest lobe of a picture is 2 to 3 times its standard error
CHANCE = 3.0


def noise_notes(frames: Sequence[ScannedFrame], hemispheres: Sequence[Hemisphere]) -> str:
    """
    What chance alone makes of the lobes of each frame, in words.

    The error of a lobe is of scan and sample together, as if it were the same in all directions.
    """
    notes = []
    for frame, picture in zip(frames, hemispheres, strict=True):
        known = [
            _note(what, error, deviation)
            for what, error, deviation in (
                ("void lengths", void_noise(frame.row, frame.space), picture.voids),
                ("contact normals", contact_noise(frame.row, frame.space), picture.contacts),
            )
            if error is not None and deviation is not None
        ]
        if known:
            notes.append(f"Frame {frame.number}: {'; '.join(known)}.")
    return " ".join(notes)


def _note(what: str, error: float, deviation: FloatArray) -> str:
    largest = float(np.abs(deviation).max())
    text = f"lobes of {what} reach {largest:.2g} %, one standard error is {error:.2g} %"
    return f"{text}, so they are noise" if largest < CHANCE * error else text


def void_noise(row: Mapping[str, Any], space: Space = SPACE) -> float | None:
    """
    Standard error of a lobe of the mean void length, per cent of the mean.

    A lobe is a sum of harmonics, each with √5 times the error of the axial anisotropy α, in a plane
    √2 times: of the sample those of the second degree, five or two, as it hardly differs in finer
    ones; of the scan all that are fitted, as lines of different directions are independent.
    """
    scan, sample = (number_of(row, f"alpha_vs_axial_{part}") for part in ("se", "sample_se"))
    if sample is None:
        return None
    second = harmonics_of(2, space)
    fitted = sum(harmonics_of(degree, space) for degree in range(2, HIGHEST_DEGREE + 1, 2))
    parts = math.sqrt(fitted) * (scan or 0.0), math.sqrt(second) * sample
    return 100.0 * math.sqrt(second) * math.hypot(*parts)


def contact_noise(row: Mapping[str, Any], space: Space = SPACE) -> float | None:
    """Standard error of the smoothed density of contact normals, per cent of the mean."""
    alone, error = number_of(row, "alpha_c_axial_se"), total_error(row, "alpha_c_axial")
    if not alone or error is None:
        return None
    points, weights = direction_points(space)
    kernel = np.exp(CONCENTRATION * points[:, max(space.along)] ** 2)
    spread = float(weights @ kernel**2) / float(weights @ kernel) ** 2 - 1.0
    # neighbouring contacts are not independent: by how much is known of the anisotropy
    return 100.0 * math.sqrt(spread / row["contacts"]) * error / alone
