"""Inspect a series: what a reader finds in each frame, without computing a fabric."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import nullcontext, suppress
from dataclasses import replace
from typing import Any

from scanfab.base.column import LENGTH, Column
from scanfab.base.errors import PackingError, ReadError, ScanfabNote, collected, tell
from scanfab.base.option import unusable
from scanfab.io.frame import Frame
from scanfab.io.series import Series
from scanfab.packing.boundary import spelt_rules
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import SurfaceBox, Window
from scanfab.pipeline.frames import Frames, doubts_of_frame, sample_of
from scanfab.pipeline.rv import rvs_of
from scanfab.pipeline.settings import Settings
from scanfab.table.columns import FRAME_COLUMNS, row_of
from scanfab.table.row import Row

REPORT_COLUMNS = (
    *FRAME_COLUMNS[:4],
    Column("format", str, "", "name of the reader"),
    Column("grains", int, "", "number of grains, without boundary particles; a clump is one grain"),
    Column("boundary", int, "", "number of boundary particles"),
    Column("radius_min", float, LENGTH, "smallest radius of a grain"),
    Column("radius_max", float, LENGTH, "largest radius of a grain"),
    Column("contacts", int, "", "number of contacts, including those with boundary particles"),
    Column("contacts_from", str, "", "file: listed in the dump; geometric: found by geometry"),
    Column("rattlers", int, "", "number of grains with too few contacts (clumps: neighbours)"),
    Column("coordination", float, "", "mean number of contacts (clumps: neighbours) per grain"),
    Column("cell", list, LENGTH, "lattice vectors as rows"),
    Column("periodic", list, "", "whether the sample repeats along each lattice vector"),
    Column("columns", list, "", "names of the particle columns, standard columns first"),
    Column("warnings", list, "", "doubts about the frame"),
    Column("low", list, LENGTH, "lower corner of the box around the grains"),
    Column("high", list, LENGTH, "upper corner of the box around the grains"),
    Column("rv_center", list, LENGTH, "centre of the RV of the series"),
    Column("rv_radius", float, LENGTH, "radius of the ball that holds the RV"),
    Column("rv_shape", str, "", "shape and size of the RV in words"),
    Column("clumps", int, "", "number of grains that are bodies of several spheres"),
    Column("spheres", int, "", "number of spheres that the grains consist of"),
    Column("grains_in_rv", int, "", "number of grains whose centre lies in the RV"),
)
"""Columns of a row of :func:`inspect`: one frame as the reader sees it."""


def inspect(series: Series, **options: Any) -> Iterator[Row]:
    """
    Report what a reader finds in each frame of a series, without computing the fabric.

    Parameters
    ----------
    series : Series
        The frames, as :func:`scanfab.read_series` returns them.
    **options
        Options of :func:`scanfab.compute`. Used are those that choose frames, the boundary, the
        rule for rattlers, contacts by geometry, and the RV.

    Yields
    ------
    Row
        One for each chosen frame. Its attributes are the columns of ``scanfab inspect --json``,
        among them ``grains``, ``contacts``, ``rattlers``, ``cell`` and ``warnings``, and the box
        around the grains. Lengths are in the dump's unit.

    Raises
    ------
    ScanfabError
        If an option has a value that cannot be used, a frame cannot be read, or no frame has
        boundary particles although they are named.
    TypeError
        If there is no such option; the message suggests the most similar name.

    Examples
    --------
    >>> import scanfab
    >>> series = scanfab.read_series("sample_data/yade_triaxial/triaxial-spheres-*.vtk.gz")
    >>> for frame in scanfab.inspect(series, boundary="mask=3", frames="-2:"):
    ...     print(frame.step, frame.grains, frame.boundary, frame.contacts, frame.rattlers)
    5 800 1000 2179 88
    6 800 1000 2167 95
    """
    if not isinstance(series, Series):
        raise unusable("inspect", "a Series, as scanfab.read_series returns it", series)
    return inspect_series(series, Settings(**options))


def inspect_series(series: Series, settings: Settings) -> Iterator[Row]:
    """
    Read the chosen frames and report what is in them.

    Parameters
    ----------
    series : Series
        The frames.
    settings : Settings
        Only ``boundary``, ``frames``, ``min_contacts``, ``rattlers``, ``min_force``,
        ``contact_tolerance`` and the options of the RV are used.

    Raises
    ------
    ScanfabError
        If a frame cannot be read, or no frame has boundary particles although they are named.
    """
    # the RV is reported whatever the variants
    frames, any_chosen = Frames(series, replace(settings, variants="c")), False
    window: Window | None = None
    if settings.reference is not None:
        window = _rv(frames, frames.reference()[2])
    for number, frame in enumerate(series.whole):
        is_chosen = number in frames.chosen
        any_chosen |= is_chosen
        # a frame before the chosen ones is read only for the RV, so it may be damaged
        with nullcontext() if is_chosen else suppress(PackingError, ReadError):
            if is_chosen or window is None:
                sample, doubts = _read(frames, frame)
                window = window or _rv(frames, sample)
        if is_chosen:
            yield _report(series.name, number, frame, sample, doubts, window)
        if number >= frames.chosen.stop - 1:
            break
    if not any_chosen:
        raise frames.no_such_frames()


def _read(frames: Frames, frame: Frame) -> tuple[Sample, list[str]]:
    """Read a frame and collect doubts about it."""
    rules = frames.settings.boundary
    with collected() as told:
        sample = sample_of(frame, frames.settings)
    told = [*told, *doubts_of_frame(frame, sample, frames.settings)]
    tell(one for one in told if one.kind is ScanfabNote)
    doubts = [one.text for one in told if one.kind is not ScanfabNote]
    if rules and len(sample.packing) and not sample.boundary.any():
        doubts.insert(0, f"`boundary`: no particle has {spelt_rules(rules, sample.packing)}")
    return sample, doubts


def _rv(frames: Frames, sample: Sample) -> Window | None:
    """The largest RV from a frame with grains, else None; also warns about the boundary."""
    if not sample.grains.any():
        return None
    tell(frames.check_boundary(sample))
    return rvs_of(frames.settings.in_space(sample.packing.space), sample)[-1].window


def _report(
    source: str, number: int, frame: Frame, sample: Sample, doubts: list[str], window: Window | None
) -> Row:
    packing, grains, cell = sample.packing, sample.grains, sample.packing.cell
    radius = packing.radius[grains]
    box = SurfaceBox.of(packing, sample.gathered) if grains.any() else None
    in_rv = None if window is None else sample.number(sample.counted(VARIANTS["c"], window))
    found = {
        "source": source,
        "frame": number,
        "step": packing.step,
        "time": packing.time,
        "format": frame.reader.name,
        "grains": sample.number(grains),
        "boundary": sample.number(sample.boundary),
        "radius_min": float(radius.min()) if radius.size else None,
        "radius_max": float(radius.max()) if radius.size else None,
        "contacts": len(sample.contacts),
        "contacts_from": sample.contacts.source,
        "rattlers": sample.number(sample.rattlers),
        "coordination": sample.coordination(VARIANTS["a"], None),
        "cell": None if cell is None else cell.vectors.tolist(),
        "periodic": None if cell is None else list(cell.periodic),
        "columns": ["id", "x", "y", "z", "radius", *packing.columns],
        "warnings": doubts,
        "low": None if box is None else box.low.tolist(),
        "high": None if box is None else box.high.tolist(),
        "rv_center": None if window is None else window.center.tolist(),
        "rv_radius": None if window is None else window.radius,
        "rv_shape": None if window is None else str(window.shape),
        "clumps": sample.clumps,
        "spheres": int(grains.sum()),
        "grains_in_rv": in_rv,
    }
    return row_of(REPORT_COLUMNS, found)
