"""Settings of a map: those of a computation, and the blocks of space it tells apart."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scanfab.base.errors import SettingsError
from scanfab.base.option import numbers, optional, sample, whole
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.values import parse_variants

if TYPE_CHECKING:
    from scanfab.base.column import Column


BLOCK_OPTIONS = ("grid", "slices", "shells")
block_count = whole("1 or more", lambda number: number >= 1)


def parse_grid(name: str, value: Any) -> tuple[int, int, int]:
    """Three whole numbers of at least 1, in a text between commas or blanks."""
    parse = numbers(
        "three numbers of blocks, such as 4,4,8",
        lambda grid: len(grid) == 3 and all(one >= 1 and one.is_integer() for one in grid),
    )
    first, second, third = map(int, parse(name, value))
    return first, second, third


@dataclass(frozen=True, init=False, repr=False)
class MapSettings(Settings):
    """
    What to map, and how: the options of :func:`scanfab.fabric_map`.

    Parameters
    ----------
    **options
        Those of :func:`scanfab.fabric_map`.

    Raises
    ------
    SettingsError
        If a value cannot be used, or not just one of `grid`, `slices` and `shells` is given.
    TypeError
        If there is no such option.

    Examples
    --------
    >>> from scanfab.pipeline.maps.settings import MapSettings
    >>> MapSettings(grid="2,3,4").rows_per_frame
    24
    """

    variants: str = sample(parse_variants, default="a", metavar="LETTERS", first=True)
    grid: tuple[int, int, int] | None = sample(optional(parse_grid), metavar="NX,NY,NZ", first=True)
    """So many blocks along x, y and z (along the edges of a periodic cell)."""
    slices: int | None = sample(optional(block_count), first=True)
    """So many slices of equal thickness along `axis`."""
    shells: int | None = sample(optional(block_count), first=True)
    """So many shells of equal thickness about the centre."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        named = [name for name in BLOCK_OPTIONS if getattr(self, name) is not None]
        if len(named) != 1:
            raise SettingsError(
                f"a map has one kind of blocks: expected just one of `grid`, `slices` and "
                f"`shells`, found {' and '.join(f'`{name}`' for name in named) or 'none'}"
            )
        if self.cutoffs:
            raise SettingsError(
                "cutoffs: a map is of one cut-off: name it as `cutoff`, and make a map for each"
            )
        if len(self.rvs) > 1:
            raise SettingsError(
                f"rv: expected one size, as a map is of one RV, found {len(self.rvs)}: make a map "
                f"for each"
            )
        if self.with_:
            raise SettingsError(
                f"with_: a map has no further columns, found {', '.join(self.with_)}: `compute` "
                f"has them, of the whole sample and of RVs wherever `rv_center` is"
            )

    @property
    def blocks(self) -> int:
        """How many there are."""
        return math.prod(self.grid) if self.grid is not None else self.slices or self.shells or 1

    @property
    def rows_per_frame(self) -> int:
        """One for each variant and block."""
        return len(self.variants) * self.blocks

    @property
    def columns(self) -> tuple[Column, ...]:
        """Of the table."""
        from scanfab.table.columns import map_columns

        return map_columns(self.more_columns, shells=self.shells is not None)

    @property
    def more_columns(self) -> tuple[str, ...]:
        """Of those of compute, what can be told of each block."""
        return tuple(name for name in super().more_columns if name == "edge")


def is_map(options: Any) -> bool:
    """Whether some options are those of a map."""
    return any(options.get(name) is not None for name in BLOCK_OPTIONS)
