"""The lattice of a periodic cell by its shortest vectors, and the nearest image in it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from scanfab.base.typing import FloatArray, IntArray

# A step counts only if it makes a vector shorter than this factor; the rest is rounding.
SHORTER = 1.0 - 1e-9


@dataclass(frozen=True, eq=False)
class Lattice:
    """
    The translations that leave a packing the same: 0 to 3 vectors, as short as they can be.

    Attributes
    ----------
    vectors : ndarray, shape (K, 3)
        Dump's length unit.
    combination : ndarray of int, shape (K, 3)
        Each of them in whole vectors of the cell.
    """

    vectors: FloatArray
    combination: IntArray

    @classmethod
    def of(cls, vectors: FloatArray, periodic: tuple[bool, bool, bool]) -> Lattice:
        """The lattice of those vectors of a cell, its rows, along which it repeats."""
        combination = np.eye(3, dtype=np.int64)[list(periodic)]
        reduced = vectors[list(periodic)]
        while (found := _shortening(reduced)) is not None:
            place, weights = found
            combination[place] += weights @ combination
            # from the cell's own vectors each time: rounding does not add up
            reduced[place] = combination[place] @ vectors
        return cls(reduced, combination)

    @property
    def heights(self) -> FloatArray:
        """Distances between neighbouring planes of the lattice in its span, shape (K,)."""
        return np.asarray(1.0 / np.linalg.norm(np.linalg.pinv(self.vectors), axis=0))

    @property
    def shortest(self) -> float:
        """Length of the shortest translation; infinite if there is none."""
        return float(np.linalg.norm(self.vectors, axis=1).min(initial=np.inf))

    @property
    def half_extent(self) -> float:
        """An upper limit for branches to the nearest image, in the span of the lattice."""
        return 0.5 * float(np.linalg.norm(self.vectors, axis=1).sum())

    def steps(self, most: FloatArray) -> FloatArray:
        """All translations by at most so many of each vector, 0 among them, shape (T, K)."""
        counts = [np.arange(-n, n + 1.0) for n in most]
        return np.array(list(product(*counts)))

    def within(self, length: float) -> FloatArray:
        """Translations but 0 that are shorter than a length, the shortest first, shape (T, 3)."""
        shifts: FloatArray = self.steps(np.floor(length / self.heights)) @ self.vectors
        lengths = np.linalg.norm(shifts, axis=1)
        near = np.flatnonzero((lengths > 0.0) & (lengths < length))
        return shifts[near[np.argsort(lengths[near], kind="stable")]]

    def nearest(self, branch: FloatArray) -> IntArray:
        """Vectors of the cell to add to each branch, shape (M, 3), to make it shortest."""
        # components outside the span are the same for all images
        inverse = np.linalg.pinv(self.vectors)
        image = -np.rint(branch @ inverse)
        gram = self.vectors @ self.vectors.T
        if np.any(gram - np.diag(np.diagonal(gram))):
            rest = branch @ inverse @ self.vectors + image @ self.vectors
            # a branch that is shorter than half of the shortest vector has no shorter image
            far = np.flatnonzero(np.linalg.norm(rest, axis=1) >= 0.5 * self.shortest)
            rest, best = rest[far], np.zeros((len(far), len(self.vectors)))
            shortest = np.linalg.norm(rest, axis=1)
            # between vectors that are as short as can be, one step along each is enough
            steps = self.steps(np.ones(len(self.vectors)))
            for step in steps[np.argsort(np.abs(steps).sum(axis=1), kind="stable")]:
                length = np.linalg.norm(rest + step @ self.vectors, axis=1)
                # of equal lengths the first one counts, which has fewer steps
                better = length < shortest * (1.0 - 1e-12)
                best[better], shortest[better] = step, length[better]
            image[far] += best
        return image.astype(np.int64) @ self.combination


def _shortening(vectors: FloatArray) -> tuple[int, IntArray] | None:
    """
    Find a vector that others make shorter, and how many of each to add; None if there is none.

    Long steps along one other vector are tried first, then single steps along all others.
    """
    count = len(vectors)
    for place in np.argsort(-np.linalg.norm(vectors, axis=1), kind="stable").tolist():
        length = float(np.linalg.norm(vectors[place]))
        others = [k for k in range(count) if k != place]
        steps = np.zeros((len(others) + 3 ** len(others), count), np.int64)
        for row, k in enumerate(others):
            steps[row, k] = -np.rint(vectors[place] @ vectors[k] / (vectors[k] @ vectors[k]))
        steps[len(others) :, others] = list(product((-1, 0, 1), repeat=len(others)))
        for weights in steps:
            if np.linalg.norm(vectors[place] + weights @ vectors) < length * SHORTER:
                return place, weights
    return None
