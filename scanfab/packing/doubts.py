"""What looks wrong in a frame before anything is measured: units, clumps, cells, flat samples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import Note, PackingError
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray, IntArray
from scanfab.packing.bodies import CLUMP_COLUMNS, MOLECULE_COLUMNS
from scanfab.packing.packing import FEWEST, Packing, off_plane, space_of, spelt_plane, spelt_some
from scanfab.packing.sample import Sample
from scanfab.packing.window import SurfaceBox

# A clump is smaller than this part of the sample, or of the period. A body whose length is at most
# LONG times the median of all is like the others.
SMALL, LONG = 0.5, 3.0
# No packing of spheres has so many contacts a grain: it has 6 at random, at most 12 in a lattice.
MANY_CONTACTS = 15
# Volume of the grains over that of the box of their surfaces. Only clumps of many spheres overlap
# as much.
SOLIDS = 20.0
# A period is doubtful if this part of it has no grain.
EMPTY = 0.2
# If nearest neighbours are no further apart than this, in sums of their radii, the gap is rounding.
CLOSED = 1.01
# What formats without a cell lack, and the option that makes up for it.
CELL_LACKS = {
    "nothing": ("this format carries no cell", "`cell=(LX, LY, LZ)`"),
    "box": ("this format has a box, but does not say whether it repeats", '`periodic="xyz"`'),
}
# At most so many grains of a face are compared with the opposite face.
MOST_GRAINS = 2000
# Lengths that differ by less than this, in mean radii, are one period: contacts overlap a little.
SAME = 0.1
# Contacts through a face, over those through the middle: 0.6 to 1.5 in periodic samples, up to 0.3
# between flat walls.
FITS = 0.5
# This share of the contacts through a face may overlap more, as oblique contacts do.
BEYOND = 0.4


def refuse_impossible(sample: Sample) -> None:
    """
    Refuse a frame that cannot be measured.

    Raises
    ------
    PackingError
        If the grains have many times the volume of the box around them.
    """
    packing, radius = sample.packing, sample.packing.radius[sample.grains]
    # A program that lists contacts knows the radii. The spheres of a clump may overlap.
    listed = packing.contacts is not None and packing.contacts.source == "file"
    if len(radius) < FEWEST or listed or packing.bodies is not None:
        return
    extents = SurfaceBox.of(packing, sample.grains).extents[list(packing.space.along)]
    # in units of the box, as the volume in the dump's unit may overflow
    scale = np.exp(np.log(extents).mean())
    solid = float(np.sum(packing.space.volume(radius / scale)))
    if solid >= SOLIDS:
        raise PackingError(
            f"the grains have {solid:.3g} times the volume of the box that they lie in "
            f"({_sizes(sample)}): check the units of radius and position"
        )


def doubts_of(
    sample: Sample, cell_is_named: bool = False, bodies_are_named: bool = False
) -> list[Note]:
    """
    Notes on what looks wrong in a frame whose contacts are known.

    Parameters
    ----------
    sample : Sample
        One frame.
    cell_is_named : bool, optional
        Whether the user has named the cell, or along which axes it repeats, and may be mistaken.
    bodies_are_named : bool, optional
        Whether the user has said which spheres are one body, or that each is one of its own.
    """
    if len(sample.packing) < FEWEST:
        return []
    asked = {"clumps": not bodies_are_named, "empty_period": cell_is_named}
    texts = {code: rule(sample) for code, rule in RULES.items() if asked.get(code, True)}
    if texts.get("clumps"):
        texts["many_contacts"] = ""  # the spheres of a clump overlap
    return [Note(code, text) for code, text in texts.items() if text]


def cell_doubt(sample: Sample, carries: str) -> str:
    """
    Say that opposite faces of a sample fit together, if its format has no cell.

    Parameters
    ----------
    sample : Sample
        One frame.
    carries : str
        What its format says of a cell, as :data:`scanfab.io.reader.Carries`.
    """
    if carries == "cell" or sample.packing.is_periodic:
        return ""
    periods = zip(fitting_periods(sample.packing), "xyz", strict=True)
    lengths = ", ".join(f"{period:.4g} along {axis}" for period, axis in periods if period)
    if not lengths:
        return ""
    lacks, cure = CELL_LACKS[carries]
    return (
        f"the sample looks periodic: grains of opposite faces touch at a period of {lengths} "
        f"(roughly); {lacks}: name it with {cure}"
    )


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


def _clumps(sample: Sample) -> str:
    """
    A column may number clumps although each sphere counts as a grain.

    The spheres of a clump lie close together. If spheres all over the sample share a number, it is
    that of a species or a molecule.
    """
    packing, known = sample.packing, (*CLUMP_COLUMNS, *MOLECULE_COLUMNS)
    for name, values in packing.columns.items() if packing.bodies is None else ():
        if name.lower() not in known or values.ndim != 1 or values.dtype.kind not in "iuf":
            continue
        rows = np.flatnonzero(values > 0)
        _, counts, extents = _extents_of(packing.position[rows], values[rows])
        several = counts > 1
        close = several & (extents.max(axis=1) < SMALL * np.ptp(packing.position, axis=0).max())
        # a clump that a periodic face cuts seems as large as the sample
        if several.any() and close.sum() >= 0.5 * several.sum():
            return (
                f"the column {name} names {several.sum()} clumps of {counts[several].sum()} "
                f"spheres, but each sphere counts as a grain: if the clumps are rigid, "
                f'`bodies="{name}"` makes each of them one grain'
            )
    return ""


def _spread_bodies(sample: Sample) -> str:
    """A periodic face may cut a body, or the column may number something else."""
    bodies, cell, position = sample.packing.bodies, sample.packing.cell, sample.packing.position
    if bodies is None:
        return ""
    periodic = np.zeros(3, np.bool_)
    if cell is not None and cell.is_periodic:
        # fractions along the shortest vectors of the cell
        position = (position + bodies.turns @ cell.vectors) @ np.linalg.inv(cell.short_vectors)
        periodic = np.array(cell.periodic)
    rows = np.flatnonzero(bodies.has_many)
    heads, _, extents = _extents_of(position[rows], bodies.head[rows])
    wide = extents > SMALL * np.where(periodic, 1.0, np.ptp(position, axis=0))
    # if the sample consists of few large clumps, all are as long
    alone = (extents > LONG * np.median(extents, axis=0)) | wide.all(axis=1, keepdims=True)
    spread = heads[(wide & (periodic | alone)).any(axis=1)]
    if spread.size == 0:
        return ""
    where, cure = "sample", "if the sample is periodic, name its cell (`cell`, `periodic`)"
    if periodic.any():
        where, cure = "cell", "a body longer than half a period is put together wrongly"
    return (
        f"{counted(len(spread), 'body', 'bodies')} of several spheres, such as number "
        f"{bodies.number[spread[0]]}, reach through more than half of the {where}: {cure}; or are "
        f"these no bodies (`bodies`)?"
    )


def _extents_of(position: FloatArray, body: npt.NDArray[Any]) -> tuple[Any, IntArray, FloatArray]:
    """The numbers of some bodies, how many spheres each has, and their extents, shape (B, 3)."""
    order = np.argsort(body, kind="stable")
    names, starts, counts = np.unique(body[order], return_index=True, return_counts=True)
    along = position[order]
    return names, counts, np.maximum.reduceat(along, starts) - np.minimum.reduceat(along, starts)


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
    told = f"{mean:.0f} contacts a grain by geometry ({_sizes(sample)})"
    return f"{told}: check the units of radius and position; is the radius a diameter?"


def _no_contacts(sample: Sample) -> str:
    """Radii in a larger unit than the positions, or gaps by rounding, leave no contact."""
    if sample.contact_numbers[sample.grains].any() or sample.contacts.source == "file":
        return ""
    from scipy.spatial import KDTree

    # median distance of a grain's nearest neighbour, in sums of their radii
    position, radius = sample.packing.position, sample.packing.radius
    some = np.arange(0, len(radius), len(radius) // 1000 + 1)
    distance, near = KDTree(position).query(position[some], k=2)
    nearest = float(np.median(distance[:, 1] / (radius[some] + radius[near[:, 1]])))
    # twice the median gap closes most of the gaps
    tolerance = max(2.0 * (nearest - 1.0), 1e-6)
    wider = f", or use `contact_tolerance={tolerance:.1g}`" if nearest < CLOSED else ""
    return (
        f"no contact at all by geometry: the centres of nearest neighbours are {nearest:.6g} "
        f"diameters apart (median): right for a gas, else check the units of radius and "
        f"position{wider}"
    )


def _sizes(sample: Sample) -> str:
    radius = sample.packing.radius[sample.grains]
    extent = np.ptp(sample.packing.position[sample.grains], axis=0).max()
    return f"radii {radius.min():.3g} to {radius.max():.3g}, centres within {extent:.3g}"


def fitting_periods(packing: Packing) -> list[float | None]:
    """
    The period along x, y and z at which grains of opposite faces touch; None where they do not.

    A face is moved by this length so that about as many pairs of grains touch as inside.

    Parameters
    ----------
    packing : Packing
        With contacts. Its cell does not count; only upright faces are compared.
    """
    return [_period(packing, axis) for axis in range(3)]


def _period(packing: Packing, axis: int) -> float | None:
    from scipy.spatial import KDTree

    along, radius = packing.position[:, axis], packing.radius
    if len(along) < FEWEST:
        return None
    low, high, layer = float(along.min()), float(along.max()), 2.0 * float(radius.max())
    # there is no face if the sample is thin, or if the layer vanishes by rounding
    if not 3.0 * layer <= high - low < layer / np.finfo(float).eps:
        return None
    face, opposite = np.flatnonzero(along < low + layer), np.flatnonzero(along > high - layer)
    across = np.delete(packing.position, axis, axis=1)
    middle = np.median(across[face], axis=0)
    nearest = np.argsort(np.linalg.norm(across[face] - middle, axis=1))[:MOST_GRAINS]
    some = face[nearest] if len(face) > MOST_GRAINS else face
    reach = radius[some] + float(radius[opposite].max())
    near = KDTree(across[opposite]).query_ball_point(across[some], reach)
    one = np.repeat(some, [len(rows) for rows in near])
    two = opposite[np.concatenate([np.asarray(rows, np.int64) for rows in near])]
    # the periods at which these pairs would touch
    room = (radius[one] + radius[two]) ** 2 - np.sum((across[one] - across[two]) ** 2, axis=1)
    meets = room > 0
    lengths = np.sort(along[two[meets]] - along[one[meets]] + np.sqrt(room[meets]))
    if len(lengths) < FEWEST:
        return None
    ends = np.searchsorted(lengths, lengths + SAME * float(radius.mean()), side="right")
    counts = ends - np.arange(len(lengths))
    counts[len(lengths) - ends > BEYOND * counts] = 0
    best = int(np.argmax(counts))
    # contacts whose grains lie on both sides of the middle
    assert packing.contacts is not None
    is_above = along[packing.contacts.pairs] >= 0.5 * (low + high)
    through = np.count_nonzero(is_above[:, 0] != is_above[:, 1])
    expected = len(some) / len(face) * through
    if expected < FEWEST or counts[best] < max(FEWEST, FITS * expected):
        return None
    return float(np.median(lengths[best : ends[best]]))


# Each rule says in a sentence what is doubtful, and nothing if nothing is.
RULES: dict[str, Callable[[Sample], str]] = {
    "plane": _read_as_spheres,
    "clumps": _clumps,
    "spread_bodies": _spread_bodies,
    "own_images": _own_images,
    "empty_period": _empty_period,
    "many_contacts": _many_contacts,
    "no_contacts": _no_contacts,
}
