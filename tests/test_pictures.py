"""The pictures of the documentation are what the code draws now."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from PIL import Image

from scanfab.viz.figures.curves import Evolution
from scanfab.viz.figures.page import drawn_page, make_figures
from tests.conftest import ROOT
from tests.helpers.tables import curve
from tests.test_docs import script

# what scanfab tells of the sample does not matter here
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")


pictures = script("make_figures")
NAMES = (
    *pictures.TABLE_FIGURES, *pictures.PAPER_FIGURES, *pictures.FRAME_FIGURES, *pictures.VIEWS,
    *pictures.STORED, "picture",
)  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> dict:
    """What all pictures would be drawn from today; nothing is drawn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        return pictures.made(tmp_path_factory.mktemp("pictures"), draw=False)


@pytest.mark.parametrize("name", NAMES)
def test_pictures_are_fresh(made, name):
    folder = pictures.COVER.parent if name == "picture" else pictures.PICTURES
    stored = pictures.content_of(folder / f"{name}.png")
    assert pictures.differences(stored, made[name]) == [], "run python docs/make_figures.py"


def test_every_picture_of_the_pages_is_one_of_them():
    found = {path.stem for path in (ROOT / "docs").rglob("*.png")}
    assert found == set(NAMES)


def content(rows):
    with drawn_page(make_figures(rows, "table")) as page:
        return pictures.of_figure(page)


def test_other_numbers_words_and_sizes_are_told_and_last_digits_are_not(monkeypatch):
    """A test that could not fail would be worth nothing."""
    rows = curve()
    before = content(rows)
    assert pictures.differences(before, content(rows)) == []
    other = [{**row, "alpha_vs_axial": 1.01 * row["alpha_vs_axial"]} for row in rows]
    errors = [{**row, "alpha_c_axial_sample_se": 1e-3} for row in rows]
    for changed in (other, errors, rows[:-1]):
        assert pictures.differences(before, content(changed))
    monkeypatch.setattr(Evolution, "height", 3.5)
    assert pictures.differences(before, content(rows))
    monkeypatch.undo()
    monkeypatch.setattr("scanfab.viz.figures.curves.MEANINGS", {"c": "another word"})
    assert pictures.differences(before, content(rows))
    assert pictures.differences([1.0, "a", 0.0], [1.0 + 1e-5, "a", 1e-9]) == []
    assert pictures.differences([1.0, "a"], [1.01, "a"]) == ["1.0, now 1.01"]
    assert pictures.differences([1.0, "a"], [1.0, "b"]) == ["'a', now 'b'"]


def test_a_picture_that_does_not_say_what_it_was_drawn_from_is_not_fresh(tmp_path: Path):
    Image.new("RGB", (2, 2)).save(tmp_path / "bare.png")
    bare = pictures.content_of(tmp_path / "bare.png")
    assert pictures.differences(bare, ["a"]) == ["0 words and numbers, now 1"]
    pictures.shrink(Image.new("RGB", (2, 2)), tmp_path / "said.png", ["a", 1.5])
    assert pictures.content_of(tmp_path / "said.png") == ["a", 1.5]


def test_stored_numbers_are_those_of_the_page():
    """Each row of the file stands in the table of docs/validation.md."""
    page = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    with (ROOT / "docs" / "rv_size.csv").open(encoding="utf-8") as lines:
        rows = [row for row in csv.DictReader(lines) if row["rule"] != "medium"]
    for row in rows:
        told = [
            line for line in page.splitlines() if f"R = {row['radius']}, `{row['rule']}`" in line
        ]
        told = [line for line in told if line.startswith("| RV")]
        assert len(told) == 1
        assert f"{row['mean_length']} ± {row['mean_length_se']}" in told[0]
        assert f"{float(row['alpha']):+.5f} ± {row['alpha_se']}" in told[0]
