"""Volumes of clumps: what several of their spheres share counts once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray, IntArray
from scanfab.packing.packing import Packing

# rays through pairs of spheres of one clump, all together: a second or two
MOST_RAYS = 1 << 23
# of a sphere, where clumps are so many that their errors cancel, and where they are few
FEWEST_RAYS, ENOUGH_RAYS = 256, 4096
# what is known of rays through pairs of spheres at a time: some tens of megabytes
CHUNK = 1 << 20


def own_shares(packing: Packing, directions: Callable[[int], FloatArray]) -> FloatArray:
    """
    Of each sphere, the part of its volume that no sphere of the same clump before it covers.

    Rays run from its centre to its surface, and what the others cover of each ray is exact; so is
    the volume of two spheres or a rod. Of clumps of another shape 1e-4 to 1e-3 are uncertain, each
    by itself: over many of them it is less.

    Parameters
    ----------
    packing : Packing
        Of spheres that are grains, or parts of clumps.
    directions : callable
        Gives so many unit vectors, evenly spread, shape (P, 3).

    Returns
    -------
    ndarray, shape (N,)
        1 for spheres that are a grain of their own.
    """
    bodies, radius, space = packing.bodies, packing.radius, packing.space
    share = np.ones(len(radius))
    if bodies is None:
        return share
    position = -bodies.to_place(packing.position, packing.cell)
    one, two = _pairs(bodies.head)
    apart = np.linalg.norm(position[one] - position[two], axis=1)
    meet = apart < radius[one] + radius[two]
    one, two, apart = one[meet], two[meet], apart[meet]
    rays = directions(int(np.clip(MOST_RAYS // max(len(one), 1), FEWEST_RAYS, ENOUGH_RAYS)))
    _, first, before = np.unique(two, return_index=True, return_counts=True)
    # what the nearest covers is known, rays have to tell what the others cover beyond it
    lens = lens_volumes(apart, radius[one], radius[two], space) / space.volume(radius[two])
    for count in np.unique(before):
        pairs = first[before == count][:, None] + np.arange(count)
        nearest = lens[pairs].argmax(axis=1)
        share[two[pairs[:, 0]]] -= lens[pairs].max(axis=1)
        if count == 1:
            continue
        for part in np.array_split(np.arange(len(pairs)), 1 + pairs.size * len(rays) // CHUNK):
            some = pairs[part]
            other, own = one[some], two[some]
            place = (position[other] - position[own]) / radius[own][..., None]
            ratio = radius[other] / radius[own]
            share[own[:, 0]] -= _beyond(place, ratio, nearest[part], rays, space.dimension)
    return share


def _beyond(
    place: FloatArray, radius: FloatArray, nearest: IntArray, rays: FloatArray, dimension: int
) -> FloatArray:
    """
    The part of spheres' volumes that others cover beyond what the nearest does.

    Places and radii of the others, shape (spheres, others), are in radii of their sphere.
    """
    depth = place @ rays.T
    reach = np.square(radius) - np.einsum("...i,...i->...", place, place)
    half = np.sqrt(np.maximum(reach[..., None] + depth**2, 0.0))
    # where rays enter and leave others
    into, out = np.clip(depth - half, 0.0, 1.0), np.clip(depth + half, 0.0, 1.0)
    row = np.arange(len(nearest))
    known = (out[row, nearest] ** dimension - into[row, nearest] ** dimension).mean(axis=1)
    order = np.argsort(into, axis=1)
    into, out = (np.take_along_axis(ends, order, axis=1) for ends in (into, out))
    # of each stretch what lies beyond those that begin before it
    until = np.maximum.accumulate(out, axis=1)
    into[:, 1:] = np.maximum(into[:, 1:], until[:, :-1])
    covered = np.maximum(out**dimension - into**dimension, 0.0)
    found: FloatArray = covered.sum(axis=1).mean(axis=1) - known
    return found


def lens_volumes(
    apart: FloatArray, one: FloatArray, two: FloatArray | float, space: Space = SPACE
) -> FloatArray:
    """
    Volumes that pairs of spheres share; of discs areas.

    Parameters
    ----------
    apart : ndarray, shape (K,)
        Distance of their centres, dump's length unit.
    one, two : ndarray, shape (K,), or float
        Their radii, dump's length unit.
    space : Space, optional
        The plane in which they lie, if they are discs.
    """
    smaller = space.volume(np.minimum(one, two))
    is_inside = apart <= np.abs(two - one)
    distance = np.where(is_inside, 1.0, apart)
    if space.is_plane:
        return np.where(is_inside, smaller, _lens_areas(distance, one, two))
    deep = np.maximum(two + one - apart, 0.0)
    lens = np.pi * deep**2 / (12.0 * distance)
    lens *= distance**2 + 2.0 * distance * (one + two) - 3.0 * (one - two) ** 2
    return np.where(is_inside, smaller, lens)


def _lens_areas(apart: FloatArray, one: FloatArray, two: FloatArray | float) -> FloatArray:
    """Two segments of circles, each a sector less its triangle."""
    found = np.zeros_like(apart)
    for r, other in ((one, two), (two, one)):
        height = (apart**2 + np.square(r) - np.square(other)) / (2.0 * apart)
        cosine = np.clip(height / r, -1.0, 1.0)
        found = found + np.square(r) * (np.arccos(cosine) - cosine * np.sqrt(1.0 - cosine**2))
    return found


def _pairs(head: IntArray) -> tuple[IntArray, IntArray]:
    """All pairs of spheres of one body, the earlier and the later row, shape (K,) each."""
    order = np.argsort(head, kind="stable")
    # the place of each sphere among those of its body
    starts = np.searchsorted(head[order], head[order], side="left")
    place = np.arange(len(order)) - starts
    later = np.repeat(np.arange(len(order)), place)
    earlier = np.arange(len(later)) - np.repeat(np.cumsum(place) - place, place) + starts[later]
    return order[earlier], order[later]
