"""Moved to scanfab.io.contacts."""

import warnings
from collections.abc import Iterable

from scanfab.base.errors import ScanfabNote
from scanfab.io.contacts import proved_force as proved_force


def tell_left_out(names: Iterable[str]) -> None:
    """A note of arrays that may be forces too, but by no name that is known."""
    left_out = ", ".join(name for name in names if "force" in name.lower() and name != "force")
    if left_out:
        warnings.warn(
            f"left out of the contacts: {left_out}: a force is taken from an array `force` with "
            f"three components",
            ScanfabNote,
            stacklevel=2,
        )
