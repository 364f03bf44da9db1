"""Packings with known answers: lattices, separate spheres, Poisson spheres."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation


class Spheres(NamedTuple):
    """Centres and radii."""

    position: np.ndarray
    radius: np.ndarray

    def moved(self, shift):
        return Spheres(self.position + np.asarray(shift), self.radius)

    def scaled(self, factor):
        return Spheres(self.position * factor, self.radius * factor)

    def turned(self, rotation):
        return Spheres(self.position @ rotation.T, self.radius)


def rotation(random):
    """A random rotation matrix."""
    return Rotation.random(rng=random).as_matrix()


def unit_vectors(random, *shape):
    """Random unit vectors, shape (..., 3)."""
    vectors = random.normal(size=(*shape, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def ball_points(random, count, reach):
    """Points uniform in a ball about the origin."""
    return unit_vectors(random, count) * reach * np.cbrt(random.random((count, 1)))


def simple_cubic(count, edge=1.0):
    """count³ equal spheres that touch, in the cell [0, count · edge]³."""
    steps = np.arange(count) + 0.5
    position = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    return Spheres(position * edge, np.full(count**3, 0.5 * edge))


def face_centred_cubic(count, edge=1.0):
    """4 count³ equal spheres that touch, in the cell [0, count · edge]³."""
    corners = simple_cubic(count, edge).position - 0.25 * edge
    basis = 0.5 * edge * np.array([[0, 0, 0], [0, 1, 1], [1, 0, 1], [1, 1, 0]])
    position = (corners[:, None] + basis).reshape(-1, 3)
    return Spheres(position, np.full(len(position), edge / np.sqrt(8.0)))


def shaken_cubic(random, count, jitter=0.15, overlap=1.02):
    """A cubic lattice of unequal, displaced spheres: some contacts, some grains with few."""
    lattice = simple_cubic(count)
    position = lattice.position + random.uniform(-jitter, jitter, lattice.position.shape)
    return Spheres(position, lattice.radius * overlap * random.uniform(0.9, 1.1, count**3))


def separate_spheres(random, count, reach, radii=(0.5, 1.5)):
    """Spheres that do not overlap, all inside a ball about the origin, added one by one."""
    position, radius = np.zeros((0, 3)), np.zeros(0)
    while len(radius) < count:
        centre, size = ball_points(random, 1, reach)[0], random.uniform(*radii)
        apart = np.linalg.norm(position - centre, axis=1) > radius + size
        if apart.all() and np.linalg.norm(centre) + size < reach:
            position, radius = np.vstack([position, centre]), np.append(radius, size)
    return Spheres(position, radius)


def poisson_spheres(random, density, reach, radii=(0.5, 1.5)):
    """Freely overlapping spheres: a Poisson process, wherever they reach into a ball."""
    outer = reach + radii[1]
    count = random.poisson(density * 4 / 3 * np.pi * outer**3)
    return Spheres(ball_points(random, count, outer), random.uniform(*radii, count))
