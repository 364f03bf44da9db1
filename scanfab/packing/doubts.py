"""What looks wrong in a frame before anything is measured: units, clumps, cells, flat samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanfab.base.errors import Note
from scanfab.base.spelling import counted, spelt_place
from scanfab.packing.packing import FEWEST, MOST_NAMED, off_plane, space_of, spelt_plane, spelt_some
from scanfab.packing.sample import Sample

# A clump is smaller than this part of the sample, or of the period.
SMALL = 0.5
# No packing of spheres has so many contacts a grain: it has 6 at random, at most 12 in a lattice.
MANY_CONTACTS = 15
# A period is doubtful if this part of it has no grain.
EMPTY = 0.2
# What formats without a cell lack, and the option that makes up for it.
CELL_LACKS = {
    "nothing": ("this format carries no cell", "`cell=(LX, LY, LZ)`"),
    "box": ("this format has a box, but does not say whether it repeats", '`periodic="xyz"`'),
}


def doubts_of(sample: Sample, cell_is_named: bool = False) -> list[Note]:
    """
    Notes on what looks wrong in a frame whose contacts are known.

    Parameters
    ----------
    sample : Sample
        One frame.
    cell_is_named : bool, optional
        Whether the user has named the cell, or along which axes it repeats, and may be mistaken.
    """
    if len(sample.packing) < FEWEST:
        return []
    asked = {code: rule for code, rule in RULES.items() if cell_is_named or code != "empty_period"}
    return [Note(code, text) for code, rule in asked.items() if (text := rule(sample))]


def cell_hint(sample: Sample, carries: str) -> str:
    """Say that a format has no cell; nothing is wrong with it, as most samples are open."""
    if carries == "cell" or sample.packing.is_periodic:
        return ""
    lacks, cure = CELL_LACKS[carries]
    return f"{lacks}; {cure} if the sample is periodic"


def _read_as_spheres(sample: Sample) -> str:
    """Centres that lie in a plane are those of discs."""
    packing, plane = sample.packing, space_of(sample.packing.position)
    nearly, rows = off_plane(packing.position)
    if len(rows) and not packing.space.is_plane:
        return (
            f"all centres lie in {nearly} but those of {spelt_some(packing.id[rows])}, so all are "
            f"taken for spheres: `dim=2` reads discs once these grains are taken out of the dump, "
            f"`dim=3` reads spheres"
        )
    if packing.space.is_plane or not plane.is_plane:
        return ""
    return (
        f"all {len(packing)} centres lie in {plane} ({spelt_plane(packing.position, plane)}), but "
        f"are taken for spheres: `dim=2` reads discs"
    )


def _spread_bodies(sample: Sample) -> str:
    """A periodic face may cut a body, or the column may number something else."""
    bodies, cell, position = sample.packing.bodies, sample.packing.cell, sample.packing.position
    if bodies is None:
        return ""
    where, cure = "sample", "if the sample is periodic, name its cell (`cell`, `periodic`)"
    away = bodies.to_place(position, cell) / np.ptp(position, axis=0).max()
    if cell is not None and cell.is_periodic:
        where, cure = "cell", "a body longer than half a period is put together wrongly"
        away = bodies.to_place(position, cell) @ np.linalg.inv(cell.short_vectors)
        away = away[:, list(cell.periodic)]
    # a sphere at the end of a body is half its length away from its middle
    far = (np.abs(away) > 0.5 * SMALL).any(axis=1)
    if not far.any():
        return ""
    return (
        f"{counted(bodies.count(far), 'body', 'bodies')} of several spheres, such as number "
        f"{bodies.number[far][0]}, reach through more than half of the {where}: {cure}; or are "
        f"these no bodies (`bodies`)?"
    )


def _own_images(sample: Sample) -> str:
    """A grain that is larger than the cell touches its own image."""
    packing, pairs = sample.packing, sample.contacts.pairs
    itself = np.unique(pairs[pairs[:, 0] == pairs[:, 1], 0])
    if itself.size == 0 or packing.cell is None:
        return ""
    return (
        f"{itself.size} grains touch themselves, through a face of the cell: the shortest period "
        f"is {packing.cell.lattice.shortest:.3g}, their diameter up to "
        f"{2 * packing.radius[itself].max():.3g}; is the sample 2D, or the cell in another unit?"
    )


def _empty_period(sample: Sample) -> str:
    """A period that is wider than the sample leaves a layer without grains."""
    cell = sample.packing.cell
    if cell is None:
        return ""
    fractions = np.sort(cell.fractional(sample.packing.position), axis=0)
    gaps = np.diff(np.vstack([fractions, fractions[0] + 1.0]), axis=0).max(axis=0)
    is_wide = (gaps > EMPTY) & (gaps * cell.heights > 4.0 * sample.packing.radius.max())
    for axis in np.flatnonzero(is_wide & cell.periodic):
        return (
            f"the grains fill {1.0 - gaps[axis]:.0%} of the cell's period along {'xyz'[axis]} "
            f"({cell.heights[axis]:.4g}), the rest of it is empty: does the sample repeat along "
            f"it, and with this period (`periodic`, `cell`)?"
        )
    return ""


def _many_contacts(sample: Sample) -> str:
    """Radii in a smaller unit than the positions make grains overlap."""
    numbers = sample.contact_numbers[sample.grains]
    mean = float(numbers.mean()) if numbers.size else 0.0
    if sample.contacts.source != "geometric" or mean < MANY_CONTACTS:
        return ""
    radius = sample.packing.radius[sample.grains]
    extent = np.ptp(sample.packing.position[sample.grains], axis=0).max()
    return (
        f"{mean:.0f} contacts a grain by geometry (radii {radius.min():.3g} to {radius.max():.3g}, "
        f"centres within {extent:.3g}): check the units of radius and position; is the radius a "
        f"diameter?"
    )


def _no_contacts(sample: Sample) -> str:
    """Radii in a larger unit than the positions, or gaps by rounding, leave no contact."""
    if sample.contact_numbers[sample.grains].any() or sample.contacts.source == "file":
        return ""
    return (
        "no contact at all by geometry: right for a gas, else check the units of radius and "
        "position; `contact_tolerance` closes gaps by rounding"
    )


def _escaped(sample: Sample) -> str:
    """Grains that flew away, and the option that takes them out."""
    rows = np.flatnonzero(sample.escaped)
    if not rows.size:
        return ""
    ids = sample.packing.id[rows]
    named = ",".join(map(str, ids[:MOST_NAMED])) + ",..." * (len(ids) > MOST_NAMED)
    effect = "leave them out; in a and b they are still solid"
    if sample.gathered[rows[0]]:
        effect = "include them, as they are too many to be left out"
    return (
        f"far away from all others: {spelt_some(ids)}, the first at "
        f"{spelt_place(sample.packing.position[rows[0]])}; the sample's extents, RV and octants "
        f'{effect}: `boundary="id={named}"` takes them out'
    )


# Each rule says in a sentence what is doubtful, and nothing if nothing is.
RULES: dict[str, Callable[[Sample], str]] = {
    "plane": _read_as_spheres,
    "escaped": _escaped,
    "spread_bodies": _spread_bodies,
    "own_images": _own_images,
    "empty_period": _empty_period,
    "many_contacts": _many_contacts,
    "no_contacts": _no_contacts,
}
