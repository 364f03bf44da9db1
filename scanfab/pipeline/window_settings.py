"""
Which settings go together, and what they mean for discs in a plane.

Of the plane nothing is known before a frame is read.
"""

from __future__ import annotations

import math
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
    shape, sizes = chosen.rv_shape, SHAPES.get(chosen.rv_shape, "")
    of_file = "its file says how large it is"
    one_size = (
        f"`rv` asks for {len(chosen.rvs)} sizes, and this gives one: leave out one of the two"
    )
    are_several = len(chosen.rvs) > 1
    rules = (
        ("rv_radius", are_several and chosen.rv_radius is not None, one_size),
        ("rv_size", are_several and chosen.rv_size, one_size),
        ("rv_shape", are_several and shape not in SHAPES, one_size),
        (
            "rv_size",
            chosen.rv_size and not sizes,
            f"the shape {shape} takes none: "
            + ("choose `rv_radius`" if shape == "sphere" else of_file),
        ),
        (
            "rv_radius",
            chosen.rv_radius is not None and shape != "sphere",
            f"is that of a sphere, but `rv_shape` is {shape}: "
            + (f"choose `rv_size` ({sizes})" if sizes else of_file),
        ),
        (
            "rv_axis",
            chosen.rv_axis is not None and shape != "cylinder",
            f"is that of a cylinder, but `rv_shape` is {shape}: leave it out, or choose "
            f'`rv_shape="cylinder"`',
        ),
        (
            "rv_follows",
            chosen.rv_follows == "strain" and chosen.strain not in STRAIN_MODES,
            f"a file of strains ({chosen.strain}) does not say how the sample deforms along all "
            f"axes: choose another `strain`, or leave out `rv_follows`",
        ),
        (
            "moment",
            chosen.edge == ENDS and chosen.moment != 1,
            "from what lies inside the window alone, as `edge=ends` takes it, the second moment of "
            "the full lengths is not known: choose `edge=start`, or `moment=1`",
        ),
        (
            "min_force",
            chosen.min_force and chosen.rattlers != "force",
            f'is that of the rule `rattlers="force"`, but `rattlers` is {chosen.rattlers}: choose '
            f"that rule, or leave out `min_force`",
        ),
    )
    for name, is_wrong, words in rules:
        if is_wrong:
            raise SettingsError(f"{name}: {words}")
    if shape == "cylinder":
        check_sizes(chosen, 3)


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
