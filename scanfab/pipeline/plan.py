"""The plan of a series: settings turned into lengths, from its first frame that has grains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from scanfab.base.convex import Convex
from scanfab.base.errors import Note, SettingsError
from scanfab.base.shapes import circle
from scanfab.base.space import SPACE, Space
from scanfab.packing.doubts import refuse_impossible
from scanfab.packing.sample import VARIANTS, Sample, SampleRule
from scanfab.packing.window import SurfaceBox, Window
from scanfab.pipeline.frames import sample_rule
from scanfab.pipeline.maps.blocks import MapBlocks, map_blocks
from scanfab.pipeline.maps.settings import MapSettings
from scanfab.pipeline.rv import RV, Deformation, doubts_of_rv, sizes_of, windows_of
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.strain import Strains
from scanfab.pipeline.values import Vector
from scanfab.pipeline.window_settings import settings_in
from scanfab.scan.directions import DirectionRule, usual_rule

# replicates of a fixed scan, and at least of an auto scan
REPLICATES = 16
# and at most of one whose directions are added until its error, as these tell it, is small enough
MOST_REPLICATES = 64
# lines of one axis below which a replicate's mean lengths are too uncertain to be of use
FEWEST_LINES = 30
# of what is scanned: far closer lines than anyone could wait for
CLOSEST = 1e-9
# of the mean radius: lines so far apart know nothing of one another
WIDE = 3.0


class Noise(NamedTuple):
    """What the error of a scan costs, as it was measured."""

    segments: float
    """For a standard error of 1, at a spacing of the mean radius."""
    growth: float
    """The power of the spacing that they grow with."""
    close: float
    """Of the mean radius: closer lines say little more than those between which they lie."""


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
    """Of the first frame that has grains, if :meth:`in_frame` has not put others in their place, in
    ascending order; the first is scanned until its tolerance holds, the others along its lines."""
    deformation: Deformation | None
    """What the windows follow."""
    more_columns: tuple[str, ...]
    """Of the table, behind those that it always has."""
    groups: tuple[str, ...]
    """Of further columns, see :data:`scanfab.fabric.registry.GROUPS`."""
    cutoff: float
    """Of the scan that is to meet the tolerance."""
    cutoffs: tuple[float, ...]
    """Of the table's rows, in ascending order."""
    rule: DirectionRule
    spacing: float
    """Between the lines of one axis and replicate."""
    replicates: int
    """Of a fixed scan; of the first round of an auto scan."""
    auto: str
    """What the scan may add to meet the tolerance: ``""``, ``replicates`` or ``directions``."""
    rule_is_asked_for: bool
    """Then an auto scan keeps it."""
    edge: str
    """What counts at the window's surface, see :mod:`scanfab.scan.edges`."""
    lists_gaps: bool
    """Whether sums for one cut-off do not suffice."""
    map_settings: MapSettings | None = None
    """Of a map; else None."""
    map_blocks: MapBlocks | None = None
    """Of a map whose series has grains: what its blocks tile."""
    space: Space = SPACE
    """The plane in which all grains of the series lie, if they are discs."""
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
        """Those that a variant has rows for; of the whole one that is none."""
        return self.rvs if VARIANTS[variant].in_window else (RV(),)

    def in_frame(self, sample: Sample) -> Plan:
        """The plan with the windows as they lie in a frame."""
        if self.deformation is None:
            return self
        return self._with(self.deformation.windows_in(sample, self.windows))

    def _with(self, windows: Sequence[Window]) -> Plan:
        rvs = zip(self.rvs, windows, strict=True)
        return replace(self, rvs=tuple(rv._replace(window=window) for rv, window in rvs))

    def along(self, replicates: int) -> Iterator[Plan]:
        """The plans of the other RVs, for the lines that the first was scanned along."""
        variants = "".join(one for one in self.variants if VARIANTS[one].in_window)
        for rv in self.rvs[1:]:
            yield replace(self, rvs=(rv,), variants=variants, replicates=replicates, auto="")


def make_plan(settings: Settings, sample: Sample, strains: Strains | None = None) -> Plan:
    """
    Resolve settings with the first frame that has grains.

    Parameters
    ----------
    settings : Settings
        Nothing behind the plan sees them.
    sample : Sample
        The first frame that has grains.
    strains : Strains, optional
        What the settings say of strains, if that has been looked up already.

    Raises
    ------
    SettingsError
        If the settings do not fit the packing.
    PackingError
        If the packing cannot be measured.
    """
    refuse_impossible(sample)
    space = sample.packing.space
    settings = settings_in(settings, space)
    grains = sample.grains
    radii = sample.packing.radius[grains]
    lengths = {
        "rmin": float(radii.min()),
        "rmean": float(radii.mean()),
        "rmax": float(radii.max()),
    }
    box = SurfaceBox.of(sample.packing, sample.gathered)
    strains = replace(strains or Strains.of(settings), axis=settings.axis)
    plan = _without_lengths(settings, strains, space)
    notes: list[Note] = []
    windows = windows_of(sample, settings) if settings.needs_window else []
    for window in windows:
        notes += doubts_of_rv(window, sample, box, lengths["rmax"])
    blocks: MapBlocks | None = None
    if isinstance(settings, MapSettings):
        blocks = map_blocks(settings, sample)
        notes += blocks.doubts(sample, next(iter(windows), None), lengths["rmean"])
    scanned = _scanned(box, windows[0].shape if windows else None)
    rule = plan.rule
    if rule.bias > 0.1 * settings.tolerance:
        text = f"directions {rule.name}: an isotropic sample would get alpha = {rule.bias:.2g}"
        notes.append(Note("biased_directions", text))
    cutoff = settings.cutoff.resolve(lengths)
    # as many as were asked for, also if two are equal: every frame has the same number of rows
    cutoffs = tuple(sorted(one.resolve(lengths) for one in settings.cutoffs)) or (cutoff,)
    return replace(
        plan._with(windows),
        strains=plan.strains.since(sample),
        deformation=_deformation(settings, sample),
        max_chords=plan.max_chords * _share_of_first(windows, settings),
        cutoff=cutoff,
        cutoffs=cutoffs,
        map_blocks=blocks,
        notes=tuple(notes),
        **_lines(settings, rule, scanned, lengths),
    )


def _deformation(settings: Settings, sample: Sample) -> Deformation | None:
    if settings.rv_follows == "none" or not settings.needs_window:
        return None
    return Deformation.since(sample, settings.strain, settings.axis)


def _share_of_first(windows: Sequence[Window], settings: Settings) -> float:
    """The part of all chords that the scan of the first RV, of several, cuts at least."""
    if len(windows) < 2:
        return 1.0
    if any(not VARIANTS[one].in_window for one in settings.variants):
        # the first scan is that of the whole, too
        return 1.0 / len(windows)
    volumes = [one.shape.volume for one in windows]
    return volumes[0] / sum(volumes)


class _Scanned(NamedTuple):
    """How large is what lines scan: the window, or of the whole half the smallest extent."""

    reach: float
    area: float
    """That lines of one direction pierce, in the mean of all; in a plane a length."""
    depth: float
    """Three quarters of the mean length of the lines in it: of a sphere the radius."""
    space: Space


def _scanned(box: SurfaceBox, window: Convex | None) -> _Scanned:
    space = box.space
    if space.is_plane:
        window = window or circle(0.5 * box.smallest_extent, space)
    elif window is None or window.is_sphere:
        reach = 0.5 * box.smallest_extent if window is None else window.reach
        return _Scanned(reach, math.pi * reach**2, reach, space)
    area = window.mean_shadow
    return _Scanned(window.reach, area, 0.75 * window.volume / area, space)


def _lines(
    settings: Settings, rule: DirectionRule, scanned: _Scanned, lengths: dict[str, float]
) -> dict[str, Any]:
    """How close the lines are, in how many replicates, and what an auto scan may add."""
    reach = scanned.reach
    if settings.spacing is None:
        spacing = _auto_spacing(settings, len(rule), scanned, lengths)
        return {"spacing": spacing, "replicates": REPLICATES, "auto": "replicates"}
    asked = settings.spacing.resolve(lengths)
    if asked > 2.0 * reach:
        what = "RV" if settings.needs_window else "sample"
        raise SettingsError(
            f"spacing: {asked:g} between lines is more than the {what} is wide ({2.0 * reach:g}): "
            f"lengths are in the dump's unit; did you mean 1rmin ({lengths['rmin']:g})?"
        )
    if asked < CLOSEST * reach:
        raise SettingsError(
            f"spacing: {asked:g} between lines is less than {CLOSEST:g} of the radius of what they "
            f"scan ({reach:g}): choose a wider spacing"
        )
    lines = scanned.space.lines(scanned.area, asked)
    auto = "directions" if settings.directions is None else ""
    fewest, most = (REPLICATES, MOST_REPLICATES) if auto else (1, REPLICATES)
    replicates = int(min(max(lines / FEWEST_LINES, fewest), most))
    spacing = asked * scanned.space.apart(replicates)
    return {"spacing": spacing, "replicates": replicates, "auto": auto}


def plan_without_grains(settings: Settings) -> Plan:
    """The plan of a series without any grain: its frames have rows, but nothing is scanned."""
    return _without_lengths(settings, Strains.of(settings))


def _without_lengths(settings: Settings, strains: Strains, space: Space = SPACE) -> Plan:
    """What settings say by themselves."""
    return Plan(
        samples=sample_rule(settings),
        strains=strains,
        variants=settings.variants,
        axis=settings.axis,
        moment=settings.moment,
        seed=settings.seed,
        workers=settings.workers,
        tolerance=settings.tolerance,
        max_chords=settings.max_chords,
        rvs=sizes_of(settings),
        deformation=None,
        more_columns=settings.more_columns,
        groups=settings.with_,
        cutoff=math.nan,
        cutoffs=(math.nan,) * max(len(settings.cutoffs), 1),
        rule=settings.directions or usual_rule(space),
        spacing=math.nan,
        replicates=0,
        auto="",
        rule_is_asked_for=settings.directions is not None,
        edge=settings.edge,
        lists_gaps=settings.lists_gaps,
        map_settings=settings if isinstance(settings, MapSettings) else None,
        space=space,
    )


def _auto_spacing(
    settings: Settings, axes: int, scanned: _Scanned, lengths: dict[str, float]
) -> float:
    """
    Spacing of one replicate's lines at which the first round is likely to meet the tolerance.

    Never so wide that lines get too few, nor closer than is of use: more directions are added then.
    """
    area, radius, space = scanned.area, lengths["rmean"], scanned.space
    noise = NOISE[space.dimension]
    segments_per_line = max(scanned.depth / (3.0 * radius), 1.0)
    # lines * segments_per_line = segments, and lines are so many axes' area / spacing²
    lines = noise.segments / settings.tolerance**2 / (REPLICATES * axes * segments_per_line)
    # of which each block gets its share
    lines *= settings.blocks
    apart = area / lines / radius ** (space.dimension - 1)
    spacing = radius * max(
        min(math.pow(apart, 1.0 / (space.dimension - 1.0 + noise.growth)), WIDE),
        space.apart(apart / WIDE**noise.growth),
    )
    return min(max(spacing, noise.close * radius), space.apart(area / (4 * FEWEST_LINES)))
