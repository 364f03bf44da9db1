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

from scanfab.base.errors import ScanfabError
from scanfab.io.sources import read_series
from scanfab.pipeline.strain import shear_strain
from scanfab.table.compare import compare_tables
from scanfab.table.formats import read_rows
from scanfab.viz.window3d import add_words, check_drawing
from tests.conftest import ROOT, SAMPLE
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.figures import save_rows
from tests.helpers.interruptions import PROGRAM
from tests.helpers.tables import curve

FAST = ["--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac"]


@pytest.fixture
def series(tmp_path):
    folder = tmp_path / "series"
    folder.mkdir()
    for frame in range(4):
        write(folder / f"dump_{frame}.txt", dump_text(cubic_rows(), step=10 * frame))
    return folder


@pytest.fixture
def other(tmp_path):
    (tmp_path / "other").mkdir()
    return write(tmp_path / "other" / "dump_1.txt", dump_text(cubic_rows())).parent


@pytest.fixture
def table(tmp_path):
    rows = [*curve(), *curve(variant="d")]
    return write(tmp_path / "t.jsonl", "".join(json.dumps(row) + "\n" for row in rows))


def test_compute_draws_its_table_or_a_figure_of_frames(series, tmp_path, ask):
    table, plot = tmp_path / "t.csv", tmp_path / "t.svg"
    ask("compute", series, *FAST, "-o", table, "--plot", plot)
    again = tmp_path / "again.svg"
    save_rows(again, read_rows(table))
    assert plot.read_bytes() == again.read_bytes()
    plot = tmp_path / "t.png"
    printed = ask("compute", series, *FAST, "--plot", plot, "--figure", "histogram")
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert len(printed.rows) == 8


def test_a_resumed_run_draws_all_frames_and_keeps_their_files(series, tmp_path, ask):
    whole, part = tmp_path / "whole", tmp_path / "part"

    def compute(folder, *more):
        folder.mkdir(exist_ok=True)
        files = ["-o", folder / "t.csv", "--plot", folder / "t.svg", "--vtk", folder / "vtk"]
        ask("compute", series, *FAST, *files, *more)

    compute(whole)
    compute(part, "--frames", "0:2")
    # as if the whole had been interrupted after two frames
    rows = read_rows(whole / "t.csv")
    (part / "t.csv").unlink()
    manifest = json.loads((whole / "t.csv.manifest.json").read_text())
    frames = [{"inputs": manifest["inputs"], "rows": rows[k : k + 2]} for k in (0, 2)]
    lines = [json.dumps(one) + "\n" for one in ({"settings": manifest["settings"]}, *frames)]
    (part / "t.csv.part").write_text("".join(lines))
    compute(part, "--resume")
    for name in ("t.csv", "t.svg", "vtk/distribution-c.pvd"):
        assert (part / name).read_bytes() == (whole / name).read_bytes()


def test_several_series_have_folders_of_their_own(series, other, tmp_path, ask):
    vtk = tmp_path / "vtk"
    ask("compute", series, other, *FAST, "--vtk", vtk)
    assert {path.name for path in vtk.iterdir()} == {"series-1", "series-2"}
    assert len(list((vtk / "series-1").glob("grains_*.vtp"))) == 4
    words = ["--plot", tmp_path / "x.png", "--figure", "rose"]
    assert "draws one series" in ask("compute", series, other, *words, code=2).err


def test_compare_draws_the_fit_that_it_prints(table, tmp_path, ask):
    for name in ("evolution", "normalised", "correlation"):
        plot = tmp_path / f"{name}.pdf"
        words = ["--plot", plot, "--figure", name, "--strain-max", "0.03"]
        row = ask("compare", table, "--summary", *words).rows[0]
        assert plot.read_bytes().startswith(b"%PDF")
    fit = compare_tables(read_rows(table), strain_max=0.03).summary[0]
    assert float(row["slope"]) == fit.slope


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--plot", "x.docx"], "figures can be written as .png, .svg, .pdf, not as .docx"),
        (["--plot", "nowhere/x.png"], "there is no folder nowhere"),
        (["--figure", "correlation"], "--figure goes with --plot FILE"),
        (["--plot", "x.png", "--figure", "pie"], "--figure: expected evolution"),
        (["--plot", "x.png", "--figure", "correlation:2"], "--figure: expected evolution"),
        (["--plot", "x.png", "--figure", "rose:95"], ""),
    ],
)
def test_wrong_usage_is_told_before_the_work(series, table, words, message, ask):
    for command, source in (("compute", series), ("compare", table)):
        told = ask(command, source, *words, code=2)
        assert message in told.told
        assert told.out == ""


def test_a_table_without_void_fabric_is_written_and_not_drawn(series, tmp_path, ask):
    table, plot = tmp_path / "t.csv", tmp_path / "x.png"
    told = ask("compute", series, *FAST, "--cutoff", "100", "--plot", plot, "-o", table, code=1)
    assert f"{plot} is not drawn: no row has a void fabric" in told.err
    assert table.exists()
    assert not plot.exists()
    assert "there is nothing to draw" in ask("compare", table, "--plot", plot, code=1).err


def test_a_vtk_folder_that_cannot_be_made_is_wrong_usage(series, tmp_path, ask):
    file = write(tmp_path / "file", "")
    for folder in (file, file / "vtk"):
        assert str(folder) in ask("compute", series, "--vtk", folder, code=2).told


def can_draw() -> bool:
    try:
        check_drawing()
    except ScanfabError:
        return False
    return True


needs_drawing = pytest.mark.skipif(
    not can_draw(), reason="VTK cannot draw here (libegl1 or libosmesa6 is missing)"
)


@pytest.fixture
def view(ask, tmp_path):
    """The picture that a view writes."""

    def call(*words):
        picture = tmp_path / "view.png"
        ask("view", *words, "--screenshot", picture)
        return picture

    return call


@needs_drawing
@pytest.mark.parametrize("words", [["--cut"], ["--axis", "x", "--rv", "0.5"]])
def test_view_writes_a_picture_of_several_colours(view, words):
    picture = view(ROOT / SAMPLE, *words, "--boundary", "mask=3", "--frame", "-1")
    colours = Image.open(picture).convert("RGB").quantize(8).getcolors()
    assert sum(count > 2000 for count, _ in colours) >= 4
    assert [path.name for path in picture.parent.iterdir()] == ["view.png"]


def drawn(path):
    """Pixels of a picture as numbers from 0 to 255, shape (900, 1200, 3)."""
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


@needs_drawing
@pytest.mark.parametrize(
    "words",
    [
        [SAMPLE, "--boundary", "mask=3", "--frame", "-1"],
        [SAMPLE, "--boundary", "mask=3", "--frame", "-1", "--cut"],
        ["sample_data/liggghts_periodic", "--axis", "1,1,2"],
        ["sample_data/lammps_shear", "--frame", "5"],
    ],
)
def test_the_sample_fills_the_picture_and_its_rv_is_seen(view, words):
    pixels = drawn(view(ROOT / words[0], *words[1:]))
    # between the words above, and the axes and the scale in the corners below
    middle = (pixels[115:835, 200:1000] < 250).any(axis=2)
    high = np.flatnonzero(middle.any(axis=1))
    assert len(high) > 690 or middle.any(axis=0).all()
    blue = pixels[..., 2] - pixels[..., 0] > 50
    assert blue.mean() > 0.08
    across = np.flatnonzero((pixels[115:700] < 250).any(axis=(0, 2)))
    assert abs(across[0] + across[-1] - 1200) < 60


@needs_drawing
def test_title_legend_and_scale_are_dark_on_white(view, series):
    dark = (drawn(view(series)) < 90).all(axis=2)
    title, legend, scale = dark[20:60], dark[60:100], dark[860:875, 700:]
    assert title.sum() > 400
    assert legend.sum() > 300
    bar = scale.any(axis=0).nonzero()[0]
    assert 100 < len(bar) < 260
    assert bar[-1] == pytest.approx(0.98 * 1200 - 700, abs=2)


@pytest.fixture
def scenes(monkeypatch):
    """What would be shown: scene, axis and title."""
    found = []
    monkeypatch.setattr("scanfab.viz.window3d.show_scene", lambda *said: found.append(said))
    return found


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
@pytest.mark.parametrize(
    ("words", "title"),
    [
        ((SAMPLE, "--boundary", "mask=3", "--frame", "-1"), "frame 6, axial strain 15 %"),
        (("sample_data/lammps_shear",), "frame 0, shear strain 0 %"),
        (("sample_data/lammps_shear", "--frame", "5"), "frame 5, shear strain {shear} %"),
        (("sample_data/liggghts_periodic",), "frame 0, axial strain 0 %"),
    ],
)
def test_the_title_names_the_frame_and_its_strain(view, monkeypatch, scenes, words, title):
    monkeypatch.chdir(ROOT)
    view(*words)
    first, last = (frame.read().cell for frame in [*read_series("sample_data/lammps_shear")][::5])
    shear = f"{100 * shear_strain(last, first):.3g}"
    assert [one[2] for one in scenes] == [f"{words[0]}, {title.format(shear=shear)}"]


@pytest.mark.parametrize("words", [[], ["--cut"]])
def test_a_frame_without_grains_is_shown_as_such(tmp_path, words, view, request):
    dump = write(tmp_path / "dump_1.txt", dump_text([]))
    if can_draw():
        assert view(dump, *words).exists()
    scenes = request.getfixturevalue("scenes")
    view(dump, *words)
    assert scenes[0][2].endswith("frame 0, no grains")


@pytest.mark.parametrize("letter", "im")
def test_a_long_path_leaves_frame_and_strain_in_the_picture(tmp_path, monkeypatch, letter, view):
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
    view(dumps, "--frame", "5")
    ((title, width),) = widths
    assert title.startswith(str(dumps)[:20])
    assert re.search(r"/shear, frame 5, shear strain [\d.]+ %$", title)
    assert 0 < width < 1160


def test_damaged_frames_before_the_one_asked_for_are_skipped(tmp_path, scenes, ask):
    """A radius of 0 makes no packing, and cut text no frame: the RV is of the third."""
    flat = [(*cubic_rows()[0][:5], 0), *cubic_rows()[1:]]
    write(tmp_path / "dump_0.txt", dump_text(flat))
    write(tmp_path / "dump_1.txt", dump_text(cubic_rows(), step=1)[:-40])
    write(tmp_path / "dump_2.txt", dump_text(cubic_rows(), step=2))
    words = ["view", tmp_path, "--screenshot", tmp_path / "x.png"]
    told = ask(*words, "--frame", "2").err
    assert scenes[0][0].window is not None
    assert told.count("frame 0 skipped: ") == told.count("frame 1 skipped: ") == 1
    ask(*words, "--frame", "0", code=1)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a screen")
def test_without_a_screen_view_says_what_to_do(series):
    env = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [*PROGRAM, "view", str(series)]
    answer = subprocess.run(command, capture_output=True, text=True, env=env, check=False)
    assert answer.returncode == 1
    assert "has no screen" in answer.stderr
    assert "--screenshot FILE.png" in answer.stderr


def test_where_vtk_cannot_draw_view_says_what_to_install(series, tmp_path):
    # a kind of window that needs a library which is not there
    env = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkOSOpenGLRenderWindow", "LD_LIBRARY_PATH": ""}
    picture = tmp_path / "x.png"
    command = [*PROGRAM, "view", str(series), "--screenshot", str(picture)]
    answer = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, **env}, check=False
    )
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
def test_what_view_cannot_show(series, words, code, message, ask):
    assert message in ask("view", series, *words, code=code).told
    assert not Path("x.png").exists()
