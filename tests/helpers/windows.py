"""Windows made up from data alone: what a constructor of the next one would write."""

import numpy as np

from scanfab.base.convex import EVERYWHERE, Convex, Quadric
from tests.helpers.lattices import rotation

NO_PLANES = np.zeros((0, 4))


def made_up(planes, quadric, reach):
    """A region that a ball of this radius holds, with the box of the ball."""
    box = np.full(3, float(reach))
    return Convex(np.array(planes, dtype=float), quadric, -box, box, float(reach), "made up")


def slabs(axes, half):
    """Two planes across each axis, at this distance on either side."""
    axes = np.concatenate([axes, np.negative(axes)])
    return np.column_stack([axes, np.tile(half, 2)])


def box(half, turn=None):
    """Six half-spaces; the edges lie along the rows of ``turn``."""
    planes = slabs(np.eye(3) if turn is None else turn, half)
    return made_up(planes, EVERYWHERE, np.linalg.norm(half))


def cylinder(axis, radius, half):
    """A round column about an axis, between two planes."""
    quadric = Quadric(1.0, -np.outer(axis, axis), radius**2)
    return made_up(slabs([axis], [half]), quadric, np.hypot(radius, half))


def ellipsoid(half, turn):
    """A quadric alone, with half axes along the rows of ``turn``."""
    return made_up(NO_PLANES, Quadric(0.0, turn.T @ np.diag(half**-2.0) @ turn, 1.0), half.max())


def cut_ball(radius, normal, distance):
    """A ball with a piece cut off by a plane."""
    plane = np.append(normal, distance)
    return made_up([plane], Quadric(1.0, np.zeros((3, 3)), radius**2), radius)


def random_window(random):
    """None at times (0), the radius of a sphere, or a region of any kind."""
    half, turn = random.uniform(0.3, 2.0, 3), rotation(random)
    return [
        lambda: 0.0,
        lambda: 1.0,
        lambda: random.uniform(0.3, 3.0),
        lambda: random.uniform(0.3, 3.0),
        lambda: random.uniform(0.3, 3.0),
        lambda: box(half),
        lambda: box(half, turn),
        lambda: cylinder(turn[0], half[0], half[1]),
        lambda: cylinder(np.eye(3)[random.integers(3)], half[0], half[1]),
        lambda: ellipsoid(half, turn),
        lambda: cut_ball(half[0], turn[0], random.uniform(0.1, 1.1) * half[0]),
    ][random.integers(11)]()
