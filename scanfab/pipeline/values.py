"""Parsers of option values: from what users write to what it means."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from scanfab.base.errors import SettingsError
from scanfab.base.option import number, numbers, one_of, optional, unusable, whole
from scanfab.base.spelling import shortest
from scanfab.io.surface import SUFFIXES
from scanfab.packing.boundary import BoundaryRule
from scanfab.packing.rattlers import installed_rules
from scanfab.scan.directions import DirectionRule, direction_rule

Vector = tuple[float, float, float]
UNITS = ("rmin", "rmean", "rmax")
STRAIN_MODES = ("auto", "cell", "boundary", "grains")
MOST_CUTOFFS = 1000
# groups of further columns, in the order of the table
GROUP_NAMES = ("invariants", "state", "forces", "harmonics")
# shapes of windows, each with the sizes that it takes
SHAPES = {
    "sphere": "",
    "box": "A,B,C, full edges",
    "cylinder": "R,H, radius and height",
    "ellipsoid": "A,B,C, semi-axes",
}

# parsers for which auto is no value
or_auto = partial(optional, word="auto")
parse_radius = optional(number("a length above 0", lambda value: 0 < value < math.inf))
parse_share = number("0 or more", lambda value: 0 <= value < math.inf)
parse_work = optional(number("a number of at least 1", lambda value: value >= 1))
parse_count = whole("0 or more", lambda value: value >= 0)
parse_moment = whole("1 or 2", lambda moment: moment in (1, 2))
parse_point = optional(numbers("three finite numbers", lambda vector: len(vector) == 3))
parse_sizes = optional(
    numbers(
        "two or three lengths above 0, such as 2,3,4", lambda n: 2 <= len(n) <= 3 and min(n) > 0
    )
)
parse_tolerance = or_auto(
    number("auto, or a number above 0, from 1e-15 to 1e15", lambda value: 1e-15 <= value <= 1e15)
)


class Axis(NamedTuple):
    """A unit vector; :func:`parse_axis` makes it from any three numbers."""

    x: float
    y: float
    z: float


class UsualAxis(Axis):
    """The default loading axis: z, or in a plane its second axis."""

    __slots__ = ()


AXES = {"x": Axis(1.0, 0.0, 0.0), "y": Axis(0.0, 1.0, 0.0), "z": Axis(0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Length:
    """A length in the dump's unit, or relative to a radius of the series' first frame."""

    value: float
    unit: str = ""
    """``rmin``, ``rmean`` or ``rmax``; empty for the dump's unit."""

    def resolve(self, radii: dict[str, float]) -> float:
        """The length in the dump's unit."""
        return self.value * (radii[self.unit] if self.unit else 1.0)


def as_written(value: Any) -> Any:
    """
    The text or numbers that users would write for a value of an option; None for ``auto``.

    Examples
    --------
    >>> from scanfab.pipeline.values import Length, as_written
    >>> as_written(Length(0.5, "rmin")), as_written(slice(2, None))
    ('0.5rmin', '2:')
    """
    if isinstance(value, Length):
        return f"{shortest(value.value)}{value.unit}" if value.unit else value.value
    if isinstance(value, slice):
        parts = [value.start, value.stop, *([] if value.step is None else [value.step])]
        return ":".join("" if part is None else str(part) for part in parts)
    if isinstance(value, UsualAxis):
        return None
    if isinstance(value, Axis):
        return next((name for name, axis in AXES.items() if axis == value), tuple(value))
    if isinstance(value, tuple):
        return [as_written(item) for item in value]
    if isinstance(value, BoundaryRule):
        return value.text
    return value.asked_as if isinstance(value, DirectionRule) else value


def parse_length(name: str, text: str | float | Length) -> Length:
    """
    Parse a length of 0 or more, such as ``0.5``, ``1rmin`` or ``0.2rmean``.

    Examples
    --------
    >>> from scanfab.pipeline.values import parse_length
    >>> parse_length("cutoff", "0.5rmin")
    Length(value=0.5, unit='rmin')
    """
    expected = "a length such as 0.0005 or 1rmin (rmin, rmean, rmax), not negative"
    word = str(as_written(text)).strip()
    unit = next((unit for unit in UNITS if word.endswith(unit)), "")
    parse = number(expected, lambda value: 0 <= value < math.inf)
    return Length(parse(name, word.removesuffix(unit)), unit)


@or_auto
def parse_spacing(name: str, value: Any) -> Length:
    """Parse a length above 0."""
    length = parse_length(name, value)
    if length.value == 0:
        raise unusable(name, "a length above 0, or auto", value)
    return length


def parse_lengths(name: str, text: Any) -> tuple[Length, ...]:
    """
    Parse lengths: ``FROM:TO:STEP`` with both ends, ``L,L,...``, or a sequence.

    Examples
    --------
    >>> from scanfab.pipeline.values import parse_lengths
    >>> [length.value for length in parse_lengths("cutoffs", "0:1rmin:0.5rmin")]
    [0.0, 0.5, 1.0]
    """
    if text is None:
        return ()
    is_range = isinstance(text, str) and ":" in text
    parts = text.split(":" if is_range else ",") if isinstance(text, str) else text
    several = parts if isinstance(parts, Iterable) else [parts]
    lengths = tuple(parse_length(name, part) for part in several)
    if not is_range:
        return lengths
    units = {length.unit for length in lengths if length.value != 0}
    if len(lengths) != 3 or len(units) > 1 or lengths[2].value == 0:
        raise unusable(name, "FROM:TO:STEP of one unit such as 0:3rmin:0.1rmin", text)
    first, last, step = (length.value for length in lengths)
    count = math.floor((last - first) / step + 1e-9) + 1
    if not 1 <= count <= MOST_CUTOFFS:
        raise unusable(name, f"1 to {MOST_CUTOFFS} lengths (these are {count})", text)
    # multiples of the step are exact after rounding; adding steps one by one would not be
    return tuple(Length(float(f"{first + k * step:.12g}"), *units) for k in range(count))


def parse_axis(name: str, text: str | Iterable[float] | None) -> Axis:
    """Parse ``x``, ``y``, ``z`` or three numbers into a unit vector; None gives the default."""
    if text is None:
        return UsualAxis(*AXES["z"])
    if isinstance(text, Axis):
        return text
    if isinstance(text, str) and text in AXES:
        return AXES[text]
    expected = "x, y, z or three numbers X,Y,Z"
    vector = numbers(expected, lambda v: len(v) == 3 and math.hypot(*v) > 0)(name, text)
    # a unit vector stays as it is, so that the axis of a manifest gives the same numbers again
    length = math.hypot(*vector)
    length = 1.0 if math.isclose(length, 1.0, rel_tol=1e-15) else length
    return Axis(*(part / length for part in vector))


# axis of a cylinder; None stands for the loading axis
parse_rv_axis = optional(parse_axis)


def parse_fractions(name: str, value: Any) -> float | tuple[float, ...]:
    """
    Parse sizes of RVs: one becomes a number, several a tuple in ascending order.

    Examples
    --------
    >>> from scanfab.pipeline.values import parse_fractions
    >>> parse_fractions("rv", "0.7"), parse_fractions("rv", "0.7,0.4")
    (0.7, (0.4, 0.7))
    """
    expected = "a fraction above 0, or several such as 0.4,0.5,0.6"
    parse = numbers(expected, lambda sizes: len(sizes) > 0 and min(sizes) > 0)
    fractions = sorted(parse(name, value))
    if len(set(fractions)) < len(fractions):
        raise unusable(name, "fractions that differ", value)
    return fractions[0] if len(fractions) == 1 else tuple(fractions)


def parse_shape(name: str, value: Any) -> str:
    """Parse the shape of a window: a word, or an existing file with a surface."""
    text = str(value)
    if text not in SHAPES and not (text.lower().endswith(SUFFIXES) and Path(text).is_file()):
        words = f"{', '.join(SHAPES)} or a closed convex surface that exists ({' '.join(SUFFIXES)})"
        raise unusable(name, words, text)
    return text


def parse_variants(name: str, letters: object) -> str:
    """Parse letters out of abcd; each is kept once, in alphabetical order."""
    if not isinstance(letters, str) or not letters or not set(letters) <= set("abcd"):
        raise unusable(name, "letters out of abcd", letters)
    return "".join(variant for variant in "abcd" if variant in letters)


def parse_groups(name: str, groups: Any) -> tuple[str, ...]:
    """Parse groups of columns, a text with commas or blanks, into the order of the table."""
    groups = groups.replace(",", " ").split() if isinstance(groups, str) else groups
    words = tuple(groups) if isinstance(groups, Iterable) else () if groups is None else (groups,)
    if unknown := [word for word in words if word not in GROUP_NAMES]:
        raise unusable(name, f"groups of columns out of {', '.join(GROUP_NAMES)}", unknown[0])
    return tuple(group for group in GROUP_NAMES if group in words)


def parse_boundary(name: str, rules: Any) -> tuple[BoundaryRule, ...]:
    """Parse boundary rules from one or several expressions."""
    several = rules if isinstance(rules, tuple | list) else [rules]
    return tuple(
        rule if isinstance(rule, BoundaryRule) else BoundaryRule.parse(str(rule))
        for rule in several
    )


@or_auto
def parse_directions(name: str, value: Any) -> DirectionRule:
    """Parse a direction rule, whose axes must not lie in one plane."""
    rule = value if isinstance(value, DirectionRule) else direction_rule(str(value))
    if rule.is_flat:
        what = f"the {len(rule)} axes of {rule.name} lie in one plane"
        raise SettingsError(f"{name}: {what}, so nothing is measured across it: choose more axes")
    return rule


def parse_rattlers(name: str, value: Any) -> str:
    """Parse the name of an installed rattler rule."""
    return str(one_of(*installed_rules())(name, value))


def parse_strain(name: str, value: Any) -> str:
    """Parse the source of the axial strain: a word, or an existing file."""
    text = str(value)
    if text not in STRAIN_MODES and not Path(text).is_file():
        found = text if isinstance(value, Path) else value
        raise unusable(name, "auto, cell, boundary, grains or a CSV file that exists", found)
    return text


def parse_workers(name: str, value: Any) -> int:
    """Parse a number of workers; None stands for all cores."""
    count = (os.cpu_count() or 1) if value is None else value
    return int(whole("1 or more", lambda count: count >= 1)(name, count))
