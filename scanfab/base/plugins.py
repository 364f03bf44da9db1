"""Plugins that installed packages offer under an entry point."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any, NamedTuple

from scanfab.base.errors import ScanfabError, warn


class Offer(NamedTuple):
    """An object that a package offers."""

    plugin: Any
    package: str
    """The name of the package."""


def having(expected: str, **members: Any) -> Callable[[Any], Any]:
    """
    A check of plugins: it raises TypeError for a class, or for an object without these members.

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
    The objects that packages offer, by name and in alphabetical order.

    A plugin that cannot be loaded is left out with a warning, so that the others still work.

    Parameters
    ----------
    group : str
        The entry point, for instance ``scanfab.fabrics``.
    what : str
        How messages call such a plugin.
    make : callable
        Makes a plugin of a loaded object, or raises if the object is none.

    Raises
    ------
    ScanfabError
        If two packages use one name.
    """
    found: dict[str, Offer] = {}
    for point in sorted(entry_points(group=group), key=lambda point: (point.name, point.value)):
        package = point.dist.name if point.dist is not None else "unknown package"
        try:
            plugin = make(point.load())
        except (Exception, SystemExit) as error:  # a foreign package may fail in any way
            warn(
                f"the {what} {point.name!r} of {package} cannot be loaded: "
                f"{type(error).__name__}: {error}"
            )
            continue
        if point.name in found:
            raise ScanfabError(
                f"two packages offer a {what} called {point.name!r}: "
                f"{found[point.name].package} and {package}; remove one of them"
            )
        found[point.name] = Offer(plugin, package)
    return found
