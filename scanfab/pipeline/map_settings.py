"""Settings of a map: the settings of a computation, and the blocks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scanfab.base.option import numbers, optional, sample, whole
from scanfab.pipeline.settings import MAX_CHORDS, Settings
from scanfab.pipeline.values import parse_variants

if TYPE_CHECKING:
    from scanfab.base.column import Column


BLOCK_OPTIONS = ("grid", "slices", "shells")
parse_blocks = optional(whole("1 or more", lambda number: number >= 1))
parse_grid = optional(
    numbers("three numbers of blocks, such as 4,4,8", lambda n: len(n) == 3 and min(n) >= 1, int)
)


@dataclass(frozen=True, init=False, repr=False)
class MapSettings(Settings):
    """
    What to map, and how: the options of :func:`scanfab.fabric_map`.

    Parameters
    ----------
    **options
        Options of :func:`scanfab.fabric_map`.

    Raises
    ------
    SettingsError
        If a value cannot be used, or not exactly one of `grid`, `slices` and `shells` is given.
    TypeError
        If there is no such option.

    Examples
    --------
    >>> from scanfab.pipeline.map_settings import MapSettings
    >>> MapSettings(grid="2,3,4").rows_per_frame
    24
    """

    variants: str = sample(parse_variants, default="a", form="LETTERS", first=True)
    grid: tuple[int, int, int] | None = sample(parse_grid, form="NX,NY,NZ", first=True)
    """Number of blocks along x, y and z (along the edges of a periodic cell)."""
    slices: int | None = sample(parse_blocks, first=True)
    """Number of slices of equal thickness along `axis`."""
    shells: int | None = sample(parse_blocks, first=True)
    """Number of shells of equal thickness about the centre."""

    def _clashes(self) -> Iterator[str]:
        yield from super()._clashes()
        named = [f"`{name}`" for name in BLOCK_OPTIONS if getattr(self, name) is not None]
        if len(named) != 1:
            yield (
                f"a map has one kind of blocks: expected exactly one of `grid`, `slices` and "
                f"`shells`, found {' and '.join(named) or 'none'}"
            )
        several = {"rv": len(self.rvs) > 1, "cutoffs": self.cutoffs, "with_": self.with_}
        for name in (name for name, given in several.items() if given):
            yield f"{name}: a map has one RV, one cut-off and no further columns: use `compute`"

    @property
    def budget(self) -> float:
        """Most chords of an auto scan, which has the lines of all blocks."""
        return self.max_chords or MAX_CHORDS

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return math.prod(self.grid) if self.grid is not None else self.slices or self.shells or 1

    @property
    def columns(self) -> tuple[Column, ...]:
        """All columns of the table."""
        from scanfab.table.columns import map_columns

        return map_columns(self.more_columns, shells=self.shells is not None)

    @property
    def more_columns(self) -> tuple[str, ...]:
        """Names of the further columns that exist for blocks."""
        return tuple(name for name in super().more_columns if name == "edge")


def is_map(options: Any) -> bool:
    """Whether one of the options makes a map, such as ``slices``."""
    return any(options.get(name) is not None for name in BLOCK_OPTIONS)
