"""Settings of a computation: each option declared once, checked when they are made, frozen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scanfab.base.option import (
    fabric,
    number,
    numbers,
    optional,
    options_of,
    reading,
    refuse_unknown,
    sample,
    scan,
    whole,
    window,
)
from scanfab.io.options import parse_frames
from scanfab.packing.columns import RV_COLUMN
from scanfab.pipeline import values
from scanfab.pipeline.values import AXES, SHAPES, Axis, Length, Vector, as_written, parse_axis
from scanfab.pipeline.window_settings import check_together
from scanfab.scan.edges import CLIP, EDGE_COLUMNS, EDGES

if TYPE_CHECKING:
    from scanfab.base.column import Column
    from scanfab.packing.boundary import BoundaryRule
    from scanfab.scan.directions import DirectionRule


# of an auto scan of one frame: one to two minutes of one processor, some hundred times what dense
# packings need for the default tolerance
MAX_CHORDS = 1e10
RULE_NAMES = (
    "lebedev", "design", "icosahedral", "product", "fibonacci", "equal-angle", "equal-angle-full",
)  # fmt: skip

AXIS_FORM = "x|y|z|X,Y,Z"
length_above_0 = number("a length above 0", lambda value: 0 < value < math.inf)
at_least_0 = number("0 or more", lambda value: 0 <= value < math.inf)
at_least_1 = number("a number of at least 1", lambda value: value >= 1)
count = whole("0 or more", lambda value: value >= 0)
three_numbers = numbers("three finite numbers", lambda vector: len(vector) == 3)
parse_moment = whole("1 or 2", lambda moment: moment in (1, 2))
parse_tolerance = number(
    "a number above 0, from 1e-15 to 1e15", lambda value: 1e-15 <= value <= 1e15
)


def parse_sizes(name: str, value: Any) -> tuple[float, ...]:
    """Two or three lengths; none if not given."""
    expected = "two or three lengths above 0, such as 2,3,4"
    parse = numbers(expected, lambda sizes: len(sizes) in (2, 3) and min(sizes) > 0)
    return () if value is None or value in ((), []) else tuple(parse(name, value))


@dataclass(frozen=True, init=False)
class Settings:
    """
    What to compute, and how.

    Settings are made of the options of :func:`scanfab.compute`, written as there; the attributes
    are what they mean, with lengths in the dump's unit.

    Parameters
    ----------
    **options
        Those of :func:`scanfab.compute`.

    Raises
    ------
    SettingsError
        If a value cannot be used.
    TypeError
        If there is no such option.

    Examples
    --------
    >>> from scanfab import Settings
    >>> Settings(cutoff="0.5rmin").cutoff
    Length(value=0.5, unit='rmin')
    """

    rv: float | tuple[float, ...] = window(
        values.parse_fractions, default=0.7, metavar="FRACTION[,FRACTION...]", first=True
    )
    """
    Size of the RV: radius of the sphere as a fraction of half the smallest extent of the grains;
    sizes of other shapes, of half the extents. Several: a row for each, from the same lines.
    """
    rv_radius: float | None = window(optional(length_above_0), metavar="L")
    """Radius of the sphere RV in the dump's units, instead of `rv`."""
    rv_center: Vector | None = window(optional(three_numbers), metavar="X Y Z")
    """Centre of the RV in the dump's units (default: middle of the sample)."""
    rv_shape: str = window(
        values.parse_shape,
        default="sphere",
        metavar="sphere|box|cylinder|ellipsoid|FILE",
        choices=tuple(SHAPES),
        files=True,
    )
    """Shape of the RV; FILE is a closed convex surface in dump units (.stl .vtp .ply .obj)."""
    rv_size: tuple[float, ...] = window(parse_sizes, metavar="A,B,C")
    """
    In the dump's units, instead of `rv`: edges of the box, radius and height of the cylinder,
    semi-axes of the ellipsoid; of discs two.
    """
    rv_axis: Axis | None = window(optional(parse_axis), metavar=AXIS_FORM, choices=tuple(AXES))
    """Axis of the cylinder (default: `axis`)."""
    rv_follows: str = window(default="none", choices=("none", "strain"))
    """
    none: the RV keeps its shape; strain: it deforms with what `strain` is measured by, that is with
    the cell, or with the extents of boundary or grains along x, y, z.
    """
    edge: str = window(default=CLIP, choices=EDGES)
    """
    What counts at the surface of the RV: clip cuts the void segments there; start takes their full
    length if they begin or end inside, ends their ends inside.
    """
    variants: str = sample(
        values.parse_variants,
        default="abcd",
        metavar="LETTERS",
        choices=("abcd", "ab", "cd", "ac", *"abcd"),
        first=True,
    )
    """
    Which variants to compute, letters out of abcd: a whole sample, b whole without rattlers, c RV,
    d RV without rattlers.
    """
    boundary: tuple[BoundaryRule, ...] = sample(
        values.parse_boundary, default=(), metavar="EXPR", several=True, first=True
    )
    """Which particles are boundary: "type=2", "mask=3,4", "id>=13723"; several: or."""
    cutoff: Length = scan(values.parse_length, default="1rmin", metavar="L")
    """Shortest void segment kept: in the dump's units, or with rmin, rmean, rmax."""
    cutoffs: tuple[Length, ...] = scan(values.parse_lengths, metavar="FROM:TO:STEP|L,L,...")
    """
    Several cut-offs, a row for each, from one pass over the void segments; `cutoff` is then the one
    at which the scan meets the tolerance.
    """
    moment: int = fabric(parse_moment, default=1, metavar="1|2", choices=("1", "2"))
    """Mean length of the void segments (1), or mean of the squares over the mean (2)."""
    spacing: Length | None = scan(
        values.parse_spacing, default="auto", metavar="L", choices=("auto",)
    )
    """Distance between neighbouring lines, as `cutoff`; auto meets `tolerance`."""
    directions: DirectionRule | None = scan(
        values.parse_directions,
        default="auto",
        metavar="N|RULE",
        choices=("auto", *(f"{rule}:" for rule in RULE_NAMES)),
    )
    """
    N axes, rounded up to the next exact rule, or lebedev:DEGREE, design:DEGREE, icosahedral:DEGREE,
    product:DEGREE, fibonacci:N, equal-angle:STEP, equal-angle-full:STEP; auto meets `tolerance`.
    """
    tolerance: float = scan(parse_tolerance, default=1e-4, first=True)
    """Target standard error of alpha_vs_axial, for every variant, when something is auto."""
    max_chords: float = scan(at_least_1, default=MAX_CHORDS, metavar="N")
    """
    An auto scan stops before it cuts more chords from grains than this, in each frame: by default
    after one or two minutes of one processor (lines count like chords).
    """
    min_contacts: int = sample(count, default=2)
    """A grain with fewer contacts (a clump: with fewer neighbours) is a rattler."""
    rattlers: str = sample(
        values.parse_rattlers, default="count", metavar="RULE", choices=values.rattler_rules
    )
    """
    Rule for rattlers: count is one pass over all contacts; recursive repeats it without those of
    rattlers, until none is new; force is one pass over those above `min_force`.
    """
    min_force: float = sample(at_least_0, default=0.0)
    """By the rule force contacts count whose normal force is above this, over the mean."""
    contact_tolerance: float = sample(at_least_0, default=0.0)
    """Of contacts by geometry, relative: contact if distance < (r1 + r2)(1 + X)."""
    axis: Axis = fabric(parse_axis, metavar=AXIS_FORM, choices=tuple(AXES))
    """
    Loading axis, along which the anisotropies are signed (default: z; of discs the second axis of
    their plane).
    """
    with_: tuple[str, ...] = fabric(
        values.parse_groups, metavar="GROUP,...", choices=values.GROUP_NAMES
    )
    """
    More columns: forces (with branches, strong and weak contacts), state (void ratio, stress,
    fabric against stress), invariants, harmonics; several: forces,state.
    """
    strain: str = sample(
        values.parse_strain,
        default="auto",
        metavar="auto|cell|boundary|grains|FILE.csv",
        choices=values.STRAIN_MODES,
        files=True,
    )
    """Where the axial strain comes from: auto is the cell if periodic, else the boundary."""
    frames: slice = reading(
        lambda name, value: parse_frames(value, name), metavar="A:B:C", first=True
    )
    """Which frames, as a Python slice (default: all)."""
    seed: int = scan(count, default=0)
    """Seed of the random numbers."""
    workers: int = scan(values.parse_workers, first=True, decides=False)
    """Parallel workers (default: all cores)."""
    on_error: str = reading(default="stop", choices=("stop", "skip"))
    """What a frame that cannot be read does."""

    def __init__(self, **options: Any) -> None:
        """Check what users write, and keep what it means."""
        declared = options_of(type(self))
        refuse_unknown("Settings", options, [one.name for one in declared])
        for one in declared:
            value = one.parse(one.name, options.get(one.name, one.default))
            object.__setattr__(self, one.name, value)
        check_together(self)

    def __repr__(self) -> str:
        chosen = [
            f"{one.name}={as_written(getattr(self, one.name))!r}"
            for one in options_of(type(self))
            if as_written(getattr(self, one.name)) != as_written(one.parse(one.name, one.default))
        ]
        return f"{type(self).__name__}({', '.join(chosen)})"

    @property
    def rvs(self) -> tuple[float, ...]:
        """The sizes of the RVs, one or several."""
        return self.rv if isinstance(self.rv, tuple) else (self.rv,)

    @property
    def more_columns(self) -> tuple[str, ...]:
        """Columns that the table has because these settings ask for more than the default."""
        # to print the help of a command needs no fabric
        from scanfab.fabric.registry import GROUPS

        shaped = self.rv_shape != "sphere" or self.rv_follows != "none"
        several = len(self.rvs) > 1
        of_window = {RV_COLUMN.name: several, "window_alpha_vs_axial": shaped}
        columns = [name for name, asked in of_window.items() if asked and self.needs_window]
        columns += [one.name for one in EDGE_COLUMNS if self.edge != CLIP]
        columns += ["alpha_vs_axial_contacts"] * bool(self.cutoffs)
        return (*columns, *(one.name for group in self.with_ for one in GROUPS[group].columns))

    @property
    def columns(self) -> tuple[Column, ...]:
        """Of the table."""
        from scanfab.table.columns import table_columns

        return table_columns(self.more_columns)

    @property
    def lists_gaps(self) -> bool:
        """Whether sums for one cut-off do not suffice."""
        return bool(self.cutoffs) or self.moment != 1

    @property
    def blocks(self) -> int:
        """How many parts of the sample a frame tells apart, each with rows of its own."""
        return 1

    @property
    def rows_per_frame(self) -> int:
        """Rows of each frame: one for each variant, RV and cut-off."""
        windows = sum(len(self.rvs) if variant in "cd" else 1 for variant in self.variants)
        return windows * max(len(self.cutoffs), 1)

    @property
    def needs_window(self) -> bool:
        """Whether a variant of the RV is asked for."""
        return "c" in self.variants or "d" in self.variants
