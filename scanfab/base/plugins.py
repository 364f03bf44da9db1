"""Plugins: objects that installed packages offer under an entry point."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any, NamedTuple

from scanfab.base.errors import ScanfabError, warn


class Offer(NamedTuple):
    """An object that a package offers."""

    plugin: Any
    point: Any
    """The entry point."""

    @property
    def package(self) -> str:
        """The name of the package; it stands in a long file, which is read only when needed."""
        return self.point.dist.name if self.point.dist is not None else "unknown package"


def having(expected: str, **members: Any) -> Callable[[Any], Any]:
    """
    Make a check of plugins: it raises TypeError for a class or an object without these members.

    Examples
    --------
    >>> from scanfab.base.plugins import having
    >>> having("something with a length", __len__=Callable)(3)
    Traceback (most recent call last):
    TypeError: expected something with a length, found 3, whose __len__ is None
    """

    def make(plugin: Any) -> Any:
        if isinstance(plugin, type):
            raise TypeError(f"expected {expected}, found the class {plugin.__name__} itself")
        for name, kind in members.items():
            if not isinstance(found := getattr(plugin, name, None), kind):
                raise TypeError(f"expected {expected}, found {plugin!r}, whose {name} is {found!r}")
        return plugin

    return make


def load_plugins(group: str, what: str, make: Callable[[Any], Any]) -> dict[str, Offer]:
    """
    Load the plugins of an entry point, by name, in alphabetical order.

    A plugin that cannot be loaded is skipped with a warning, so that the others still work.

    Parameters
    ----------
    group : str
        Name of the entry point, for instance ``scanfab.fabrics``.
    what : str
        Word for a plugin in messages.
    make : callable
        Turns a loaded object into a plugin, or raises an error if it is not suitable.

    Raises
    ------
    ScanfabError
        If two packages use the same name.
    """
    offers: dict[str, Offer] = {}
    for point in sorted(entry_points(group=group), key=lambda point: (point.name, point.value)):
        offer = Offer(None, point)
        try:
            offer = Offer(make(point.load()), point)
        except (Exception, SystemExit) as error:  # a foreign package may fail in any way
            warn(
                f"the {what} {point.name!r} of {offer.package} cannot be loaded: "
                f"{type(error).__name__}: {error}"
            )
            continue
        if point.name in offers:
            raise ScanfabError(
                f"two packages offer a {what} called {point.name!r}: "
                f"{offers[point.name].package} and {offer.package}; remove one of them"
            )
        offers[point.name] = offer
    return offers
