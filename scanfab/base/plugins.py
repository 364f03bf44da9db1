"""What other packages offer under an entry point."""

from __future__ import annotations

import warnings
from importlib.metadata import entry_points
from typing import Any

from scanfab.base.errors import ScanfabError, ScanfabWarning

__all__ = ["load_plugins"]


def load_plugins(group: str, what: str) -> dict[str, Any]:
    """
    The objects that packages offer, by name and in alphabetical order.

    One that cannot be loaded is a warning with its name, so that it spoils nothing else.

    Parameters
    ----------
    group : str
        The entry point, for instance ``scanfab.fabrics``.
    what : str
        What one of them is called in a message.

    Raises
    ------
    ScanfabError
        If two packages use one name.
    """
    found: dict[str, tuple[str, Any]] = {}
    for point in sorted(entry_points(group=group), key=lambda point: (point.name, point.value)):
        package = point.dist.name if point.dist is not None else "unknown package"
        if point.name in found:
            raise ScanfabError(
                f"two packages offer a {what} called {point.name!r}: {found[point.name][0]} and "
                f"{package}; remove one of them"
            )
        try:
            found[point.name] = package, point.load()
        except (Exception, SystemExit) as error:  # a foreign package may fail in any way
            warnings.warn(
                f"the {what} {point.name!r} of {package} cannot be loaded: "
                f"{type(error).__name__}: {error}",
                ScanfabWarning,
                stacklevel=2,
            )
    return {name: offered for name, (_, offered) in found.items()}
