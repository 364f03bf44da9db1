"""The plan of a series: settings turned into lengths, from its first frame that has grains."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from scanfab.base.convex import Convex
from scanfab.base.errors import Note, SettingsError
from scanfab.base.shapes import sphere
from scanfab.base.space import SPACE, Space
from scanfab.packing.doubts import refuse_impossible
from scanfab.packing.sample import VARIANTS, Sample, SampleRule
from scanfab.packing.window import SurfaceBox, Window
from scanfab.pipeline.frames import sample_rule
from scanfab.pipeline.maps.blocks import MapBlocks
from scanfab.pipeline.maps.settings import MapSettings
from scanfab.pipeline.rv import RV, Deformation, doubts_of_rv, sizes_of, windows_of
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.strain import Strains
from scanfab.pipeline.values import Vector
from scanfab.pipeline.window_settings import settings_in
from scanfab.scan.directions import DirectionRule, usual_rule

# settings that a plan takes over unchanged
AS_ASKED = (
    "variants", "axis", "moment", "seed", "workers", "tolerance", "max_chords", "more_columns",
    "edge", "lists_gaps",
)  # fmt: skip
# replicates of a fixed scan, and at least of an auto scan
REPLICATES = 16
# replicates at most of a scan that adds directions until its error, as they tell it, is small
MOST_REPLICATES = 64
# with fewer lines along an axis, the mean lengths of a replicate are too uncertain to be of use
FEWEST_LINES = 30
# the closest spacing, over the reach of what is scanned: nobody could wait for closer lines
CLOSEST = 1e-9
# in mean radii: lines so far apart are independent of one another
WIDE = 3.0


class Noise(NamedTuple):
    """How many segments a scan needs for its error, as measured in dense packings."""

    segments: float
    """Number for a standard error of 1, at a spacing of the mean radius."""
    growth: float
    """The number grows with this power of the spacing."""
    close: float
    """A spacing in mean radii: closer lines say little more than their neighbours do."""


# By dimension. In dense packings of spheres whose radii are equal, or in the ratio 3 or 10, the
# choice of directions is all that remains of the noise at a third of a radius. In dense packings of
# discs, in the ratio 1.9 (sample_data/lammps_biaxial), it takes 0.025 to 0.039 segments at one
# radius, 0.011 to 0.016 at 0.3 and 0.004 to 0.006 at 0.1, before shear and after.
NOISE = {3: Noise(0.068, 0.75, 0.3), 2: Noise(0.032, 0.8, 0.1)}


@dataclass(frozen=True, eq=False)
class Plan:
    """All that the frames of a series need to be computed; lengths in the dump's unit."""

    samples: SampleRule
    """What is a grain, and what a rattler."""
    strains: Strains
    variants: str
    axis: Vector
    """Loading axis, a unit vector."""
    moment: int
    """1: ℓ is the mean length; 2: the mean of squares over the mean."""
    seed: int
    workers: int
    """Threads of a frame's scan."""
    tolerance: float
    """Of an auto scan: the wanted standard error of alpha_vs_axial."""
    max_chords: float
    """An auto scan stops before it cuts more."""
    rvs: tuple[RV, ...]
    """
    The RVs in ascending order: as they lie in the first frame that has grains, or, after
    :meth:`in_frame`, in another one. The first is scanned until its tolerance holds, the others
    along the same lines.
    """
    more_columns: tuple[str, ...]
    """Further columns of the table, behind those that every table has."""
    groups: tuple[str, ...]
    """Of further columns, see :data:`scanfab.fabric.registry.GROUPS`."""
    cutoffs: tuple[float, ...]
    """Cut-offs of the table's rows, in ascending order."""
    rule: DirectionRule
    rule_is_asked_for: bool
    """Whether the user chose the rule; then an auto scan keeps it."""
    edge: str
    """What counts at the window's surface, see :mod:`scanfab.scan.edges`."""
    lists_gaps: bool
    """Whether sums for one cut-off do not suffice."""
    map_settings: MapSettings | None
    """Of a map; else None."""
    space: Space
    """The plane in which all grains of the series lie, if they are discs."""
    # the fields below are unknown for a series without grains
    cutoff: float = math.nan
    """Cut-off of the scan that is to meet the tolerance."""
    spacing: float = math.nan
    """Between the lines of one axis and replicate."""
    replicates: int = 0
    """Of a fixed scan; of the first round of an auto scan."""
    auto: str = ""
    """What the scan may add to meet the tolerance: ``""``, ``replicates`` or ``directions``."""
    deformation: Deformation | None = None
    """What the windows follow."""
    map_blocks: MapBlocks | None = None
    """Of a map whose series has grains: what its blocks tile."""
    notes: tuple[Note, ...] = ()
    """What is doubtful about the settings, for a user who has chosen them."""

    @property
    def window(self) -> Window | None:
        """The RV that is scanned; None if no variant needs one."""
        return next(iter(self.windows), None)

    @property
    def windows(self) -> list[Window]:
        """All RVs."""
        return [one.window for one in self.rvs if one.window is not None]

    def rvs_of(self, variant: str) -> tuple[RV, ...]:
        """The RVs that a variant has rows for; the whole has one entry without a window."""
        return self.rvs if VARIANTS[variant].in_window else (RV(),)

    def in_frame(self, sample: Sample) -> Plan:
        """The plan with the windows as they lie in a frame."""
        if self.deformation is None:
            return self
        windows = self.deformation.windows_in(sample, self.windows)
        rvs = zip(self.rvs, windows, strict=True)
        return replace(self, rvs=tuple(RV(rv.fraction, window) for rv, window in rvs))

    def along(self, replicates: int) -> Iterator[Plan]:
        """A plan for each of the other RVs, with the lines that the first was scanned along."""
        variants = "".join(one for one in self.variants if VARIANTS[one].in_window)
        for rv in self.rvs[1:]:
            yield replace(self, rvs=(rv,), variants=variants, replicates=replicates, auto="")


def plan_without_grains(settings: Settings, space: Space = SPACE) -> Plan:
    """
    The plan as far as settings alone decide it.

    A series without any grain keeps this plan: its frames have rows, but nothing is scanned.
    """
    return Plan(
        samples=sample_rule(settings),
        strains=Strains.of(settings),
        rvs=sizes_of(settings),
        groups=settings.with_,
        cutoffs=(math.nan,) * max(len(settings.cutoffs), 1),
        rule=settings.directions or usual_rule(space),
        rule_is_asked_for=settings.directions is not None,
        map_settings=settings if isinstance(settings, MapSettings) else None,
        space=space,
        **{name: getattr(settings, name) for name in AS_ASKED},
    )


def make_plan(settings: Settings, sample: Sample) -> Plan:
    """
    Resolve settings with the first frame that has grains.

    Parameters
    ----------
    settings : Settings
        Later steps see only the plan.
    sample : Sample
        The first frame that has grains.

    Raises
    ------
    SettingsError
        If the settings do not fit the packing.
    PackingError
        If the packing cannot be measured.
    """
    refuse_impossible(sample)
    packing, space = sample.packing, sample.packing.space
    settings = settings_in(settings, space)
    plan = plan_without_grains(settings, space)
    radii = packing.radius[sample.grains]
    lengths = {"rmin": float(radii.min()), "rmean": float(radii.mean()), "rmax": float(radii.max())}
    box = SurfaceBox.of(packing, sample.gathered)
    windows = windows_of(sample, settings) if settings.needs_window else []
    notes = [note for one in windows for note in doubts_of_rv(one, sample, box, lengths["rmax"])]
    blocks: MapBlocks | None = None
    if isinstance(settings, MapSettings):
        blocks = MapBlocks.of(settings, sample)
        notes += blocks.doubts(sample, windows[0] if windows else None, lengths["rmean"])
    if plan.rule.bias > 0.1 * settings.tolerance:
        name, bias = plan.rule.name, plan.rule.bias
        text = f"directions {name}: an isotropic sample would get alpha = {bias:.2g}"
        notes.append(Note("biased_directions", text))
    deformation = None
    if settings.rv_follows != "none" and settings.needs_window:
        deformation = Deformation.since(sample, settings.strain, settings.axis)
    cutoff = settings.cutoff.resolve(lengths)
    # of several RVs the first gets the share of all chords that its scan cuts at least
    share = 1.0
    if len(windows) > 1:
        volumes = [one.shape.volume for one in windows]
        share = volumes[0] / sum(volumes)
        if any(not VARIANTS[one].in_window for one in settings.variants):
            # its scan is that of the whole, too
            share = 1.0 / len(windows)
    return replace(
        plan,
        rvs=tuple(RV(rv.fraction, one) for rv, one in zip(plan.rvs, windows, strict=True)),
        strains=plan.strains.since(sample),
        deformation=deformation,
        max_chords=plan.max_chords * share,
        cutoff=cutoff,
        # as many as were asked for, also if two are equal: all frames have the same number of rows
        cutoffs=tuple(sorted(one.resolve(lengths) for one in settings.cutoffs)) or (cutoff,),
        map_blocks=blocks,
        notes=tuple(notes),
        **_lines(settings, len(plan.rule), box, windows[0].shape if windows else None, lengths),
    )


def _lines(
    settings: Settings, axes: int, box: SurfaceBox, shape: Convex | None, lengths: dict[str, float]
) -> dict[str, Any]:
    """How close the lines are, how many replicates there are, and what an auto scan may add."""
    space = box.space
    # How large is what lines scan, the window, or of the whole half the smallest extent: its reach;
    # the area that lines of one direction pierce, in the mean of all (in a plane a length); and
    # three quarters of the mean length of the lines in it, of a sphere the radius.
    reach = 0.5 * box.smallest_extent if shape is None else shape.reach
    area, depth = math.pi * reach**2, reach
    if space.is_plane or (shape is not None and not shape.is_sphere):
        shape = shape or sphere(reach, space)
        area = shape.mean_shadow
        depth = 0.75 * shape.volume / area
    if settings.spacing is None:
        spacing = _auto_spacing(settings, axes, area, depth, lengths["rmean"], space)
        return {"spacing": spacing, "replicates": REPLICATES, "auto": "replicates"}
    asked = settings.spacing.resolve(lengths)
    if not CLOSEST * reach <= asked <= 2.0 * reach:
        raise SettingsError(
            f"spacing: expected a length from {CLOSEST * reach:.2g} to {2.0 * reach:.4g}, the "
            f"width of what is scanned, found {asked:g}: lengths are in the dump's unit; did you "
            f"mean 1rmin ({lengths['rmin']:g})?"
        )
    auto = "directions" if settings.directions is None else ""
    fewest, most = (REPLICATES, MOST_REPLICATES) if auto else (1, REPLICATES)
    replicates = int(min(max(space.lines(area, asked) / FEWEST_LINES, fewest), most))
    return {"spacing": asked * space.apart(replicates), "replicates": replicates, "auto": auto}


def _auto_spacing(
    settings: Settings, axes: int, area: float, depth: float, radius: float, space: Space
) -> float:
    """
    Spacing of one replicate's lines at which the first round is likely to meet the tolerance.

    The spacing is never so wide that a replicate has too few lines, nor so close that more
    directions would tell more.
    """
    noise = NOISE[space.dimension]
    segments_per_line = max(depth / (3.0 * radius), 1.0)
    # lines * segments_per_line = segments, and lines are so many axes' area / spacing²
    lines = noise.segments / settings.tolerance**2 / (REPLICATES * axes * segments_per_line)
    # each block of a map gets its share of the lines
    lines *= settings.blocks
    apart = area / lines / radius ** (space.dimension - 1)
    spacing = radius * max(
        min(math.pow(apart, 1.0 / (space.dimension - 1.0 + noise.growth)), WIDE),
        space.apart(apart / WIDE**noise.growth),
    )
    return min(max(spacing, noise.close * radius), space.apart(area / (4 * FEWEST_LINES)))
