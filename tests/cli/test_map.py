"""Several parts of a sample: scanfab map with its files and figure, and tables of several RVs."""

import pytest
import pyvista

import scanfab
from scanfab.cli.main import run
from tests.helpers.dumps import write
from tests.helpers.interruptions import interrupted_at_row

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--workers", "1")
OPTIONS = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin", "workers": 1}
GRID = ("--grid", "2,1,1")


@pytest.fixture(scope="module")
def table(series, tmp_path_factory):
    output = tmp_path_factory.mktemp("tables") / "map.csv"
    drawn = ("--vtk", str(output.with_name("vtk")), "--plot", str(output.with_name("map.png")))
    assert run(["map", str(series), *FAST, *GRID, "-o", str(output), *drawn]) == 0
    return output


@pytest.mark.filterwarnings("ignore:.*whether the sample is homogeneous")
def test_the_table_is_that_of_the_library(series, table, tmp_path):
    computed = scanfab.fabric_map(scanfab.read_series(series), grid=(2, 1, 1), **OPTIONS)
    assert scanfab.load(table) == computed
    output = tmp_path / "map.csv"
    scanfab.compute_file(series, output, grid="2,1,1", **OPTIONS)
    assert output.read_bytes() == table.read_bytes()


def test_it_is_drawn_and_written_for_paraview(table):
    assert table.with_name("map.png").stat().st_size > 10_000
    collection = table.with_name("vtk") / "map-a.pvd"
    assert collection.read_text().count("map-a_00000") == 5
    mesh = pyvista.read(collection.with_name("map-a_000001.vtu"))
    rows = scanfab.load(table)[2:4]
    fabric = [row.alpha_vs_axial for row in rows]
    assert mesh.cell_data["alpha_vs_axial"].tolist() == pytest.approx(fabric)
    # blocks are where their rows say they are
    assert mesh.cell_centers().points[:, 0].tolist() == pytest.approx([row.x for row in rows])


def test_a_frame_that_is_named_overrides_the_settings_file(series, tmp_path, monkeypatch, ask):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "scanfab.toml", '[compute]\nframes = "0:2"\n')
    assert {row["frame"] for row in ask("map", series, *FAST, *GRID, "--frame", "3").rows} == {"3"}


def test_a_run_that_was_stopped_goes_on(series, table, tmp_path, monkeypatch, ask):
    """In the middle of a frame, which has two rows; but not with other blocks."""
    output = tmp_path / "map.csv"
    with interrupted_at_row(monkeypatch, 4) as rows:
        ask("map", series, *FAST, *GRID, "-o", output, code=130)
    assert len(rows) == 4
    ask("map", series, *FAST, *GRID, "-o", output, "--resume")
    assert output.read_bytes() == table.read_bytes()
    other = ("--grid", "1,2,1", "-o", output, "--resume")
    assert "grid" in ask("map", series, *FAST, *other, code=2).err
    assert output.read_bytes() == table.read_bytes()


def test_several_rvs_are_told_apart(series, ask, tmp_path):
    """In the table, in its comparison, and in files for ParaView."""
    table, both = tmp_path / "table.csv", ("--variants", "ac", "--rv", "0.7,0.5")
    ask("compute", series, *FAST, *both, "-o", table, "--vtk", tmp_path)
    rows = ask("compare", table, "--summary").rows
    assert [(row["variant"], row["rv"]) for row in rows] == [("a", ""), ("c", "0.5"), ("c", "0.7")]
    found = scanfab.load(table).compare()
    # each as from a table of its own
    for rv in (0.5, 0.7):
        (alone,) = scanfab.load(table).select(rv=rv).compare().summary
        assert alone in list(found.summary)
    pairs = {row.variants for row in found.differences}
    assert pairs == {"a-c RV 0.5", "a-c RV 0.7", "c RV 0.5-c RV 0.7"}
    names = {path.name.rpartition("_")[0] for path in tmp_path.glob("*.vtp")}
    for kind in ("window", "lines-c", "distribution-c", "tensors-c"):
        assert {f"{kind}-rv0.5", f"{kind}-rv0.7"} <= names
        assert kind not in names
    assert "lines-a" in names
