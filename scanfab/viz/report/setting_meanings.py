"""What every setting means, in the words of the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scanfab.pipeline.repeat import spelt_settings

__all__ = ["SETTING_MEANINGS", "settings_table"]

# of the options that read, of the fields of Settings, and of those that write; a test misses any
# that is not here
SETTING_MEANINGS = {
    "format": "reader of the dumps; not given: found by their content",
    "columns": "names of columns that are not the usual ones",
    "contact_columns": "what the columns of the contact files are",
    "radius": "radius of grains whose dump has none, dump's unit",
    "cell": "the periodic cell, where the dump carries none, dump's unit",
    "periodic": "directions in which the sample repeats; not given: the dump's",
    "contacts": "where the contacts come from: contact files, or the geometry of the grains",
    "variants": "a whole sample, b whole without rattlers, c RV, d RV without rattlers",
    "rv": "radius of the RV over half the smallest extent of the grains",
    "rv_radius": "radius of the RV instead, dump's unit",
    "rv_center": "centre of the RV, dump's unit; not given: the middle of the sample",
    "boundary": "particles that are boundary, not grains",
    "cutoff": "shortest void segment that counts (rmin: smallest grain radius)",
    "cutoffs": "several such lengths instead, a row of the table for each",
    "moment": "1: mean length of the void segments; 2: mean of their squares over that",
    "spacing": "distance between neighbouring scan lines; auto: as the tolerance needs",
    "directions": "rule of the scan directions; auto: as the tolerance needs",
    "tolerance": "wanted standard error of the scan, where spacing or directions are auto",
    "max_chords": "an auto scan stops before it cuts more chords from grains in a frame",
    "min_contacts": "a grain with fewer contacts is a rattler",
    "contact_tolerance": "relative tolerance of contacts by geometry",
    "axis": "loading axis, along which the anisotropies are signed",
    "strain": "where the axial strain comes from: cell, boundary, grains or a file",
    "frames": "which frames, as a Python slice",
    "seed": "of the random numbers; the same seed repeats the same numbers",
    "on_error": "what a frame that cannot be read does: stop, or skip it",
    "fields": "columns of the table, where not all are written",
    "digits": "significant digits of the numbers of the table",
}


def settings_table(asked: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value and meaning of each setting of a manifest."""
    spelt = spelt_settings(asked)
    return [
        (
            name.replace("_", "-"),
            _plain(spelt.get(name, "auto" if name in ("spacing", "directions") else "-")),
            SETTING_MEANINGS.get(name, ""),
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
