"""What tests of figures look at: a drawn page, and the sample's frames."""

import pytest

import scanfab
from scanfab.table.compare import compare_tables
from scanfab.viz.figures.figure import drawn_page, make_figures
from tests.conftest import ROOT, SAMPLE


@pytest.fixture
def drawn():
    """Draw a figure of a table, or the page of all."""

    def draw(rows, name=None, strain_max=None):
        comparison = compare_tables(rows, strain_max=strain_max)
        with drawn_page(make_figures(rows, "table", name, comparison=comparison)) as page:
            page.canvas.draw()
        return page

    return draw


@pytest.fixture
def series(monkeypatch):
    monkeypatch.chdir(ROOT)
    return scanfab.read_series(SAMPLE)
