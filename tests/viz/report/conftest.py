"""What tests of the report share: tables in files, and reports without figures."""

from contextlib import chdir

import pytest

import scanfab
from scanfab.viz.report.page import Picture
from tests.conftest import ROOT


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


@pytest.fixture(scope="session")
def sample_report(computed):
    """Of the sample's table, opened from the repository."""
    with chdir(ROOT):
        return scanfab.report(computed.table)
