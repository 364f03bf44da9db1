"""
Dense packings of the paper's sizes: radii uniform from 0.5 to 1.5, solid fraction 0.6.

Random centres in a small periodic cell, pushed apart where grains overlap until little overlap is
left; a larger packing is made of copies of the cell, of which a sphere is kept, as in the paper.
"""

from functools import cache

import numpy as np

import scanfab
from scanfab.base.convex import Convex
from scanfab.scan.edges import START
from scanfab.scan.kernels.grid import CellGrains
from scanfab.scan.solids import Solids, margin_of

PAPER = 13_723
CELL = 1_250
SOLID_FRACTION = 0.6
STEPS = 200


def pushed_apart(position: np.ndarray, radius: np.ndarray, edge: float, steps: int) -> np.ndarray:
    """Positions in a periodic cube, after each overlap has been halved so many times."""
    cell = scanfab.Cell([edge] * 3)
    for _ in range(steps):
        packing = scanfab.find_contacts(scanfab.Packing(position, radius, cell=cell))
        contacts = packing.contacts
        one, two = contacts.pairs.T
        branch = packing.position[two] - packing.position[one] + edge * contacts.image
        overlap = radius[one] + radius[two] - np.linalg.norm(branch, axis=1)
        push = 0.5 * overlap[:, None] * contacts.normal
        position = packing.position.copy()
        np.add.at(position, one, -push)
        np.add.at(position, two, push)
    return position


@cache
def relaxed_cell() -> tuple[np.ndarray, np.ndarray, float]:
    """Positions, radii and edge of the periodic cell."""
    random = np.random.default_rng(0)
    radius = random.uniform(0.5, 1.5, CELL)
    edge = float(np.cbrt(4 / 3 * np.pi * np.sum(radius**3) / SOLID_FRACTION))
    return pushed_apart(edge * random.random((CELL, 3)), radius, edge, STEPS), radius, edge


def copied(copies: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions about the origin, radii and edge of a cube of so many cells along each edge."""
    position, radius, edge = relaxed_cell()
    steps = edge * np.stack(np.meshgrid(*3 * [np.arange(copies)]), axis=-1).reshape(-1, 1, 3)
    position = (position % edge + steps).reshape(-1, 3) - 0.5 * copies * edge
    return position, np.tile(radius, copies**3), copies * edge


def dense(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions about the origin, and radii, of a sphere of so many grains."""
    # cut from a cube around the sphere
    position, radius, _ = copied(int(np.ceil(np.cbrt(6 / np.pi * count / CELL))) + 1)
    order = np.argpartition(np.sum(position**2, axis=1), count - 1)[:count]
    return position[order], radius[order]


def dense_packing(count: int) -> scanfab.Packing:
    """With its contacts, found by geometry."""
    return scanfab.find_contacts(scanfab.Packing(*dense(count)))


def tenth(count: int) -> np.ndarray:
    """Which grains are rattlers: every tenth, at random."""
    return np.random.default_rng(1).random(count) < 0.1


def solids_near(window: Convex, edge: str = "clip") -> Solids:
    """The grains of the paper's sample that lines of a window meet, by a rule at its surface."""
    position, radius = dense(PAPER)
    removed = tenth(PAPER)
    around = None
    if edge == START:
        around = CellGrains(position, radius, removed, np.eye(3), np.zeros(3, bool))
    near = window.may_meet(position, radius + (margin_of(around) if around else 0.0))
    return Solids(position[near], radius[near], removed[near], window, edge=edge, around=around)
