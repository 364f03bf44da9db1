"""The first and the last frame of a table, scanned to be drawn: which, and what they are called."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

import scanfab
from scanfab.base.errors import SettingsError
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.settings import Settings
from scanfab.viz.figures.page import drawn_page, make_figures, save_figures
from scanfab.viz.scanned_frames import ScannedFrames
from tests.conftest import ROOT, SAMPLE
from tests.helpers.figures import BYTES, frame_figure, row_of

pytestmark = pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabNote")
SETTINGS = Settings(boundary="mask=3", tolerance=5e-4)


@pytest.fixture
def series(monkeypatch):
    monkeypatch.chdir(ROOT)
    return scanfab.read_series(SAMPLE)


@pytest.fixture
def frames(series, computed):
    return ScannedFrames(series, SETTINGS, computed.rows)


def test_every_figure_of_the_sample_is_drawn(frames, tmp_path):
    suffixes = [*BYTES, ".png"]
    for figure, suffix in zip(make_figures(frames, "frames"), suffixes, strict=True):
        path = tmp_path / f"figure{suffix}"
        save_figures(path, [figure])
        assert path.read_bytes().startswith(BYTES[suffix])
        assert frames.name in figure.caption
        assert figure.caption.endswith(".")


def test_panels_are_lettered_where_there_are_several(frames):
    for figure in make_figures(frames, "frames"):
        with drawn_page([figure]) as page:
            titles = [axes.get_title(loc="left") for axes in page.axes[:4]]
        if figure.lettered:
            assert [title[:3] for title in titles] == ["(a)", "(b)", "(c)", "(d)"]
            assert all("variant c, frame " in title for title in titles)
        else:
            assert titles == [""]


def test_titles_name_variant_frame_and_strain(frames, computed):
    strain = 100 * row_of(computed, 6)["strain"]
    for one in (frames.frames, frames.with_lines_of_table):
        assert [frame.title for frame in one] == [
            r"variant c, frame 0, $\varepsilon_a$ = 0 %",
            rf"variant c, frame 6, $\varepsilon_a$ = {strain:.3g} %",
        ]


def test_the_lines_of_the_table_give_its_rows(frames, computed):
    for frame, number in zip(frames.with_lines_of_table, (0, 6), strict=True):
        assert dict(frame.row) == row_of(computed, number)


def test_frames_are_scanned_once_for_all_figures_and_when_one_needs_them(frames, monkeypatch):
    """Both in one pass, so that the frame that fixes all lengths is not read for each of them."""
    asked = []

    def remember(source, settings, **more):
        asked.append(settings.frames)
        return compute_rows(source, settings, **more)

    monkeypatch.setattr("scanfab.viz.scanned_frames.compute_rows", remember)
    assert repr(frames) == f"ScannedFrames(variant c of {SAMPLE}, frames 0 and 6)"
    assert not asked
    for _ in range(2):
        for name in ("histogram", "projection"):
            getattr(frames.plot, name)(ax=Figure().subplots())
    assert asked == [slice(0, 7, 6)]


def test_without_a_strain_titles_name_the_frame(series, computed):
    rows = [{**row, "strain": 0.0} for row in computed.rows]
    figure = frame_figure(series, SETTINGS, rows, "histogram")
    assert [one.title for one in figure.samples] == [
        "variant c, frame 0",
        "variant c, frame 6",
    ]


def test_the_strain_of_a_title_is_that_of_the_table(series, computed, tmp_path):
    """The file that it came from may have lost a frame since, or say something else."""
    strains = tmp_path / "strain.csv"
    strains.write_text("frame,strain\n0,0.5\n")
    settings = Settings(boundary="mask=3", tolerance=5e-4, strain=str(strains))
    rows = [{**row, "strain": 0.01 * row["frame"]} for row in computed.rows]
    figure = frame_figure(series, settings, rows, "histogram")
    assert [one.title for one in figure.samples] == [
        r"variant c, frame 0, $\varepsilon_a$ = 0 %",
        r"variant c, frame 6, $\varepsilon_a$ = 6 %",
    ]


def test_one_frame_and_other_variants(series, computed):
    rows = [row for row in computed.rows if row["frame"] == 3]
    settings = Settings(boundary="mask=3", tolerance=1e-3, variants="b")
    figure = frame_figure(series, settings, rows, "histogram")
    assert len(figure.samples) == 1


def test_a_table_without_void_fabric_is_an_error(series, computed):
    rows = [{**row, "alpha_vs_axial": None} for row in computed.rows]
    with pytest.raises(SettingsError, match="no frame has a void fabric of variant c"):
        frame_figure(series, SETTINGS, rows, "rose")


WORDS = {"boundary": "mask=3", "tolerance": 5e-4}


def test_a_notebook_scans_frames_by_the_options_of_compute(series, computed):
    """With the table its frames and strains; without one the first and the last frame."""
    table = scanfab.load(computed.table)
    for frames in (
        scanfab.scan_frames(series, table=table, **WORDS),
        scanfab.scan_frames(series, **WORDS),
    ):
        assert repr(frames) == f"ScannedFrames(variant c of {SAMPLE}, frames 0 and 6)"
    middle = scanfab.scan_frames(series, **WORDS, frames="2:4", variants="b")
    assert repr(middle) == f"ScannedFrames(variant b of {SAMPLE}, frames 2 and 3)"
    (frame,) = scanfab.scan_frames(series, **WORDS, frames=6).frames
    assert frame.title == [*ScannedFrames(series, SETTINGS, computed.rows).frames][1].title
    with pytest.raises(TypeError, match="scan_frames has no option 'tolerence': did you mean"):
        scanfab.scan_frames(series, tolerence=1e-3)


def test_of_a_table_of_several_sources_the_rows_of_this_one_count(series, computed):
    other = [{**row, "source": "other", "frame": 99} for row in computed.rows]
    frames = scanfab.scan_frames(series, table=[*other, *computed.rows], **WORDS)
    assert repr(frames).endswith("frames 0 and 6)")


def test_all_panels_are_drawn_on_the_figure_that_they_get(frames):
    page = Figure(figsize=(12, 6))
    left, right = page.subfigures(1, 2)
    assert frames.plot.projection(left) is left
    assert frames.plot.histogram(right) is right
    # four disks, the scales of both columns, and the histogram
    assert len(page.axes) == 7
    alone = Figure()
    frames.plot.projection(alone, frame=6, of="voids")
    assert [axes.get_title(loc="left")[:20] for axes in alone.axes] == ["(a) mean void length", ""]
