"""Windows of every shape, and several: tables, comparison, files for ParaView, pictures."""

import meshio
import numpy as np
import pytest

import scanfab
from scanfab.cli.main import run
from scanfab.pipeline.record import read_manifest
from tests.helpers.truth import SHEAR
from tests.helpers.windows import OF_A_BOX, corners_of_a_box

FAST = ("--directions", "9", "--spacing", "1rmin", "--workers", "1", "--variants", "ac")


def surface(path, half=0.004):
    middle = np.array([0.01125, 0.012, 0.0105])
    corners = middle + corners_of_a_box(np.full(3, half))
    meshio.Mesh(corners, [("triangle", OF_A_BOX)]).write(path)
    return str(path)


def test_shape_and_surface_are_resumed_unless_the_file_has_changed(ask, tmp_path):
    file, output, whole = surface(tmp_path / "box.ply"), tmp_path / "t.csv", tmp_path / "whole.csv"
    for words in (("--rv-shape", "box", "--rv-follows", "strain"), ("--rv-shape", file)):
        words = ("compute", SHEAR, *FAST, *words, "--frames")
        ask(*words, "0:1", "-o", output)
        ask(*words, "0:2", "-o", output, "--resume")
        ask(*words, "0:2", "-o", whole)
        assert output.read_bytes() == whole.read_bytes()
    manifest = read_manifest(output)
    assert manifest["settings"]["rv_shape"] == file
    assert file in [one["path"] for one in manifest["inputs"]]
    surface(tmp_path / "box.ply", half=0.0035)
    told = ask(*words, "0:3", "-o", output, "--resume", code=2).told
    assert f"{file} has changed since" in told


SMALL = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac")
RVS = ("--rv", "0.7,0.5")


@pytest.fixture(scope="module")
def table(series, tmp_path_factory):
    output = tmp_path_factory.mktemp("tables") / "table.csv"
    vtk = output.with_name("vtk")
    assert run(["compute", str(series), *SMALL, *RVS, "-o", str(output), "--vtk", str(vtk)]) == 0
    return output


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
