"""
Rattlers are grains that too few neighbours hold; this file has the rules that find them.

A grain that is a single sphere has as many neighbours as contacts. Two clumps that touch in several
points are one neighbour of each other.

A rule is a function of a :class:`~scanfab.packing.sample.Sample`, which has the contacts, the
numbers of neighbours and the options ``min_contacts`` and ``min_force``. Packages offer rules under
the entry point ``scanfab.rattlers``, as this file does.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from scanfab.base.errors import ReadError
from scanfab.base.plugins import having, load_plugins
from scanfab.base.typing import BoolArray

if TYPE_CHECKING:
    from scanfab.packing.sample import Sample

GROUP = "scanfab.rattlers"


RattlerRule = Callable[["Sample"], BoolArray]
"""A function that gives the rattlers, shape (N,). The first sphere speaks for its clump."""


def count(sample: Sample) -> BoolArray:
    """
    Grains with fewer than ``min_contacts`` neighbours, in one pass: the rule of the 2017 paper.

    Rattlers count as neighbours of other grains.
    """
    return sample.grains & (sample.contact_numbers < sample.min_contacts)


def recursive(sample: Sample) -> BoolArray:
    """
    The rule ``count`` over and over, without the rattlers found before, until it finds no more.

    The grains that are left are held by grains that are held themselves, by the boundary and walls.
    """
    found, before = count(sample), np.zeros(len(sample.grains), bool)
    while not np.array_equal(found, before):
        before = found
        numbers = sample.numbers_without(~sample.contacts_without(found))
        found = sample.grains & (numbers < sample.min_contacts)
    return found


def force(sample: Sample) -> BoolArray:
    """
    Grains with fewer than ``min_contacts`` neighbours that press on them, in one pass.

    A contact counts if its normal force is above ``min_force`` times the mean over all contacts,
    compression positive. Contacts with walls count, whatever their force.

    Raises
    ------
    ReadError
        If the contacts have no forces, or one that is no finite number.
    """
    contacts = sample.contacts
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
    slack = ~(contacts.force_n > sample.min_force * mean)
    return sample.grains & (sample.numbers_without(slack) < sample.min_contacts)


@cache
def installed_rules() -> dict[str, RattlerRule]:
    """The rules by name, those of other packages among them."""
    make = having("a function of a scanfab.Sample", __call__=Callable)
    return {name: one.plugin for name, one in load_plugins(GROUP, "rattler rule", make).items()}
