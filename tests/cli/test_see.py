"""--plot, --figure, --vtk, view: what is written, and what is told when it cannot be."""

import os
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from scanfab.base.errors import ScanfabError
from scanfab.table.formats import read_rows
from scanfab.viz.window3d import check_drawing
from tests.conftest import ROOT, SAMPLE
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.figures import save_rows
from tests.helpers.interruptions import FAST, PROGRAM


def test_a_resumed_run_draws_all_frames_and_keeps_their_files(series, tmp_path, ask):
    whole, part = tmp_path / "whole", tmp_path / "part"
    for folder, frames, *more in ((whole, "0:2"), (part, "0:1"), (part, "0:2", "--resume")):
        folder.mkdir(exist_ok=True)
        files = ["-o", folder / "t.csv", "--plot", folder / "t.svg", "--vtk", folder / "vtk"]
        words = ["--variants", "c", "--figure", "evolution", "--frames", frames]
        ask("compute", series, *FAST, *words, *files, *more)
    for name in ("t.csv", "t.svg", "vtk/distribution-c.pvd"):
        assert (part / name).read_bytes() == (whole / name).read_bytes()
    # what is drawn is the table
    save_rows(tmp_path / "again.svg", read_rows(whole / "t.csv"), "evolution")
    assert (tmp_path / "again.svg").read_bytes() == (whole / "t.svg").read_bytes()


def test_a_table_without_void_fabric_is_written_and_not_drawn(series, tmp_path, ask):
    table, plot = tmp_path / "t.csv", tmp_path / "x.png"
    told = ask("compute", series, *FAST, "--cutoff", "100", "--plot", plot, "-o", table, code=1)
    assert f"{plot} is not drawn: no row has a void fabric" in told.err
    assert (table.exists(), plot.exists()) == (True, False)
    assert "there is nothing to draw" in ask("compare", table, "--plot", plot, code=1).err


@pytest.fixture
def drawing():
    """VTK, if it can draw here."""
    try:
        check_drawing()
    except ScanfabError as error:
        pytest.skip(str(error))


@pytest.fixture
def view(ask, tmp_path):
    """The picture that a view writes."""

    def call(*words):
        picture = tmp_path / "view.png"
        ask("view", *words, "--screenshot", picture)
        return picture

    return call


def drawn(path):
    """Pixels of a picture as numbers from 0 to 255, shape (900, 1200, 3)."""
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


VIEWS = [
    f"{SAMPLE} --boundary mask=3 --frame -1 --cut",
    # an RV that follows the cell
    "sample_data/lammps_shear --frame 5 --rv-shape cylinder --rv-axis 1,1,2 --rv-follows strain",
]


@pytest.mark.usefixtures("drawing")
@pytest.mark.parametrize("words", VIEWS)
def test_the_sample_fills_the_picture_and_its_rv_is_seen(view, words):
    source, *words = words.split()
    picture = view(ROOT / source, *words)
    assert [path.name for path in picture.parent.iterdir()] == ["view.png"]
    colours = Image.open(picture).convert("RGB").quantize(8).getcolors()
    assert sum(count > 2000 for count, _ in colours) >= 4
    pixels = drawn(picture)
    # between the words above, and the axes and the scale in the corners below
    middle = (pixels[115:835, 200:1000] < 250).any(axis=2)
    high = np.flatnonzero(middle.any(axis=1))
    assert len(high) > 690 or middle.any(axis=0).all()
    blue = pixels[..., 2] - pixels[..., 0] > 50
    assert blue.mean() > 0.08
    across = np.flatnonzero((pixels[115:700] < 250).any(axis=(0, 2)))
    assert abs(across[0] + across[-1] - 1200) < 60
    # the legend has the colours of grains in the RV and of rattlers
    assert blue[60:100].any()
    assert (pixels[60:100, :, 0] - pixels[60:100, :, 2] > 100).any()


@pytest.mark.usefixtures("drawing")
def test_words_and_scale_are_dark_on_white_and_within_the_picture(view, tmp_path):
    """Also the title of a long path; with two RVs."""
    dumps = tmp_path.joinpath(*["m" * 30] * 5)
    dumps.mkdir(parents=True)
    write(dumps / "dump_0.txt", dump_text(cubic_rows()))
    dark = (drawn(view(dumps, "--rv", "0.7,0.5")) < 90).all(axis=2)
    title, legend, ruler = dark[20:60], dark[60:100], dark[875:]
    assert title.sum() > 400
    assert legend.sum() > 300
    words = dark[20:100].any(axis=0)
    assert not (words[:20] | words[-20:]).any()
    numbers = ruler.any(axis=0).nonzero()[0]
    assert 10 < numbers[0] < 100
    assert 1100 < numbers[-1] < 1190


@pytest.fixture
def scenes(monkeypatch):
    """What would be shown: scene, axis and title."""
    found = []
    monkeypatch.setattr("scanfab.viz.window3d.show_scene", lambda *said: found.append(said))
    return found


TITLES = [
    (f"{SAMPLE} --boundary mask=3 --frame -1", "frame 6, axial strain 15 %"),
    # 2/√3 asinh(γ/2) for γ = 1
    ("sample_data/lammps_shear --frame 5", "frame 5, shear strain 55.6 %"),
]


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
@pytest.mark.parametrize(("words", "title"), TITLES)
def test_the_title_names_the_frame_and_its_strain(tmp_path, view, scenes, words, title):
    """And both ends of a long path."""
    source, *options = words.split()
    link = tmp_path.joinpath(*["i" * 30] * 5, "linked")
    link.parent.mkdir(parents=True)
    link.symlink_to(ROOT / source)
    view(link, *options)
    ((_, _, found, _),) = scenes
    assert found.startswith(str(link)[:15])
    assert found.endswith(f"/linked, {title}")


def test_a_frame_without_grains_is_shown_as_such(tmp_path, view, scenes):
    write(tmp_path / "dump_0.txt", dump_text([]))
    write(tmp_path / "dump_1.txt", dump_text(cubic_rows(), step=1))
    view(tmp_path, "--cut")
    assert scenes[0][2].endswith("frame 0, no grains")


def test_damaged_frames_before_the_one_asked_for_are_skipped(tmp_path, scenes, ask):
    """A radius of 0 makes no packing, and cut text no frame: the RV is of the third."""
    flat = [(*cubic_rows()[0][:5], 0), *cubic_rows()[1:]]
    for step, text in enumerate((dump_text(flat), dump_text()[:-40], dump_text(cubic_rows()))):
        write(tmp_path / f"dump_{step}.txt", text.replace("TIMESTEP\n0", f"TIMESTEP\n{step}"))
    words = ["view", tmp_path, "--screenshot", tmp_path / "x.png"]
    told = ask(*words, "--frame", "2").err
    assert scenes[0][0].window is not None
    assert told.count("frame 0 skipped: ") == told.count("frame 1 skipped: ") == 1
    ask(*words, "--frame", "0", code=1)


NO_LIBRARY = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkOSOpenGLRenderWindow", "LD_LIBRARY_PATH": ""}


WITHOUT_SCREEN = [
    ([], {}, "write a picture instead: --screenshot FILE.png"),
    # a kind of window that needs a library which is not there
    (["--screenshot", "x.png"], NO_LIBRARY, "apt-get install"),
]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a screen")
@pytest.mark.parametrize(("words", "env", "message"), WITHOUT_SCREEN)
def test_where_nothing_can_be_drawn_view_says_what_to_do(series, tmp_path, words, env, message):
    env = {**os.environ, "DISPLAY": "", "WAYLAND_DISPLAY": "", **env}
    command = [*PROGRAM, "view", str(series), *words]
    answer = subprocess.run(command, capture_output=True, text=True, env=env, cwd=tmp_path)
    if (tmp_path / "x.png").exists():
        pytest.skip("libosmesa6 is installed")
    assert answer.returncode == 1
    assert message in " ".join(answer.stderr.split())
    assert "Traceback" not in answer.stderr


def test_a_folder_of_paraview_files_is_a_series_of_its_grains(series, tmp_path, ask):
    """Scan lines, surfaces and tensors beside them are none of its contacts."""
    files = ("--vtk", tmp_path / "vtk", "-o", tmp_path / "t.csv")
    ask("compute", series, *FAST, "--frames", "0", *files)
    out = ask("inspect", tmp_path / "vtk").out
    contacts = read_rows(tmp_path / "t.csv")[0]["contacts"]
    assert f"contacts      {contacts}" in out
