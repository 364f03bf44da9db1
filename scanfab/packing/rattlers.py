"""
Rattlers, grains that too few contacts hold: the rules that tell them, by name.

A rule is a function of :class:`Touching`. A package offers one under the entry point
``scanfab.rattlers``, where those of this file register too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from scanfab.base.plugins import having, load_plugins
from scanfab.base.typing import BoolArray, IntArray
from scanfab.packing.contacts import Contacts

__all__ = ["RattlerRule", "Touching", "count", "installed_rules", "recursive"]

GROUP = "scanfab.rattlers"


@dataclass(frozen=True, eq=False)
class Touching:
    """What a rule tells the rattlers of a frame by."""

    contacts: Contacts
    """Those of all particles, M of them, with their forces where the dump has some."""
    numbers: IntArray
    """
    Number of contacts of each particle, shape (N,): with grains, boundary particles and walls.

    A grain that touches an image of itself has two of that contact.
    """
    grains: BoolArray
    """Particles that are not boundary, shape (N,); only these can be rattlers."""
    min_contacts: int = 2
    """What the option `min_contacts` says: with fewer contacts a grain is not held."""

    def numbers_without(self, left_out: BoolArray) -> IntArray:
        """The numbers of contacts, shape (N,), if some contacts, shape (M,), do not count."""
        # np.compress is several times as fast as to index with a mask
        return self.numbers - _ends(np.compress(left_out, self.contacts.pairs, axis=0), self)


RattlerRule = Callable[[Touching], BoolArray]
"""Gives the rattlers, shape (N,)."""


def count(touching: Touching) -> BoolArray:
    """
    Grains with fewer than ``min_contacts`` contacts, in one pass: the rule of the 2017 paper.

    Contacts with other rattlers count.
    """
    return np.asarray(touching.grains & (touching.numbers < touching.min_contacts))


def recursive(touching: Touching) -> BoolArray:
    """
    The same over and over, each time without the contacts of the rattlers, until none is new.

    What is left is held by grains that are held themselves, by the boundary and by walls.
    """
    pairs, numbers = touching.contacts.pairs, touching.numbers
    while True:
        found: BoolArray = touching.grains & (numbers < touching.min_contacts)
        lost = found[pairs[:, 0]] | found[pairs[:, 1]]
        if not lost.any():
            return found
        numbers = numbers - _ends(np.compress(lost, pairs, axis=0), touching)
        pairs = np.compress(~lost, pairs, axis=0)


def _ends(pairs: IntArray, touching: Touching) -> IntArray:
    """How often each particle stands in some pairs, shape (N,)."""
    return np.bincount(pairs.ravel(), minlength=len(touching.numbers))


@cache
def installed_rules() -> dict[str, RattlerRule]:
    """The rules by name, those of other packages among them."""
    make = having("a function of scanfab.packing.rattlers.Touching", __call__=Callable)
    return load_plugins(GROUP, "rattler rule", make)
