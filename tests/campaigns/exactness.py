"""
The fast scans against their slow twins on many random packings: not one may differ.

Usage, from the root of the repository (10,000 packings take about ten minutes)::

    python -m tests.campaigns.exactness [--packings N] [--seed S]

Grains hang together in chains; neighbours overlap by 0 to 60 % of the sum of their radii, radii
have ratios of 1 to 50. Each packing is scanned along a random axis, with all grains and without
some, by both sweeps at four cut-offs and by the scan that puts its gaps in bins: numbers must be
equal, and lengths to rounding. The exit code is 0 if all are.
"""

from __future__ import annotations

import sys

import numpy as np

from tests.campaigns.frame import asked
from tests.scan.kernels import test_axes, test_bins

MOST_OVERLAP = 0.6
MOST_RATIO = 50.0
# every so often one of the awkward kinds of the test suite
AWKWARD = 10


def chained(random):
    """Grains one on another: random ratio of their sizes, random overlap of neighbours."""
    count = random.integers(2, 30)
    ratio = np.exp(random.uniform(0.0, np.log(MOST_RATIO)))
    largest = random.uniform(0.3, 1.5)
    radius = largest * np.exp(random.uniform(-np.log(ratio), 0.0, count))
    overlap = random.uniform(0.0, MOST_OVERLAP)
    position = np.zeros((count, 3))
    for grain in range(1, count):
        on = random.integers(grain)
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        reach = (radius[on] + radius[grain]) * (1.0 - random.uniform(0.0, overlap))
        position[grain] = position[on] + reach * direction
    return position - position.mean(axis=0), radius


def check(number: int, seed: int) -> str | None:
    """What differs in one packing; None if nothing does."""
    random = np.random.default_rng([seed, number])
    awkward = number % AWKWARD == 0
    kind = test_axes.KINDS[number // AWKWARD % len(test_axes.KINDS)] if awkward else chained
    state = random.bit_generator.state
    for twin in (test_axes, test_bins):
        random.bit_generator.state = state
        try:
            twin.check_random_packing(kind, random)
        except AssertionError as error:
            words = str(error).strip().splitlines()
            return f"{kind.__name__}, {twin.__name__}: {words[0] if words else 'differs'}"
    return None


def main() -> int:
    """The number of packings that differ."""
    given, wrong = asked(__doc__, packings=10_000, seed=0), 0
    for number in range(given.packings):
        difference = check(number, given.seed)
        if difference is not None:
            wrong += 1
            print(f"packing {number} of seed {given.seed}: {difference}", flush=True)
    print(f"{given.packings} packings, {wrong} differ")
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main()))
