"""Values of options: what users write, and what it means."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from scanfab.base.errors import SettingsError
from scanfab.base.option import number, numbers, one_of, optional, unusable, whole
from scanfab.base.spelling import shortest

if TYPE_CHECKING:
    # their modules need numpy, for which the help of a command does not wait
    from scanfab.packing.boundary import BoundaryRule
    from scanfab.scan.directions import DirectionRule


Vector = tuple[float, float, float]
STRAIN_MODES = ("auto", "cell", "boundary", "grains")
MOST_CUTOFFS = 1000
# of further columns, in their order in the table
GROUP_NAMES = ("invariants", "state", "forces", "harmonics")
# of windows, with the sizes that each takes
SHAPES = {
    "sphere": "",
    "box": "A,B,C, full edges",
    "cylinder": "R,H, radius and height",
    "ellipsoid": "A,B,C, semi-axes",
}


parse_radius = optional(number("a length above 0", lambda value: 0 < value < math.inf))
parse_share = number("0 or more", lambda value: 0 <= value < math.inf)
parse_work = number("a number of at least 1", lambda value: value >= 1)
parse_count = whole("0 or more", lambda value: value >= 0)
parse_moment = whole("1 or 2", lambda moment: moment in (1, 2))
parse_point = optional(numbers("three finite numbers", lambda vector: len(vector) == 3))
parse_tolerance = number(
    "a number above 0, from 1e-15 to 1e15", lambda value: 1e-15 <= value <= 1e15
)


class Axis(NamedTuple):
    """A unit vector; a vector of three numbers is made one by :func:`parse_axis`, once."""

    x: float
    y: float
    z: float


class UsualAxis(Axis):
    """The loading axis where none is given: z, or in a plane its second axis."""

    __slots__ = ()


AXES = {"x": Axis(1.0, 0.0, 0.0), "y": Axis(0.0, 1.0, 0.0), "z": Axis(0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Length:
    """A length in the dump's unit, or relative to a radius of the series' first frame."""

    value: float
    unit: Literal["", "rmin", "rmean", "rmax"] = ""

    def resolve(self, radii: dict[str, float]) -> float:
        """The length in the dump's unit."""
        return self.value * (radii[self.unit] if self.unit else 1.0)


def as_written(value: Any) -> Any:
    """
    What users write for a value of an option, from which the same is read again.

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
        return [as_written(one) for one in value]
    # of a boundary rule its text, of a rule of directions its name
    return getattr(value, "text", getattr(value, "name", value))


def parse_length(name: str, text: str | float | Length) -> Length:
    """
    A length of 0 or more as users write it: ``0.5``, ``1rmin``, ``0.2rmean``.

    Examples
    --------
    >>> from scanfab.pipeline.values import parse_length
    >>> parse_length("cutoff", "0.5rmin")
    Length(value=0.5, unit='rmin')
    """
    found = re.fullmatch(r"\s*(.+?)\s*(rmin|rmean|rmax)?\s*", str(as_written(text)))
    expected = "a length such as 0.0005 or 1rmin (rmin, rmean, rmax), not negative"
    parse = number(expected, lambda value: 0 <= value < math.inf)
    if found is None:
        raise unusable(name, expected, text)
    return Length(parse(name, found[1]), found[2] or "")  # type: ignore[arg-type]


def parse_spacing(name: str, value: Any) -> Length | None:
    """A length above 0; None for ``auto``."""
    if value is None or value == "auto":
        return None
    length = parse_length(name, value)
    if length.value == 0:
        raise unusable(name, "a length above 0, or auto", value)
    return length


def parse_lengths(name: str, text: Any) -> tuple[Length, ...]:
    """
    Lengths as ``FROM:TO:STEP``, both ends included, as ``L,L,...``, or one by one.

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
        raise unusable(name, f"1 to {MOST_CUTOFFS} lengths, and not {count}", text)
    # not by adding steps, whose rounding would show
    return tuple(Length(round(first + k * step, 12), *units) for k in range(count))


def parse_axis(name: str, text: str | Iterable[float] | None) -> Axis:
    """A unit vector from ``x``, ``y``, ``z`` or three numbers; the usual one if none is given."""
    if text is None:
        return UsualAxis(*AXES["z"])
    if isinstance(text, Axis):
        return text
    if isinstance(text, str) and text in AXES:
        return AXES[text]
    parse = numbers("x, y, z or three numbers X,Y,Z", lambda v: len(v) == 3 and math.hypot(*v) > 0)
    vector = parse(name, text)
    return Axis(*(part / math.hypot(*vector) for part in vector))


# of a cylinder, which has the loading axis if none is given
parse_rv_axis = optional(parse_axis)


def parse_fractions(name: str, value: Any) -> float | tuple[float, ...]:
    """
    Sizes of RVs: one as a number; several, each once, in ascending order.

    Examples
    --------
    >>> from scanfab.pipeline.values import parse_fractions
    >>> parse_fractions("rv", "0.7"), parse_fractions("rv", "0.7,0.4")
    (0.7, (0.4, 0.7))
    """
    parse = numbers(
        "a fraction above 0, or several such as 0.4,0.5,0.6",
        lambda sizes: len(sizes) > 0 and min(sizes) > 0,
    )
    found = sorted(parse(name, [value] if isinstance(value, int | float) else value))
    if len(set(found)) < len(found):
        raise unusable(name, "fractions that differ", value)
    return found[0] if len(found) == 1 else tuple(found)


def parse_sizes(name: str, value: Any) -> tuple[float, ...]:
    """Two or three lengths; none if not given."""
    if value is None or value in ((), []):
        return ()
    expected = "two or three lengths above 0, such as 2,3,4"
    return numbers(expected, lambda found: len(found) in (2, 3) and min(found) > 0)(name, value)


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


def parse_variants(name: str, letters: object) -> str:
    """Letters out of abcd, each once and in this order."""
    if not isinstance(letters, str) or not letters or not set(letters) <= set("abcd"):
        raise unusable(name, "letters out of abcd", letters)
    return "".join(variant for variant in "abcd" if variant in letters)


def parse_groups(name: str, groups: Any) -> tuple[str, ...]:
    """Groups of columns, in a text between commas or blanks; each once, in the table's order."""
    given = groups.replace(",", " ").split() if isinstance(groups, str) else groups
    words = tuple(given) if isinstance(given, Iterable) else () if given is None else (given,)
    for word in words:
        if word not in GROUP_NAMES:
            raise unusable(name, f"groups of columns out of {', '.join(GROUP_NAMES)}", word)
    return tuple(group for group in GROUP_NAMES if group in words)


def parse_boundary(name: str, rules: Any) -> tuple[BoundaryRule, ...]:
    """Rules from one expression or several."""
    from scanfab.packing.boundary import BoundaryRule

    several = rules if isinstance(rules, tuple | list) else [rules]
    return tuple(
        rule if isinstance(rule, BoundaryRule) else BoundaryRule.parse(str(rule))
        for rule in several
    )


def parse_directions(name: str, value: Any) -> DirectionRule | None:
    """A rule whose axes do not all lie in one plane; None for ``auto``."""
    from scanfab.scan.directions import DirectionRule, direction_rule

    if value is None or value == "auto":
        return None
    rule = value if isinstance(value, DirectionRule) else direction_rule(str(value))
    if rule.is_flat:
        raise SettingsError(
            f"{name}: the {len(rule)} axes of {rule.name} lie in one plane, across which they "
            f"say nothing: take more of them"
        )
    return rule


def direction_rules() -> list[str]:
    """How the rules for directions begin."""
    from scanfab.scan.directions import RULES

    return ["auto", *(f"{name}:" for name in RULES)]


def rattler_rules() -> Iterable[str]:
    """The names of the rules that are installed."""
    from scanfab.packing.rattlers import installed_rules

    return installed_rules()


def parse_rattlers(name: str, value: Any) -> str:
    """The name of a rule that is installed."""
    return str(one_of(*rattler_rules())(name, value))


def parse_strain(name: str, value: Any) -> str:
    """Where the axial strain comes from: a word, or a file that exists."""
    is_path = isinstance(value, str | os.PathLike)
    if not is_path or (str(value) not in STRAIN_MODES and not Path(value).is_file()):
        found = str(value) if is_path else value
        raise unusable(name, "auto, cell, boundary, grains or a CSV file that exists", found)
    return str(value)


def parse_workers(name: str, value: Any) -> int:
    """A number of threads: all cores if not given."""
    count = (os.cpu_count() or 1) if value is None else value
    return int(whole("1 or more", lambda count: count >= 1)(name, count))
