"""Settings of a computation: each option declared once, checked when they are made, frozen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scanfab.base.option import (
    number,
    one_of,
    option,
    options_of,
    refuse_unknown,
    whole,
)
from scanfab.io.options import parse_frames
from scanfab.packing.columns import RV_COLUMN
from scanfab.pipeline.values import (
    AXES,
    GROUP_NAMES,
    STRAIN_MODES,
    Axis,
    Length,
    as_written,
    check_min_force,
    check_moment,
    parse_axis,
    parse_boundary,
    parse_cutoff,
    parse_cutoffs,
    parse_directions,
    parse_groups,
    parse_rattlers,
    parse_spacing,
    parse_strain,
    parse_tolerance,
    parse_variants,
    parse_workers,
    rattler_rules,
)
from scanfab.pipeline.window_settings import WindowSettings, check_window
from scanfab.scan.columns import EDGE_COLUMNS
from scanfab.scan.edges import CLIP

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


@dataclass(frozen=True, init=False)
class Settings(WindowSettings):
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

    variants: str = option(
        default="abcd",
        parse=parse_variants,
        group="sample",
        help="Which variants to compute: letters out of abcd.",
        meaning="a whole sample, b whole without rattlers, c RV, d RV without rattlers",
        metavar="LETTERS",
        choices=lambda: ("abcd", "ab", "cd", "ac", *"abcd"),
        first=True,
    )
    boundary: tuple[BoundaryRule, ...] = option(
        default=(),
        parse=parse_boundary,
        group="sample",
        help='Which particles are boundary: "type=2", "mask=3,4", "id>=13723"; several: or.',
        meaning="particles that are boundary, not grains",
        takes="str or sequence of str",
        metavar="EXPR",
        several=True,
        first=True,
    )
    cutoff: Length = option(
        default="1rmin",
        parse=parse_cutoff,
        group="scan",
        help="Shortest void segment kept: in the dump's units, or with rmin, rmean, rmax.",
        meaning="shortest void segment that counts (rmin: smallest grain radius)",
        takes="str or float",
        metavar="L",
    )
    cutoffs: tuple[Length, ...] = option(
        parse=parse_cutoffs,
        group="scan",
        help="Several cut-offs, a row for each, from one pass over the void segments; `cutoff` is "
        "then the one at which the scan meets the tolerance.",
        meaning="several such lengths instead, a row of the table for each",
        takes="str or sequence of str or float",
        metavar="FROM:TO:STEP|L,L,...",
    )
    """Several instead of the one, each with its rows."""
    moment: int = option(
        default=1,
        parse=whole("1 or 2", lambda moment: moment in (1, 2)),
        group="fabric",
        help="Mean length of the void segments (1), or mean of the squares over the mean (2).",
        meaning="1: mean length of the void segments; 2: mean of their squares over that",
        takes="int",
        metavar="1|2",
        choices=lambda: ("1", "2"),
    )
    spacing: Length | None = option(
        default="auto",
        parse=parse_spacing,
        group="scan",
        help="Distance between neighbouring lines, as `cutoff`; auto meets `tolerance`.",
        meaning="distance between neighbouring scan lines; auto: as the tolerance needs",
        takes="str or float",
        metavar="L",
        choices=lambda: ("auto",),
    )
    """None for ``auto``."""
    directions: DirectionRule | None = option(
        default="auto",
        parse=parse_directions,
        group="scan",
        help="N axes, rounded up to the next exact rule, or lebedev:DEGREE, design:DEGREE, "
        "icosahedral:DEGREE, product:DEGREE, fibonacci:N, equal-angle:STEP, equal-angle-full:STEP.",
        meaning="rule of the scan directions; auto: as the tolerance needs",
        takes="str, int or DirectionRule",
        metavar="N|RULE",
        choices=lambda: ("auto", *(f"{rule}:" for rule in RULE_NAMES)),
    )
    """None for ``auto``."""
    tolerance: float = option(
        default=1e-4,
        parse=parse_tolerance,
        group="scan",
        help="Target standard error of alpha_vs_axial, for every variant, when something is auto.",
        meaning="wanted standard error of the scan, where spacing or directions are auto",
        takes="float",
        metavar="X",
        first=True,
    )
    max_chords: float = option(
        default=MAX_CHORDS,
        parse=number("a number of at least 1", lambda value: value >= 1),
        group="scan",
        help="An auto scan stops before it cuts more chords from grains than this, in each frame: "
        "by default after one or two minutes of one processor (lines count like chords).",
        meaning="an auto scan stops before it cuts more chords from grains in a frame",
        takes="float",
        metavar="N",
    )
    min_contacts: int = option(
        default=2,
        parse=whole("0 or more", lambda count: count >= 0),
        group="sample",
        help="A grain with fewer contacts (a clump: with fewer neighbours) is a rattler.",
        meaning="a grain with fewer contacts (a clump: with fewer neighbours) is a rattler",
        takes="int",
        metavar="N",
    )
    rattlers: str = option(
        default="count",
        parse=parse_rattlers,
        group="sample",
        help="Rule for rattlers: count is one pass over all contacts; recursive repeats it without "
        "those of rattlers, until none is new; force is one pass over those above `min_force`.",
        meaning="rule for rattlers; count: one pass over all contacts; recursive: again without "
        "those of rattlers, until none is new; force: one pass over contacts that press",
        metavar="RULE",
        choices=rattler_rules,
    )
    min_force: float = option(
        default=0.0,
        parse=number("0 or more", lambda value: 0 <= value < math.inf),
        group="sample",
        help="By the rule force contacts count whose normal force is above this, over the mean.",
        meaning="by the rule force contacts count whose normal force is above this, over the mean",
        takes="float",
        metavar="X",
    )
    contact_tolerance: float = option(
        default=0.0,
        parse=number("0 or more", lambda value: 0 <= value < math.inf),
        group="sample",
        help="Of contacts by geometry, relative: contact if distance < (r1 + r2)(1 + X).",
        meaning="relative tolerance of contacts by geometry",
        takes="float",
        metavar="X",
    )
    axis: Axis = option(
        parse=lambda name, value: parse_axis(value, name),
        group="fabric",
        help="Loading axis, along which the anisotropies are signed (default: z; of discs the "
        "second axis of their plane).",
        meaning="loading axis, along which the anisotropies are signed; not given: z, of discs the "
        "second axis of their plane",
        takes="str or three floats",
        metavar="x|y|z|X,Y,Z",
        choices=lambda: AXES,
    )
    with_: tuple[str, ...] = option(
        parse=parse_groups,
        group="fabric",
        help="More columns: forces (with branches, strong and weak contacts), state (void ratio, "
        "stress, fabric against stress), invariants, harmonics; several: forces,state.",
        meaning="groups of further columns",
        takes="str or sequence of str",
        metavar="GROUP,...",
        choices=lambda: GROUP_NAMES,
    )
    strain: str = option(
        default="auto",
        parse=parse_strain,
        group="sample",
        help="Where the axial strain comes from: auto is the cell if periodic, else the boundary.",
        meaning="where the axial strain comes from: cell, boundary, grains or a file",
        takes="str or path",
        metavar="auto|cell|boundary|grains|FILE.csv",
        choices=lambda: STRAIN_MODES,
        files=True,
    )
    frames: slice = option(
        parse=lambda name, value: parse_frames(value, name),
        group="reading",
        help="Which frames, as a Python slice (default: all).",
        meaning="which frames, as a Python slice",
        takes="str, int or slice",
        metavar="A:B:C",
        first=True,
    )
    seed: int = option(
        default=0,
        parse=whole("0 or more", lambda seed: seed >= 0),
        group="scan",
        help="Seed of the random numbers.",
        meaning="of the random numbers; the same seed repeats the same numbers",
        takes="int",
        metavar="N",
    )
    workers: int = option(
        parse=parse_workers,
        group="scan",
        help="Parallel workers (default: all cores).",
        takes="int",
        metavar="N",
        first=True,
    )
    on_error: str = option(
        default="stop",
        parse=one_of("stop", "skip"),
        group="reading",
        help="What a frame that cannot be read does.",
        meaning="what a frame that cannot be read does: stop, or skip it",
        metavar="stop|skip",
        choices=lambda: ("stop", "skip"),
    )

    def __init__(self, **options: Any) -> None:
        """Check what users write, and keep what it means."""
        declared = options_of(type(self))
        refuse_unknown("Settings", options, [one.name for one in declared])
        for one in declared:
            value = one.parse(one.name, options.get(one.name, one.default))
            object.__setattr__(self, one.name, value)
        check_window(self)
        check_moment(self)
        check_min_force(self)

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

    def __repr__(self) -> str:
        chosen = [
            f"{one.name}={as_written(getattr(self, one.name))!r}"
            for one in options_of(type(self))
            if as_written(getattr(self, one.name)) != as_written(one.parse(one.name, one.default))
        ]
        return f"{type(self).__name__}({', '.join(chosen)})"

    @property
    def lists_gaps(self) -> bool:
        """Whether sums for one cut-off do not suffice."""
        return bool(self.cutoffs) or self.moment != 1

    @property
    def columns(self) -> tuple[Column, ...]:
        """Of the table."""
        from scanfab.table.columns import table_columns

        return table_columns(self.more_columns)

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
