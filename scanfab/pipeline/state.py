"""Void ratio, stress and mechanical coordination of a frame: what `with=state` is made of."""

from __future__ import annotations

import math
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

# points that stand for a grain that is cut by the surface of an RV, unless that is a sphere
POINTS = 2048
# grains whose points are handled at a time: some tens of megabytes
CHUNK = 256


def refuse_forces(sample: Sample, groups: Collection[str]) -> None:
    """PackingError if forces are asked for but missing, or if one is no finite number."""
    contacts = sample.contacts
    if contacts.force_n is not None and not np.isfinite(contacts.force_n).all():
        one, two = sample.packing.id[contacts.pairs[np.argmin(np.isfinite(contacts.force_n))]]
        raise PackingError(
            f"the contact of the grains {one} and {two} has a force that is no finite number"
        )
    if contacts.force_n is None and len(contacts) and "forces" in groups:
        found = "are found by geometry" if contacts.source == "geometric" else "have none"
        raise PackingError(
            f'`with_="forces"` needs the forces of contacts, but these {found}: name a file that '
            f"lists contacts with their forces (`contacts`), or which of its columns they are "
            f"(`contact_columns`)"
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
    The state of the RV, or without a window of the whole sample.

    Void ratio and stress are the same with and without rattlers: rattlers are solid, and all
    contacts bear stress. The coordination is that of the variant's grains.
    """
    counted = sample.once(sample.counted(variant, window) & ~sample.removed(variant))
    numbers = sample.numbers_of(variant)[counted]
    held = numbers[numbers >= 2]
    return SampleState(
        void_ratio=_void_ratio(sample, window),
        coordination_mechanical=float(held.mean()) if len(held) else None,
        stress=_stress(sample, window),
        space=sample.packing.space,
    )


def doubts_of_state(sample: Sample, window: Window | None) -> dict[str, str]:
    """Notes, by code, on why there is no stress, or on forces that it leaves out."""
    contacts, packing = sample.contacts, sample.packing
    if len(contacts) and contacts.force is None:
        known = "no forces" if contacts.force_n is None else "the normal part of forces only"
        return {
            "no_stress": f"the contacts have {known}: stress, and what follows from it, is empty"
        }
    if _volume(packing, window) is None:
        return {
            "no_volume": "void ratio and stress of the whole are empty: they need a volume, which "
            "is that of a cell that repeats along all its vectors, or of an RV"
        }
    at_walls = packing.position[(packing.wall_contacts > 0) & sample.grains]
    if window is not None:
        at_walls = at_walls[window.contains(at_walls, packing)]
    if packing.wall_forces is not None or not len(at_walls):
        return {}
    return {
        "wall_stress": "grains touch walls, and the forces of these contacts are not known (they "
        "are read from LIGGGHTS' wall/gran/local and YADE's O.save): the stress leaves them out; "
        "choose an RV away from the walls"
    }


def _volume(packing: Packing, window: Window | None) -> float | None:
    if window is not None:
        return window.shape.volume
    cell = packing.cell
    return None if cell is None or not cell.is_endless else cell.volume


def _places_and_branches(packing: Packing) -> tuple[FloatArray, FloatArray]:
    """
    The place of each sphere, (N, 3), and from the first grain's place to the second's, (M, 3).

    Of a clump the place of its image next to the sphere.
    """
    places, bodies, contacts = packing.position, packing.bodies, packing.contacts
    assert contacts is not None
    if bodies is not None:
        places = places + bodies.to_place(places, packing.cell)
    return places, branches(places, contacts.pairs, contacts.image, packing.cell)


def _stress(sample: Sample, window: Window | None) -> FloatArray | None:
    """The stress of all contacts of grains; None without forces or a volume."""
    packing, contacts = sample.packing, sample.contacts
    volume = _volume(packing, window)
    if contacts.force is None or volume is None:
        return None
    one, two = contacts.pairs.T
    places, branch = _places_and_branches(packing)
    start, end = places[one], places[one] + branch
    # boundary is a wall: the branch of such a contact ends where the grain does
    start = np.where(sample.boundary[one][:, None], contacts.point, start)
    end = np.where(sample.boundary[two][:, None], contacts.point, end)
    branch = end - start
    chosen = ~(sample.boundary[one] & sample.boundary[two]) & branch.any(axis=1)
    start, branch, force = start[chosen], branch[chosen], contacts.force[chosen]
    walls = packing.wall_forces
    if walls is not None:
        # the branch from where a grain touches a wall to its place
        ours = sample.grains[walls.row]
        start = np.concatenate([start, walls.point[ours]])
        branch = np.concatenate([branch, places[walls.row[ours]] - walls.point[ours]])
        force = np.concatenate([force, walls.force[ours]])
    if window is not None:
        # the part of each branch that lies in the window, of all its images together
        longest = float(np.linalg.norm(branch, axis=1).max(initial=0.0))
        origin, shifts = window.images(start, packing, longest)
        share = sum(window.shape.share(origin + shift, branch) for shift in shifts)
        branch = branch * np.asarray(share)[:, None]
    return love_weber(force, branch, volume)


def _void_ratio(sample: Sample, window: Window | None) -> float | None:
    """(1 - ν)/ν with the volumes of grains summed up; None without a volume or grains."""
    packing, space = sample.packing, sample.packing.space
    volume = _volume(packing, window)
    if volume is None:
        return None
    position, radius = packing.position[sample.grains], packing.radius[sample.grains]
    # what several spheres of a clump share counts once
    share = np.ones_like(radius)
    if packing.bodies is not None:
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
    Volumes that spheres share with a region about the origin, shape (N,).

    Exact for a region that is a sphere; else by points that fill each sphere evenly.
    """
    if shape.is_sphere:
        return lens_volumes(np.linalg.norm(places, axis=1), radius, shape.reach, space)
    points = _points_in_ball(space)
    # A convex region that holds the ball of radius ρ about the origin and the place x / (1 - r/ρ)
    # also holds the sphere of radius r about x.
    curved = float(np.linalg.eigvalsh(shape.quadric.form)[-1])
    ball = math.sqrt(shape.quadric.level / curved) if curved > 0.0 else math.inf
    room = 1.0 - radius / min([ball, *shape.planes[:, 3]])
    scaled = places / np.where(room > 0.0, room, 1.0)[:, None]
    found = ((room > 0.0) & shape.contains(scaled)).astype(np.float64)
    cut = np.flatnonzero(found == 0.0)
    for first in range(0, len(cut), CHUNK):
        rows = cut[first : first + CHUNK]
        spread = places[rows, None] + radius[rows, None, None] * points
        inside = shape.contains(spread.reshape(-1, 3)).reshape(-1, len(points))
        found[rows] = inside.mean(axis=1)
    return space.volume(radius, found)


def _rays(count: int, space: Space = SPACE) -> FloatArray:
    """Directions that are spread evenly, and their opposites, shape (P, 3)."""
    half = count // 2
    rule = plane_rule(half, space) if space.is_plane else direction_rule(f"fibonacci:{half}")
    return np.concatenate([rule.axes, -rule.axes])


def _points_in_ball(space: Space = SPACE) -> FloatArray:
    """Points that fill the unit ball, or disc, evenly, each with its opposite, shape (P, 3)."""
    from scipy.stats import qmc

    # shells of equal volume, directions of equal solid angle
    share, height, turn = qmc.Sobol(3, scramble=False).random(POINTS // 2).T
    share = (share + 0.5 / len(share)) ** (1.0 / space.dimension)
    if space.is_plane:
        height = np.full_like(share, 0.5 - 0.5 / len(share))
    cosine = 2.0 * (height + 0.5 / len(height)) - 1.0
    across = np.sqrt(1.0 - cosine**2)
    angle = 2.0 * math.pi * turn
    unit = np.column_stack([across * np.cos(angle), across * np.sin(angle), cosine]) @ space.basis
    half = share[:, None] * unit
    return np.concatenate([half, -half])
