"""One frame of a series as a scene: read, told apart, and with the RV of the series."""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import islice

from scanfab.errors import ReadError, ScanfabWarning, SettingsError
from scanfab.pipeline import boundary_hint, classify
from scanfab.plan import Plan, make_plan
from scanfab.scene import Scene, scene_of
from scanfab.series import Frame, Series
from scanfab.settings import Settings

__all__ = ["scene_at"]


def scene_at(series: Series, settings: Settings, number: int = 0) -> Scene:
    """
    The scene of one frame; nothing is scanned.

    Parameters
    ----------
    series : Series
        The frames.
    settings : Settings
        Boundary, rattlers, RV and cut-off count.
    number : int, optional
        Which frame; negative from the end.

    Raises
    ------
    ScanfabError
        If there is no such frame, or it cannot be read.
    """
    frame = _frame(series, number)
    sample = classify(frame.read(), settings)
    hint = boundary_hint(sample, settings)
    if hint is not None:
        warnings.warn(hint, ScanfabWarning, stacklevel=2)
    plan = _plan(series, settings)
    scene = scene_of(sample, None if plan is None else plan.window)
    return scene if plan is None else replace(scene, cutoff=plan.cutoff)


def _frame(series: Series, number: int) -> Frame:
    if number >= 0:
        found = next(islice(series, number, None), None)
    else:
        frames = list(series)
        found = frames[number] if -number <= len(frames) else None
    if found is None:
        count = sum(1 for _ in series)
        raise ReadError(f"{series.name}: has {count} frames, there is no frame {number}")
    return found


def _plan(series: Series, settings: Settings) -> Plan | None:
    """The plan of the series; None, with a warning, if it cannot be made."""
    for frame in series:
        try:
            sample = classify(frame.read(), settings)
        except ReadError:
            continue
        if sample.grains.any():
            try:
                return make_plan(settings, sample)
            except SettingsError as error:
                warnings.warn(f"the RV is not shown: {error}", ScanfabWarning, stacklevel=3)
                return None
    return None
