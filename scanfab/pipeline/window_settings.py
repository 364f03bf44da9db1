"""What settings mean for discs in a plane; only a frame tells whether the grains are discs."""

from __future__ import annotations

import math
from dataclasses import replace

from scanfab.base.errors import DimensionError
from scanfab.base.space import Space
from scanfab.base.spelling import spelt_place
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import AXES, Axis, UsualAxis, as_written
from scanfab.scan.directions import DirectionRule, rule_of

# a component of a unit vector up to this counts as 0
ROUNDING = 1e-9


def settings_in(settings: Settings, space: Space) -> Settings:
    """
    Adapt settings to discs in a plane; settings for spheres do not change.

    Parameters
    ----------
    settings : Settings
        Settings as users made them, or as this function returned them.
    space : Space
        Space of the first frame that has grains.

    Raises
    ------
    DimensionError
        If the settings are for spheres and the grains are discs, or the other way round.
    """
    settings.check_sizes(space.dimension)
    if not space.is_plane:
        return settings
    if settings.rv_shape not in ("sphere", "box", "ellipsoid"):
        raise DimensionError(
            f"rv_shape: {settings.rv_shape} is no window for discs in {space}: choose sphere "
            f"(a circle), box (a rectangle) or ellipsoid (an ellipse)"
        )
    return replace(settings, axis=_axis(settings.axis, space), directions=_rule(settings, space))


def _axis(axis: Axis, space: Space) -> Axis:
    """The loading axis in a plane; the default is the second axis of the plane."""
    assert space.across is not None
    if isinstance(axis, UsualAxis):
        return AXES["xyz"[max(space.along)]]
    if abs(axis[space.across]) > ROUNDING:
        first, second = ("xyz"[k] for k in sorted(space.along))
        named = as_written(axis)
        spelt = named if isinstance(named, str) else spelt_place(axis)
        raise DimensionError(
            f"axis: the axis {spelt} leads out of {space} of the discs: choose {first}, {second}, "
            f"or another axis in the plane"
        )
    if axis[space.across] == 0.0:
        return axis
    flat = [0.0 if k == space.across else part for k, part in enumerate(axis)]
    return Axis(*(part / math.hypot(*flat) for part in flat))


def _rule(settings: Settings, space: Space) -> DirectionRule | None:
    """The direction rule in a plane: equal angles, as many as asked for; None for ``auto``."""
    rule = settings.directions
    if rule is None or rule.space == space:
        return rule
    if rule.asked is None:
        raise DimensionError(
            f"directions: {rule.name} is a rule for three dimensions, but all discs lie in "
            f"{space}: choose a number of axes, such as 16"
        )
    return rule_of(rule.asked, space)
