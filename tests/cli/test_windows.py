"""Several windows: tables, comparison, files for ParaView, pictures."""

import pytest

import scanfab
from scanfab.cli.main import run

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


def test_paraview_and_report_show_all(table, tmp_path, ask):
    names = {path.name.rpartition("_")[0] for path in table.with_name("vtk").glob("*.vtp")}
    for kind in ("window", "lines-c", "distribution-c", "tensors-c"):
        assert {f"{kind}-rv0.5", f"{kind}-rv0.7"} <= names
        assert kind not in names
    assert "lines-a" in names
    ask("report", table, "-o", tmp_path / "report.html")
    assert "c RV 0.5" in (tmp_path / "report.html").read_text()
