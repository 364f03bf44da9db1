"""
Rattlers are grains that too few neighbours hold; this file has the rules that find them.

A grain that is a single sphere has as many neighbours as contacts. Two clumps that touch in several
points are one neighbour of each other.

A rule is a function of :class:`Touching`. Packages offer rules under the entry point
``scanfab.rattlers``, as this file does.
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
    """The data of a frame by which a rule finds the rattlers."""

    contacts: Contacts
    """The M contacts of all particles, with forces if the dump has them."""
    numbers: IntArray
    """
    Number of neighbours of each particle, shape (N,): grains, boundary particles and wall contacts.

    A grain that touches an image of itself counts it twice, once on each side. Each sphere of a
    clump has the number of the clump.
    """
    grains: BoolArray
    """Particles that are not boundary, shape (N,); only these can be rattlers."""
    min_contacts: int = 2
    """The option `min_contacts`: with fewer neighbours a grain is a rattler."""
    bodies: Bodies | None = None
    """The bodies of the packing; None if each sphere is a grain."""
    min_force: float = 0.0
    """The option `min_force`, relative to the mean normal force."""

    def numbers_without(self, left_out: BoolArray) -> IntArray:
        """Numbers of neighbours, shape (N,), without some contacts, shape (M,)."""
        if self.bodies is None:
            return self.numbers - self.ends(np.compress(left_out, self.contacts.pairs, axis=0))
        # clumps that touch in several points stay neighbours while one contact is left
        left = self.contacts.neighbours(self.bodies, left_out)
        return self.numbers - self.ends(self.neighbours) + self.ends(left)

    @property
    def neighbours(self) -> RowArray:
        """Pairs of grains that touch, each once: rows of their first spheres, shape (K, 2)."""
        return self.contacts.neighbours(self.bodies)

    def ends(self, pairs: RowArray) -> IntArray:
        """How many of some pairs each grain belongs to, at each of its spheres, shape (N,)."""
        # one column at a time, as bincount copies what it counts
        first, second = (np.bincount(rows, minlength=len(self.grains)) for rows in pairs.T)
        numbers = first + second
        return numbers if self.bodies is None else numbers[self.bodies.head]


RattlerRule = Callable[[Touching], BoolArray]
"""A function that gives the rattlers, shape (N,). The first sphere speaks for its clump."""


def count(touching: Touching) -> BoolArray:
    """
    Grains with fewer than ``min_contacts`` neighbours, in one pass: the rule of the 2017 paper.

    Rattlers count as neighbours of other grains.
    """
    return np.asarray(touching.grains & (touching.numbers < touching.min_contacts))


def recursive(touching: Touching) -> BoolArray:
    """
    The rule ``count`` over and over, without the rattlers found before, until it finds no more.

    The grains that are left are held by grains that are held themselves, by the boundary and walls.
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
            'the rule `rattlers="force"`: the mean normal force is a pull: if the file lists the '
            "force on the other grain, name id1 and id2 the other way round"
        )
    pressing = contacts.force_n > touching.min_force * mean
    found = touching.numbers_without(~pressing) < touching.min_contacts
    return np.asarray(touching.grains & found)


@cache
def installed_rules() -> dict[str, RattlerRule]:
    """The rules by name, those of other packages among them."""
    make = having("a function of scanfab.packing.rattlers.Touching", __call__=Callable)
    return {name: one.plugin for name, one in load_plugins(GROUP, "rattler rule", make).items()}
