"""Void ratio, stress and mechanical coordination of a frame, for `with=state`."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial

import numpy as np

from scanfab.base.convex import Convex
from scanfab.base.errors import PackingError
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import BoolArray, FloatArray
from scanfab.fabric.measured import ContactForces, SampleState
from scanfab.fabric.state import love_weber
from scanfab.packing.bodies import lens_volumes, own_shares
from scanfab.packing.contacts import branches
from scanfab.packing.packing import Packing
from scanfab.packing.sample import Sample, Variant
from scanfab.packing.window import Window
from scanfab.scan.directions import direction_rule, plane_rule

# number of points that fill a grain to measure its part inside an RV that is no sphere
POINTS = 2048
# number of grains whose points are tested at once: some tens of megabytes
CHUNK = 256


def refuse_forces(sample: Sample, groups: Collection[str]) -> None:
    """Raise PackingError if needed forces are missing, or if a force is not a finite number."""
    contacts, force = sample.contacts, sample.contacts.force_n
    if force is not None and not np.isfinite(force).all():
        first, second = sample.packing.id[contacts.pairs[np.argmin(np.isfinite(force))]]
        raise PackingError(
            f"the contact of the grains {first} and {second} has a force that is no finite number"
        )
    if force is None and len(contacts) and "forces" in groups:
        found = "are found by geometry" if contacts.source == "geometric" else "have none"
        raise PackingError(
            f'`with_="forces"` needs the forces of contacts, but these {found}: name a file that '
            f"lists contacts with their forces (`contacts`), or its columns (`contact_columns`)"
        )


def contact_forces(sample: Sample, chosen: BoolArray) -> ContactForces | None:
    """Forces and branches of the chosen contacts; None if the dump has no forces."""
    contacts = sample.contacts
    if contacts.force_n is None:
        return None
    _, branch = _places_and_branches(sample.packing)
    branch = np.einsum("ci,ci->c", branch[chosen], contacts.normal[chosen])
    force = None if contacts.force is None else contacts.force[chosen]
    return ContactForces(branch, contacts.force_n[chosen], force)


def sample_state(sample: Sample, variant: Variant, window: Window | None) -> SampleState:
    """
    The state of the RV, or without a window the state of the whole sample.

    Void ratio and stress are the same with and without rattlers, because rattlers are solid and all
    contacts carry stress. The coordination is that of the variant's grains.
    """
    counted = sample.once(sample.counted(variant, window) & ~sample.removed(variant))
    numbers = sample.numbers_of(variant)[counted]
    held, volume = numbers[numbers >= 2], _volume(sample.packing, window)
    return SampleState(
        void_ratio=None if volume is None else _void_ratio(sample, window, volume),
        coordination_mechanical=float(held.mean()) if len(held) else None,
        stress=None if volume is None else _stress(sample, window, volume),
        space=sample.packing.space,
    )


def doubts_of_state(sample: Sample, window: Window | None) -> dict[str, str]:
    """Notes, by code, that say why the stress is missing or incomplete."""
    contacts, packing = sample.contacts, sample.packing
    if len(contacts) and contacts.force is None:
        held = "no forces" if contacts.force_n is None else "the normal part of forces only"
        text = f"the contacts have {held}: all columns that need the stress are empty"
        return {"no_stress": text}
    if _volume(packing, window) is None:
        text = "they need the volume of an RV, or of a cell that is periodic along all its vectors"
        return {"no_volume": f"void ratio and stress of the whole are empty: {text}"}
    at_walls = packing.position[(packing.wall_contacts > 0) & sample.grains]
    if window is not None:
        at_walls = at_walls[window.contains(at_walls, packing)]
    if packing.wall_forces is not None or not len(at_walls):
        return {}
    text = (
        "grains touch walls, but the forces of these contacts are unknown (they are read from "
        "LIGGGHTS' wall/gran/local and YADE's O.save), so the stress leaves them out: choose an RV "
        "away from the walls"
    )
    return {"wall_stress": text}


def _volume(packing: Packing, window: Window | None) -> float | None:
    if window is not None:
        return window.shape.volume
    cell = packing.cell
    return None if cell is None or not cell.is_endless else cell.volume


def _places_and_branches(packing: Packing) -> tuple[FloatArray, FloatArray]:
    """
    Centres of grains, (N, 3), and vectors from the first grain of a contact to the second, (M, 3).

    A sphere of a clump has the centre of the clump's image next to it.
    """
    places, bodies, contacts = packing.position, packing.bodies, packing.contacts
    assert contacts is not None
    if bodies is not None:
        places = places + bodies.to_place(places, packing.cell)
    return places, branches(places, contacts.pairs, contacts.image, packing.cell)


def _stress(sample: Sample, window: Window | None, volume: float) -> FloatArray | None:
    """The stress from all contacts of grains; None without forces."""
    packing, contacts = sample.packing, sample.contacts
    if contacts.force is None:
        return None
    first, second = contacts.pairs.T
    places, branch = _places_and_branches(packing)
    start, end = places[first], places[first] + branch
    # boundary particles act as a wall, so the branch of such a contact ends at the contact point
    start = np.where(sample.boundary[first][:, None], contacts.point, start)
    end = np.where(sample.boundary[second][:, None], contacts.point, end)
    branch = end - start
    chosen = ~(sample.boundary[first] & sample.boundary[second]) & branch.any(axis=1)
    start, branch, force = start[chosen], branch[chosen], contacts.force[chosen]
    walls = packing.wall_forces
    if walls is not None:
        # the branch runs from the contact point at the wall to the centre of the grain
        ours = sample.grains[walls.row]
        start = np.concatenate([start, walls.point[ours]])
        branch = np.concatenate([branch, places[walls.row[ours]] - walls.point[ours]])
        force = np.concatenate([force, walls.force[ours]])
    if window is not None:
        # only the part of each branch inside the window counts, over all its periodic images
        longest = float(np.linalg.norm(branch, axis=1).max(initial=0.0))
        origin, shifts = window.images(start, packing, longest)
        share = sum(window.shape.share(origin + shift, branch) for shift in shifts)
        branch = branch * np.asarray(share)[:, None]
    return love_weber(force, branch, volume)


def _void_ratio(sample: Sample, window: Window | None, volume: float) -> float | None:
    """(1 - ν)/ν, where ν sums the volumes of grains; None without grains."""
    packing, space = sample.packing, sample.packing.space
    position, radius = packing.position[sample.grains], packing.radius[sample.grains]
    # overlaps between the spheres of a clump count once
    share = own_shares(packing, partial(_rays, space=space))[sample.grains]
    if window is None:
        solid = float(np.sum(space.volume(radius) * share))
    else:
        # a window may reach through periodic faces
        solid = 0.0
        origin, shifts = window.images(position, packing, float(radius.max(initial=0.0)))
        for shift in shifts:
            near = window.shape.may_meet(origin + shift, radius)
            inside = cut_volumes((origin + shift)[near], radius[near], window.shape, space)
            solid += float((inside * share[near]).sum())
    return None if solid == 0.0 else (volume - solid) / solid


def cut_volumes(
    places: FloatArray, radius: FloatArray, shape: Convex, space: Space = SPACE
) -> FloatArray:
    """
    Volumes of the parts of spheres inside a region about the origin, shape (N,).

    They are exact for a spherical region; else points that fill each sphere evenly are counted.
    """
    if shape.is_sphere:
        return lens_volumes(np.linalg.norm(places, axis=1), radius, shape.reach, space)
    points = _points_in_ball(space)
    # A convex region that contains the ball of radius ρ about the origin and the point
    # x / (1 - r/ρ) also contains the sphere of radius r about x.
    curved = float(np.linalg.eigvalsh(shape.quadric.form)[-1])
    ball = np.sqrt(shape.quadric.level / curved) if curved > 0.0 else np.inf
    room = 1.0 - radius / min([ball, *shape.planes[:, 3]])
    scaled = places / np.where(room > 0.0, room, 1.0)[:, None]
    share = ((room > 0.0) & shape.contains(scaled)).astype(np.float64)
    cut = np.flatnonzero(share == 0.0)
    for first in range(0, len(cut), CHUNK):
        rows = cut[first : first + CHUNK]
        spread = places[rows, None] + radius[rows, None, None] * points
        inside = shape.contains(spread.reshape(-1, 3)).reshape(-1, len(points))
        share[rows] = inside.mean(axis=1)
    return space.volume(radius, share)


def _rays(count: int, space: Space = SPACE) -> FloatArray:
    """Directions that are spread evenly, and their opposites, shape (P, 3)."""
    half = count // 2
    rule = plane_rule(half, space) if space.is_plane else direction_rule(f"fibonacci:{half}")
    return np.concatenate([rule.axes, -rule.axes])


def _points_in_ball(space: Space) -> FloatArray:
    """Points that fill the unit ball, or disc, evenly, each with its opposite, shape (P, 3)."""
    from scipy.stats import qmc

    # shells of equal volume, directions of equal solid angle
    share, height, turn = qmc.Sobol(3, scramble=False).random(POINTS // 2).T
    share = (share + 0.5 / len(share)) ** (1.0 / space.dimension)
    if space.is_plane:
        height = np.full_like(share, 0.5 - 0.5 / len(share))
    cosine = 2.0 * (height + 0.5 / len(height)) - 1.0
    across = np.sqrt(1.0 - cosine**2)
    angle = 2.0 * np.pi * turn
    unit = np.column_stack([across * np.cos(angle), across * np.sin(angle), cosine]) @ space.basis
    half = share[:, None] * unit
    return np.concatenate([half, -half])
