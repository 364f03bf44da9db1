"""What every setting means, in the words of the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scanfab.base.option import flag_of
from scanfab.pipeline.options import MEANINGS
from scanfab.pipeline.repeat import spelt_settings


def settings_table(asked: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value and meaning of each setting of a manifest."""
    spelt = spelt_settings(asked)
    return [
        (
            flag_of(name)[2:],
            _plain(spelt.get(name, "auto" if name in ("spacing", "directions") else "-")),
            MEANINGS.get(name, ""),
        )
        for name in asked
        if name not in ("scanfab", "sources")
    ]


def _plain(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    if isinstance(value, dict):
        return ", ".join(f"{key}={item}" for key, item in value.items())
    return str(value)
