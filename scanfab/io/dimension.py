"""Whether a series is of spheres or of discs: what its first particles and its user say."""

from __future__ import annotations

import warnings

from scanfab.base.errors import PackingError, ScanfabNote
from scanfab.base.space import SPACE, Space
from scanfab.base.typing import FloatArray
from scanfab.packing.plane import flat_space, space_of, spelt_plane


def decided_space(name: str, position: FloatArray, dim: str | int) -> Space:
    """
    The space of all frames, with a note where that is a plane that nobody has asked for.

    Parameters
    ----------
    name : str
        Of the series.
    position : ndarray, shape (N, 3)
        The centres of the first frame that has particles, dump's length unit.
    dim : {"auto", 2, 3}
        What is asked for.

    Raises
    ------
    PackingError
        If discs are asked for, and these are none.
    """
    if dim != "auto":
        return flat_space(position) if dim == 2 else SPACE
    found = space_of(position)
    if found.is_plane:
        warnings.warn(
            f"{name}: all centres lie in {found} ({spelt_plane(position, found)}): they are read "
            f"as discs, in 2D; `dim=3` reads them as spheres",
            ScanfabNote,
            stacklevel=5,
        )
    return found


def refuse_other_space(position: FloatArray, decided: Space) -> None:
    """PackingError if a frame of a series that is one of spheres is one of discs."""
    found = space_of(position)
    if found.is_plane and not decided.is_plane:
        raise PackingError(
            f"{other_space(found, decided)}; `dim=2` reads all as discs, `dim=3` all as spheres"
        )


def other_space(found: Space, decided: Space) -> str:
    """What is said of a frame that lies in another space than its series."""
    return (
        f"all its centres lie in {found}, but the first frame that has grains lies in {decided}: "
        f"the frames of a series are all discs in one plane, or all spheres"
    )
