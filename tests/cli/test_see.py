"""--plot, --figure, --vtk, view: what is written, and what is told when it cannot be."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scanfab.cli.main import run
from scanfab.io.sources import read_series
from scanfab.pipeline.strain import shear_strain
from scanfab.table.compare import compare_tables
from scanfab.table.formats import read_rows
from scanfab.viz.figures.correlation import fits_of
from scanfab.viz.overlay import add_words
from tests.conftest import ROOT, SAMPLE
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.figures import save_rows
from tests.helpers.tables import curve

FAST = ["--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac"]


@pytest.fixture
def series(tmp_path):
    folder = tmp_path / "series"
    folder.mkdir()
    for frame in range(4):
        write(folder / f"dump_{frame}.txt", dump_text(cubic_rows(), step=10 * frame))
    return str(folder)


@pytest.fixture
def table(tmp_path):
    rows = [*curve(), *curve(variant="d")]
    return str(write(tmp_path / "t.jsonl", "".join(json.dumps(row) + "\n" for row in rows)))


def test_compute_draws_its_table(series, tmp_path):
    table, plot = tmp_path / "t.csv", tmp_path / "t.svg"
    assert run(["compute", series, *FAST, "-o", str(table), "--plot", str(plot)]) == 0
    again = tmp_path / "again.svg"
    save_rows(again, read_rows(table))
    assert plot.read_bytes() == again.read_bytes()


def test_a_figure_of_frames_is_drawn_with_the_table(series, tmp_path, capsys):
    plot = tmp_path / "t.png"
    words = ["--plot", str(plot), "--figure", "histogram"]
    assert run(["compute", series, *FAST, *words]) == 0
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert len(capsys.readouterr().out.splitlines()) == 9


def test_a_resumed_run_draws_all_frames_and_keeps_their_files(series, tmp_path):
    whole, part = tmp_path / "whole", tmp_path / "part"
    for folder in (whole, part):
        folder.mkdir()

    def words(folder):
        files = ["-o", f"{folder}/t.csv", "--plot", f"{folder}/t.svg", "--vtk", f"{folder}/vtk"]
        return ["compute", series, *FAST, *files]

    assert run(words(whole)) == 0
    assert run([*words(part), "--frames", "0:2"]) == 0
    # as if the whole had been interrupted after two frames
    rows = [json.dumps(row) + "\n" for row in read_rows(whole / "t.csv")[:4]]
    (part / "t.csv").unlink()
    (part / "t.csv.part").write_text("".join(rows))
    manifest = json.loads((whole / "t.csv.manifest.json").read_text())
    record = [{"settings": manifest["settings"]}, *manifest["inputs"]]
    lines = "".join(json.dumps(one) + "\n" for one in record)
    (part / "t.csv.manifest.json.part").write_text(lines)
    assert run([*words(part), "--resume"]) == 0
    assert (part / "t.csv").read_bytes() == (whole / "t.csv").read_bytes()
    assert (part / "t.svg").read_bytes() == (whole / "t.svg").read_bytes()
    pvd = "vtk/distribution-c.pvd"
    assert (part / pvd).read_bytes() == (whole / pvd).read_bytes()


def test_several_series_have_folders_of_their_own(series, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    write(other / "dump_1.txt", dump_text(cubic_rows()))
    vtk = tmp_path / "vtk"
    assert run(["compute", series, str(other), *FAST, "--vtk", str(vtk)]) == 0
    assert {path.name for path in vtk.iterdir()} == {"series-1", "series-2"}
    assert len(list((vtk / "series-1").glob("grains_*.vtp"))) == 4


def test_compare_draws_the_fit_that_it_prints(table, tmp_path, capsys):
    for name in ("evolution", "normalised", "correlation"):
        plot = tmp_path / f"{name}.pdf"
        words = ["--plot", str(plot), "--figure", name, "--strain-max", "0.03"]
        assert run(["compare", table, "--summary", *words]) == 0
        assert plot.read_bytes().startswith(b"%PDF")
    printed = capsys.readouterr().out.splitlines()[1].split(",")
    fit = fits_of(compare_tables(read_rows(table), strain_max=0.03))[0]
    assert fit is not None
    assert float(printed[3]) == fit.slope


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--plot", "x.docx"], "figures can be written as .png, .svg, .pdf, not as .docx"),
        (["--plot", "nowhere/x.png"], "there is no folder nowhere"),
        (["--figure", "correlation"], "--figure goes with --plot FILE"),
        (["--plot", "x.png", "--figure", "pie"], "--figure: expected evolution"),
        (["--plot", "x.png", "--figure", "correlation:2"], "--figure: expected evolution"),
    ],
)
@pytest.mark.parametrize("command", ["compute", "compare"])
def test_wrong_usage_is_told_before_the_work(series, table, words, message, command, capsys):
    assert run([command, series if command == "compute" else table, *words]) == 2
    told = capsys.readouterr()
    assert message in told.err
    assert told.out == ""


def test_polar_angles_are_checked_before_the_work(series, capsys):
    assert run(["compute", series, "--plot", "x.png", "--figure", "rose:95"]) == 2
    assert "polar angles above 0 and up to 90" in capsys.readouterr().err


def test_figures_of_frames_are_of_one_series(series, tmp_path, capsys):
    other = tmp_path / "other"
    other.mkdir()
    write(other / "dump_1.txt", dump_text(cubic_rows()))
    words = ["--plot", str(tmp_path / "x.png"), "--figure", "rose"]
    assert run(["compute", series, str(other), *words]) == 2
    assert "draws one series" in capsys.readouterr().err


def test_compare_knows_no_figures_of_frames(table, tmp_path, capsys):
    words = ["--plot", str(tmp_path / "x.png"), "--figure", "rose"]
    assert run(["compare", table, *words]) == 2
    assert (
        "--figure: expected evolution, normalised, correlation, columns" in capsys.readouterr().err
    )


def test_a_table_without_void_fabric_is_written_and_not_drawn(series, tmp_path, capsys):
    plot = tmp_path / "x.png"
    words = ["--cutoff", "100", "--plot", str(plot), "-o", str(tmp_path / "t.csv")]
    assert run(["compute", series, *FAST, *words]) == 1
    assert f"{plot} is not drawn: no row has a void fabric" in capsys.readouterr().err
    assert (tmp_path / "t.csv").exists()
    assert not plot.exists()
    assert run(["compare", str(tmp_path / "t.csv"), "--plot", str(plot)]) == 1
    assert "there is nothing to draw" in capsys.readouterr().err


def test_a_vtk_folder_that_cannot_be_made_is_wrong_usage(series, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert run(["compute", series, "--vtk", str(tmp_path / "file")]) == 2
    assert run(["compute", series, "--vtk", str(tmp_path / "file" / "vtk")]) == 2
    assert "cannot be made" in capsys.readouterr().err


def can_draw() -> bool:
    from scanfab.base.errors import ScanfabError
    from scanfab.viz.window3d import check_drawing

    try:
        check_drawing()
    except ScanfabError:
        return False
    return True


@pytest.mark.skipif(
    not can_draw(), reason="VTK cannot draw here (libegl1 or libosmesa6 is missing)"
)
@pytest.mark.parametrize("words", [[], ["--cut"], ["--axis", "x", "--rv", "0.5"]])
def test_view_writes_a_picture_of_several_colours(tmp_path, words, monkeypatch):
    monkeypatch.chdir(ROOT)
    picture = tmp_path / "view.png"
    words = [*words, "--boundary", "mask=3", "--frame", "-1", "--screenshot", str(picture)]
    assert run(["view", SAMPLE, *words]) == 0
    colours = Image.open(picture).convert("RGB").quantize(8).getcolors()
    assert sum(count > 2000 for count, _ in colours) >= 4
    assert [path.name for path in tmp_path.iterdir()] == ["view.png"]


def drawn(path):
    """Pixels of a picture as numbers from 0 to 255, shape (900, 1200, 3)."""
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


@pytest.mark.skipif(not can_draw(), reason="VTK cannot draw here")
@pytest.mark.parametrize(
    "words",
    [
        [f"{ROOT}/{SAMPLE}", "--boundary", "mask=3", "--frame", "-1"],
        [f"{ROOT}/{SAMPLE}", "--boundary", "mask=3", "--frame", "-1", "--cut"],
        [f"{ROOT}/sample_data/liggghts_periodic", "--axis", "1,1,2"],
        [f"{ROOT}/sample_data/lammps_shear", "--frame", "5"],
    ],
)
@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_the_sample_fills_the_picture_and_its_rv_is_seen(tmp_path, words):
    picture = tmp_path / "view.png"
    assert run(["view", *words, "--screenshot", str(picture)]) == 0
    pixels = drawn(picture)
    # between the words above, and the axes and the scale in the corners below
    middle = (pixels[115:835, 200:1000] < 250).any(axis=2)
    high = np.flatnonzero(middle.any(axis=1))
    assert len(high) > 690 or middle.any(axis=0).all()
    blue = pixels[..., 2] - pixels[..., 0] > 50
    assert blue.mean() > 0.08
    across = np.flatnonzero((pixels[115:700] < 250).any(axis=(0, 2)))
    assert abs(across[0] + across[-1] - 1200) < 60


@pytest.mark.skipif(not can_draw(), reason="VTK cannot draw here")
def test_title_legend_and_scale_are_dark_on_white(tmp_path, series):
    picture = tmp_path / "view.png"
    assert run(["view", series, "--screenshot", str(picture)]) == 0
    dark = (drawn(picture) < 90).all(axis=2)
    title, legend, scale = dark[20:60], dark[60:100], dark[860:875, 700:]
    assert title.sum() > 400
    assert legend.sum() > 300
    bar = scale.any(axis=0).nonzero()[0]
    assert 100 < len(bar) < 260
    assert bar[-1] == pytest.approx(0.98 * 1200 - 700, abs=2)


@pytest.mark.skipif(not can_draw(), reason="VTK cannot draw here")
@pytest.mark.parametrize("words", [[], ["--cut"]])
def test_a_frame_without_grains_is_shown_as_such(tmp_path, words, monkeypatch):
    write(tmp_path / "dump_1.txt", dump_text([]))
    titles = []
    monkeypatch.setattr("scanfab.viz.window3d.show_scene", lambda *said: titles.append(said[2]))
    picture = tmp_path / "view.png"
    words = [str(tmp_path / "dump_1.txt"), *words, "--screenshot", str(picture)]
    assert run(["view", *words]) == 0
    assert titles[0].endswith("frame 0, no grains")
    monkeypatch.undo()
    assert run(["view", *words]) == 0
    assert picture.exists()


def test_the_title_names_the_frame_and_its_strain(tmp_path, monkeypatch):
    titles = []
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr("scanfab.viz.window3d.show_scene", lambda *said: titles.append(said[2]))
    words = ["--boundary", "mask=3", "--frame", "-1", "--screenshot", str(tmp_path / "x.png")]
    assert run(["view", SAMPLE, *words]) == 0
    assert titles == [f"{SAMPLE}, frame 6, axial strain 15 %"]


@pytest.mark.parametrize("letter", "im")
def test_a_long_path_leaves_frame_and_strain_in_the_picture(tmp_path, monkeypatch, letter):
    """Both ends of the source are kept, and all words are within the picture."""
    widths = []

    def measure(plotter, title, names):
        add_words(plotter, title, names)
        (words,) = (
            actor
            for actor in plotter.renderer.actors.values()
            if getattr(actor, "GetInput", lambda: None)() == title
        )
        box = [0.0] * 4
        words.GetBoundingBox(plotter.renderer, box)
        widths.append((title, box[1] - box[0]))

    monkeypatch.setattr("scanfab.viz.window3d.add_words", measure)
    monkeypatch.setattr("scanfab.viz.window3d.check_drawing", lambda: None)
    monkeypatch.setattr("pyvista.Plotter.screenshot", lambda _, path: Path(path).touch())
    folder = tmp_path.joinpath(*[letter * 30] * 5)
    folder.mkdir(parents=True)
    dumps = folder / "shear"
    dumps.symlink_to(f"{ROOT}/sample_data/lammps_shear")
    assert run(["view", str(dumps), "--frame", "5", "--screenshot", str(tmp_path / "x.png")]) == 0
    ((title, width),) = widths
    assert title.startswith(str(dumps)[:20])
    assert re.search(r"/shear, frame 5, shear strain [\d.]+ %$", title)
    assert 0 < width < 1160


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_the_title_of_a_sheared_cell_has_its_shear(tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr("scanfab.viz.window3d.show_scene", lambda *said: titles.append(said[2]))
    monkeypatch.chdir(ROOT)
    source = "sample_data/lammps_shear"
    assert run(["view", source, "--frame", "5", "--screenshot", str(tmp_path / "x.png")]) == 0
    first, last = (frame.read().cell for frame in [*read_series(source)][::5])
    assert titles == [f"{source}, frame 5, shear strain {100 * shear_strain(last, first):.3g} %"]


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
@pytest.mark.parametrize(
    ("series", "strain"), [("lammps_shear", "shear strain"), ("liggghts_periodic", "axial strain")]
)
def test_the_first_frame_has_the_strain_of_the_others(tmp_path, monkeypatch, series, strain):
    """Neither has begun there."""
    titles = []
    monkeypatch.setattr("scanfab.viz.window3d.show_scene", lambda *said: titles.append(said[2]))
    source = f"{ROOT}/sample_data/{series}"
    assert run(["view", source, "--screenshot", str(tmp_path / "x.png")]) == 0
    assert titles == [f"{source}, frame 0, {strain} 0 %"]


def test_damaged_frames_before_the_one_asked_for_are_skipped(tmp_path, monkeypatch, capsys):
    """A radius of 0 makes no packing, and cut text no frame: the RV is of the third."""
    flat = [(*cubic_rows()[0][:5], 0), *cubic_rows()[1:]]
    write(tmp_path / "dump_0.txt", dump_text(flat))
    write(tmp_path / "dump_1.txt", dump_text(cubic_rows(), step=1)[:-40])
    write(tmp_path / "dump_2.txt", dump_text(cubic_rows(), step=2))
    scenes = []
    monkeypatch.setattr("scanfab.viz.window3d.show_scene", lambda *said: scenes.append(said[0]))
    words = ["--screenshot", str(tmp_path / "x.png")]
    assert run(["view", str(tmp_path), "--frame", "2", *words]) == 0
    assert scenes[0].window is not None
    told = capsys.readouterr().err
    assert told.count("frame 0 skipped: ") == told.count("frame 1 skipped: ") == 1
    assert run(["view", str(tmp_path), "--frame", "0", *words]) == 1


def scanfab(*words, **environment):
    command = [sys.executable, "-c", "from scanfab.cli.main import main; main()", *map(str, words)]
    kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return subprocess.run(
        command, capture_output=True, text=True, env={**kept, **environment}, check=False
    )


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a screen")
def test_without_a_screen_view_says_what_to_do(series):
    answer = scanfab("view", series)
    assert answer.returncode == 1
    assert "has no screen" in answer.stderr
    assert "write a picture instead: --screenshot FILE.png" in answer.stderr
    assert "--screenshot" in answer.stderr


def test_where_vtk_cannot_draw_view_says_what_to_install(series, tmp_path):
    # a kind of window that needs a library which is not there
    wanted = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkOSOpenGLRenderWindow", "LD_LIBRARY_PATH": ""}
    picture = tmp_path / "x.png"
    answer = scanfab("view", series, "--screenshot", picture, **wanted)
    if picture.exists():
        pytest.skip("libosmesa6 is installed")
    assert answer.returncode == 1
    assert "apt-get install" in answer.stderr
    assert "Traceback" not in answer.stderr


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["--screenshot", "x.jpg"], 2, "screenshots are PNG files"),
        (["--screenshot", "nowhere/x.png"], 2, "there is no folder"),
        (["--screenshot", "x.png", "--frame", "9"], 1, "has 4 frames, there is no frame 9"),
        (["--screenshot", "x.png", "--frame", "-5"], 1, "there is no frame -5"),
        (["--rv", "-1", "--screenshot", "x.png"], 2, "rv: expected a fraction above 0"),
    ],
)
def test_what_view_cannot_show(series, words, code, message, capsys):
    assert run(["view", series, *words]) == code
    assert message in capsys.readouterr().err
    assert not Path("x.png").exists()
