"""Figures of the first and the last frame of a series: what they need is scanned here."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.errors import ScanfabWarning, SettingsError
from scanfab.base.typing import FloatArray
from scanfab.fabric.contact import contact_fabric
from scanfab.fabric.distribution import mean_length_function, sphere_points
from scanfab.io.series import Series
from scanfab.packing.sample import VARIANTS
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.frame import FrameResult
from scanfab.pipeline.settings import Length, Settings
from scanfab.scan.directions import DirectionRule
from scanfab.scan.gaps import scan_gaps
from scanfab.scan.lines import line_triads
from scanfab.scan.scan import ScanSums
from scanfab.scan.segments import sample_segments
from scanfab.scan.solids import Solids
from scanfab.table.abscissa import spelt_strain, strain_column
from scanfab.table.reading import number_of, total_error
from scanfab.viz.figures.of_frames import (
    CutoffCurve,
    LengthSample,
    Projection,
    Ring,
    Rose,
    disk,
    plot_cutoffs,
    plot_histogram,
    plot_projection,
    plot_rose,
)
from scanfab.viz.figures.style import DPI

__all__ = [
    "FRAME_FIGURES",
    "ScannedFrames",
    "lengths_of",
    "parse_figure",
    "plot_frames",
    "projections_of",
    "scan_frames",
]


FRAME_FIGURES = {
    "rose": "mean void length and contact normals over θ; rose:30,60,90 chooses φ in degrees",
    "projection": "both over all directions, on an equal-area disk",
    "histogram": "lengths of the void segments, with the cut-off",
    "cutoffs": "void anisotropy over the cut-off",
}

POLAR_ANGLES = (90.0, 60.0, 30.0)
REPLICATES = 16
# segments for each direction of a rose: mean lengths to about half a per cent
ROSE_SEGMENTS = 20_000
THETA_STEP = 15.0
CONTACT_STEP = 30.0
# of the kernel exp(k (n·m)²) that smooths contact normals: half its height at 19 degrees
CONCENTRATION = 6.5
HISTOGRAM_LINES = 6_000
CUTOFFS = (0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0)


def parse_figure(text: str) -> tuple[str, tuple[float, ...]]:
    """
    The name of a figure of frames, and the polar angles of a rose in degrees.

    Raises
    ------
    SettingsError
        If there is no such figure.

    Examples
    --------
    >>> from scanfab.viz.figures.scanned import parse_figure
    >>> parse_figure("rose:45,90")
    ('rose', (45.0, 90.0))
    """
    name, colon, argument = text.partition(":")
    if name not in FRAME_FIGURES or (colon and name != "rose"):
        raise SettingsError(f"figure: expected {', '.join(FRAME_FIGURES)}, found {text!r}")
    if not colon:
        return name, POLAR_ANGLES
    words = argument.split(",")
    if len(words) > 4 or not all(re.fullmatch(r"\d+(\.\d+)?", word) for word in words):
        raise SettingsError(
            f"figure: expected one to four polar angles such as rose:30,60,90, found {text!r}"
        )
    angles = tuple(float(word) for word in words)
    if not all(0 < angle <= 90 for angle in angles):
        raise SettingsError(f"figure: polar angles lie above 0 and up to 90, found {text!r}")
    return name, angles


@dataclass(frozen=True, eq=False)
class ScannedFrames:
    """The first and the last frame of a table that have a void fabric, scanned for one variant."""

    results: list[FrameResult]
    titles: list[str]
    variant: str

    @property
    def titled(self) -> list[tuple[FrameResult, str]]:
        """Each frame with its title."""
        return list(zip(self.results, self.titles, strict=True))


def plot_frames(
    path: Path,
    series: Series,
    settings: Settings,
    rows: Sequence[Mapping[str, Any]],
    figure: str,
    dpi: int = DPI,
) -> None:
    """
    Draw the first and the last frame of a table that have a void fabric.

    Parameters
    ----------
    path : Path
        ``.png``, ``.svg`` or ``.pdf``.
    series, settings, rows
        As for :func:`scan_frames`.
    figure : str
        See :func:`parse_figure`.
    dpi : int, optional
        Pixels an inch.

    Raises
    ------
    SettingsError
        If there is nothing to draw.
    """
    name, angles = parse_figure(figure)
    if name == "cutoffs":
        with warnings.catch_warnings():
            # errors that grow with the cut-off are what the figure shows
            warnings.filterwarnings("ignore", ".* which holds for the mean", ScanfabWarning)
            frames = scan_frames(series, _over_cutoffs(settings), rows, settings.variants)
        curves = [_cutoffs(*one, frames.variant) for one in frames.titled]
        plot_cutoffs(path, curves, dpi)
        return
    frames = scan_frames(series, settings, rows)
    if name == "rose":
        roses = [_rose(*one, frames.variant, angles, settings) for one in frames.titled]
        plot_rose(path, roses, dpi)
    elif name == "projection":
        plot_projection(path, projections_of(frames), dpi)
    else:
        plot_histogram(path, lengths_of(frames), dpi)


def scan_frames(
    series: Series,
    settings: Settings,
    rows: Sequence[Mapping[str, Any]],
    variants: str | None = None,
) -> ScannedFrames:
    """
    Scan the first and the last frame of a table again, for as many figures as are wanted.

    Parameters
    ----------
    series, settings
        What the table was computed from. The variant is c, if it is among the settings', else
        the first.
    rows : sequence of mapping
        The table.
    variants : str, optional
        Those to scan, that one by default. Only together do they have the lines of the table.

    Raises
    ------
    SettingsError
        If no frame has a void fabric of that variant.
    """
    variant = "c" if "c" in settings.variants else settings.variants[0]
    own = [row for row in rows if row["source"] == series.name and row["variant"] == variant]
    results = _results(series, replace(settings, variants=variants or variant), own, variant)
    row_of = {row["frame"]: row for row in own}
    # of the table: what is asked of a strain file now may be another
    titles = [_title(row_of[one.number], strain_column(own)) for one in results]
    return ScannedFrames(results, titles, variant)


def projections_of(frames: ScannedFrames) -> list[Projection]:
    """What :func:`scanfab.viz.figures.of_frames.plot_projection` draws."""
    return [_projection(*one, frames.variant) for one in frames.titled]


def lengths_of(frames: ScannedFrames) -> list[LengthSample]:
    """What :func:`scanfab.viz.figures.of_frames.plot_histogram` draws."""
    return [_lengths(*one, frames.variant) for one in frames.titled]


def _results(
    series: Series, settings: Settings, rows: Sequence[Mapping[str, Any]], variant: str
) -> list[FrameResult]:
    """The first and the last frame that have a void fabric of a variant, computed again."""
    numbers = [row["frame"] for row in rows if row["alpha_vs_axial"] is not None]
    if not numbers:
        raise SettingsError(
            f"there is nothing to draw: no frame has a void fabric of variant {variant}"
        )
    results: list[FrameResult] = []
    for number in sorted({min(numbers), max(numbers)}):
        one = replace(settings, frames=slice(number, number + 1))
        for _ in compute_rows(series.whole, one, observe=results.append):
            pass
    return results


def _title(row: Mapping[str, Any], column: str | None) -> str:
    """Variant, frame and, if the table has one, the strain."""
    strain = spelt_strain(row, column, symbol=True)
    return ", ".join(filter(None, [f"variant {row['variant']}", f"frame {row['frame']}", strain]))


def _parts(result: FrameResult) -> tuple[Solids, ScanSums, float, float]:
    """Solids, sums, cut-off and smallest radius of a frame that has a void fabric."""
    scanned = result.scanned
    smallest = float(result.sample.packing.radius[result.sample.grains].min())
    return scanned.solids, scanned.sums, scanned.plan.cutoff, smallest


def _normals(result: FrameResult, variant: str) -> FloatArray:
    window = result.scanned.plan.window
    chosen = result.sample.fabric_contacts(VARIANTS[variant], window)
    return result.sample.contacts.normal[chosen]


def _rose(
    result: FrameResult, title: str, variant: str, angles: Sequence[float], settings: Settings
) -> Rose:
    rings = {phi: _azimuths(phi) for phi in angles}
    axes = np.concatenate([_vectors(theta, phi) for phi, theta in rings.items()])
    value, error = _mean_lengths(result, variant, axes, settings)
    place, void = 0, []
    for phi, theta in rings.items():
        here = slice(place, place + len(theta))
        place += len(theta)
        void.append(_around(phi, theta, value[here], error[here]))
    normals = _normals(result, variant)
    contact = [_contact_ring(normals, phi) for phi in angles] if len(normals) else []
    return Rose(title, void, contact)


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


def _mean_lengths(
    result: FrameResult, variant: str, axes: FloatArray, settings: Settings
) -> tuple[FloatArray, FloatArray]:
    """ℓ of each axis over the mean of all directions, and its standard error, shape (D,)."""
    solids, sums, cutoff, _ = _parts(result)
    # as many lines as give the wanted number of segments
    found = sums.kept(variant)[1].mean()
    spacing = result.scanned.plan.spacing * np.sqrt(found * REPLICATES / ROSE_SEGMENTS)
    rule = DirectionRule("rose", axes, np.full(len(axes), 1 / len(axes)), None, turned=False)
    rose = scan_gaps(
        solids,
        rule,
        spacing=float(spacing),
        cutoffs=[cutoff],
        blocks=result.scanned.blocks,
        variants=variant,
        replicates=range(REPLICATES),
        seed=settings.seed,
        workers=settings.workers,
        most_steps=settings.max_chords,
    )
    sums_of, numbers = rose.kept(variant, 0, settings.moment)
    length, segments = result.scanned.kept(variant)
    mean = length.sum() / segments.sum()
    with np.errstate(invalid="ignore", divide="ignore"):
        value = sums_of.sum(axis=0) / numbers.sum(axis=0) / mean
        scatter = np.nanstd(sums_of / numbers, axis=0, ddof=1) / mean
    return value, scatter / np.sqrt(REPLICATES)


def _contact_ring(normals: FloatArray, phi: float) -> Ring:
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


def _projection(result: FrameResult, title: str, variant: str) -> Projection:
    _, sums, _, _ = _parts(result)
    _, directions = disk()
    mean_length = mean_length_function(sums.axes, *result.scanned.kept(variant))
    assert mean_length is not None
    points, weights = sphere_points()
    mean = float(weights @ mean_length(points))
    normals = _normals(result, variant)
    return Projection(
        title,
        100 * (mean_length(directions) / mean - 1),
        100 * (_smoothed_density(normals, directions) - 1) if len(normals) else None,
    )


def _smoothed_density(normals: FloatArray, directions: FloatArray) -> FloatArray:
    """Density of the normals (n or -n) about each direction, over that of isotropic ones."""
    points, weights = sphere_points()
    isotropic = float(weights @ np.exp(CONCENTRATION * points[:, 2] ** 2))
    flat = directions.reshape(-1, 3)
    density: FloatArray = np.array(
        [np.exp(CONCENTRATION * (normals @ one) ** 2).mean() for one in flat]
    )
    return density.reshape(directions.shape[:-1]) / isotropic


def _lengths(result: FrameResult, title: str, variant: str) -> LengthSample:
    _, _, cutoff, smallest = _parts(result)
    position, radius, window = result.scanned.spheres_of(VARIANTS[variant])
    points, _ = sphere_points()
    frames = line_triads(points[: len(points) // 2 : 20])
    found = sample_segments(position, radius, frames, HISTOGRAM_LINES, window)
    return LengthSample(title, found.length[found.void] / smallest, cutoff / smallest)


def _over_cutoffs(settings: Settings) -> Settings:
    """Settings whose rows are the curve, by the lines of the table and with its errors."""
    lengths = {*(Length(cutoff, "rmin") for cutoff in CUTOFFS), settings.cutoff}
    return replace(settings, cutoffs=tuple(lengths))


def _cutoffs(result: FrameResult, title: str, variant: str) -> CutoffCurve:
    """The rows of one frame and many cut-offs as a curve."""
    _, _, chosen, smallest = _parts(result)
    rows = [dict(row) for row in result.rows if row.variant == variant]

    def column(values: Iterable[float | None]) -> FloatArray:
        return np.array([np.nan if one is None else one for one in values], np.float64)

    return CutoffCurve(
        title,
        cutoff=column(number_of(row, "cutoff") for row in rows) / smallest,
        alpha=column(number_of(row, "alpha_vs_axial") for row in rows),
        error=column(number_of(row, "alpha_vs_axial_se") for row in rows),
        total=column(total_error(row, "alpha_vs_axial") for row in rows),
        chosen=chosen / smallest,
    )
