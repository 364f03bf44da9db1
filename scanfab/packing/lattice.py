"""The lattice of a periodic cell by its shortest vectors, and the nearest image in it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from scanfab.base.typing import FloatArray, IntArray

# A step that makes a vector shorter by less is rounding; without this, reducing might never end.
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
        """That of the vectors of a cell, as rows, that repeat."""
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
        """No branch to a nearest image is longer, of those in the span of the lattice."""
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
        if len(self.vectors) == 0:
            return np.zeros((len(branch), 3), np.int64)
        # components outside the span are the same for all images
        inverse = np.linalg.pinv(self.vectors)
        image = -np.rint(branch @ inverse)
        gram = self.vectors @ self.vectors.T
        if np.any(gram - np.diag(np.diagonal(gram))):
            rest = branch @ inverse @ self.vectors + image @ self.vectors
            # what is shorter than half of the shortest vector has no shorter image
            far = np.flatnonzero(np.linalg.norm(rest, axis=1) >= 0.5 * self.shortest)
            image[far] += self._steps_to_nearest(rest[far])
        return image.astype(np.int64) @ self.combination

    def _steps_to_nearest(self, rest: FloatArray) -> FloatArray:
        """
        Further steps for branches whose components are at most half a vector each, shape (M, K).

        A shorter image is no longer than the longest of these branches, so it lies between planes
        of the lattice that are no further away than that.
        """
        corners = 0.5 * self.steps(np.ones(len(self.vectors))) @ self.vectors
        longest = np.linalg.norm(corners, axis=1).max()
        steps = self.steps(np.floor(0.5 + longest / self.heights + 1e-9))
        steps = steps[np.argsort(np.abs(steps).sum(axis=1), kind="stable")]
        best, shortest = np.zeros((len(rest), steps.shape[1])), np.full(len(rest), np.inf)
        for step in steps:
            length = np.linalg.norm(rest + step @ self.vectors, axis=1)
            # the first of equals: no step rather than some
            better = length < shortest * (1.0 - 1e-12)
            best[better], shortest[better] = step, length[better]
        return best


def _shortening(vectors: FloatArray) -> tuple[int, IntArray] | None:
    """
    A vector, and how many of each vector to add to make it shorter; None if nothing does.

    Long steps along one other vector are tried first, then short ones along all others.
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
