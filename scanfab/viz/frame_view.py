"""One frame of a series to be looked at: read, told apart, and with the RV of the series."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

from scanfab.base.errors import (
    Note,
    PackingError,
    ReadError,
    SettingsError,
    tell,
)
from scanfab.io.series import Series
from scanfab.packing.sample import Sample
from scanfab.pipeline.frames import Frames
from scanfab.pipeline.plan import Plan, make_plan
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.strain import Strains, shear_strain
from scanfab.pipeline.values import Vector
from scanfab.pipeline.window_settings import settings_in
from scanfab.table.curves import SAME, frame_strain_column
from scanfab.viz.scene import Scene, about_window, scene_of


@dataclass(frozen=True, eq=False)
class Look:
    """What there is to see and to say of one frame."""

    scene: Scene
    number: int
    """Of the frame, counted from 0."""
    sample: Sample
    strains: dict[str, float | None]
    """Axial and shear strain since the first frame that has grains, by the names of their columns
    in the fabric table; None where that is not known."""
    first: Sample | None
    """The first frame that has grains, which fixes all lengths of the series."""
    plan: Plan | None
    """None if the settings do not fit the series."""
    strain_column: str | None
    """Which of the strains tells the frames of the series apart."""
    axis: Vector
    """Loading axis, a unit vector."""


def look_at(series: Series, settings: Settings, number: int = 0) -> Look:
    """
    One frame to be looked at; nothing is scanned.

    Parameters
    ----------
    series : Series
        The frames.
    settings : Settings
        Boundary, rattlers, RV, cut-off, axis and strain count.
    number : int, optional
        Which frame; negative from the end.

    Raises
    ------
    ScanfabError
        If there is no such frame, or it cannot be read.
    """
    # of damaged frames only the one asked for counts
    frames = Frames(series, replace(settings, on_error="skip"))
    frame = series[number]
    number = frame.number
    sample = frames.read(frame)
    tell(frames.notes(frame, sample))
    found = frames.first()
    first = None if found is None else found[2]
    if first is not None:
        settings = _in_space(settings, first)
    plan = None if first is None else _plan(first, settings)
    if plan is not None and sample.grains.any():
        plan = plan.in_frame(sample)
    scene = scene_of(sample, *(() if plan is None else plan.windows))
    if plan is not None:
        scene = about_window(replace(scene, cutoff=plan.cutoff))
    strains = _strains(number, sample, first, settings)
    column = _strain_column(frames, strains, first, settings)
    return Look(scene, number, sample, strains, first, plan, column, settings.axis)


def _in_space(settings: Settings, first: Sample) -> Settings:
    """As the plan has them; what makes it impossible is told where the plan is made."""
    with suppress(SettingsError):
        return settings_in(settings, first.packing.space)
    return settings


def _plan(first: Sample, settings: Settings) -> Plan | None:
    """The plan of the series; None, with a warning, if it cannot be made."""
    try:
        # of a strain that cannot be had the view says nothing, if the RV does not follow it
        strain = settings.strain if settings.rv_follows == "strain" else "auto"
        plan = make_plan(replace(settings, strain=strain), first)
    except SettingsError as error:
        tell([Note("no_rv", f"the RV is not shown: {error}")])
        return None
    tell(plan.notes)
    return plan


def _strains(
    number: int, sample: Sample, first: Sample | None, settings: Settings
) -> dict[str, float | None]:
    axial, shear = _axial(number, sample, first, settings), None
    if first is not None and sample.grains.any():
        shear = shear_strain(sample.packing.cell, first.packing.cell)
    return {"strain": axial, "shear_strain": shear}


def _strain_column(
    frames: Frames, strains: dict[str, float | None], first: Sample | None, settings: Settings
) -> str | None:
    """That of the frame; where no strain has begun, that of the last frame that can be read."""
    has_begun = any(value is None or abs(value) >= SAME for value in strains.values())
    for number, frame in reversed([] if has_begun else list(frames)):
        with suppress(PackingError, ReadError):
            last = frames.read(frame)
            return frame_strain_column(_strains(number, last, first, settings))
    return frame_strain_column(strains)


def _axial(number: int, sample: Sample, first: Sample | None, settings: Settings) -> float | None:
    """Axial strain as the fabric table has it; None also where it cannot be had."""
    strains = Strains.of(settings)
    with suppress(SettingsError):
        if first is not None:
            strains = strains.since(first)
        return strains.at(number, sample)["strain"]
    return None
