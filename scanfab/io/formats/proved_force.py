"""Forces of contacts whose file does not say on which grain they act: that is proved, or told."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from pathlib import Path

from scanfab.base.errors import ScanfabNote, ScanfabWarning
from scanfab.base.typing import FloatArray, IntArray
from scanfab.io.formats.table_proof import NEARLY_ALL, share_of_push
from scanfab.io.reader import GrainTable

__all__ = ["proved_force", "tell_left_out"]


def proved_force(
    path: Path, grains: GrainTable, rows: IntArray, force: FloatArray
) -> FloatArray | None:
    """
    The force on the second grain: the sign by which nearly all forces push the grains apart.

    Parameters
    ----------
    path : Path
        For messages.
    grains : GrainTable
        Of the same step.
    rows : ndarray, shape (M, 2)
        Both grains of each contact.
    force : ndarray, shape (M, 3)
        On one of both, the same for all contacts.

    Returns
    -------
    ndarray, shape (M, 3), or None
        None, with a warning, where the forces speak for neither.
    """
    share = share_of_push(grains, rows, force)
    if share is not None and 1 - NEARLY_ALL < share < NEARLY_ALL:
        warnings.warn(
            f"{path}: the forces are left out: {share:.0%} of them push the second grain off the "
            f"first, so it cannot be told on which of both they act",
            ScanfabWarning,
            stacklevel=2,
        )
        return None
    on_second = share is None or share >= NEARLY_ALL
    warnings.warn(
        f"{path.name}: the forces act on the {'second' if on_second else 'first'} grain of each "
        f"contact, since they push the grains apart",
        ScanfabNote,
        stacklevel=2,
    )
    return force if on_second else -force


def tell_left_out(path: Path, names: Iterable[str]) -> None:
    """A note of arrays that may be forces too, but by no name that is known."""
    left_out = ", ".join(name for name in names if "force" in name.lower() and name != "force")
    if left_out:
        warnings.warn(
            f"{path.name}: left out of the contacts: {left_out}: a force is taken from an array "
            f"`force` with three components",
            ScanfabNote,
            stacklevel=2,
        )
