"""Settings of a computation: each option is declared once, checked at once and then fixed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from scanfab.base.column import Column
from scanfab.base.errors import DimensionError, SettingsError
from scanfab.base.option import (
    fabric,
    fill,
    optional,
    options_of,
    reading,
    sample,
    scan,
    whole,
    window,
)
from scanfab.base.space import Space
from scanfab.base.spelling import spelt_place
from scanfab.io.reader import READING_OPTIONS, parse_frames
from scanfab.packing.boundary import BoundaryRule
from scanfab.packing.rattlers import installed_rules
from scanfab.pipeline import values
from scanfab.pipeline.values import SHAPES, STRAIN_MODES, Axis, Length, Vector, as_written
from scanfab.scan.directions import RULES, DirectionRule, rule_of
from scanfab.scan.edges import CLIP, EDGES, ENDS

# A scan of so many chords takes one processor one to two minutes. A frame of a dense packing needs
# some hundred times less for a tolerance of 1e-4, and a tenth of it is the limit if the tolerance
# follows from the sample's error.
MAX_CHORDS, MAX_CHORDS_AUTO = 1e10, 1e9
# The tolerance auto: this part of the sample's error, but not less than the second number. More
# digits of the scan add nothing to an error that comes from the sample.
OF_SAMPLE, LEAST_TOLERANCE = 0.05, 1e-4
# a component of a unit vector up to this counts as 0
ROUNDING = 1e-9
# beginnings of direction rules, for shell completion
DIRECTIONS = [f"{name}:" for name in RULES]
# options that have a meaning only if another option has one of these values
NEEDS = {
    "rv_radius": ("rv_shape", ("sphere",)),
    "rv_size": ("rv_shape", ("box", "cylinder", "ellipsoid")),
    "rv_axis": ("rv_shape", ("cylinder",)),
    "min_force": ("rattlers", ("force",)),
}


@dataclass(frozen=True, init=False)
class Settings:
    """
    What to compute, and how: the checked options of :func:`scanfab.compute`.

    The attributes hold what the options mean, for instance a :class:`Length` for ``"0.5rmin"``.

    Parameters
    ----------
    **options
        Options of :func:`scanfab.compute`.

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
        values.parse_fractions, default=0.7, form="FRACTION[,FRACTION...]", first=True
    )
    """
    Size of the representative volume (RV), relative to the sample: the radius of a sphere as a
    fraction of half the smallest extent of the grains, the sizes of other shapes as fractions of
    half the extents. `compute` takes several: each gives a row of its own, from the same lines.
    """
    rv_radius: float | None = window(values.parse_radius, form="L")
    """Radius of the spherical RV in the dump's units, instead of `rv`."""
    rv_center: Vector | None = window(values.parse_point, form="X Y Z")
    """Centre of the RV in the dump's units (default: middle of the sample)."""
    rv_shape: str = window(values.parse_shape, default="sphere", form="|".join([*SHAPES, "FILE"]))
    """
    Shape of the RV; FILE is a closed convex surface in the dump's units (.stl .vtp .ply .obj).
    """
    rv_size: tuple[float, ...] | None = window(values.parse_sizes, form="A,B,C")
    """
    Size of the RV in the dump's units, instead of `rv`: edges of the box, radius and height of the
    cylinder, semi-axes of the ellipsoid. Discs take two numbers.
    """
    rv_axis: Axis | None = window(values.parse_rv_axis, form="x|y|z|X,Y,Z")
    """Axis of the cylinder (default: `axis`)."""
    rv_follows: str = window(default="none", form="none|strain")
    """
    none: the RV keeps its shape. strain: it deforms with what `strain` measures: the cell, or the
    extents of boundary or grains along x, y, z.
    """
    edge: str = window(default=CLIP, form="|".join(EDGES))
    """
    How to count void segments that the surface of the RV cuts. clip (the paper's): their part
    inside counts, so mean lengths are a little too small. start: their full length counts, one half
    for each end inside. ends: their part inside and the number of their ends inside count. Neither
    start nor ends has this bias.
    """
    variants: str = sample(values.parse_variants, default="abcd", form="LETTERS", first=True)
    """
    Which variants to compute, as letters: a whole sample, b whole sample without rattlers, c RV, d
    RV without rattlers.
    """
    boundary: tuple[BoundaryRule, ...] = sample(
        values.parse_boundary, default=(), form="EXPR", several=True, first=True
    )
    """
    Which particles are boundary: "type=2", "mask=3,4", "id>=13723", "id=1..800", "type!=1". Repeat
    the option to combine conditions (or); in Python, give a list.
    """
    cutoff: Length = scan(values.parse_length, default="1rmin", form="L")
    """
    Shortest void segment that counts: a length in the dump's units, or relative to the radii of the
    grains, such as 1rmin, 0.5rmean, 2rmax.
    """
    cutoffs: tuple[Length, ...] = scan(values.parse_lengths, form="FROM:TO:STEP|L,L,...")
    """
    Several cut-offs, with a row for each, from one pass over the void segments; the scan then meets
    the tolerance at `cutoff`.
    """
    moment: int = fabric(values.parse_moment, default=1, form="1|2")
    """
    1: mean length of the void segments; 2: mean of their squared lengths divided by their mean
    length.
    """
    spacing: Length | None = scan(values.parse_spacing, default="auto", form="auto|L")
    """
    Distance between neighbouring scan lines: a length in the dump's units, or relative to the
    radii, such as 0.2rmin; auto meets `tolerance`.
    """
    directions: DirectionRule | None = scan(
        values.parse_directions, default="auto", form="auto|N|RULE", words=DIRECTIONS
    )
    """
    Directions of the scan: N axes, rounded up to the next exact rule, or lebedev:DEGREE,
    design:DEGREE, icosahedral:DEGREE, product:DEGREE, fibonacci:N, equal-angle:STEP,
    equal-angle-full:STEP; auto meets `tolerance`.
    """
    tolerance: float | None = scan(
        values.parse_tolerance, kind=str, default="auto", form="auto|X", first=True
    )
    """
    Standard error of alpha_vs_axial that the scan aims at in every variant, if spacing or
    directions are auto. auto: for each row the larger of 1e-4 and a twentieth of its
    alpha_vs_axial_sample_se; in map and calibrate 1e-4.
    """
    max_chords: float | None = scan(values.parse_work, form="N")
    """
    Limit for the work of an auto scan: in each frame the scans of the whole sample and of the RVs
    each stop before they cut more than this number of chords from grains (each line also counts as
    a chord). Default: 1e9 with the tolerance auto, which takes one processor some ten seconds;
    otherwise 1e10, which takes one or two minutes.
    """
    min_contacts: int = sample(values.parse_count, default=2)
    """A grain with fewer contacts (a clump: with fewer neighbours) is a rattler."""
    rattlers: str = sample(
        values.parse_rattlers, default="count", form="RULE", words=installed_rules
    )
    """
    Rule that finds rattlers. count: one pass over all contacts; recursive: further passes without
    the contacts of rattlers, until no new ones are found; force: one pass over the contacts whose
    force exceeds `min_force`.
    """
    min_force: float = sample(values.parse_share, default=0)
    """
    With `rattlers="force"`: a contact counts only if its normal force exceeds X times the mean.
    """
    contact_tolerance: float = sample(values.parse_share, default=0)
    """
    For contacts found by geometry: two grains touch if their distance is below (r1 + r2)(1 + X).
    """
    axis: Axis = fabric(values.parse_axis, form="x|y|z|X,Y,Z")
    """
    Loading axis, along which the anisotropies are signed (default: z; for discs the second axis of
    their plane).
    """
    with_: tuple[str, ...] = fabric(values.parse_groups, form="GROUP,...", words=values.GROUP_NAMES)
    """
    Groups of further columns: forces (branches, strong and weak contacts), state (void ratio,
    stress, fabric against stress), invariants, harmonics. Several: forces,state.
    """
    strain: str = sample(
        values.parse_strain, default="auto", form="|".join([*STRAIN_MODES, "FILE.csv"])
    )
    """
    What the axial strain is measured by: the extent of cell, boundary or grains, or FILE.csv with
    the columns step (or frame) and strain. auto: the cell if it is periodic along the loading axis,
    else the boundary; without either the strain is empty.
    """
    frames: slice = reading(parse_frames, form="A:B:C", first=True)
    """
    Which frames: a number (0 is the first, -1 the last), or a Python slice such as :10, ::5 or -3:
    (default: all).
    """
    reference: int | None = reading(
        optional(whole("the number of a frame, such as 0 or -1", lambda _: True)), form="FRAME"
    )
    """
    Number of the reference frame in each series. This frame sets L0, the RV, rmin, rmean and rmax,
    and the blocks of a map. A negative number counts from the end (default: the first frame that
    has grains).
    """
    seed: int = scan(values.parse_count, default=0)
    """Seed of the random numbers."""
    workers: int = scan(values.parse_workers, first=True, decides=False)
    """Number of parallel workers (default: all cores)."""
    on_error: str = reading(default="stop", form="stop|skip")
    """What to do when a frame cannot be read."""

    def __init__(self, **options: Any) -> None:
        """Check the options as users write them, and keep what they mean."""
        fill(self, options, READING_OPTIONS)
        for problem in self._clashes():
            raise SettingsError(problem)
        # Only a cylinder is checked here: other shapes may be those of discs, which a frame tells.
        if self.rv_shape == "cylinder":
            self._check_sizes(3)

    def __repr__(self) -> str:
        options = options_of(type(self))
        written = {one.name: as_written(getattr(self, one.name)) for one in options}
        usual = {one.name: as_written(one.parse(one.name, one.default)) for one in options}
        chosen = [f"{name}={value!r}" for name, value in written.items() if value != usual[name]]
        return f"{type(self).__name__}({', '.join(chosen)})"

    def _clashes(self) -> Iterator[str]:
        """Messages about options that contradict each other, each with what to do."""
        is_file, several = self.rv_shape not in SHAPES, f"`rv` asks for {len(self.rvs)}"
        sizes = {"rv_radius": self.rv_radius, "rv_size": self.rv_size, "rv_shape": is_file}
        for name in (name for name, given in sizes.items() if given and len(self.rvs) > 1):
            yield f"{name}: gives the RV one size, but {several}: leave out one of the two options"
        for name, (other, needed) in NEEDS.items():
            found, choose = (
                getattr(self, other),
                " or ".join(f'`{other}="{one}"`' for one in needed),
            )
            if getattr(self, name) and found not in needed:
                advice = f"leave out `{name}`, or choose {choose}"
                yield f"{name}: has no meaning if `{other}` is {found}: {advice}"
        if self.rv_follows == "strain" and self.strain not in STRAIN_MODES:
            lack = f"a file of strains ({self.strain}) does not give the strains along all axes"
            yield f"rv_follows: {lack}: choose another `strain`, or leave out `rv_follows`"
        if self.edge == ENDS and self.moment != 1:
            lack = "`edge=ends` does not give the second moment of the full lengths"
            yield f"moment: {lack}: choose `edge=start`, or `moment=1`"

    def _check_sizes(self, dimension: int) -> None:
        """Raise DimensionError if the RV has too many or too few sizes for discs or spheres."""
        shape, sizes = self.rv_shape, self.rv_size
        if sizes and len(sizes) != (2 if shape == "cylinder" else dimension):
            found, takes = ",".join(f"{size:g}" for size in sizes), SHAPES[shape]
            if dimension == 2:
                takes = takes.replace("A,B,C", "A,B in the plane of the discs")
            expected = f"expected {takes} (`rv_shape` is {shape})"
            raise DimensionError(f"rv_size: {expected}, found {found}")

    def in_space(self, space: Space) -> Settings:
        """
        Adapt settings to discs in a plane; settings for spheres do not change.

        Parameters
        ----------
        space : Space
            Space of the reference frame: only a frame shows that the grains are discs.

        Returns
        -------
        Settings
            Settings with an axis in the plane, and with directions in the plane.

        Raises
        ------
        SettingsError
            If the settings are for spheres and the grains are discs, or the other way round.
        """
        self._check_sizes(space.dimension)
        if space.across is None:
            return self
        if self.rv_shape not in ("sphere", "box", "ellipsoid"):
            choose = "choose sphere (a circle), box (a rectangle) or ellipsoid (an ellipse)"
            what = f"{self.rv_shape} is no window for discs in {space}"
            raise DimensionError(f"rv_shape: {what}: {choose}")
        rule = self.directions
        if rule is not None and rule.space != space:
            if rule.asked is None:
                what = f"{rule.name} is a rule for three dimensions, but all discs lie in {space}"
                raise DimensionError(f"directions: {what}: choose a number of axes, such as 16")
            # as many equal angles as axes were asked for
            rule = rule_of(rule.asked, space)
        return replace(self, axis=self._axis_in(space, space.across), directions=rule)

    def _axis_in(self, space: Space, across: int) -> Axis:
        """The loading axis in a plane; the default is the second axis of the plane."""
        axis, (first, second) = self.axis, ("xyz"[k] for k in sorted(space.along))
        if isinstance(axis, values.UsualAxis):
            return values.AXES[second]
        if abs(axis[across]) > ROUNDING:
            named = as_written(axis)
            spelt = named if isinstance(named, str) else spelt_place(axis)
            choose = f"choose {first}, {second}, or another axis in the plane"
            what = f"the axis {spelt} leads out of {space} of the discs"
            raise DimensionError(f"axis: {what}: {choose}")
        return axis

    def aim(self, sample_error: float | None = None) -> float:
        """
        The standard error of ``alpha_vs_axial`` that the scan of a row aims at.

        Parameters
        ----------
        sample_error : float, optional
            The row's error due to the sample, dimensionless.

        Returns
        -------
        float
        """
        if self.tolerance is not None:
            return self.tolerance
        return max(LEAST_TOLERANCE, OF_SAMPLE * (sample_error or 0.0))

    @property
    def budget(self) -> float:
        """Most chords of an auto scan."""
        return self.max_chords or (MAX_CHORDS_AUTO if self.tolerance is None else MAX_CHORDS)

    @property
    def rvs(self) -> tuple[float, ...]:
        """The sizes of all RVs."""
        return self.rv if isinstance(self.rv, tuple) else (self.rv,)

    @property
    def more_columns(self) -> tuple[str, ...]:
        """Names of columns that only these settings add to the default columns."""
        # to print the help of a command needs no fabric
        from scanfab.fabric.registry import GROUPS
        from scanfab.table.columns import EDGE_COLUMNS, RV_COLUMN

        shaped = self.rv_shape != "sphere" or self.rv_follows != "none"
        several = len(self.rvs) > 1
        of_window = {RV_COLUMN.name: several, "window_alpha_vs_axial": shaped}
        columns = [name for name, asked in of_window.items() if asked and self.needs_window]
        columns += [column.name for column in EDGE_COLUMNS if self.edge != CLIP]
        columns += ["alpha_vs_axial_contacts"] * bool(self.cutoffs)
        columns += [column.name for group in self.with_ for column in GROUPS[group].columns]
        return tuple(columns)

    @property
    def columns(self) -> tuple[Column, ...]:
        """All columns of the table."""
        from scanfab.table.columns import table_columns

        return table_columns(self.more_columns)

    @property
    def lists_gaps(self) -> bool:
        """Whether the scan must list all gaps, for several cut-offs or another moment."""
        return bool(self.cutoffs) or self.moment != 1

    @property
    def blocks(self) -> int:
        """Number of parts of the sample that have rows of their own; a map has more than one."""
        return 1

    @property
    def rows_per_frame(self) -> int:
        """Number of rows per frame: one for each variant, RV, cut-off and block."""
        windows = sum(len(self.rvs) if variant in "cd" else 1 for variant in self.variants)
        return windows * max(len(self.cutoffs), 1) * self.blocks

    @property
    def needs_window(self) -> bool:
        """Whether any variant needs the RV."""
        return "c" in self.variants or "d" in self.variants
