"""Figures by name, on a page and in files; made-up ones are reached wherever the package's are."""

import inspect
import re

import numpy as np
import pytest
from click import Context
from matplotlib.figure import Figure

from scanfab.base.errors import SettingsError
from scanfab.cli.group import cli
from scanfab.cli.main import run
from scanfab.pipeline.settings import Settings
from scanfab.table.plots import figures_of, installed_figures
from scanfab.table.table import Table, load
from scanfab.viz.figures.figure import Figure as PackagesFigure
from scanfab.viz.figures.figure import FrameFigure, make_figures
from scanfab.viz.report.report import report
from scanfab.viz.scanned_frames import ScannedFrames
from tests.conftest import SAMPLE
from tests.helpers.figures import BYTES, save_rows
from tests.helpers.plugins import offer
from tests.helpers.tables import curve

pytestmark = pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabNote")
OWN = (
    "evolution", "normalised", "correlation", "columns", "rose", "projection", "histogram",
    "cutoffs", "calibration", "map",
)  # fmt: skip
TABLE_FIGURES = ("evolution", "normalised", "correlation")
FAST = ["--boundary", "mask=3", "--tolerance", "1e-2", "--variants", "c", "--frames", "::6"]


class Rattlers(PackagesFigure):
    """Rattlers over the frames."""

    columns = ("frame", "variant", "rattlers")

    def draw(self, ax):
        for variant in sorted(set(self.data["variant"])):
            rows = self.data.select(variant=variant)
            ax.plot(rows["frame"], rows["rattlers"], label=variant, gid="rattlers")
        ax.set_ylabel("rattlers")


class Contacts(FrameFigure):
    """Heights of the contact normals, a count for each frame."""

    def draw(self, ax):
        for frame in self.chosen(self.data.frames):
            ax.hist(abs(frame.normals[:, 2]), label=frame.title, gid="heights")


@pytest.fixture
def made_up(monkeypatch):
    """A package offers figures besides what is installed."""
    for name, figure in (("made_up", Rattlers), ("heights", Contacts)):
        offer(monkeypatch, "scanfab.figures", name, lambda figure=figure: figure)
    installed_figures.cache_clear()
    yield
    installed_figures.cache_clear()


def test_the_figures_of_the_package_stand_first_and_in_their_order(made_up):
    assert tuple(installed_figures()) == (*OWN, "heights", "made_up")
    assert [*figures_of("table")] == [*OWN[:4], "made_up"]
    assert [*figures_of("frames")] == [*OWN[4:8], "heights"]


def test_the_help_names_the_figures_that_there_are():
    """It is written by hand, as to look for figures takes longer than to print it."""
    for command, kinds in (("compute", ("table", "frames")), ("compare", ("table",))):
        options = cli.get_command(Context(cli), command).params
        (option,) = (one for one in options if one.name == "figure")
        named = [name for name in OWN if re.search(rf"\b{name}\b", option.help)]
        assert named == [name for kind in kinds for name in figures_of(kind)]


@pytest.mark.usefixtures("made_up")
def test_compute_and_python_draw_a_made_up_figure_of_frames(series, tmp_path):
    table, plot = tmp_path / "t.csv", tmp_path / "x.svg"
    words = ["-o", str(table), "--plot", str(plot), "--figure", "heights"]
    assert run(["compute", SAMPLE, *FAST, *words]) == 0
    assert 'id="heights"' in plot.read_text()
    frames = ScannedFrames(series, Settings(boundary="mask=3", tolerance=1e-2), load(table))
    ax = Figure().subplots()
    assert frames.plot.heights(ax=ax, frame=0) is ax
    assert sum(bar.get_height() for bar in ax.patches) == load(table)[0]["contacts"]


@pytest.mark.usefixtures("made_up")
def test_python_compare_and_report_draw_a_made_up_figure_of_a_table(table, tmp_path):
    path = table([{**row, "rattlers": 5 * row["frame"]} for row in curve()])
    plot, ax = load(path).plot, Figure().subplots()
    assert plot.made_up(ax=ax) is ax
    assert ax.lines[0].get_ydata().tolist() == [0, 5, 10, 15, 20]
    file = tmp_path / "x.svg"
    assert run(["compare", str(path), "--plot", str(file), "--figure", "made_up"]) == 0
    assert 'id="rattlers"' in file.read_text()
    page = report([path]).page
    assert page.count("data:image/svg") == 4
    assert "<figcaption>Rattlers over the frames.</figcaption>" in page


@pytest.mark.usefixtures("made_up")
def test_a_table_without_its_columns_goes_without_it(tmp_path, capsys):
    assert len(make_figures(Table(curve()), "table")) == 3
    Table(curve()).save(tmp_path / "t.csv")
    words = ["compare", str(tmp_path / "t.csv"), "--plot", str(tmp_path / "x.png"), "--figure"]
    assert run([*words, "made_up"]) == 1
    assert "--figure: made_up needs rattlers, which the table does" in capsys.readouterr().err


def test_a_notebook_shows_what_a_figure_takes_and_gets_axes_in_the_style_of_the_package():
    from matplotlib import pyplot

    plot = Table(curve()).plot.evolution
    assert str(inspect.signature(plot)).startswith("(ax=None, *, of:")
    assert "Bands are total standard errors" in plot.__doc__
    pyplot.switch_backend("agg")
    ax = plot()
    assert ax.xaxis.label.get_size() == 9
    assert not ax.spines["top"].get_visible()
    pyplot.close(ax.figure)
    with pytest.raises(SettingsError, match="ax: expected Axes, a Figure or a SubFigure"):
        plot(ax=3)


def test_all_panels_are_lettered_and_say_which_alpha(drawn):
    for name in (None, *TABLE_FIGURES):
        panels = [axes for axes in drawn(curve(), name).axes if axes.axison]
        letters = [axes.get_title(loc="left") for axes in panels]
        # a lone panel has no letter
        several = [f"({letter})" for letter in "abcde"[: len(panels)]]
        assert letters == (several if len(panels) > 1 else [""])
        assert all(axes.get_ylabel().count(", axial") == 1 for axes in panels)


def test_the_words_of_a_figure_fit_its_width(drawn):
    """Nothing is cut off, whatever the sources are called."""
    rows = [row for source in ("p" * 90, "q" * 90) for v in "abcd" for row in curve(source, v)]
    for name in TABLE_FIGURES:
        figure = drawn(rows, name)
        box = figure.get_tightbbox()
        assert np.all(box.min > -0.02)
        assert np.all(box.max < figure.get_size_inches() + 0.02)


def test_files_are_what_their_names_say_and_repeat(tmp_path):
    for suffix, begin in BYTES.items():
        one, two = tmp_path / f"one{suffix}", tmp_path / f"two{suffix}"
        for path in (one, two):
            save_rows(path, curve(), "columns:alpha_vs_axial")
        assert one.read_bytes().startswith(begin)
        assert one.read_bytes() == two.read_bytes()
        # of the same second; no file tells when it was made
        assert not re.search(b"CreationDate|dc:date", one.read_bytes())
    assert len(list(tmp_path.iterdir())) == 6
