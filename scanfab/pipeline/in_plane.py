"""What settings mean for discs in a plane: their axis, directions and RV are those of the plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.space import Space
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import Axis, UsualAxis
from scanfab.pipeline.window_settings import check_sizes
from scanfab.scan.directions import DirectionRule, rule_of

__all__ = ["settings_in"]

# of a unit vector: what rounding leaves of a component that is 0
ROUNDING = 1e-9


def settings_in(settings: Settings, space: Space) -> Settings:
    """
    The settings for a series whose grains lie in a space; those of all space are what they are.

    Parameters
    ----------
    settings : Settings
        As users made them, or as this function has returned them.
    space : Space
        That of the first frame that has grains.

    Raises
    ------
    SettingsError
        If they are of three dimensions and the grains are discs, or the other way round.
    """
    check_sizes(settings, space.dimension)
    if not space.is_plane:
        return settings
    shape = settings.rv_shape
    if shape not in ("sphere", "box", "ellipsoid"):
        what = "is no window of" if shape == "cylinder" else "is a surface in space, no window of"
        raise SettingsError(
            f"rv_shape: {shape} {what} discs in {space}: choose sphere (the circle), box or "
            f"ellipsoid (the ellipse)"
        )
    return replace(settings, axis=_axis(settings.axis, space), directions=_rule(settings, space))


def _axis(axis: Axis, space: Space) -> Axis:
    """Where none was given, the plane's second axis."""
    assert space.across is not None
    if isinstance(axis, UsualAxis):
        return Axis(*np.eye(3)[max(space.along)])
    if abs(axis[space.across]) > ROUNDING:
        first, second = ("xyz"[k] for k in sorted(space.along))
        raise SettingsError(
            f"axis: the axis {axis.spelt} leads out of {space}, in which all discs lie: choose "
            f"{first}, {second}, or another axis in the plane"
        )
    flat = np.where(np.arange(3) == space.across, 0.0, axis)
    return axis if axis[space.across] == 0.0 else Axis(*(flat / np.linalg.norm(flat)))


def _rule(settings: Settings, space: Space) -> DirectionRule | None:
    """So many equal steps as a number asks for; None for ``auto``."""
    rule = settings.directions
    if rule is None or rule.space == space:
        return rule
    if rule.asked is None:
        raise SettingsError(
            f"directions: {rule.name} is a rule of three dimensions, but all discs lie in {space}: "
            f"choose a number of axes, such as 16"
        )
    return rule_of(rule.asked, space)
