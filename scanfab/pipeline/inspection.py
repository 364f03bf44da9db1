"""Inspect a series: what a reader finds in each frame, without computing a fabric."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from scanfab.base.column import LENGTH, Column
from scanfab.base.errors import Note, ScanfabNote, collected, tell
from scanfab.base.option import unusable
from scanfab.io.frame import Frame
from scanfab.io.series import Series
from scanfab.packing.boundary import spelt_rules
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import SurfaceBox, Window
from scanfab.pipeline.frames import Frames, doubts_of_frame
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
    frames = Frames(series, replace(settings, variants="c"))
    with collected() as told_before:
        reference, window = _reference(frames)
    for number, frame in frames.due():
        with collected() as told:
            sample = frames.sample(number, frame)
        if sample is not None and isinstance(frame, Frame):
            told = told_before if number == reference else told
            doubts = _doubts(frames.settings, frame, sample, told)
            yield _report(series.name, number, frame, sample, doubts, window)


def _reference(frames: Frames) -> tuple[int, Window | None]:
    """The number of the reference frame, and its largest RV; -1 and None without grains."""
    found = frames.reference()
    if found is None:
        return -1, None
    number, _, sample = found
    return number, rvs_of(frames.settings.in_space(sample.packing.space), sample)[-1].window


def _doubts(settings: Settings, frame: Frame, sample: Sample, told: Iterable[Note]) -> list[str]:
    """Doubts about a frame; what is only a note is told."""
    found = [*told, *doubts_of_frame(frame, sample, settings)]
    tell(one for one in found if one.kind is ScanfabNote)
    doubts = [one.text for one in found if one.kind is not ScanfabNote]
    if settings.boundary and len(sample.packing) and not sample.boundary.any():
        named = spelt_rules(settings.boundary, sample.packing)
        doubts.insert(0, f"`boundary`: no particle has {named}")
    return doubts


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
