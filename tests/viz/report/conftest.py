"""What tests of the report share: tables in files, and reports without figures."""

from __future__ import annotations

import json

import pytest

from tests.helpers.dumps import write


@pytest.fixture
def table(tmp_path):
    """Write rows into a file."""

    def make(rows, name="t.jsonl"):
        return write(tmp_path / name, "".join(json.dumps(row) + "\n" for row in rows))

    return make


@pytest.fixture
def plain(monkeypatch):
    """No figures are drawn, which take most of the time."""
    monkeypatch.setattr("scanfab.viz.report.report.make_figures", lambda *_, **__: [])
