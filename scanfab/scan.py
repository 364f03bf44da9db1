"""The scan: lines in many directions through a packing, as sums by replicate and axis."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from scanfab.directions import DirectionRule
from scanfab.errors import SettingsError
from scanfab.kernels import sweep as kernel

__all__ = ["MAX_LINES", "ScanSums", "Solids", "is_affordable", "line_frames", "scan_lines"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

# lines of one axis and replicate: 40 bytes each
MAX_LINES = 50_000_000


@dataclass(frozen=True, eq=False)
class Solids:
    """
    The spheres that lines meet, and the sphere window; lengths in the dump's unit.

    Positions are relative to the window's centre.
    """

    position: FloatArray
    """Shape (N, 3)."""
    radius: FloatArray
    """Shape (N,)."""
    removed: BoolArray
    """Spheres that the variants b and d leave out, shape (N,)."""
    window_radius: float = 0.0
    """Radius of the sphere window; 0 for none."""


@dataclass(frozen=True, eq=False)
class ScanSums:
    """
    What a scan adds up, for replicate r, variant v (a, b, c, d) and axis d.

    A segment counts in ``length`` and ``segments`` if it is kept, that is not shorter than the
    cut-off; ``void`` is the length of all. Lengths in the dump's unit.
    """

    axes: FloatArray
    """Unit vectors, shape (R, D, 3)."""
    length: FloatArray
    """Sum of the lengths of the kept segments, shape (R, 4, D)."""
    segments: IntArray
    """Number of the kept segments, shape (R, 4, D)."""
    lines: IntArray
    """Lines that meet the window (for the whole: any solid), shape (R, 4, D)."""
    void: FloatArray
    """Length of all void in the window, kept or not, shape (R, 4, D); 0 for the whole."""
    line_length: FloatArray
    """Length of the lines in the window, shape (R, 4, D); 0 for the whole."""

    @property
    def replicates(self) -> int:
        """Number of replicates R."""
        return len(self.axes)

    def kept(self, variant: str) -> tuple[FloatArray, IntArray]:
        """Lengths and numbers of one variant's kept segments, shapes (R, D)."""
        which = "abcd".index(variant)
        return self.length[:, which], self.segments[:, which]

    @classmethod
    def concatenate(cls, parts: Iterable[ScanSums]) -> ScanSums:
        """All replicates of several scans."""
        parts = list(parts)
        return cls(
            *(
                np.concatenate([getattr(part, field.name) for part in parts])
                for field in fields(cls)
            )
        )


def line_frames(axes: FloatArray) -> FloatArray:
    """
    Orthonormal frames (rows u, v, n) whose third row is each axis, shape (D, 3, 3).

    Examples
    --------
    >>> import numpy as np
    >>> from scanfab.scan import line_frames
    >>> line_frames(np.array([[0.0, 0.0, 1.0]]))[0]
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    helper = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    u = helper - np.sum(helper * axes, axis=1, keepdims=True) * axes
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return np.stack([u, np.cross(axes, u), axes], axis=1)


def scan_lines(
    solids: Solids,
    rule: DirectionRule,
    *,
    spacing: float,
    cutoff: float,
    variants: str = "abcd",
    replicates: Iterable[int] = range(16),
    seed: int = 0,
    workers: int = 1,
) -> ScanSums:
    """
    Scan with one square grid of lines for each axis and replicate.

    In each replicate the rule is turned at random and the grid of every axis is shifted at random.
    The random numbers depend on the seed and the replicate's number alone.

    Parameters
    ----------
    solids : Solids
        What the lines meet.
    rule : DirectionRule
        The axes.
    spacing : float
        Distance between neighbouring lines of one axis and replicate, dump's length unit.
    cutoff : float
        Segments shorter than this are not kept, dump's length unit.
    variants : str, optional
        Which of a, b, c, d to scan; the sums of the others are 0.
    replicates : iterable of int, optional
        Numbers of the replicates.
    seed, workers : int, optional
        Seed of the random numbers; threads to use. The result does not depend on the threads.

    Returns
    -------
    ScanSums

    Raises
    ------
    SettingsError
        If the spacing asks for more lines than memory should hold.
    """
    _check_spacing(solids, spacing)
    frames = line_frames(rule.axes)

    def one(replicate: int) -> ScanSums:
        turned, offsets = _replicate(rule, frames, seed, replicate)
        return _scan_frames(solids, turned, offsets, spacing, cutoff, variants)

    numbers = list(replicates)
    if not numbers:
        raise SettingsError("replicates: expected at least one")
    if workers == 1 or len(numbers) == 1:
        return ScanSums.concatenate(map(one, numbers))
    with ThreadPoolExecutor(workers) as pool:
        return ScanSums.concatenate(pool.map(one, numbers))


def _replicate(
    rule: DirectionRule, frames: FloatArray, seed: int, replicate: int
) -> tuple[FloatArray, FloatArray]:
    """The rule's line frames, turned, and the shifts of the grids."""
    random = np.random.default_rng([seed, replicate])
    rotation = Rotation.random(rng=random).as_matrix()
    offsets = random.random((len(rule), 2))
    return (frames @ rotation.T if rule.turned else frames), offsets


def _scan_frames(
    solids: Solids,
    frames: FloatArray,
    offsets: FloatArray,
    spacing: float,
    cutoff: float,
    variants: str,
) -> ScanSums:
    """One replicate: given line frames (D, 3, 3) and shifts (D, 2)."""
    tallies = np.zeros((len(frames), 2, kernel.TALLY_SIZE))
    kernel.scan_axes(
        np.ascontiguousarray(solids.position),
        solids.radius,
        solids.removed,
        ("a" in variants or "c" in variants, "b" in variants or "d" in variants),
        "a" in variants or "b" in variants,
        np.ascontiguousarray(frames),
        offsets,
        spacing,
        cutoff,
        solids.window_radius,
        tallies,
    )
    zero = np.zeros((len(frames), 2))

    def by_variant(whole: FloatArray, window: FloatArray) -> FloatArray:
        values = np.concatenate([whole, window], axis=1).T[None]
        chosen = [variant in variants for variant in "abcd"]
        return np.where(np.array(chosen)[:, None], values, 0.0)

    return ScanSums(
        axes=frames[None, :, 2],
        length=by_variant(tallies[..., kernel.WHOLE_LENGTH], tallies[..., kernel.WINDOW_LENGTH]),
        segments=by_variant(
            tallies[..., kernel.WHOLE_KEPT], tallies[..., kernel.WINDOW_KEPT]
        ).astype(np.int64),
        lines=by_variant(
            tallies[..., kernel.WHOLE_LINES], tallies[..., kernel.WINDOW_LINES]
        ).astype(np.int64),
        void=by_variant(zero, tallies[..., kernel.WINDOW_VOID]),
        line_length=by_variant(zero, tallies[..., kernel.WINDOW_LINE_LENGTH]),
    )


def is_affordable(solids: Solids, spacing: float) -> bool:
    """Whether memory should hold the lines of one axis and replicate."""
    return _most_lines(solids, spacing) <= MAX_LINES


def _most_lines(solids: Solids, spacing: float) -> float:
    reach = solids.window_radius
    if len(solids.position):
        reach = max(reach, float((np.linalg.norm(solids.position, axis=1) + solids.radius).max()))
    return (2.0 * reach / spacing + 1.0) ** 2


def _check_spacing(solids: Solids, spacing: float) -> None:
    lines = _most_lines(solids, spacing)
    if lines > MAX_LINES:
        raise SettingsError(
            f"spacing: {spacing:g} between lines of one direction and replicate makes "
            f"{lines:.2g} of them, more than {MAX_LINES:.0e}: choose a wider spacing"
        )
