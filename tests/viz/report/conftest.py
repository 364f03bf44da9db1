"""What tests of the report share: tables in files, and reports without figures."""

from __future__ import annotations

import json

import pytest

from scanfab.viz.report.page import Picture
from tests.helpers.dumps import write


@pytest.fixture
def table(tmp_path):
    """Write rows into a file."""

    def make(rows, name="t.jsonl"):
        return write(tmp_path / name, "".join(json.dumps(row) + "\n" for row in rows))

    return make


@pytest.fixture
def plain(monkeypatch):
    """There are no figures, which take most of the time."""
    monkeypatch.setattr("scanfab.viz.report.report.make_figures", lambda *_, **__: [])


@pytest.fixture
def undrawn(monkeypatch):
    """Figures have their captions, and are not drawn."""
    monkeypatch.setattr(
        "scanfab.viz.report.report.picture_of", lambda figure, _: Picture("", figure.caption, 1)
    )
