"""
Which settings go together, and what they mean for discs in a plane.

Of the plane nothing is known before a frame is read.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from scanfab.base.errors import DimensionError, SettingsError
from scanfab.pipeline.values import AXES, SHAPES, STRAIN_MODES, Axis, UsualAxis
from scanfab.scan.edges import ENDS

if TYPE_CHECKING:
    from scanfab.base.space import Space
    from scanfab.pipeline.settings import Settings
    from scanfab.scan.directions import DirectionRule


# of a unit vector: what rounding leaves of a component that is 0
ROUNDING = 1e-9


def check_together(chosen: Settings) -> None:
    """SettingsError if settings do not go together."""
    for problem in _clashes(chosen):
        raise SettingsError(problem)
    if chosen.rv_shape == "cylinder":
        check_sizes(chosen, 3)


def _clashes(chosen: Settings) -> Iterator[str]:
    """What does not go together, each with what to do."""
    shape, takes = chosen.rv_shape, SHAPES.get(chosen.rv_shape, "")
    given = {"rv_radius": chosen.rv_radius, "rv_size": chosen.rv_size}
    for name, one in {**given, "rv_shape": shape not in SHAPES}.items():
        if one and len(chosen.rvs) > 1:
            several = f"`rv` asks for {len(chosen.rvs)}"
            yield f"{name}: gives the RV one size, but {several}: leave out one of the two"
    instead = "choose `rv_radius`" if shape == "sphere" else "its file says how large it is"
    if chosen.rv_size and not takes:
        yield f"rv_size: the shape {shape} takes none: {instead}"
    instead = f"choose `rv_size` ({takes})" if takes else instead
    if chosen.rv_radius is not None and shape != "sphere":
        yield f"rv_radius: is that of a sphere, but `rv_shape` is {shape}: {instead}"
    if chosen.rv_axis is not None and shape != "cylinder":
        instead = 'leave it out, or choose `rv_shape="cylinder"`'
        yield f"rv_axis: is that of a cylinder, but `rv_shape` is {shape}: {instead}"
    if chosen.rv_follows == "strain" and chosen.strain not in STRAIN_MODES:
        yield (
            f"rv_follows: a file of strains ({chosen.strain}) does not say how the sample deforms "
            f"along all axes: choose another `strain`, or leave out `rv_follows`"
        )
    if chosen.edge == ENDS and chosen.moment != 1:
        yield (
            "moment: `edge=ends` counts only what lies inside the window, which does not give the "
            "second moment of the full lengths: choose `edge=start`, or `moment=1`"
        )
    if chosen.min_force and chosen.rattlers != "force":
        yield (
            f'min_force: is that of the rule `rattlers="force"`, but `rattlers` is '
            f"{chosen.rattlers}: choose that rule, or leave out `min_force`"
        )


def check_sizes(chosen: Settings, dimension: int) -> None:
    """DimensionError if the RV has too many sizes, or too few."""
    shape, sizes = chosen.rv_shape, chosen.rv_size
    if not sizes or shape not in SHAPES:
        return
    takes = SHAPES[shape]
    if len(sizes) != (2 if shape == "cylinder" else dimension):
        found = ",".join(f"{size:g}" for size in sizes)
        if dimension == 2:
            takes = f"two, {takes.replace(',C', '')}, in the plane of the discs"
        raise DimensionError(f"rv_size: expected {takes} (`rv_shape` is {shape}), found {found}")


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
    check_sizes(settings, space.dimension)
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
        raise DimensionError(
            f"axis: the axis {axis.spelt} leads out of {space}, in which all discs lie: choose "
            f"{first}, {second}, or another axis in the plane"
        )
    if axis[space.across] == 0.0:
        return axis
    flat = [0.0 if k == space.across else part for k, part in enumerate(axis)]
    return Axis(*(part / math.hypot(*flat) for part in flat))


def _rule(settings: Settings, space: Space) -> DirectionRule | None:
    """So many equal steps as a number asks for; None for ``auto``."""
    # its module needs numpy, for which the help of a command does not wait
    from scanfab.scan.directions import rule_of

    rule = settings.directions
    if rule is None or rule.space == space:
        return rule
    if rule.asked is None:
        raise DimensionError(
            f"directions: {rule.name} is a rule of three dimensions, but all discs lie in {space}: "
            f"choose a number of axes, such as 16"
        )
    return rule_of(rule.asked, space)
