"""Several RVs on the command line: table, manifest, resume, comparison, figures, ParaView, view."""

from __future__ import annotations

import json
import shlex

import pytest

import scanfab
from scanfab.cli.main import run
from scanfab.pipeline.repeat import repeat_command
from scanfab.viz.scanned_frames import scan_frames
from tests.helpers.interruptions import interrupted_at_row, write_series

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac")
RVS = ("--rv", "0.7,0.5")


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    return write_series(tmp_path_factory.mktemp("several") / "series", 4)


@pytest.fixture(scope="module")
def table(series, tmp_path_factory):
    output = tmp_path_factory.mktemp("tables") / "table.csv"
    vtk = output.with_name("vtk")
    assert run(["compute", str(series), *FAST, *RVS, "-o", str(output), "--vtk", str(vtk)]) == 0
    return output


def test_the_table_is_that_of_the_library(series, table):
    options = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin", "variants": "ac"}
    computed = scanfab.compute(scanfab.read_series(series), rv=(0.5, 0.7), **options)
    assert scanfab.load(table) == computed
    assert [(row.frame, row.variant, row.rv) for row in computed[:3]] == [
        (0, "a", None), (0, "c", 0.5), (0, "c", 0.7),
    ]  # fmt: skip


def test_the_manifest_repeats_it(table):
    asked = json.loads(table.with_name("table.csv.manifest.json").read_text())["settings"]
    assert asked["rv"] == [0.5, 0.7]
    words = shlex.split(repeat_command(asked, str(table.with_name("again.csv"))))
    assert words[words.index("--rv") + 1] == "0.5,0.7"
    assert run(words[1:]) == 0
    assert table.with_name("again.csv").read_bytes() == table.read_bytes()


def test_a_run_that_was_stopped_goes_on(series, table, tmp_path, monkeypatch):
    """In the middle of a frame, which has three rows."""
    output = tmp_path / "table.csv"
    command = ["compute", str(series), *FAST, *RVS, "--workers", "1", "-o", str(output)]
    with interrupted_at_row(monkeypatch, 8) as rows:
        assert run(command) == 130
    assert len(rows) == 8
    assert run([*command, "--resume"]) == 0
    assert output.read_bytes() == table.read_bytes()


def test_curves_are_told_apart_by_their_rv(table, capsys):
    assert run(["compare", str(table), "--summary"]) == 0
    header, *lines = capsys.readouterr().out.splitlines()
    assert header.split(",")[-1] == "rv"
    assert [(line.split(",")[1], line.split(",")[-1]) for line in lines] == [
        ("a", ""), ("c", "0.5"), ("c", "0.7"),
    ]  # fmt: skip
    found = scanfab.load(table).compare()
    # each as from a table of its own
    for rv in (0.5, 0.7):
        (alone,) = scanfab.load(table).select(rv=rv).compare().summary
        assert alone in list(found.summary)
    assert "variant c RV 0.5: slope" in repr(found)
    pairs = {row.variants for row in found.differences}
    assert pairs == {"a-c RV 0.5", "a-c RV 0.7", "c RV 0.5-c RV 0.7"}


def test_a_table_of_one_has_no_column_for_it(series, tmp_path, capsys):
    output = tmp_path / "one.csv"
    assert run(["compute", str(series), *FAST, "-o", str(output)]) == 0
    assert run(["compare", str(output), "--summary"]) == 0
    assert "rv" not in capsys.readouterr().out.splitlines()[0].split(",")


def test_figures_have_a_curve_for_each(table):
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    scanfab.load(table).plot.evolution(ax=axes)
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    for name in ("variant a", "variant c RV 0.5", "variant c RV 0.7"):
        assert any(name in one for one in names), names
    colours = {line.get_color() for line in axes.get_lines() if len(line.get_xdata()) > 1}
    assert len(colours) >= 3


def test_frames_are_drawn_of_the_largest(series):
    options = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin", "variants": "ac"}
    frames = scan_frames(scanfab.read_series(series), rv="0.5,0.7", **options)
    assert repr(frames) == f"ScannedFrames(variant c RV 0.7 of {series}, frames 0 and 3)"
    first = frames.frames[0]
    computed = scanfab.compute(scanfab.read_series(series)[:1], rv="0.5,0.7", **options)
    assert first.row.alpha_vs_axial == pytest.approx(computed[2].alpha_vs_axial)
    assert len(first.normals) == computed[2].contacts


def test_paraview_files_are_named_by_it(table):
    names = {path.name.rpartition("_")[0] for path in table.with_name("vtk").glob("*.vtp")}
    for kind in ("window", "lines-c", "distribution-c", "tensors-c"):
        assert {f"{kind}-rv0.5", f"{kind}-rv0.7"} <= names
        assert kind not in names
    assert "lines-a" in names


def test_a_report_has_a_column_for_each(table, tmp_path):
    page = tmp_path / "report.html"
    assert run(["report", str(table), "-o", str(page)]) == 0
    assert "c RV 0.5" in page.read_text()


def test_the_view_shows_all(series, tmp_path):
    picture = tmp_path / "view.png"
    assert run(["view", str(series), *RVS, "--screenshot", str(picture)]) == 0
    assert picture.stat().st_size > 10_000


def test_a_calibration_is_of_one(series, capsys):
    assert run(["calibrate", str(series), *RVS]) == 1
    assert "nor several rv" in capsys.readouterr().err


def test_a_settings_file_may_have_a_list(series, table, tmp_path):
    import shutil

    folder = tmp_path / "series"
    shutil.copytree(series, folder)
    (folder / "scanfab.toml").write_text("[compute]\nrv = [0.7, 0.5]\n")
    output = tmp_path / "table.csv"
    assert run(["compute", str(folder), *FAST, "-o", str(output)]) == 0
    found, expected = scanfab.load(output), scanfab.load(table)
    assert list(found["alpha_vs_axial"]) == list(expected["alpha_vs_axial"])
