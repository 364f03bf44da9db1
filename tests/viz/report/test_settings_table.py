"""Every setting is explained to the readers of a report."""

from __future__ import annotations

import inspect
import json
from dataclasses import fields
from pathlib import Path

from scanfab.io.sources import READING, read_series
from scanfab.pipeline.options import MEANINGS
from scanfab.pipeline.settings import Settings
from scanfab.viz.report.tables import settings_table


def test_every_setting_has_a_meaning():
    """A setting that is new needs a meaning where it is declared."""
    settings = {field.name for field in fields(Settings)} - {"workers"}
    assert {*READING, *settings, "fields", "digits"} == set(MEANINGS)
    assert all(MEANINGS.values())
    reading = inspect.signature(read_series).parameters.values()
    assert set(READING) == {one.name for one in reading if one.kind is one.KEYWORD_ONLY}


def test_every_line_of_a_manifest_is_explained(computed):
    manifest = json.loads(Path(f"{computed.table}.manifest.json").read_text("utf-8"))
    lines = settings_table(manifest["settings"])
    assert len(lines) > 20
    assert all(name and value and meaning for name, value, meaning in lines)


def test_a_setting_that_nobody_knows_is_shown():
    assert settings_table({"sources": ["x"], "unheard": 3}) == [("unheard", "3", "")]
