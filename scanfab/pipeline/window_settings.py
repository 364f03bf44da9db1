"""
What users say of the RV: its options, declared once, and whether they go together.

And what settings mean for discs in a plane, of which nothing is known before a frame is read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scanfab.base.errors import DimensionError, SettingsError
from scanfab.base.option import number, one_of, option, optional, unusable
from scanfab.pipeline.values import (
    AXES,
    STRAIN_MODES,
    Axis,
    UsualAxis,
    Vector,
    parse_axis,
    parse_vector,
    words_of,
)
from scanfab.scan.edges import CLIP, EDGES

if TYPE_CHECKING:
    from scanfab.base.space import Space
    from scanfab.pipeline.settings import Settings
    from scanfab.scan.directions import DirectionRule


# of a unit vector: what rounding leaves of a component that is 0
ROUNDING = 1e-9
# of windows, with the sizes that each takes
SHAPES = {
    "sphere": "",
    "box": "A,B,C, full edges",
    "cylinder": "R,H, radius and height",
    "ellipsoid": "A,B,C, semi-axes",
}


def parse_fractions(name: str, value: Any) -> float | tuple[float, ...]:
    """
    Sizes of RVs: one as a number; several, each once, in ascending order.

    Examples
    --------
    >>> from scanfab.pipeline.window_settings import parse_fractions
    >>> parse_fractions("rv", "0.7"), parse_fractions("rv", "0.7,0.4")
    (0.7, (0.4, 0.7))
    """
    try:
        several = isinstance(value, str | tuple | list)
        found = sorted(map(float, words_of(value))) if several else [float(value)]
    except (TypeError, ValueError):
        found = []
    if not found or not all(0 < one < math.inf for one in found):
        raise unusable(name, "a fraction above 0, or several such as 0.4,0.5,0.6", value)
    if len(set(found)) < len(found):
        raise unusable(name, "fractions that differ", value)
    return found[0] if len(found) == 1 else tuple(found)


def parse_sizes(name: str, values: Any) -> tuple[float, ...]:
    """Two or three lengths above 0, in a text between commas or blanks; none if not given."""
    if values is None or (isinstance(values, tuple | list) and not values):
        return ()
    try:
        sizes = tuple(map(float, words_of(values)))
    except (TypeError, ValueError):
        sizes = ()
    if not all(0 < size < math.inf for size in sizes) or not 2 <= len(sizes) <= 3:
        raise unusable(name, "two or three lengths above 0, such as 2,3,4", values)
    return sizes


def parse_shape(name: str, value: Any) -> str:
    """The shape of a window: a word, or a file with its surface that exists."""
    if str(value) in SHAPES:
        return str(value)
    from scanfab.io.surface import SUFFIXES

    path = Path(value)
    if path.suffix.lower() not in SUFFIXES or not path.is_file():
        words = f"{', '.join(SHAPES)} or a closed convex surface that exists ({' '.join(SUFFIXES)})"
        raise unusable(name, words, str(value))
    return str(value)


@dataclass(frozen=True, init=False)
class WindowSettings:
    """The options of the RV, of which settings are made; see :class:`Settings`."""

    rv: float | tuple[float, ...] = option(
        default=0.7,
        parse=parse_fractions,
        group="window",
        help="Size of the RV: radius of the sphere as a fraction of half the smallest extent of "
        "the grains; sizes of other shapes, of half the extents. Several: a row for each, from "
        "the same lines.",
        meaning="radius of the RV over half the smallest extent of the grains; of other shapes "
        "their sizes over half the extents",
        takes="float, str or sequence of float",
        metavar="FRACTION[,FRACTION...]",
        first=True,
    )
    """Several in ascending order."""
    rv_radius: float | None = option(
        parse=optional(number("a length above 0", lambda value: 0 < value < math.inf)),
        group="window",
        help="Radius of the sphere RV in the dump's units, instead of `rv`.",
        meaning="radius of the RV instead, dump's unit",
        takes="float",
        kind=float,
        metavar="L",
    )
    rv_center: Vector | None = option(
        parse=optional(parse_vector),
        group="window",
        help="Centre of the RV (default: middle).",
        meaning="centre of the RV, dump's unit; not given: the middle of the sample",
        takes="str or three floats",
        metavar="X Y Z",
    )
    rv_shape: str = option(
        default="sphere",
        parse=parse_shape,
        group="window",
        help="Shape of the RV; FILE is a closed convex surface in the dump's units (.stl .vtp .ply "
        ".obj).",
        meaning="shape of the RV: sphere, box, cylinder, ellipsoid, or the file of its surface",
        takes="str or path",
        metavar="sphere|box|cylinder|ellipsoid|FILE",
        choices=lambda: SHAPES,
        files=True,
    )
    rv_size: tuple[float, ...] = option(
        parse=parse_sizes,
        group="window",
        help="In the dump's units, instead of `rv`: edges of the box, radius and height of the "
        "cylinder, semi-axes of the ellipsoid; of discs two.",
        meaning="edges of the box, radius and height of the cylinder or semi-axes of the ellipsoid "
        "instead, dump's unit",
        takes="str or sequence of float",
        metavar="A,B,C",
    )
    """None given: empty."""
    rv_axis: Axis | None = option(
        parse=optional(lambda name, value: parse_axis(value, name)),
        group="window",
        help="Axis of the cylinder (default: `axis`).",
        meaning="axis of the cylinder; not given: the loading axis",
        takes="str or three floats",
        metavar="x|y|z|X,Y,Z",
        choices=lambda: AXES,
    )
    rv_follows: str = option(
        default="none",
        parse=one_of("none", "strain"),
        group="window",
        help="The RV keeps its shape, or deforms with what `strain` is measured by: with the cell, "
        "or by the extents of boundary or grains along x, y, z.",
        meaning="none: the RV keeps its shape; strain: it deforms with the sample",
        metavar="none|strain",
        choices=lambda: ("none", "strain"),
    )
    edge: str = option(
        default=CLIP,
        parse=one_of(*EDGES),
        group="window",
        help="What counts at the surface of the RV: clip cuts the void segments there; start takes "
        "their full length if they begin or end inside, ends their ends inside.",
        meaning="clip: void segments are cut at the RV's surface; start: those that begin or end "
        "in it count with their full length; ends: by their ends in it, in the whole, too",
        metavar="|".join(EDGES),
        choices=lambda: EDGES,
    )

    @property
    def rvs(self) -> tuple[float, ...]:
        """The sizes of the RVs, one or several."""
        return self.rv if isinstance(self.rv, tuple) else (self.rv,)


def check_window(chosen: Settings) -> None:
    """SettingsError if what is said of the RV does not go together."""
    shape, sizes = chosen.rv_shape, chosen.rv_size
    takes = SHAPES.get(shape, "")
    if len(chosen.rvs) > 1:
        _check_several(chosen)
    if sizes and not takes:
        hint = "choose `rv_radius`" if shape == "sphere" else "its file says how large it is"
        raise SettingsError(f"rv_size: the shape {shape} takes none: {hint}")
    if shape == "cylinder":
        check_sizes(chosen, 3)
    if chosen.rv_radius is not None and shape != "sphere":
        hint = f"choose `rv_size` ({takes})" if takes else "its file says how large it is"
        raise SettingsError(f"rv_radius: is that of a sphere, but `rv_shape` is {shape}: {hint}")
    if chosen.rv_axis is not None and shape != "cylinder":
        raise SettingsError(
            f"rv_axis: is that of a cylinder, but `rv_shape` is {shape}: leave it out, or "
            f'choose `rv_shape="cylinder"`'
        )
    if chosen.rv_follows == "strain" and chosen.strain not in STRAIN_MODES:
        raise SettingsError(
            f"rv_follows: a file of strains ({chosen.strain}) does not say how the sample "
            f"deforms along all axes: choose another `strain`, or leave out `rv_follows`"
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


def _check_several(chosen: Settings) -> None:
    """SettingsError if what is said of the RV holds for one size alone."""
    of_file = chosen.rv_shape not in SHAPES
    for name, is_given in (
        ("rv_radius", chosen.rv_radius is not None),
        ("rv_size", bool(chosen.rv_size)),
        ("rv_shape", of_file),
    ):
        if is_given:
            what = "the file of a surface has" if name == "rv_shape" else "it gives the RV"
            raise SettingsError(
                f"{name}: {what} one size, but `rv` asks for {len(chosen.rvs)}: leave out one of "
                f"the two"
            )


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
    DimensionError
        If they are of three dimensions and the grains are discs, or the other way round.
    """
    check_sizes(settings, space.dimension)
    if not space.is_plane:
        return settings
    shape = settings.rv_shape
    if shape not in ("sphere", "box", "ellipsoid"):
        what = "is no window of" if shape == "cylinder" else "is a surface in space, no window of"
        raise DimensionError(
            f"rv_shape: {shape} {what} discs in {space}: choose sphere (the circle), box or "
            f"ellipsoid (the ellipse)"
        )
    return replace(settings, axis=_axis(settings.axis, space), directions=_rule(settings, space))


def _axis(axis: Axis, space: Space) -> Axis:
    """Where none was given, the plane's second axis."""
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
