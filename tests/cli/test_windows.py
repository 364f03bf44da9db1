"""Windows of every shape, and several: tables, comparison, files for ParaView, pictures."""

import csv
import json

import meshio
import numpy as np
import pytest
import pyvista

import scanfab
from scanfab.cli.main import run
from tests.helpers.dumps import write
from tests.helpers.truth import SHEAR
from tests.helpers.windows import OF_A_BOX, corners_of_a_box

FAST = ("--directions", "9", "--spacing", "1rmin", "--workers", "1", "--variants", "ac")
SHAPES = {
    "box by size": ["--rv-shape", "box", "--rv-size", "0.01,0.012,0.008"],
    "cylinder": ["--rv-shape", "cylinder", "--rv-axis", "1,1,0", "--rv-size", "0.004", "0.01"],
    "follows": ["--rv-shape", "ellipsoid", "--rv-follows", "strain"],
}


@pytest.fixture
def compute(tmp_path, ask):
    """The rows of a table, or what was told."""

    def call(*words, source=SHEAR, name="table.csv", frames="0:2", code=0):
        output = tmp_path / name
        words = (*FAST, "--frames", frames, *words, "-o", output)
        told = ask("compute", source, *words, code=code).told
        if code:
            return told
        with open(output, newline="") as stream:
            return list(csv.DictReader(stream))

    return call


@pytest.mark.parametrize("name", SHAPES)
def test_every_shape_has_its_rows_and_the_column_of_the_window(compute, name):
    rows = compute(*SHAPES[name])
    assert [row["variant"] for row in rows] == list("acac")
    for row in rows:
        assert (row["window_alpha_vs_axial"] == "") == (row["variant"] == "a")
        assert float(row["mean_length"]) > 0
        assert int(row["grains"]) > 20


def test_blanks_and_commas_are_the_same_and_the_sphere_has_no_such_column(compute):
    centre, size = "0.011,0.012,0.0105", "0.01,0.012,0.008"
    box = ("--rv-shape", "box", "--rv-center", centre, "--rv-size")
    blanks = (*box[:3], *centre.split(","), "--rv-size", *size.split(","))
    assert compute(*blanks, frames="0") == compute(*box, size, frames="0")
    sphere = compute(frames="0")
    assert compute("--rv-shape", "sphere", frames="0") == sphere
    assert "window_alpha_vs_axial" not in sphere[0]


def surface(path, half=0.004, triangles=OF_A_BOX):
    middle = np.array([0.01125, 0.012, 0.0105])
    corners = middle + corners_of_a_box(np.full(3, half))
    meshio.Mesh(corners, [("triangle", triangles)]).write(path)
    return str(path)


@pytest.mark.parametrize("suffix", [".stl", ".vtp"])
def test_a_surface_from_a_file_is_the_box_that_it_draws(compute, tmp_path, suffix):
    file = tmp_path / f"box{suffix}"
    pyvista.read(surface(tmp_path / "box.ply")).save(file)
    drawn = compute("--rv-shape", file, frames="0")
    words = ("--rv-size", "0.008,0.008,0.008", "--rv-center", "0.01125,0.012,0.0105")
    named = compute("--rv-shape", "box", *words, frames="0")
    for one, other in zip(drawn, named, strict=True):
        assert one["grains"] == other["grains"]
        assert float(one["mean_length"]) == pytest.approx(float(other["mean_length"]), rel=1e-3)


def test_shape_and_surface_are_resumed_unless_the_file_has_changed(compute, tmp_path):
    file = surface(tmp_path / "box.ply")
    follows = ("--rv-shape", "box", "--rv-follows", "strain")
    for words in (follows, ("--rv-shape", file)):
        compute(*words, frames="0:1")
        assert compute(*words, "--resume") == compute(*words, name="whole.csv")
    manifest = json.loads((tmp_path / "table.csv.manifest.json").read_text())
    assert manifest["settings"]["rv_shape"] == file
    assert file in [one["path"] for one in manifest["inputs"]]
    surface(tmp_path / "box.ply", half=0.0035)
    told = compute(*words, "--resume", frames="0:3", code=2)
    assert f"{file} has changed since" in told


def test_broken_surfaces_are_told(compute, tmp_path):
    file = surface(tmp_path / "open.ply", triangles=OF_A_BOX[1:])
    assert "open.ply: the surface is not closed" in compute("--rv-shape", file, code=1)
    write(tmp_path / "open.ply", "ply\nnonsense")
    assert "open.ply: cannot be read" in compute("--rv-shape", file, code=1)


SMALL = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac")
OPTIONS = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin", "variants": "ac"}
RVS = ("--rv", "0.7,0.5")


@pytest.fixture(scope="module")
def table(series, tmp_path_factory):
    output = tmp_path_factory.mktemp("tables") / "table.csv"
    vtk = output.with_name("vtk")
    assert run(["compute", str(series), *SMALL, *RVS, "-o", str(output), "--vtk", str(vtk)]) == 0
    return output


def test_the_table_is_that_of_the_library(series, table):
    computed = scanfab.compute(scanfab.read_series(series), rv=(0.5, 0.7), **OPTIONS)
    assert scanfab.load(table) == computed
    assert [(row.frame, row.variant, row.rv) for row in computed[:4]] == [
        (0, "a", None), (0, "c", 0.5), (0, "c", 0.7), (1, "a", None),
    ]  # fmt: skip


def test_curves_are_told_apart_by_their_rv(table, series, ask, tmp_path):
    rows = ask("compare", table, "--summary").rows
    assert list(rows[0])[-1] == "rv"
    assert [(row["variant"], row["rv"]) for row in rows] == [("a", ""), ("c", "0.5"), ("c", "0.7")]
    found = scanfab.load(table).compare()
    # each as from a table of its own
    for rv in (0.5, 0.7):
        (alone,) = scanfab.load(table).select(rv=rv).compare().summary
        assert alone in list(found.summary)
    assert "variant c RV 0.5: slope" in repr(found)
    pairs = {row.variants for row in found.differences}
    assert pairs == {"a-c RV 0.5", "a-c RV 0.7", "c RV 0.5-c RV 0.7"}


def test_paraview_report_and_view_show_all(table, series, tmp_path, ask):
    names = {path.name.rpartition("_")[0] for path in table.with_name("vtk").glob("*.vtp")}
    for kind in ("window", "lines-c", "distribution-c", "tensors-c"):
        assert {f"{kind}-rv0.5", f"{kind}-rv0.7"} <= names
        assert kind not in names
    assert "lines-a" in names
    ask("report", table, "-o", tmp_path / "report.html")
    assert "c RV 0.5" in (tmp_path / "report.html").read_text()
    ask("view", series, *RVS, "--screenshot", tmp_path / "view.png")
    assert (tmp_path / "view.png").stat().st_size > 10_000
