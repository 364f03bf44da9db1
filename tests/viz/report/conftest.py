"""What tests of the report share: that of the sample, and reports without figures."""

from contextlib import chdir

import pytest

import scanfab
from tests.conftest import ROOT


@pytest.fixture
def plain(monkeypatch):
    """There are no figures, which take most of the time."""
    monkeypatch.setattr("scanfab.viz.report.report.make_figures", lambda *_, **__: [])


@pytest.fixture(scope="session")
def sample_report(computed):
    """Of the sample's table, opened from the repository."""
    with chdir(ROOT):
        return scanfab.report(computed.table)
