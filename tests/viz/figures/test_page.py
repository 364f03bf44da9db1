"""Figures by name, on a page and in files: lettered through, whole, and the same each time."""

from __future__ import annotations

import warnings

import pytest

from scanfab.base.errors import SettingsError
from scanfab.table.compare import compare_tables
from tests.helpers.figures import BYTES, save_rows
from tests.helpers.tables import curve, sheared

TABLE_FIGURES = ("evolution", "normalised", "correlation")


def test_a_comparison_is_made_and_told_once(tmp_path):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        comparison = compare_tables(sheared())
        save_rows(tmp_path / "x.png", sheared(), "evolution", comparison=comparison)
    for text in ("shear_strain is used in place", "the loading axis is not"):
        assert sum(text in str(one.message) for one in told) == 1


@pytest.mark.parametrize("name", [None, *TABLE_FIGURES])
def test_all_panels_are_lettered_and_say_which_alpha(drawn, name):
    figure = drawn(curve(), name)
    panels = [axes for axes in figure.axes if axes.axison]
    letters = [axes.get_title(loc="left") for axes in panels]
    assert letters == [f"({letter})" for letter in "abcde"[: len(panels)]]
    assert all(axes.get_ylabel().count(", axial") == 1 for axes in panels)


def test_the_words_of_a_figure_fit_its_width(drawn):
    """Nothing is cut off, whatever the sources are called."""
    rows = [row for source in ("p" * 90, "q" * 90) for v in "abcd" for row in curve(source, v)]
    for name in TABLE_FIGURES:
        figure = drawn(rows, name)
        box = figure.get_tightbbox()
        width, height = figure.get_size_inches()
        assert box.x0 > -0.02
        assert box.y0 > -0.02
        assert box.x1 < width + 0.02
        assert box.y1 < height + 0.02


@pytest.mark.parametrize("rows", [[], [{**row, "alpha_vs_axial": None} for row in curve()]])
def test_nothing_to_draw_is_an_error(rows, tmp_path):
    with pytest.raises(SettingsError, match="nothing to draw"):
        save_rows(tmp_path / "x.png", rows)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", BYTES)
@pytest.mark.parametrize("name", [None, *TABLE_FIGURES])
def test_files_are_what_their_names_say_and_repeat(tmp_path, suffix, name):
    one, two = tmp_path / f"one{suffix}", tmp_path / f"two{suffix}"
    for path in (one, two):
        save_rows(path, curve(), name)
    assert one.read_bytes().startswith(BYTES[suffix])
    assert one.read_bytes() == two.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2
