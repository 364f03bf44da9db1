"""
The four variants of the 2017 paper, and what belongs to each: solids, contacts, counted grains.

a: whole sample; b: whole, rattlers are void; c: RV; d: RV, rattlers are void.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scanfab.base.arrays import cast
from scanfab.base.errors import PackingError
from scanfab.base.spelling import counted
from scanfab.base.typing import BoolArray, IntArray, RowArray
from scanfab.packing.contacts import Contacts
from scanfab.packing.escaped import SHARE, escaped_grains
from scanfab.packing.packing import Packing
from scanfab.packing.rattlers import RattlerRule, count
from scanfab.packing.window import Window


@dataclass(frozen=True)
class Variant:
    """One of the four choices."""

    name: str
    in_window: bool
    """Only what lies in the RV."""
    without_rattlers: bool
    """Rattlers are void, and their contacts do not count."""


VARIANTS = {name: Variant(name, name in "cd", name in "bd") for name in "abcd"}


@dataclass(frozen=True, eq=False)
class Sample:
    """
    A packing whose particles are sorted into boundary, grains and rattlers.

    Parameters
    ----------
    packing : Packing
        Its contacts decide which grains are rattlers.
    boundary : ndarray of bool, shape (N,)
        Particles that are boundary, not grains. A clump is boundary if one of its spheres is.
    min_contacts : int, optional
        A grain with fewer neighbours is a rattler.
    rattler_rule : callable, optional
        The rule that finds the rattlers, by default :func:`~scanfab.packing.rattlers.count`.
    min_force : float, optional
        For the rule ``force``, relative to the mean normal force.

    Raises
    ------
    PackingError
        If the boundary is no truth value for each particle.

    Examples
    --------
    >>> from scanfab import Packing, Sample
    >>> row = [[0, 0, 0], [2, 0, 0], [4, 0, 0]]
    >>> packing = Packing(row, 1.0, contacts=[[0, 1], [1, 2]], columns={"type": [1, 1, 2]})
    >>> sample = Sample(packing, packing.columns["type"] == 2)
    >>> sample
    Sample: 2 grains, 1 rattler (fewer than 2 contacts); 1 boundary particle
    >>> sample.rattlers
    array([ True, False, False])
    """

    packing: Packing
    boundary: BoolArray
    min_contacts: int = 2
    rattler_rule: RattlerRule = count
    min_force: float = 0.0

    def __post_init__(self) -> None:
        """PackingError if the boundary is no truth value for each particle."""
        boundary = np.asarray(self.boundary)
        if boundary.shape != (len(self.packing),) or boundary.dtype != np.bool_:
            raise PackingError(
                f"boundary: expected a truth value for each of {len(self.packing)} particles, such "
                f'as packing.columns["type"] == 2, found {boundary.dtype} of shape {boundary.shape}'
            )
        if self.packing.bodies is not None:
            object.__setattr__(self, "boundary", self.packing.bodies.whole(boundary))

    def __repr__(self) -> str:
        what = f"Sample: {counted(self.number(self.grains), 'grain')}"
        if self.packing.contacts is not None:
            rattlers = counted(self.number(self.rattlers), "rattler")
            of = "contact" if self.packing.bodies is None else "neighbour"
            rule = f"fewer than {counted(self.min_contacts, of)}"
            if self.rattler_rule is not count:
                rule = f"by {getattr(self.rattler_rule, '__name__', 'a rule')} of {rule}"
            what += f", {rattlers} ({rule})"
        boundary = self.number(self.boundary)
        return what + (f"; {counted(boundary, 'boundary particle')}" if boundary else "")

    @property
    def contacts(self) -> Contacts:
        """The contacts of the packing; PackingError if they are not known."""
        if self.packing.contacts is None:
            raise PackingError(
                "the contacts of the packing are not known: find_contacts(packing) finds them"
            )
        return self.packing.contacts

    @cached_property
    def grains(self) -> BoolArray:
        """Particles that are not boundary, shape (N,)."""
        return ~self.boundary

    def number(self, chosen: BoolArray) -> int:
        """
        Number of grains that some spheres belong to: a clump is one grain.

        Parameters
        ----------
        chosen : ndarray of bool, shape (N,)
            Spheres.

        Returns
        -------
        int
        """
        bodies = self.packing.bodies
        return int(np.count_nonzero(chosen)) if bodies is None else bodies.count(chosen)

    def once(self, chosen: BoolArray) -> BoolArray:
        """
        The first sphere of each chosen grain, where all spheres of a grain are chosen or none.

        Parameters
        ----------
        chosen : ndarray of bool, shape (N,)
            Spheres.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        bodies = self.packing.bodies
        return chosen if bodies is None else np.asarray(chosen & bodies.is_head)

    @property
    def clumps(self) -> int:
        """How many grains are bodies of several spheres."""
        bodies = self.packing.bodies
        return 0 if bodies is None else int(np.sum(np.bincount(bodies.head[self.grains]) > 1))

    @cached_property
    def escaped(self) -> BoolArray:
        """Grains that lie far away from all others."""
        return escaped_grains(self.packing, self.grains)

    @cached_property
    def gathered(self) -> BoolArray:
        """Grains without escaped ones, unless these are too many, (N,); the extents are theirs."""
        few = max(SHARE * self.number(self.grains), 1.0)
        return self.grains & ~self.escaped if self.number(self.escaped) <= few else self.grains

    @cached_property
    def rattlers(self) -> BoolArray:
        """Grains that are rattlers by the rule, shape (N,)."""
        named = self.rattler_rule(self)
        found: BoolArray = cast("rattlers", named, np.bool_, (len(self.packing),))
        if self.packing.bodies is not None:
            found = found[self.packing.bodies.head]
        return self.grains & found

    @cached_property
    def contact_numbers(self) -> IntArray:
        """
        Number of neighbours of each particle, contacts with walls included, shape (N,).

        Grains that are spheres have one neighbour a contact. Each sphere of a clump has the number
        of the clump.
        """
        return self._numbers(self.contacts.neighbours(self.packing.bodies))

    def numbers_without(self, left_out: BoolArray) -> IntArray:
        """
        Number of neighbours of each particle without some contacts; contacts with walls stay.

        Parameters
        ----------
        left_out : ndarray of bool, shape (M,)
            Contacts.

        Returns
        -------
        ndarray of int, shape (N,)
        """
        contacts, packing = self.contacts, self.packing
        if packing.bodies is None:
            lost = np.compress(left_out, contacts.pairs, axis=0)
            return self.contact_numbers + packing.wall_contacts - self._numbers(lost)
        # clumps that touch in several points stay neighbours while one contact is left
        return self._numbers(contacts.neighbours(packing.bodies, left_out))

    def _numbers(self, pairs: RowArray) -> IntArray:
        """Numbers of neighbours, by pairs of grains and by all contacts with walls, shape (N,)."""
        bodies, walls = self.packing.bodies, self.packing.wall_contacts
        # one column at a time, as bincount copies what it counts
        first, second = (np.bincount(rows, minlength=len(walls)) for rows in pairs.T)
        numbers = first + second
        if bodies is None:
            return numbers + walls
        np.add.at(numbers, bodies.head, walls)
        return numbers[bodies.head]

    def numbers_of(self, variant: Variant) -> IntArray:
        """
        Number of neighbours of each particle, without grains that the variant leaves out.

        Parameters
        ----------
        variant : Variant
            One of ``VARIANTS``.

        Returns
        -------
        ndarray of int, shape (N,)
        """
        return self._numbers_left if variant.without_rattlers else self.contact_numbers

    @cached_property
    def _numbers_left(self) -> IntArray:
        """Number of neighbours without rattlers, shape (N,)."""
        return self.numbers_without(~self.contacts_without(self.rattlers))

    def removed(self, variant: Variant) -> BoolArray:
        """
        Grains that the variant leaves out.

        Parameters
        ----------
        variant : Variant
            One of ``VARIANTS``.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        return self.rattlers if variant.without_rattlers else np.zeros(len(self.packing), bool)

    def counted(self, variant: Variant, window: Window | None) -> BoolArray:
        """
        Grains whose centre lies in the variant's window, rattlers included.

        The centre of a clump is the mean of its spheres' centres, weighted by their volumes. If it
        lies in the window, all spheres of the clump are counted.

        Parameters
        ----------
        variant : Variant
            One of ``VARIANTS``.
        window : Window or None
            Of c and d.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        if not variant.in_window or window is None:
            return self.grains
        bodies = self.packing.bodies
        places = self.packing.position if bodies is None else bodies.place
        return self.grains & window.contains(places, self.packing)

    def solids(self, variant: Variant, window: Window | None) -> BoolArray:
        """
        Grains of which the variant's lines may meet a part.

        Parameters
        ----------
        variant : Variant
            One of ``VARIANTS``.
        window : Window or None
            Of c and d.

        Returns
        -------
        ndarray of bool, shape (N,)
        """
        left = self.grains & ~self.removed(variant)
        if not variant.in_window or window is None:
            return left
        return left & window.may_meet(self.packing.position, self.packing.radius, self.packing)

    def contacts_without(self, left_out: BoolArray) -> BoolArray:
        """
        Contacts between particles that are not left out.

        Parameters
        ----------
        left_out : ndarray of bool, shape (N,)
            Particles.

        Returns
        -------
        ndarray of bool, shape (M,)
        """
        one, two = self.contacts.pairs.T
        return np.asarray(~(left_out[one] | left_out[two]))

    def fabric_contacts(self, variant: Variant, window: Window | None) -> BoolArray:
        """
        Which grain-grain contacts enter the variant's contact fabric.

        Parameters
        ----------
        variant : Variant
            One of ``VARIANTS``.
        window : Window or None
            Of c and d.

        Returns
        -------
        ndarray of bool, shape (M,)
        """
        chosen = self.contacts_without(self.boundary | self.removed(variant))
        if not variant.in_window or window is None:
            return chosen
        return chosen & window.contains(self.contacts.point, self.packing)

    def coordination(self, variant: Variant, window: Window | None) -> float | None:
        """
        Mean number of contacts of the variant's grains, including contacts with the boundary.

        Contacts with removed grains do not count. Clumps are counted by neighbours.

        Parameters
        ----------
        variant : Variant
            One of ``VARIANTS``.
        window : Window or None
            Of c and d.

        Returns
        -------
        float or None
            None if there is no grain.
        """
        counted = self.once(self.counted(variant, window) & ~self.removed(variant))
        return float(self.numbers_of(variant)[counted].mean()) if counted.any() else None
