"""
Rattlers, grains that too few neighbours hold: the rules that tell them, by name.

Grains that are single spheres have as many neighbours as contacts. A clump may touch another one in
several points: that is one neighbour.

A rule is a function of :class:`Touching`. A package offers one under the entry point
``scanfab.rattlers``, where those of this file register too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.plugins import having, load_plugins
from scanfab.base.typing import BoolArray, IntArray, RowArray
from scanfab.packing.bodies import Bodies
from scanfab.packing.contacts import Contacts

GROUP = "scanfab.rattlers"


@dataclass(frozen=True, eq=False)
class Touching:
    """What a rule tells the rattlers of a frame by."""

    contacts: Contacts
    """Those of all particles, M of them, with their forces where the dump has some."""
    numbers: IntArray
    """
    Number of neighbours of each particle, shape (N,): grains, boundary particles and wall contacts.

    A grain that touches an image of itself has two by that. Each sphere of a clump has the clump's.
    """
    grains: BoolArray
    """Particles that are not boundary, shape (N,); only these can be rattlers."""
    min_contacts: int = 2
    """What the option `min_contacts` says: with fewer neighbours a grain is not held."""
    bodies: Bodies | None = None
    """Which spheres are one grain; None if each is one."""
    min_force: float = 0.0
    """What the option `min_force` says, relative to the mean normal force."""

    def numbers_without(self, left_out: BoolArray) -> IntArray:
        """The numbers of neighbours, shape (N,), if some contacts, shape (M,), do not count."""
        left = self.contacts.neighbours(self.bodies, left_out)
        return self.numbers - self.ends(self.neighbours) + self.ends(left)

    @property
    def neighbours(self) -> RowArray:
        """Pairs of grains that touch, each once: rows of their first spheres, shape (K, 2)."""
        return self.contacts.neighbours(self.bodies)

    def ends(self, pairs: RowArray) -> IntArray:
        """How often each grain stands in some pairs, at each of its spheres, shape (N,)."""
        numbers = np.bincount(pairs.ravel(), minlength=len(self.grains))
        return numbers if self.bodies is None else numbers[self.bodies.head]


RattlerRule = Callable[[Touching], BoolArray]
"""Gives the rattlers, shape (N,); of a clump, what it says of the first sphere holds."""


def count(touching: Touching) -> BoolArray:
    """
    Grains with fewer than ``min_contacts`` neighbours, in one pass: the rule of the 2017 paper.

    Other rattlers are neighbours, too.
    """
    return np.asarray(touching.grains & (touching.numbers < touching.min_contacts))


def recursive(touching: Touching) -> BoolArray:
    """
    The same over and over, each time without the rattlers as neighbours, until none is new.

    What is left is held by grains that are held themselves, by the boundary and by walls.
    """
    pairs, numbers = touching.neighbours, touching.numbers
    while True:
        found: BoolArray = touching.grains & (numbers < touching.min_contacts)
        lost = found[pairs[:, 0]] | found[pairs[:, 1]]
        if not lost.any():
            return found
        numbers = numbers - touching.ends(np.compress(lost, pairs, axis=0))
        pairs = np.compress(~lost, pairs, axis=0)


def force(touching: Touching) -> BoolArray:
    """
    Grains with fewer than ``min_contacts`` neighbours that press on them, in one pass.

    A contact counts if its normal force is above ``min_force`` times the mean over all contacts,
    compression positive. Contacts with walls count, whatever their force.

    Raises
    ------
    ReadError
        If the contacts have no forces, or one that is no finite number.
    """
    contacts = touching.contacts
    if contacts.force_n is None:
        raise ReadError(
            'the rule `rattlers="force"` needs the forces of the contacts, which are '
            f"{'not in the file' if contacts.source == 'file' else 'found by geometry'}: choose "
            '`rattlers="count"`, or name a contact file with forces (`contacts`)'
        )
    if not np.isfinite(contacts.force_n).all():
        raise ReadError(
            'the rule `rattlers="force"`: a contact has a force that is no finite number'
        )
    mean = contacts.force_n.mean() if len(contacts) else 0.0
    if mean < 0.0:
        raise ReadError(
            'the rule `rattlers="force"`: the contacts pull in the mean, as where a file lists '
            "the force on the other grain: name id1 and id2 the other way round"
        )
    pressing = contacts.force_n > touching.min_force * mean
    found = touching.numbers_without(~pressing) < touching.min_contacts
    return np.asarray(touching.grains & found)


@cache
def installed_rules() -> dict[str, RattlerRule]:
    """The rules by name, those of other packages among them."""
    make = having("a function of scanfab.packing.rattlers.Touching", __call__=Callable)
    return {name: one.plugin for name, one in load_plugins(GROUP, "rattler rule", make).items()}
