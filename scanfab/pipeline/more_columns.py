"""Which further columns a table has because its settings ask for more than the default."""

from __future__ import annotations

from scanfab.base.column import Column
from scanfab.fabric.registry import GROUPS
from scanfab.fabric.window import WINDOW_ALPHA
from scanfab.packing.columns import RV_COLUMN
from scanfab.pipeline.settings import Settings
from scanfab.scan.columns import EDGE_COLUMNS
from scanfab.scan.edges import CLIP

__all__ = ["more_columns"]


def more_columns(settings: Settings) -> tuple[str, ...]:
    """
    Their names, in the table's order.

    Examples
    --------
    >>> from scanfab import Settings
    >>> from scanfab.pipeline.more_columns import more_columns
    >>> more_columns(Settings(edge="ends", variants="a"))
    ('edge', 'left_out')
    """
    columns: list[Column] = []
    if settings.needs_window:
        shaped = settings.rv_shape != "sphere" or settings.rv_follows != "none"
        columns += [RV_COLUMN] if len(settings.rvs) > 1 else []
        columns += [WINDOW_ALPHA] if shaped else []
    columns += EDGE_COLUMNS if settings.edge != CLIP else ()
    for group in settings.with_:
        columns += GROUPS[group].columns
    return tuple(column.name for column in columns)
