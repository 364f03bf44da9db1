"""Settings of a computation: frozen, and checked once, before any frame is read."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from scanfab.base.errors import SettingsError
from scanfab.packing.boundary import BoundaryRule
from scanfab.scan.directions import DirectionRule, direction_rule

__all__ = [
    "AUTO_RULE",
    "AXES",
    "MAX_CHORDS",
    "Length",
    "Settings",
    "parse_axis",
    "parse_frames",
    "parse_length",
]

Vector = tuple[float, float, float]

AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
# equal weights and few axes: the random turns of the replicates do the rest
AUTO_RULE = "icosahedral:9"
MOST_CUTOFFS = 1000
# of an auto scan of one frame: one to two minutes of one processor, some hundred times what dense
# packings need for the default tolerance
MAX_CHORDS = 1e10
STRAIN_MODES = ("auto", "cell", "boundary", "grains")


@dataclass(frozen=True)
class Length:
    """A length in the dump's unit, or relative to a radius of the series' first frame."""

    value: float
    unit: Literal["", "rmin", "rmean", "rmax"] = ""

    def resolve(self, radii: dict[str, float]) -> float:
        """The length in the dump's unit."""
        return self.value * (radii[self.unit] if self.unit else 1.0)


def parse_length(name: str, text: str | float | Length) -> Length:
    """
    A length as users write it: ``0.5``, ``1rmin``, ``0.2rmean``.

    Examples
    --------
    >>> from scanfab.pipeline.settings import parse_length
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
    >>> from scanfab.pipeline.settings import parse_lengths
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


def _number(name: str, value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise SettingsError(f"{name}: expected a number, found {value!r}") from None


def _whole(name: str, value: object) -> int:
    number = _number(name, value)
    if not number.is_integer():
        raise SettingsError(f"{name}: expected a whole number, found {value!r}")
    return int(number)


def _vector(name: str, values: Sequence[float]) -> Vector:
    numbers = tuple(_number(name, value) for value in values) if hasattr(values, "__len__") else ()
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise SettingsError(f"{name}: expected three finite numbers, found {values!r}")
    return numbers


def _rule(directions: str | int | DirectionRule) -> DirectionRule | None:
    if directions == "auto":
        return None
    rule = directions if isinstance(directions, DirectionRule) else direction_rule(str(directions))
    if rule.is_flat:
        raise SettingsError(
            f"directions: the {len(rule)} axes of {rule.name} lie in one plane, across which they "
            f"say nothing: take more of them"
        )
    return rule


def parse_axis(text: str | Vector) -> Vector:
    """A unit vector from ``x``, ``y``, ``z`` or three numbers."""
    if isinstance(text, str) and text in AXES:
        return AXES[text]
    try:
        x, y, z = (float(part) for part in (text.split(",") if isinstance(text, str) else text))
    except (TypeError, ValueError):
        x = y = z = math.nan
    length = math.hypot(x, y, z)
    if not (math.isfinite(length) and length > 0):
        raise SettingsError(f"axis: expected x, y, z or three numbers X,Y,Z, found {text!r}")
    return (x / length, y / length, z / length)


def parse_frames(text: str | int | slice | None) -> slice:
    """A slice from ``A:B:C`` or a single number."""
    if text is None:
        return slice(None)
    if isinstance(text, slice):
        return text
    try:
        numbers = [int(part) if part.strip() else None for part in str(text).split(":")]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 3 or numbers == [None] or numbers[2:] == [0]:
        raise SettingsError(f"frames: expected a slice such as 0:10:2, :5 or -1:, found {text!r}")
    if len(numbers) > 1:
        return slice(*numbers)
    number = numbers[0]
    assert number is not None
    return slice(number, number + 1 if number != -1 else None)


@dataclass(frozen=True)
class Settings:
    """
    What to compute, and how.

    The fields are the options of ``scanfab compute``; lengths are in the dump's unit. :meth:`make`
    takes them as the command line does, as text.
    """

    variants: str = "abcd"
    rv: float = 0.7
    rv_radius: float | None = None
    rv_center: Vector | None = None
    boundary: tuple[BoundaryRule, ...] = ()
    cutoff: Length = Length(1.0, "rmin")
    cutoffs: tuple[Length, ...] = ()
    """Several instead of the one, each with its rows."""
    moment: int = 1
    spacing: Length | None = None
    """None for ``auto``."""
    directions: DirectionRule | None = None
    """None for ``auto``."""
    tolerance: float = 1e-4
    max_chords: float = MAX_CHORDS
    min_contacts: int = 2
    contact_tolerance: float = 0.0
    axis: Vector = AXES["z"]
    strain: str = "auto"
    frames: slice = field(default_factory=lambda: slice(None))
    seed: int = 0
    workers: int = 1
    on_error: str = "stop"

    @classmethod
    def make(
        cls,
        *,
        variants: str = "abcd",
        rv: float = 0.7,
        rv_radius: float | None = None,
        rv_center: Vector | None = None,
        boundary: str | tuple[str, ...] | list[str] = (),
        cutoff: str | float = "1rmin",
        cutoffs: str | float | Iterable[str | float] | None = None,
        moment: int = 1,
        spacing: str | float = "auto",
        directions: str | int | DirectionRule = "auto",
        tolerance: float = 1e-4,
        max_chords: float = MAX_CHORDS,
        min_contacts: int = 2,
        contact_tolerance: float = 0.0,
        axis: str | Vector = "z",
        strain: str | Path = "auto",
        frames: str | int | slice | None = None,
        seed: int = 0,
        workers: int | None = None,
        on_error: str = "stop",
    ) -> Settings:
        """
        Settings from what users write.

        Parameters
        ----------
        variants : str
            Which of a, b, c, d.
        rv : float
            Radius of the sphere RV as a fraction of half the smallest extent of the grains.
        rv_radius, rv_center : float, three floats, optional
            The same in the dump's length unit.
        boundary : str or sequence of str
            Which particles are boundary: ``type=2``, ``mask=3,4``, ``id>=13723``; joined by or.
        cutoff, spacing : str or float
            A length in the dump's unit, or with the suffix ``rmin``, ``rmean`` or ``rmax``; spacing
            also ``auto``.
        cutoffs : str or sequence of str or float, optional
            Several cut-offs in one pass: ``FROM:TO:STEP``, ``L,L,...``, or one by one; ``cutoff``
            is then the one at which the scan meets the tolerance.
        moment : int
            1: ℓ is the mean length of the kept segments; 2: the mean of the squares over the mean.
        directions : str, int or DirectionRule
            ``auto``, a number of axes, or a rule, see :func:`scanfab.direction_rule`.
        tolerance : float
            Target standard error of ``alpha_vs_axial`` where spacing or directions are ``auto``.
        max_chords : float
            An ``auto`` scan stops before it cuts more chords from grains, in each frame.
        min_contacts : int
            A grain with fewer contacts is a rattler.
        contact_tolerance : float
            Relative tolerance of contacts by geometry.
        axis : str or three floats
            Loading axis: x, y, z or a vector.
        strain : str or path
            ``auto``, ``cell``, ``boundary``, ``grains`` or a CSV file.
        frames : str, int or slice, optional
            Which frames.
        seed, workers : int
            Seed of the random numbers; threads (all cores by default).
        on_error : str
            What a frame that cannot be read does: ``stop`` or ``skip``.

        Raises
        ------
        SettingsError
            If a value cannot be used.
        """
        if not isinstance(variants, str):
            raise SettingsError(f"variants: expected letters out of abcd, found {variants!r}")
        if not isinstance(boundary, str | tuple | list):
            raise SettingsError(f"boundary: expected rules such as type=2, found {boundary!r}")
        return cls(
            variants="".join(v for v in "abcd" if v in variants),
            rv=_number("rv", rv),
            rv_radius=None if rv_radius is None else _number("rv-radius", rv_radius),
            rv_center=None if rv_center is None else _vector("rv-center", rv_center),
            boundary=tuple(
                BoundaryRule.parse(rule)
                for rule in ([boundary] if isinstance(boundary, str) else boundary)
            ),
            cutoff=parse_length("cutoff", cutoff),
            cutoffs=() if cutoffs is None else parse_lengths("cutoffs", cutoffs),
            moment=_whole("moment", moment),
            spacing=None if spacing == "auto" else parse_length("spacing", spacing),
            directions=_rule(directions),
            tolerance=_number("tolerance", tolerance),
            max_chords=_number("max-chords", max_chords),
            min_contacts=_whole("min-contacts", min_contacts),
            contact_tolerance=_number("contact-tolerance", contact_tolerance),
            axis=parse_axis(axis),
            strain=str(strain),
            frames=parse_frames(frames),
            seed=_whole("seed", seed),
            workers=(os.cpu_count() or 1) if workers is None else _whole("workers", workers),
            on_error=on_error,
        )._checked(variants)

    def _checked(self, variants: str) -> Settings:
        checks = [
            (
                bool(variants) and set(variants) <= set("abcd"),
                f"variants: expected letters out of abcd, found {variants!r}",
            ),
            (
                self.rv > 0 and math.isfinite(self.rv),
                f"rv: expected a fraction above 0, found {self.rv:g}",
            ),
            (
                self.rv_radius is None or (self.rv_radius > 0 and math.isfinite(self.rv_radius)),
                f"rv-radius: expected a length above 0, found {self.rv_radius}",
            ),
            (self.cutoff.value >= 0, f"cutoff: expected 0 or more, found {self.cutoff.value:g}"),
            (
                all(one.value >= 0 for one in self.cutoffs),
                "cutoffs: expected lengths of 0 or more",
            ),
            (self.moment in (1, 2), f"moment: expected 1 or 2, found {self.moment}"),
            (
                self.spacing is None or self.spacing.value > 0,
                f"spacing: expected a length above 0, found {self.spacing and self.spacing.value}",
            ),
            (
                self.tolerance > 0 and math.isfinite(self.tolerance),
                f"tolerance: expected a number above 0, found {self.tolerance:g}",
            ),
            (
                1e-15 <= self.tolerance <= 1e15,
                f"tolerance: expected a number from 1e-15 to 1e15, found {self.tolerance:g}",
            ),
            (
                self.max_chords >= 1,
                f"max-chords: expected a number of at least 1, found {self.max_chords:g}",
            ),
            (
                self.min_contacts >= 0,
                f"min-contacts: expected 0 or more, found {self.min_contacts}",
            ),
            (
                self.contact_tolerance >= 0 and math.isfinite(self.contact_tolerance),
                f"contact-tolerance: expected 0 or more, found {self.contact_tolerance:g}",
            ),
            (
                self.strain in STRAIN_MODES or Path(self.strain).is_file(),
                f"strain: expected auto, cell, boundary, grains or a CSV file that exists, "
                f"found {self.strain!r}",
            ),
            (
                self.on_error in ("stop", "skip"),
                f"on-error: expected stop or skip, found {self.on_error!r}",
            ),
            (self.seed >= 0, f"seed: expected 0 or more, found {self.seed}"),
            (self.workers >= 1, f"workers: expected 1 or more, found {self.workers}"),
        ]
        for holds, message in checks:
            if not holds:
                raise SettingsError(message)
        return self

    @property
    def lists_gaps(self) -> bool:
        """Whether sums for one cut-off do not suffice."""
        return bool(self.cutoffs) or self.moment != 1

    @property
    def rows_per_frame(self) -> int:
        """Rows of each frame: one for each variant and cut-off."""
        return len(self.variants) * max(len(self.cutoffs), 1)

    @property
    def needs_window(self) -> bool:
        """Whether a variant of the RV is asked for."""
        return "c" in self.variants or "d" in self.variants

    @property
    def needs_whole(self) -> bool:
        """Whether a variant of the whole sample is asked for."""
        return "a" in self.variants or "b" in self.variants
