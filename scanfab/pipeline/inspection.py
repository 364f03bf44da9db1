"""What a reader sees in each frame of a series, with nothing computed from it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from scanfab.base.errors import PackingError, ReadError, ScanfabNote
from scanfab.io.series import Frame, Series
from scanfab.packing.doubts import cell_doubt, cell_hint, doubts_of, refuse_impossible
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import SurfaceBox, Window
from scanfab.pipeline.compute import (
    boundary_hint,
    chosen_frames,
    classify,
    no_such_frames,
    refuse_unknown_boundary,
)
from scanfab.pipeline.plan import rv_of
from scanfab.pipeline.settings import Settings

__all__ = ["REPORT_MEANINGS", "FrameReport", "inspect_series"]


@dataclass(frozen=True, kw_only=True, slots=True)
class FrameReport:
    """One frame as the reader sees it; lengths in the dump's unit."""

    source: str
    frame: int
    step: int | None
    time: float | None
    format: str
    grains: int
    boundary: int
    radius_min: float | None
    radius_max: float | None
    contacts: int
    contacts_from: str
    rattlers: int
    coordination: float | None
    cell: list[list[float]] | None
    periodic: list[bool] | None
    columns: list[str]
    warnings: list[str]
    low: list[float] | None
    high: list[float] | None
    rv_center: list[float] | None
    rv_radius: float | None


REPORT_MEANINGS: dict[str, str] = {
    "source": "the series as given",
    "frame": "index in the series, from 0",
    "step": "of the dump",
    "time": "of the dump",
    "format": "the reader",
    "grains": "without boundary particles",
    "boundary": "number of boundary particles",
    "radius_min": "smallest radius of a grain",
    "radius_max": "largest radius of a grain",
    "contacts": "all that are listed or found by geometry, with boundary particles too",
    "contacts_from": "file or geometric",
    "rattlers": "grains with too few contacts",
    "coordination": "mean number of contacts of a grain",
    "cell": "the lattice vectors, by rows",
    "periodic": "whether the sample repeats along each of them",
    "columns": "what the dump says of each particle; what is not standard by its own name",
    "warnings": "what is doubtful",
    "low": "corner of the box of the grains' surfaces, x y z; grains that flew away left out",
    "high": "the opposite corner",
    "rv_center": "centre of the RV, which is that of the series' first frame that has grains",
    "rv_radius": "its radius",
}
"""What each entry holds; lengths are in the dump's unit."""


def inspect_series(series: Series, settings: Settings) -> Iterator[FrameReport]:
    """
    Read the chosen frames and tell what is in them.

    Parameters
    ----------
    series : Series
        The frames.
    settings : Settings
        ``boundary``, ``frames``, ``min_contacts``, ``contact_tolerance`` and the RV count.

    Raises
    ------
    ScanfabError
        If a frame cannot be read, or no frame has any of the boundary's particles.
    """
    chosen = chosen_frames(series, settings.frames)
    found = False
    window: Window | None = None
    for number, frame in enumerate(series):
        if number in chosen:
            found = True
            sample, told = _read(frame, settings)
            window = window or _rv(series, sample, settings)
            yield _report(series.name, number, frame, sample, told, window)
        elif window is None:
            with suppress(PackingError, ReadError):
                window = _rv(series, _read(frame, settings)[0], settings)
        if number >= chosen.stop - 1:
            break
    if not found:
        raise no_such_frames(series, settings.frames)


def _read(frame: Frame, settings: Settings) -> tuple[Sample, list[str]]:
    """A frame, and what is doubtful about it."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sample = classify(frame.read(), settings)
    for one in caught:
        if issubclass(one.category, ScanfabNote):
            warnings.warn(one.message, stacklevel=2)
    told = [str(one.message) for one in caught if not issubclass(one.category, ScanfabNote)]
    return sample, [*told, *_hints(frame, sample, settings)]


def _rv(series: Series, sample: Sample, settings: Settings) -> Window | None:
    """The RV, and a word on the boundary, from the first frame that has grains."""
    if not sample.grains.any():
        return None
    refuse_unknown_boundary(series, sample, settings)
    return rv_of(sample, settings)


def _report(
    source: str,
    number: int,
    frame: Frame,
    sample: Sample,
    told: list[str],
    window: Window | None,
) -> FrameReport:
    packing, grains = sample.packing, sample.grains
    radius = packing.radius[grains]
    box = SurfaceBox.of(packing, sample.gathered) if grains.any() else None
    cell = packing.cell
    return FrameReport(
        source=source,
        frame=number,
        step=packing.step,
        time=packing.time,
        format=frame.reader.name,
        grains=int(grains.sum()),
        boundary=int(sample.boundary.sum()),
        radius_min=float(radius.min()) if radius.size else None,
        radius_max=float(radius.max()) if radius.size else None,
        contacts=len(sample.contacts),
        contacts_from=sample.contacts.source,
        rattlers=int(sample.rattlers.sum()),
        coordination=sample.coordination(VARIANTS["a"], None),
        cell=None if cell is None else cell.vectors.tolist(),
        periodic=None if cell is None else list(cell.periodic),
        columns=["id", "x", "y", "z", "radius", *packing.columns],
        warnings=told,
        low=None if box is None else box.low.tolist(),
        high=None if box is None else box.high.tolist(),
        rv_center=None if window is None else window.center.tolist(),
        rv_radius=None if window is None else window.radius,
    )


def _hints(frame: Frame, sample: Sample, settings: Settings) -> list[str]:
    """What looks wrong, also what makes the frame impossible to measure."""
    hints = [boundary_hint(sample, settings)] if len(sample.packing) else []
    try:
        refuse_impossible(sample)
    except PackingError as error:
        hints.append(str(error))
    no_cell = cell_doubt(sample, frame.carries)
    hints += [
        *doubts_of(sample, cell_is_named=frame.cell_is_named),
        no_cell,
        sample.doubt_of_escaped(),
    ]
    if not no_cell and (hint := cell_hint(sample, frame.carries)):
        warnings.warn(hint, ScanfabNote, stacklevel=2)
    return [hint for hint in hints if hint]
