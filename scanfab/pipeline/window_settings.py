"""What settings mean for discs in a plane, of which nothing is known before a frame is read."""

from __future__ import annotations

import math
from dataclasses import replace

from scanfab.base.errors import DimensionError
from scanfab.base.space import Space
from scanfab.base.spelling import spelt_place
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import AXES, Axis, UsualAxis, as_written
from scanfab.scan.directions import DirectionRule, rule_of

# the largest component of a unit vector that counts as 0
ROUNDING = 1e-9


def settings_in(settings: Settings, space: Space) -> Settings:
    """
    The settings for a series whose grains lie in a space; for spheres they stay as they are.

    Parameters
    ----------
    settings : Settings
        As users made them, or as this function has returned them.
    space : Space
        That of the first frame that has grains.

    Raises
    ------
    DimensionError
        If they are of three dimensions and the grains are discs, or the other way round.
    """
    settings.check_sizes(space.dimension)
    if not space.is_plane:
        return settings
    if settings.rv_shape not in ("sphere", "box", "ellipsoid"):
        raise DimensionError(
            f"rv_shape: {settings.rv_shape} is no window of discs in {space}: choose sphere (the "
            f"circle), box or ellipsoid (the ellipse)"
        )
    return replace(settings, axis=_axis(settings.axis, space), directions=_rule(settings, space))


def _axis(axis: Axis, space: Space) -> Axis:
    """The loading axis in a plane; where none was given, the second axis of the plane."""
    assert space.across is not None
    if isinstance(axis, UsualAxis):
        return AXES["xyz"[max(space.along)]]
    if abs(axis[space.across]) > ROUNDING:
        first, second = ("xyz"[k] for k in sorted(space.along))
        named = as_written(axis)
        asked = named if isinstance(named, str) else spelt_place(axis)
        raise DimensionError(
            f"axis: the axis {asked} leads out of {space}, in which all discs "
            f"lie: choose {first}, {second}, or another axis in the plane"
        )
    if axis[space.across] == 0.0:
        return axis
    flat = [0.0 if k == space.across else part for k, part in enumerate(axis)]
    return Axis(*(part / math.hypot(*flat) for part in flat))


def _rule(settings: Settings, space: Space) -> DirectionRule | None:
    """So many equal steps as a number asks for; None for ``auto``."""
    rule = settings.directions
    if rule is None or rule.space == space:
        return rule
    if rule.asked is None:
        raise DimensionError(
            f"directions: {rule.name} is a rule of three dimensions, but all discs lie in {space}: "
            f"choose a number of axes, such as 16"
        )
    return rule_of(rule.asked, space)
