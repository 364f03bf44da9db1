"""Which tables a report takes, and in what words it refuses others."""

import pytest

from scanfab.base.errors import SettingsError
from scanfab.cli.main import run
from scanfab.table.formats import read_rows
from scanfab.viz.report.report import report
from tests.conftest import ROOT, SAMPLE
from tests.helpers.tables import curve
from tests.viz.report.test_report import page_of, part_of, words_of

pytestmark = [
    pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabWarning"),
    pytest.mark.usefixtures("plain"),
]


def test_tables_of_other_programs_and_of_compare_are_refused(table, tmp_path, capsys):
    """Those of compare were reported as made of one replicate."""
    compared, page = tmp_path / "compared.csv", tmp_path / "r.html"
    assert run(["compare", str(table(curve())), "-o", str(compared)]) == 0
    with pytest.raises(SettingsError, match=r"compared.csv: this is a table of scanfab compare: "):
        report([compared])
    engine = ROOT / SAMPLE / "engine.csv"
    assert run(["report", str(engine), "-o", str(page)]) == 1
    assert f"{engine}: there is no column" in capsys.readouterr().err
    assert not page.exists()


def test_few_columns_are_enough(table):
    few = ("frame", "variant", "alpha_vs_axial", "alpha_c_axial")
    text = words_of(page_of([table([{name: row[name] for name in few} for row in curve()])]))
    assert "5 frames of table; variants c." in text
    assert "lacks the column alpha_vs_axial_se" in text
    with pytest.raises(SettingsError, match="there is no column variant"):
        report([table([{k: v for k, v in row.items() if k != "variant"} for row in curve()])])


def test_a_table_is_read_once(table, monkeypatch):
    """It may come by a pipe."""
    read = []
    monkeypatch.setattr(
        "scanfab.viz.report.report.read_rows", lambda path: read.append(path) or read_rows(path)
    )
    path = table(curve())
    assert report([path]).has_void_fabric
    assert read == [path]


def test_one_of_several_cut_offs_is_reported(tmp_path, capsys):
    """They differ from what the scan is made for."""
    table, page = tmp_path / "fabric.csv", tmp_path / "r.html"
    words = ["--boundary", "mask=3", "--tolerance", "3e-3", "--frames", "-1:", "--variants", "c"]
    source = str(ROOT / SAMPLE)
    assert run(["compute", source, *words, "--cutoffs", "0.0005,0.001", "-o", str(table)]) == 0
    assert run(["report", str(table), "-o", str(page)]) == 1
    assert "choose one cut-off with --cutoff" in capsys.readouterr().err
    assert run(["report", str(table), "--cutoff", "0.001", "-o", str(page)]) == 0
    text = words_of(page.read_text("utf-8"))
    assert "cut-off 0.001, 1.98 smallest radii" in text
    assert "--cutoffs 0.0005,0.001" in text
    (chosen,) = [row for row in read_rows(table) if row["cutoff"] == 0.001]
    assert f"{chosen['alpha_vs_axial']:.4f} ±" in text


def test_what_is_doubtful_about_tables_is_told_and_stands_in_the_page(table):
    paths = [table(curve(), "a.jsonl"), table(curve(), "b.jsonl")]
    with pytest.warns(match="rows of one that .* also holds are used once"):
        page = page_of(paths)
    assert "also holds are used once" in part_of(page, "warnings")


def test_maps_beside_tables_have_no_labels_and_need_their_columns(table, tmp_path, capsys):
    rows = [{**row, "block": 0, "x": 0.0, "y": 0.0, "z": 0.0, "at_surface": 0} for row in curve()]
    words = [str(table(curve(), "a.jsonl")), str(table(rows, "map.jsonl"))]
    labels = ["--label", "sheared", "--label", "by place"]
    assert run(["report", *words, *labels, "-o", str(tmp_path / "r.html")]) == 0
    assert "Void fabric of sheared" in words_of((tmp_path / "r.html").read_text("utf-8"))
    with pytest.raises(SettingsError, match="labels: expected one per table: 1, found 2"):
        report(words[:1], labels=["sheared", "by place"])
    for row in rows:
        del row["variant"], row["alpha_vs_axial"], row["at_surface"]
    lack = r"map\.jsonl: the map lacks the columns variant, alpha_vs_axial"
    with pytest.raises(SettingsError, match=lack):
        report([table(rows, "map.jsonl")])
