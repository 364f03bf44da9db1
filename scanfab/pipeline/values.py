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
from scanfab.base.option import number, one_of, unusable, whole
from scanfab.base.spelling import shortest
from scanfab.scan.edges import ENDS

if TYPE_CHECKING:
    # their modules need numpy, for which the help of a command does not wait
    from scanfab.packing.boundary import BoundaryRule
    from scanfab.pipeline.settings import Settings
    from scanfab.scan.directions import DirectionRule


Vector = tuple[float, float, float]
STRAIN_MODES = ("auto", "cell", "boundary", "grains")
MOST_CUTOFFS = 1000
# of further columns, in their order in the table
GROUP_NAMES = ("invariants", "state", "forces", "harmonics")


class Axis(NamedTuple):
    """A unit vector; a vector of three numbers is made one by :func:`parse_axis`, once."""

    x: float
    y: float
    z: float

    @property
    def spelt(self) -> str:
        """As users write it."""
        named = as_written(self)
        return named if isinstance(named, str) else ",".join(map(shortest, self))


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
    A length as users write it: ``0.5``, ``1rmin``, ``0.2rmean``.

    Examples
    --------
    >>> from scanfab.pipeline.values import parse_length
    >>> parse_length("cutoff", "0.5rmin")
    Length(value=0.5, unit='rmin')
    """
    if isinstance(text, Length):
        return text
    match = re.fullmatch(r"\s*([^a-df-z\s]+)\s*(rmin|rmean|rmax)?\s*", str(text))
    try:
        value = float(match[1]) if match else math.nan
    except ValueError:
        value = math.nan
    if match is None or not math.isfinite(value):
        raise SettingsError(
            f"{name}: expected a length such as 0.0005 or 1rmin (rmin, rmean, rmax), "
            f"found {str(text)!r}"
        )
    return Length(value, match[2] or "")  # type: ignore[arg-type]


def parse_lengths(name: str, text: str | float | Iterable[str | float]) -> tuple[Length, ...]:
    """
    Lengths as ``FROM:TO:STEP``, both ends included, as ``L,L,...``, or one by one.

    Examples
    --------
    >>> from scanfab.pipeline.values import parse_lengths
    >>> [length.value for length in parse_lengths("cutoffs", "0:1rmin:0.5rmin")]
    [0.0, 0.5, 1.0]
    """
    if not isinstance(text, str):
        parts = text if isinstance(text, Iterable) else [text]
        return tuple(parse_length(name, part) for part in parts)
    if ":" not in text:
        return tuple(parse_length(name, part) for part in text.split(","))
    lengths = [parse_length(name, part) for part in text.split(":")]
    units = {length.unit for length in lengths if length.value != 0}
    if len(lengths) != 3 or len(units) > 1 or lengths[2].value <= 0:
        raise SettingsError(
            f"{name}: expected FROM:TO:STEP of one unit such as 0:3rmin:0.1rmin, found {text!r}"
        )
    first, last, step = (length.value for length in lengths)
    count = math.floor((last - first) / step + 1e-9) + 1
    if not 1 <= count <= MOST_CUTOFFS:
        raise SettingsError(
            f"{name}: expected 1 to {MOST_CUTOFFS} of them, found {count}: {text!r}"
        )
    # not by adding steps, whose rounding would show
    return tuple(Length(round(first + k * step, 12), *units) for k in range(count))


def parse_axis(text: str | Vector | None, name: str = "axis") -> Axis:
    """A unit vector from ``x``, ``y``, ``z`` or three numbers; the usual one if none is given."""
    if text is None:
        return UsualAxis(*AXES["z"])
    if isinstance(text, Axis):
        return text
    if isinstance(text, str) and text in AXES:
        return AXES[text]
    try:
        x, y, z = (float(part) for part in (text.split(",") if isinstance(text, str) else text))
    except (TypeError, ValueError):
        x = y = z = math.nan
    length = math.hypot(x, y, z)
    if not (math.isfinite(length) and length > 0):
        raise unusable(name, "x, y, z or three numbers X,Y,Z", text)
    return Axis(x / length, y / length, z / length)


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


def parse_vector(name: str, values: Any) -> Vector:
    """Three finite numbers, in a text between commas or blanks."""
    try:
        x, y, z = map(float, words_of(values))
    except (TypeError, ValueError):
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        raise unusable(name, "three finite numbers", values)
    return (x, y, z)


def words_of(values: Any) -> Iterable[Any]:
    """Parts of a text between commas or blanks; of other values those that there are."""
    return values.replace(",", " ").split() if isinstance(values, str) else values


def check_moment(chosen: Settings) -> None:
    """Whether the rule at the window's surface knows the moment."""
    if chosen.edge == ENDS and chosen.moment != 1:
        raise SettingsError(
            "moment: from what lies inside the window alone, as `edge=ends` takes it, the second "
            "moment of the full lengths is not known: choose `edge=start`, or `moment=1`"
        )


def check_min_force(chosen: Settings) -> None:
    """Whether the rule for rattlers looks at forces."""
    if chosen.min_force and chosen.rattlers != "force":
        raise SettingsError(
            f'min_force: is that of the rule `rattlers="force"`, but `rattlers` is '
            f"{chosen.rattlers}: choose that rule, or leave out `min_force`"
        )


def parse_boundary(name: str, rules: Any) -> tuple[BoundaryRule, ...]:
    """Rules from one expression or several."""
    from scanfab.packing.boundary import BoundaryRule

    several = [rules] if isinstance(rules, str | BoundaryRule) else rules
    if not isinstance(several, tuple | list):
        raise unusable(name, "rules such as type=2", rules)
    return tuple(
        rule if isinstance(rule, BoundaryRule) else BoundaryRule.parse(str(rule))
        for rule in several
    )


def parse_cutoff(name: str, value: Any) -> Length:
    """A length of 0 or more."""
    length = parse_length(name, value)
    if length.value < 0:
        raise unusable(name, "a length of 0 or more", value)
    return length


def parse_cutoffs(name: str, values: Any) -> tuple[Length, ...]:
    """Lengths of 0 or more, as :func:`parse_lengths` takes them; none if not given."""
    lengths = () if values is None else parse_lengths(name, values)
    if any(length.value < 0 for length in lengths):
        raise unusable(name, "lengths of 0 or more", values)
    return lengths


def parse_spacing(name: str, value: Any) -> Length | None:
    """A length above 0; None for ``auto``."""
    if value is None or value == "auto":
        return None
    length = parse_length(name, value)
    if length.value <= 0:
        raise unusable(name, "a length above 0, or auto", value)
    return length


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


def parse_tolerance(name: str, value: Any) -> float:
    """A number above 0 that a scan can be held to."""
    found = number("a number above 0", lambda error: 0 < error < math.inf)(name, value)
    if not 1e-15 <= found <= 1e15:
        raise unusable(name, "a number from 1e-15 to 1e15", value)
    return float(found)


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
    every = os.cpu_count() or 1
    return int(
        whole("1 or more", lambda count: count >= 1)(name, every if value is None else value)
    )
