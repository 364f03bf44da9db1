"""The plan of a series: settings turned into lengths by its reference frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

from scanfab.base.convex import Convex
from scanfab.base.errors import Note, SettingsError
from scanfab.base.shapes import sphere
from scanfab.base.space import Space
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.packing.window import SurfaceBox, Window
from scanfab.pipeline.map_blocks import MapBlocks
from scanfab.pipeline.map_settings import MapSettings
from scanfab.pipeline.rv import RV, Deformation, doubts_of_rv, in_sample, rvs_of
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.strain import Strains
from scanfab.scan.directions import DirectionRule, usual_rule

# number of replicates of a fixed scan, and least number of an auto scan
REPLICATES = 16
# most replicates of a scan that adds directions until the error between replicates is small
MOST_REPLICATES = 64
# with fewer lines along an axis, the mean lengths of a replicate are too uncertain
FEWEST_LINES = 30
# closest spacing, relative to the reach of the scanned region; closer lines would take for ever
CLOSEST = 1e-9
# in mean radii: lines at this distance are independent of one another
WIDE = 3.0


class Noise(NamedTuple):
    """How many segments a scan needs for its error, as measured in dense packings."""

    segments: float
    """Number of segments for a standard error of 1, at a spacing of the mean radius."""
    growth: float
    """The number of segments grows with this power of the spacing."""
    close: float
    """Spacing in mean radii below which closer lines add little information."""


# By dimension. Spheres: measured in dense packings with equal radii and with radii in the ratio 3
# and 10; at a spacing of a third of a radius, only the choice of directions adds noise. Discs:
# measured in dense packings with radii in the ratio 1.9 (sample_data/lammps_biaxial) before and
# after shear; 0.025 to 0.039 segments are needed at a spacing of one radius, 0.011 to 0.016 at 0.3
# and 0.004 to 0.006 at 0.1.
NOISE = {3: Noise(0.068, 0.75, 0.3), 2: Noise(0.032, 0.8, 0.1)}


class Region(NamedTuple):
    """Size of a scanned region and of the grains in it."""

    area: float
    """Projected area, averaged over directions (in a plane a length)."""
    depth: float
    """Three quarters of the mean length of lines in it; for a sphere, the radius."""
    radius: float
    """Mean radius of the grains in the reference frame."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that is needed to compute the frames of a series; lengths in the dump's unit."""

    settings: Settings
    """Settings as users made them, adapted to the plane of discs."""
    space: Space
    """The plane of the grains, if they are discs."""
    strains: Strains
    variants: str
    workers: int
    """Number of threads for the scan of a frame."""
    max_chords: float
    """An auto scan stops before it cuts more chords."""
    rule: DirectionRule
    rvs: tuple[RV, ...]
    """
    The RVs in ascending order, as they lie in the reference frame. After :meth:`in_frame`: as they
    lie in that frame, and those without a void fabric last. The first RV is scanned until its
    tolerance is met; the others are scanned along the same lines.
    """
    cutoffs: tuple[float, ...]
    """Cut-offs of the table's rows, in ascending order."""
    cutoff: float
    """Cut-off at which the scan must meet the tolerance."""
    spacing: float
    """Distance between the lines of one axis and replicate."""
    replicates: int
    """Number of replicates of a fixed scan, or of the first round of an auto scan."""
    auto: str
    """What the scan may add to meet the tolerance: ``""``, ``replicates`` or ``directions``."""
    region: Region
    """The scanned region, from which the spacing of an auto scan follows."""
    of_whole: dict[str, Any] | None = None
    """
    Spacing, replicates and region of the whole sample, if its auto scan has lines of its own.
    """
    deformation: Deformation | None = None
    """The deformation that the windows follow; None if they keep their shape."""
    map_blocks: MapBlocks | None = None
    """The region that the blocks of a map tile; None for other tables."""
    notes: tuple[Note, ...] = ()
    """Doubts about the settings, for the user who has chosen them."""

    @property
    def window(self) -> Window | None:
        """The RV that is scanned; None if no variant needs one."""
        return next(iter(self.windows), None)

    @property
    def windows(self) -> list[Window]:
        """The windows of all RVs."""
        return [rv.window for rv in self.rvs if rv.window is not None]

    def rvs_of(self, variant: str) -> tuple[RV, ...]:
        """The RVs of a variant's rows; for the whole sample, one entry without a window."""
        return self.rvs if VARIANTS[variant].in_window else (RV(),)

    def in_frame(self, sample: Sample) -> Plan:
        """
        The plan with the RVs as they lie in a frame.

        The first RV, whose scan decides on the lines of all, is one that has a void fabric, if any.
        """
        rvs = self.rvs if self.deformation is None else self.deformation.rvs_in(sample, self.rvs)
        rvs = tuple(in_sample(rv, sample) for rv in rvs)
        return replace(self, rvs=tuple(sorted(rvs, key=lambda rv: rv.lack != "")))

    def scans(self) -> Iterator[Plan]:
        """
        The plans of the separate scans of a frame.

        Variants share the lines of a fixed scan. An auto scan needs other lines for the whole
        sample than for the RV, so it is two scans, each until its tolerance is met.
        """
        if self.of_whole is None:
            yield self
            return
        whole, inner = (
            "".join(name for name in self.variants if VARIANTS[name].in_window is in_window)
            for in_window in (False, True)
        )
        yield replace(self, variants=whole, rvs=(), **self.of_whole, of_whole=None)
        yield replace(self, variants=inner, of_whole=None)

    def aiming_at(self, tolerance: float) -> Plan:
        """The plan with the spacing at which an auto scan begins for a tolerance."""
        if self.auto != "replicates":
            return self
        blocks = self.settings.blocks
        spacing = _auto_spacing(self.region, len(self.rule), tolerance, blocks, self.space)
        return replace(self, spacing=spacing)

    def along(self, replicates: int) -> Iterator[Plan]:
        """A plan for each further RV, with the same lines as for the first."""
        variants = "".join(name for name in self.variants if VARIANTS[name].in_window)
        for rv in self.rvs[1:]:
            yield replace(self, rvs=(rv,), variants=variants, replicates=replicates, auto="")


def make_plan(settings: Settings, sample: Sample) -> Plan:
    """
    Make the plan of a series from settings and the reference frame.

    Parameters
    ----------
    settings : Settings
        Settings; all later steps use only the plan.
    sample : Sample
        The reference frame.

    Raises
    ------
    SettingsError
        If the settings do not fit the packing.
    PackingError
        If the packing cannot be measured.
    """
    packing = sample.packing
    settings = settings.in_space(packing.space)
    space, rule = packing.space, settings.directions or usual_rule(packing.space)
    rvs, radii = rvs_of(settings, sample), packing.radius[sample.grains]
    lengths = {"rmin": float(radii.min()), "rmean": float(radii.mean()), "rmax": float(radii.max())}
    box = SurfaceBox.of(packing, sample.gathered)
    windows = [rv.window for rv in rvs if rv.window is not None]
    window = next(iter(windows), None)
    for one in windows:
        one.check_fits(packing)
    notes = [note for one in windows for note in doubts_of_rv(one, sample)]
    blocks = deformation = None
    if isinstance(settings, MapSettings):
        blocks = MapBlocks.of(settings, sample)
        notes += blocks.doubts(sample, window)
    if rule.bias > 0.1 * settings.aim():
        text = f"directions {rule.name}: an isotropic sample would get alpha = {rule.bias:.2g}"
        notes.append(Note("biased_directions", text))
    if settings.rv_follows != "none" and windows:
        deformation = Deformation.since(sample, settings.strain, settings.axis)
    cutoff, lines = settings.cutoff.resolve(lengths), partial(_lines, settings, rule, box)
    chosen = lines(window.shape if window else None, lengths)
    most, of_whole = settings.budget, None
    if window is not None and chosen["auto"]:
        # The limit of chords holds for all RVs together. The first RV gets the fraction that its
        # scan needs at least: its part of the total volume.
        most *= window.shape.volume / sum(one.shape.volume for one in windows)
        if not all(VARIANTS[name].in_window for name in settings.variants):
            of_whole = {**lines(None, lengths), "max_chords": settings.budget}
    return Plan(
        settings=settings,
        space=space,
        strains=Strains.of(settings, sample),
        variants=settings.variants,
        workers=settings.workers,
        max_chords=most,
        rule=rule,
        rvs=rvs,
        deformation=deformation,
        cutoff=cutoff,
        # equal cut-offs are kept, so that the number of rows is as the settings say
        cutoffs=tuple(sorted(length.resolve(lengths) for length in settings.cutoffs)) or (cutoff,),
        map_blocks=blocks,
        notes=tuple(notes),
        of_whole=of_whole,
        **chosen,
    )


def _lines(
    settings: Settings,
    rule: DirectionRule,
    box: SurfaceBox,
    shape: Convex | None,
    lengths: dict[str, float],
) -> dict[str, Any]:
    """Spacing of the lines, number of replicates, what an auto scan may add, and the region."""
    space = box.space
    # the window, or for the whole sample the sphere of half its smallest extent
    shape = shape or sphere(0.5 * box.smallest_extent, space)
    area, reach = shape.mean_shadow, shape.reach
    region = Region(area, 0.75 * shape.volume / area, lengths["rmean"])
    if settings.spacing is None:
        spacing = _auto_spacing(region, len(rule), settings.aim(), settings.blocks, space)
        words = {"replicates": REPLICATES, "auto": "replicates", "region": region}
        return {"spacing": spacing, **words}
    spacing = settings.spacing.resolve(lengths)
    if not CLOSEST * reach <= spacing <= 2.0 * reach:
        raise SettingsError(
            f"spacing: expected a length from {CLOSEST * reach:.2g} to {2.0 * reach:.4g}, found "
            f"{spacing:g}: lengths have the dump's unit; did you mean 1rmin ({lengths['rmin']:g})?"
        )
    auto = "directions" if settings.directions is None else ""
    fewest, most = (REPLICATES, MOST_REPLICATES) if auto else (1, REPLICATES)
    replicates = int(min(max(space.lines(area, spacing) / FEWEST_LINES, fewest), most))
    spacing *= space.apart(replicates)
    return {"spacing": spacing, "replicates": replicates, "auto": auto, "region": region}


def _auto_spacing(region: Region, axes: int, tolerance: float, blocks: int, space: Space) -> float:
    """
    Spacing of the lines in one replicate at which the first round probably meets the tolerance.

    The spacing is limited: if it is too wide, a replicate has too few lines; if it is too close,
    more directions would reduce the error more.
    """
    noise, (area, depth, radius) = NOISE[space.dimension], region
    segments_per_line = max(depth / (3.0 * radius), 1.0)
    # the needed number of lines per axis and replicate, which is area / spacing²
    lines = noise.segments / tolerance**2 / (REPLICATES * axes * segments_per_line)
    # each block of a map gets its share of the lines
    lines *= blocks
    apart = area / lines / radius ** (space.dimension - 1)
    spacing = radius * max(
        min(math.pow(apart, 1.0 / (space.dimension - 1.0 + noise.growth)), WIDE),
        space.apart(apart / WIDE**noise.growth),
    )
    return min(max(spacing, noise.close * radius), space.apart(area / (4 * FEWEST_LINES)))
