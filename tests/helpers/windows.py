"""Windows of every shape, and one that no constructor makes: a ball with a piece cut off."""

import meshio
import numpy as np

from scanfab.base.shapes import box, cylinder, ellipsoid, polyhedron, sphere
from tests.helpers.lattices import rotation

# triangles of the box whose corners product((-1, 1), repeat=3) makes
OF_A_BOX = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 3, 7], [1, 7, 5],
    ]
)  # fmt: skip


def cut_ball(radius, normal, distance):
    """A ball with a piece cut off by a plane."""
    ball = sphere(radius)
    ball.planes = np.append(normal, distance)[None]
    return ball


def corners_of_a_box(half, turn=None):
    """In the order of OF_A_BOX."""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return signs * half @ (np.eye(3) if turn is None else turn)


def surface(path, corners):
    """A file of the surface of a box."""
    meshio.Mesh(corners, [("triangle", OF_A_BOX)]).write(path)
    return str(path)


def box_by_corners(half, turn=None):
    """A box as the polyhedron of its surface."""
    return polyhedron(corners_of_a_box(half, turn), OF_A_BOX)[0]


def hull_of(points):
    """The polyhedron of some points that are corners of it, and its centroid."""
    from scipy.spatial import ConvexHull

    return polyhedron(points, ConvexHull(points).simplices)


def leaning(window, random):
    """The same, deformed."""
    return window.deformed(np.eye(3) + random.uniform(-0.3, 0.3, (3, 3)))


def random_window(random):
    """None at times (0), a sphere, or a region of any kind."""
    half, turn = random.uniform(0.3, 2.0, 3), rotation(random)
    return [
        lambda: 0.0,
        lambda: sphere(1.0),
        lambda: sphere(random.uniform(0.3, 3.0)),
        lambda: box(2 * half),
        lambda: box(2 * half, turn),
        lambda: cylinder(half[0], 2 * half[1], turn[0]),
        lambda: cylinder(half[0], 2 * half[1], np.eye(3)[random.integers(3)]),
        lambda: ellipsoid(half, turn),
        lambda: cut_ball(half[0], turn[0], random.uniform(0.1, 1.1) * half[0]),
        lambda: hull_of(random.normal(size=(12, 3)))[0],
        lambda: leaning(cylinder(half[0], 2 * half[1], turn[0]), random),
        lambda: leaning(box(2 * half, turn), random),
    ][random.integers(12)]()
