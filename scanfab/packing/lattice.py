"""The lattice of a periodic cell by its shortest vectors, and the nearest image in it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from scanfab.base.typing import FloatArray, IntArray

# a step that makes a vector shorter by less is rounding: reducing must come to an end
SHORTER = 1.0 - 1e-9
# branches at a time, times their candidates: some tens of megabytes
CHUNK = 1 << 16


@dataclass(frozen=True, eq=False)
class Lattice:
    """The translations that leave a packing the same: 0 to 3 vectors, as short as they can be."""

    vectors: FloatArray
    """Shape (K, 3), dump's length unit."""
    combination: IntArray
    """Shape (K, 3): each vector in whole vectors of the cell."""

    @property
    def heights(self) -> FloatArray:
        """Distances between neighbouring planes of the lattice in its span, shape (K,)."""
        return np.asarray(1.0 / np.linalg.norm(np.linalg.pinv(self.vectors), axis=0))

    @property
    def shortest(self) -> float:
        """Length of the shortest translation; infinite if there is none."""
        return float(np.linalg.norm(self.vectors, axis=1).min(initial=np.inf))

    @property
    def steps(self) -> FloatArray:
        """Translations to the images all around, shape (3**K - 1, 3), dump's length unit."""
        return self._shifts(np.ones(len(self.vectors), int))

    def within(self, length: float) -> FloatArray:
        """Translations that are shorter than a length, the shortest first, shape (T, 3)."""
        shifts = self._shifts(np.floor(length / self.heights).astype(int))
        lengths = np.linalg.norm(shifts, axis=1)
        return shifts[np.argsort(lengths, kind="stable")][: int(np.sum(lengths < length))]

    def _shifts(self, most: IntArray) -> FloatArray:
        """Translations by at most so many of each vector, but none by 0, shape (T, 3)."""
        steps = [step for step in product(*(range(-n, n + 1) for n in most)) if any(step)]
        return np.array(steps, dtype=np.float64).reshape(-1, len(self.vectors)) @ self.vectors

    @property
    def half_extent(self) -> float:
        """No branch to a nearest image is longer, of those in the span of the lattice."""
        return 0.5 * float(np.linalg.norm(self.vectors, axis=1).sum())

    def nearest(self, branch: FloatArray) -> IntArray:
        """Vectors of the cell to add to each branch, shape (M, 3), to make it shortest."""
        if len(self.vectors) == 0:
            return np.zeros((len(branch), 3), np.int64)
        # components outside the span are the same for all images
        inverse = np.linalg.pinv(self.vectors)
        image = -np.rint(branch @ inverse)
        rest = branch @ inverse @ self.vectors + image @ self.vectors
        gram = self.vectors @ self.vectors.T
        if np.any(gram - np.diag(np.diagonal(gram))):
            # what is shorter than half of the shortest vector has no shorter image
            far = np.linalg.norm(rest, axis=1) >= 0.5 * self.shortest
            for rows in np.array_split(np.flatnonzero(far), far.sum() // CHUNK + 1):
                image[rows] += self._steps_to_nearest(rest[rows])
        return image.astype(np.int64) @ self.combination

    def _steps_to_nearest(self, rest: FloatArray) -> FloatArray:
        """
        Further steps, for branches of which each component is at most half a vector.

        A shorter image is no longer than the longest of these, so it lies between planes of the
        lattice that are no further away than that.
        """
        longest = max(
            float(np.linalg.norm(np.array(signs) @ self.vectors))
            for signs in product((-0.5, 0.5), repeat=len(self.vectors))
        )
        most = np.floor(0.5 + longest / self.heights + 1e-9).astype(int)
        steps = np.array(list(product(*(range(-n, n + 1) for n in most))), dtype=np.float64)
        steps = steps[np.argsort(np.abs(steps).sum(axis=1), kind="stable")]
        best, shortest = np.zeros((len(rest), steps.shape[1])), np.full(len(rest), np.inf)
        for step in steps:
            length = np.linalg.norm(rest + step @ self.vectors, axis=1)
            # the first of equals: no step rather than some
            better = length < shortest * (1.0 - 1e-12)
            best[better], shortest[better] = step, length[better]
        return best


def reduced_lattice(vectors: FloatArray, periodic: tuple[bool, bool, bool]) -> Lattice:
    """
    The lattice of some vectors of a cell, by vectors that no sum of others makes shorter.

    Parameters
    ----------
    vectors : ndarray, shape (3, 3)
        Of the cell, as rows.
    periodic : tuple of bool
        Which of them repeat.
    """
    combination = np.eye(3, dtype=np.int64)[list(np.flatnonzero(periodic))]
    reduced = np.asarray(vectors, dtype=np.float64)[list(np.flatnonzero(periodic))]
    while True:
        step = _shortening(reduced)
        if step is None:
            return Lattice(reduced, combination)
        place, weights = step
        combination[place] += weights @ combination
        # from the cell's own vectors each time: rounding does not add up
        reduced[place] = combination[place] @ vectors


def _shortening(vectors: FloatArray) -> tuple[int, IntArray] | None:
    """
    A vector, and what of the others to add to make it shorter; None if nothing does.

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
