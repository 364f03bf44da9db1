"""The report: what it says with and without manifest and source, and which tables it takes."""

import json
import math
import re
import shutil
from datetime import date
from html import unescape
from pathlib import Path

import pytest

from scanfab.base.errors import ReadError, SettingsError
from scanfab.cli.main import run
from scanfab.table.formats import read_rows
from scanfab.table.table import Table
from scanfab.viz.report.report import report
from tests.conftest import ROOT, SAMPLE
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.tables import curve, sheared

pytestmark = pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabNote")


@pytest.fixture
def copied(computed, tmp_path, monkeypatch):
    """The sample's table and manifest in a folder of their own, opened from the repository."""
    monkeypatch.chdir(ROOT)
    table = tmp_path / "fabric.csv"
    for end in ("", ".manifest.json"):
        shutil.copy(f"{computed.table}{end}", f"{table}{end}")
    return table


@pytest.fixture
def page(sample_report):
    """The sample's report."""
    return sample_report.page


def change(table: Path, **changes):
    path = Path(f"{table}.manifest.json")
    manifest = json.loads(path.read_text())
    for name, value in changes.items():
        target = manifest if name in manifest else manifest["settings"]
        target[name] = value
    path.write_text(json.dumps(manifest))


def page_of(tables, **options):
    return report(tables, **options).page


def words_of(page):
    """What a reader sees."""
    text = re.sub(r"<(script|style).*?</\1>", " ", page, flags=re.S)
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]*>", " ", text)))


def part_of(page, name):
    """What a reader sees of one section."""
    return words_of(page.partition(f'id="{name}"')[2].partition("<h2")[0])


def test_the_sample_is_told_in_full(page):
    text = words_of(page)
    for part in (
        "3 frames of sample_data/yade_triaxial; variants a, b, c, d;",
        "axial strain 0 to 15 %",
        "scanfab compute sample_data/yade_triaxial --boundary mask=3 --tolerance 0.0005 "
        "--frames 0::3 -o fabric.csv",
        "boundary mask=3 Which particles are boundary",
        "triaxial-spheres-00000006.vtk.gz",
        "sample_data/yade_triaxial, variant a: where α vs is largest, its standard error is",
        "grains 800 in the reference frame",
        "radii smallest 0.0005042, mean 0.0009907, largest 0.001499",
        "boundary 1000 particles",
        "cell not periodic",
        "loading axis z",
        "cut-off 0.0005042, 1 smallest radii",
        "RV radius 0.00805788 about (1.368e-05, -4.461e-05, -3.663e-05)",
        "lengths of this report are in the unit of the dump",
    ):
        assert part in text
    assert re.search(r"numpy \d+\.\d+", text)
    # each setting has a value and a meaning
    assert "<td></td>" not in page
    assert "frame 6, axial strain 15 %</h3>" in page
    assert page.count("<canvas") == 1
    assert page.count("data:image/") == 5
    assert len(page) < 1_000_000


def test_the_view_holds_the_grains_of_the_last_frame(page, computed):
    data = json.loads(re.search(r'id="data-1">(.*?)</script>', page, re.S)[1])
    assert len(data["spheres"]) == 800
    inside = sum(x * x + y * y + z * z < data["rv"] ** 2 for x, y, z, *_ in data["spheres"])
    rows = {row["variant"]: row for row in computed.rows if row["frame"] == 6}
    assert inside == pytest.approx(rows["c"]["grains"], abs=2)
    rattlers = sum(kind == 2 for *_, kind in data["spheres"])
    assert rattlers == rows["a"]["rattlers"]
    assert data["cutoff"] * data["size"] / 1000 == pytest.approx(rows["c"]["cutoff"])
    assert [one[0] for one in data["axes"]] == ["x", "y", "z (loading)"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sources": ["gone"]}, "left out: gone: there is no such file, folder or glob."),
        ({"sources": ["-"]}, "The view is left out: the frames came by standard input"),
        ({"boundary": [{"text": "mask"}]}, "cannot be used: boundary: expected COLUMN=VALUE"),
        ({"rv": 0.0}, "cannot be used: rv: expected a fraction above 0"),
        ({"inputs": [{"path": "README.md", "size": 1}]}, "README.md has changed since the table"),
    ],
)
@pytest.mark.usefixtures("plain")
def test_a_source_that_cannot_be_read_again_is_told(copied, changes, message):
    change(copied, **changes)
    page = page_of([copied])
    assert message in words_of(page)
    assert "<canvas" not in page


def test_a_hundred_frames_without_a_manifest_stay_light_and_it_says_so(table):
    rows = [
        {**curve(variant=variant)[frame % 5], "frame": frame, "strain": 0.002 * frame}
        for frame in range(100)
        for variant in "ac"
    ]
    page = page_of([table(rows)])
    assert len(page) < 800_000
    assert page.count("data:image/") == 3
    for part in (
        "12 of 100 frames are shown",
        "There is no table.jsonl.manifest.json beside",
        "the frames are not known, so there is no view",
    ):
        assert part in words_of(page)


def test_a_table_without_void_fabric_is_told(table, tmp_path, capsys):
    path = table([{**row, "alpha_vs_axial": None} for row in curve()])
    page = tmp_path / "r.html"
    assert run(["report", str(path), "-o", str(page)]) == 1
    assert "no row of the tables has a void fabric" in capsys.readouterr().err
    assert "There is nothing to draw" in words_of(page.read_text("utf-8"))


def test_text_is_escaped_everywhere(table, plain):
    """The page's structure does not depend on what the names are."""

    def tags_of(page):
        return [re.sub('"[^"]*"', "", tag) for tag in re.findall("<[^>]*>", page)]

    def page(source):
        path = table(curve(source))
        asked = {"sources": [source], source: source, "contacts": source, "cutoff": source}
        manifest = {"settings": asked, "versions": {source: source}, "warnings": [source]}
        manifest |= {"inputs": [], "notes": [], "frames": {}}
        Path(f"{path}.manifest.json").write_text(json.dumps(manifest))
        return page_of([path], title=source, author=source)

    harmless = tags_of(page("x"))
    for hostile in ("\"'><img src=x onerror=alert(1)>", "</script><b>", "{{ 7 * 7 }}", "&lt;"):
        text = page(hostile)
        assert tags_of(text) == harmless
        assert hostile in words_of(text) or hostile.replace("<b>", "") in words_of(text)


def test_a_damaged_manifest_is_an_error_that_names_it(copied):
    Path(f"{copied}.manifest.json").write_text("{")
    with pytest.raises(ReadError, match=r"fabric\.csv\.manifest\.json"):
        page_of([copied])


def test_the_error_is_that_of_scan_and_sample_together(page, computed):
    """Results, frame table and caveats quote one error; its parts are called parts."""
    row = next(r for r in computed.rows if (r["frame"], r["variant"]) == (6, "c"))
    parts = row["alpha_vs_axial_se"], row["alpha_vs_axial_sample_se"]
    total = f"{math.hypot(*parts):#.2g}"
    value = f"{row['alpha_vs_axial']:.{len(total) - 2}f}"
    results = part_of(page, "results")
    assert f"{value} ± {total}" in results
    assert f"± {parts[0]:#.2g}" not in words_of(page)
    assert "its error: scan" in results
    assert f" {parts[0]:#.2g} " in results
    line = f"6 c 15 % {value} ± {total} {parts[0]:#.2g} {parts[1]:#.2g} "
    assert line in words_of(page)


@pytest.mark.filterwarnings("ignore:shear_strain stands", "ignore:the loading axis")
def test_a_sheared_cell_is_told_by_its_shear(table, plain):
    """Summary, results, frames and notes speak of what the figures show."""
    page = page_of([table(sheared())])
    assert "shear strain 0 to 40 %" in words_of(page)
    assert "shear strain 40 %" in part_of(page, "results")
    assert "the loading axis is not the axis of the contact fabric" in part_of(page, "notes")
    assert "frame variant axial strain shear strain" in part_of(page, "frames")
    assert "3 c 0 % 30 % " in part_of(page, "frames")


def test_sources_of_both_kinds_have_each_their_own_strain_and_last_frame(table, plain):
    page = page_of([table(sheared(), "s.jsonl"), table(curve())])
    for said in (
        *("shear strain 0 to 40 %", "axial strain 0 to 4 %", "3 c 0 % 30 % ", "3 c 3 % - "),
        *("frame 4 axial strain 4 %", "α vs along the loading axis -0.03000"),
    ):
        assert said in words_of(page)


def test_lobes_that_are_noise_are_called_so(page):
    of_voids = r"Frame \d: (lobes of void lengths .*?); lobes of contact"
    first, last = re.findall(of_voids, words_of(page))
    assert first.endswith("so they are noise")
    assert not last.endswith("so they are noise")


def test_title_author_and_date(table, plain):
    path, today = table(curve("dumps/sand")), date(2031, 2, 3)
    assert "<title>Void fabric of sand</title>" in page_of([path])
    page = page_of([path], title="A & B", author="Ann <x>", today=today)
    assert "<h1>A &amp; B</h1>" in page
    assert ">Ann &lt;x&gt;, 2031-02-03</p>" in page


def test_notes_are_not_warnings(copied, plain):
    words = {"notes": ["a quiet word"], "warnings": ["a loud word"]}
    change(copied, sources=["gone"], **words)
    page = page_of([copied])
    assert "a loud word" in part_of(page, "warnings")
    assert "a quiet word" not in part_of(page, "warnings")
    assert "a quiet word" in part_of(page, "notes")


def test_one_table_needs_no_list_and_a_table_without_a_file_is_refused(table, plain):
    path = table(curve())
    assert report(str(path)).page == report([path]).page
    with pytest.raises(SettingsError, match="expected files of tables"):
        report(Table(curve()))


# which tables it takes


def test_few_columns_are_enough(table, plain):
    few = ("frame", "variant", "alpha_vs_axial", "alpha_c_axial")
    text = words_of(page_of([table([{name: row[name] for name in few} for row in curve()])]))
    assert "5 frames of table; variants c." in text
    assert "lacks the column alpha_vs_axial_se" in text
    assert "1 frame of one; variants c;" in words_of(page_of([table(curve()[:1], "one.jsonl")]))


def test_one_of_several_cut_offs_is_reported(tmp_path, capsys, plain):
    """They differ from what the scan is made for."""
    dump = write(tmp_path / "dump_0.txt", dump_text(cubic_rows()))
    table, page = tmp_path / "fabric.csv", tmp_path / "r.html"
    words = ["--directions", "9", "--spacing", "0.5rmin", "--cutoffs", "0.1,0.2", "-o", str(table)]
    assert run(["compute", str(dump), *words, "--variants", "c"]) == 0
    assert run(["report", str(table), "-o", str(page)]) == 1
    assert "choose one cut-off with --cutoff" in capsys.readouterr().err
    assert run(["report", str(table), "--cutoff", "0.2", "-o", str(page)]) == 0
    text, smallest = words_of(page.read_text("utf-8")), min(row[-1] for row in cubic_rows())
    assert f"cut-off 0.2, {0.2 / smallest:.3g} smallest radii" in text
    assert "--cutoffs 0.1,0.2" in text
    (chosen,) = [row for row in read_rows(table) if row["cutoff"] == 0.2]
    assert f"{chosen['alpha_vs_axial']:.4f} ±" in text


def test_what_is_doubtful_about_tables_is_told_and_stands_in_the_page(table, plain):
    paths = [table(curve(), "a.jsonl"), table(curve(), "b.jsonl")]
    with pytest.warns(match="rows of one that .* also holds are used once"):
        page = page_of(paths)
    assert "also holds are used once" in part_of(page, "warnings")


def test_maps_beside_tables_have_no_labels_and_need_their_columns(table, tmp_path, capsys, plain):
    rows = [{**row, "block": 0, "x": 0.0, "y": 0.0, "z": 0.0, "at_surface": 0} for row in curve()]
    words = [str(table(curve(), "a.jsonl")), str(table(rows, "map.jsonl"))]
    labels = ["--label", "sheared", "--label", "by place"]
    assert run(["report", *words, *labels, "-o", str(tmp_path / "r.html")]) == 0
    assert "Void fabric of sheared" in words_of((tmp_path / "r.html").read_text("utf-8"))
    for row in rows:
        del row["variant"], row["alpha_vs_axial"], row["at_surface"]
    lack = r"map\.jsonl: the map lacks the columns variant, alpha_vs_axial"
    with pytest.raises(SettingsError, match=lack):
        report([table(rows, "map.jsonl")])


def test_it_needs_nothing_from_elsewhere(page):
    addresses = re.findall(r"(?:src|href)\s*=\s*[\"']?([^\"'>\s]*)", page)
    assert addresses
    assert all(one.startswith(("data:", "#")) for one in addresses)
    assert "@import" not in page
    assert "http" not in re.sub(r'content="default-src[^"]*"|http-equiv', "", page)


def test_tables_of_other_programs_and_of_compare_are_refused(table, tmp_path, capsys, plain):
    """Those of compare were reported as made of one replicate."""
    compared, page = tmp_path / "compared.csv", tmp_path / "r.html"
    assert run(["compare", str(table(curve())), "-o", str(compared)]) == 0
    with pytest.raises(SettingsError, match=r"compared.csv: this is a table of scanfab compare: "):
        report([compared])
    engine = ROOT / SAMPLE / "engine.csv"
    assert run(["report", str(engine), "-o", str(page)]) == 1
    assert f"{engine}: there is no column" in capsys.readouterr().err
    assert not page.exists()
