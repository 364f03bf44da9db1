"""--resume on a complete table: what is there is taken over, what is missing is computed."""

from __future__ import annotations

import gzip
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import pyvista

from scanfab.cli import talk
from scanfab.cli.main import run
from scanfab.pipeline import measurement
from scanfab.pipeline.record import read_manifest
from tests.cli.test_resume import _wait_for_frames_under_way
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import interrupted_at_row, write_series
from tests.helpers.truth import SAMPLE_DATA

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac")


@pytest.fixture(scope="module")
def five_frames(tmp_path_factory):
    return write_series(tmp_path_factory.mktemp("five") / "series", 5)


@pytest.fixture
def dumps(five_frames, tmp_path):
    """A folder whose last two frames are not written yet."""
    folder = tmp_path / "dumps"
    folder.mkdir()
    for path in sorted(five_frames.iterdir(), key=lambda path: int(path.stem[5:]))[:3]:
        shutil.copy(path, folder)
    return folder


@pytest.fixture
def compute(dumps, monkeypatch):
    """The exit code of a run, and how many frames it has scanned."""
    scan, scanned = measurement.scan_to_tolerance, []
    monkeypatch.setattr(
        measurement, "scan_to_tolerance", lambda *words: scanned.append(1) or scan(*words)
    )

    def compute(output: Path, *words: str, sources: tuple[Path, ...] = (dumps,)) -> tuple[int, int]:
        scanned.clear()
        code = run(["compute", *map(str, sources), *FAST, "-o", str(output), *words])
        return code, len(scanned)

    return compute


def add_frames(five_frames: Path, dumps: Path) -> None:
    for path in five_frames.iterdir():
        shutil.copy(path, dumps)


@pytest.mark.parametrize("suffix", [".csv", ".tsv", ".json", ".jsonl", ".parquet"])
def test_frames_that_came_later_are_added(compute, five_frames, dumps, tmp_path, suffix):
    table, whole = tmp_path / f"table{suffix}", tmp_path / f"whole{suffix}"
    assert compute(table) == (0, 3)
    add_frames(five_frames, dumps)
    assert compute(table, "--resume", "--workers", "1") == (0, 2)
    assert compute(whole) == (0, 5)
    assert table.read_bytes() == whole.read_bytes()
    one, other = read_manifest(table), read_manifest(whole)
    assert one["settings"] == other["settings"]
    assert one["inputs"] == other["inputs"]


def test_nothing_is_computed_where_nothing_is_missing(compute, tmp_path):
    table = tmp_path / "table.csv"
    assert compute(table) == (0, 3)
    before = table.read_bytes()
    assert compute(table, "--resume") == (0, 0)
    assert table.read_bytes() == before


def test_rows_of_several_sources_stay_in_their_order(compute, five_frames, dumps, tmp_path):
    other = shutil.copytree(five_frames, tmp_path / "other")
    table, whole = tmp_path / "table.csv", tmp_path / "whole.csv"
    assert compute(table, sources=(dumps, other)) == (0, 8)
    add_frames(five_frames, dumps)
    assert compute(table, "--resume", sources=(dumps, other)) == (0, 2)
    assert compute(whole, sources=(dumps, other)) == (0, 10)
    assert table.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize(
    ("first", "then", "every", "computed"),
    [
        ("1:3", ":3", ":3", 1),
        (":2", "2:", ":", 1),
        ("2:", ":2", ":", 2),
        (":", ":1", ":", 0),
        ("-1:", "-2:", "-2:", 1),
        ("::2", "1", ":", 1),
    ],
)
def test_other_frames_join_those_of_the_table(compute, tmp_path, first, then, every, computed):
    """No frame of the table is lost."""
    table, whole = tmp_path / "table.csv", tmp_path / "whole.csv"
    assert compute(table, f"--frames={first}")[0] == 0
    assert compute(table, "--resume", f"--frames={then}") == (0, computed)
    assert compute(whole, f"--frames={every}")[0] == 0
    assert table.read_bytes() == whole.read_bytes()
    chosen, expected = (read_manifest(one)["settings"].pop("frames") for one in (table, whole))
    assert range(3)[slice(*chosen)] == range(3)[slice(*expected)]


def test_a_report_is_made_of_frames_that_joined_those_of_a_table(compute, tmp_path):
    """Which are not all that the source has."""
    table = tmp_path / "table.csv"
    assert compute(table, "--frames=-1:")[0] == 0
    assert compute(table, "--resume", "--frames=-2:") == (0, 1)
    assert run(["report", str(table), "-o", str(tmp_path / "report.html")]) == 0


def test_frames_that_make_no_slice_are_refused(compute, tmp_path, five_frames, dumps, capsys):
    add_frames(five_frames, dumps)
    table = tmp_path / "table.csv"
    assert compute(table, "--frames=:2")[0] == 0
    before = table.read_bytes()
    assert compute(table, "--resume", "--frames=4:") == (2, 0)
    assert "holds frames 0 to 1, which with those chosen now make no slice" in (
        capsys.readouterr().err
    )
    assert table.read_bytes() == before


@pytest.mark.parametrize(
    ("words", "named"),
    [(["--seed", "1"], "seed"), (["--digits", "5", "--rv", "0.6"], "digits, rv")],
)
def test_other_settings_are_refused_and_named(compute, tmp_path, capsys, words, named):
    table = tmp_path / "table.csv"
    assert compute(table)[0] == 0
    before = table.read_bytes()
    assert compute(table, "--resume", *words) == (2, 0)
    told = capsys.readouterr().err
    assert f"--resume cannot go on with it: it was made with other settings ({named})" in told
    assert table.read_bytes() == before


@pytest.mark.parametrize("words", [[], ["--rattlers", "recursive"]])
def test_a_manifest_older_than_a_setting_means_its_default(compute, tmp_path, capsys, words):
    table = tmp_path / "table.csv"
    assert compute(table) == (0, 3)
    path = tmp_path / "table.csv.manifest.json"
    manifest = json.loads(path.read_text("utf-8"))
    del manifest["settings"]["rattlers"]
    path.write_text(json.dumps(manifest), "utf-8")
    assert compute(table, "--resume", *words) == ((2, 0) if words else (0, 0))
    assert ("made with other settings (rattlers)" in capsys.readouterr().err) == bool(words)


def test_a_table_without_its_manifest_is_refused(compute, tmp_path, capsys):
    table = tmp_path / "table.csv"
    assert compute(table)[0] == 0
    Path(f"{table}.manifest.json").unlink()
    assert compute(table, "--resume") == (2, 0)
    assert "there is no table.csv.manifest.json, which says what made it" in capsys.readouterr().err


def _changed(dumps: Path) -> None:
    path = dumps / "dump_100.txt"
    path.write_text(path.read_text().replace("0.5", "0.49"))


def _earlier(dumps: Path) -> None:
    write(dumps / "dump_50.txt", dump_text(cubic_rows(), step=50, box=((0, 4),) * 3))


def _gone(dumps: Path) -> None:
    (dumps / "dump_0.txt").unlink()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_changed, "dump_100.txt has changed since"),
        (_earlier, "dump_50.txt is new, and not behind the last frame"),
        (_gone, "dump_0.txt is not among the files that are read now"),
    ],
)
def test_other_inputs_are_refused(compute, dumps, tmp_path, capsys, change, said):
    table = tmp_path / "table.csv"
    assert compute(table)[0] == 0
    change(dumps)
    assert compute(table, "--resume") == (2, 0)
    assert said in capsys.readouterr().err


def test_a_dump_of_many_snapshots_may_grow(compute, five_frames, tmp_path):
    parts = sorted(five_frames.iterdir(), key=lambda path: int(path.stem[5:]))
    texts = [path.read_text() for path in parts]
    dump = write(tmp_path / "dump.txt", "".join(texts[:3]))
    table, whole = tmp_path / "table.csv", tmp_path / "whole.csv"
    assert compute(table, sources=(dump,)) == (0, 3)
    write(dump, "".join(texts))
    assert compute(table, "--resume", sources=(dump,)) == (0, 2)
    assert compute(whole, sources=(dump,)) == (0, 5)
    assert table.read_bytes() == whole.read_bytes()


def test_a_frame_that_was_skipped_is_tried_again(compute, dumps, tmp_path, capsys):
    """As long as it cannot be read the exit code is 1; once it can, its rows are there."""
    second = dumps / "dump_100.txt"
    good = second.read_text()
    second.write_text("ITEM: TIMESTEP\n")
    table, whole = tmp_path / "table.csv", tmp_path / "whole.csv"
    assert compute(table, "--on-error", "skip") == (1, 2)
    assert compute(table, "--on-error", "skip", "--resume") == (1, 0)
    assert "frame 1 skipped" in capsys.readouterr().err
    # the file was no input that a row was made of, but the manifest lists it
    second.write_text(good)
    assert compute(table, "--on-error", "skip", "--resume") == (0, 1)
    assert compute(whole, "--on-error", "skip") == (0, 3)
    assert table.read_bytes() == whole.read_bytes()


def test_what_is_interrupted_again_goes_on_with_part_and_table(
    compute, five_frames, dumps, tmp_path, monkeypatch, capsys
):
    table, whole = tmp_path / "table.csv", tmp_path / "whole.csv"
    assert compute(table, "--frames=1:3") == (0, 2)
    before = table.read_bytes()
    add_frames(five_frames, dumps)
    with interrupted_at_row(monkeypatch, 4):
        assert compute(table, "--resume", "--workers", "1")[0] == 130
    _wait_for_frames_under_way()
    assert "interrupted after 3 of 5 frames; the same command goes on" in capsys.readouterr().err
    assert table.read_bytes() == before
    assert compute(table, "--resume") == (0, 2)
    assert compute(whole) == (0, 5)
    assert table.read_bytes() == whole.read_bytes()


def test_warnings_of_the_first_run_stay_in_the_manifest(compute, five_frames, dumps, tmp_path):
    write(dumps / "notes.md", "nothing")
    table = tmp_path / "table.csv"
    assert compute(table)[0] == 0
    path = Path(f"{table}.manifest.json")
    found = json.loads(path.read_text())
    found["warnings"] = ["frame 1: something was told"]
    path.write_text(json.dumps(found))
    add_frames(five_frames, dumps)
    assert compute(table, "--resume")[0] == 0
    assert read_manifest(table)["warnings"][0] == "frame 1: something was told"


def test_columns_and_digits_are_those_of_the_table(compute, five_frames, dumps, tmp_path):
    words = ("--fields", "source,frame,variant,alpha_vs_axial", "--digits", "4")
    table, whole = tmp_path / "table.csv", tmp_path / "whole.csv"
    assert compute(table, *words) == (0, 3)
    add_frames(five_frames, dumps)
    assert compute(table, *words, "--resume") == (0, 2)
    assert compute(whole, *words) == (0, 5)
    assert table.read_bytes() == whole.read_bytes()


FEW = ("--fields", "source,frame,variant,alpha_vs_axial")


@pytest.mark.parametrize(
    "fields", ["source,frame,variant,alpha_vs_axial", "source,frame,alpha_vs", "source,frame"]
)
def test_columns_that_were_left_out_are_no_failure(compute, tmp_path, fields):
    table = tmp_path / "table.csv"
    assert compute(table, "--fields", fields) == (0, 3)
    assert compute(table, "--fields", fields, "--resume") == (0, 0)


def test_a_figure_without_the_columns_that_it_needs_is_refused(compute, tmp_path, capsys):
    table, plot = tmp_path / "table.csv", tmp_path / "plot.png"
    assert compute(table, *FEW) == (0, 3)
    before = table.read_bytes()
    assert compute(table, *FEW, "--resume", "--plot", str(plot)) == (2, 0)
    assert (
        "its rows lack strain, alpha_c_axial (--fields), which the figure needs: leave out --plot"
    ) in capsys.readouterr().err
    assert not plot.exists()
    assert table.read_bytes() == before


def test_a_figure_whose_columns_were_written_is_drawn(compute, tmp_path):
    table, plot = tmp_path / "table.csv", tmp_path / "plot.png"
    words = ("--fields", "source,frame,variant,strain,alpha_vs_axial,alpha_c_axial")
    assert compute(table, *words) == (0, 3)
    assert compute(table, *words, "--resume", "--plot", str(plot)) == (0, 0)
    assert plot.stat().st_size > 1000


def test_a_figure_of_frames_needs_no_strain(compute, tmp_path):
    table, plot = tmp_path / "table.csv", tmp_path / "plot.png"
    assert compute(table, *FEW) == (0, 3)
    words = ("--resume", "--plot", str(plot), "--figure", "histogram")
    assert compute(table, *FEW, *words)[0] == 0
    assert plot.stat().st_size > 1000


def test_a_signal_before_the_first_new_frame_says_that_the_table_stands(
    compute, five_frames, dumps, tmp_path, monkeypatch, capsys
):
    table = tmp_path / "table.csv"
    assert compute(table) == (0, 3)
    before = table.read_bytes()
    add_frames(five_frames, dumps)
    with interrupted_at_row(monkeypatch, 1):
        assert compute(table, "--resume", "--workers", "1")[0] == 130
    _wait_for_frames_under_way()
    assert (
        f"interrupted before the first new frame was finished: {table} is as it was; the same "
        f"command goes on"
    ) in capsys.readouterr().err
    assert table.read_bytes() == before
    assert compute(table, "--resume") == (0, 2)


def test_frames_that_are_taken_over_take_no_time(
    compute, five_frames, dumps, tmp_path, monkeypatch
):
    """Only those of this run say how long the others will take."""
    table = tmp_path / "table.csv"
    assert compute(table) == (0, 3)
    add_frames(five_frames, dumps)
    works = []
    make = talk._Work.__init__
    monkeypatch.setattr(
        talk._Work, "__init__", lambda self, *words: works.append(self) or make(self, *words)
    )
    assert compute(table, "--resume") == (0, 2)
    (work,) = works
    assert (work.done, work.before) == (5, 3)


def test_a_table_without_its_frames_cannot_be_gone_on_with(compute, tmp_path, capsys):
    table = tmp_path / "table.csv"
    words = ("--fields", "strain,alpha_vs_axial")
    assert compute(table, *words)[0] == 0
    assert compute(table, *words, "--resume") == (2, 0)
    assert "it lacks the columns source and frame" in capsys.readouterr().err


def test_the_dumps_that_an_index_names_are_inputs(compute, tmp_path, capsys):
    dumps = [tmp_path / f"grains_{step}.vtp" for step in (0, 100)]
    for path in dumps:
        save_points(path)
    entries = [f'<DataSet timestep="{k}" file="{path.name}"/>' for k, path in enumerate(dumps)]
    index = write(
        tmp_path / "all.pvd",
        f'<?xml version="1.0"?><VTKFile type="Collection"><Collection>{"".join(entries)}'
        f"</Collection></VTKFile>",
    )
    table = tmp_path / "table.csv"
    assert compute(table, sources=(index,)) == (0, 2)
    inputs = [Path(one["path"]) for one in read_manifest(table)["inputs"]]
    assert inputs == sorted([index, *dumps])
    assert compute(table, "--resume", sources=(index,)) == (0, 0)
    save_points(dumps[1], squeeze=0.99)
    assert compute(table, "--resume", sources=(index,)) == (2, 0)
    assert "grains_100.vtp has changed since" in capsys.readouterr().err


def save_points(path: Path, squeeze: float = 1.0) -> None:
    """Grains as VTK points with a radius."""
    rows = np.array(cubic_rows(squeeze=squeeze), float)
    mesh = pyvista.PolyData(rows[:, 2:5])
    mesh["radius"] = rows[:, 5]
    mesh.save(str(path))


@pytest.fixture
def numbers(tmp_path):
    """A file with a row of text for each of three frames."""

    def write_numbers(header: str, row: str) -> Path:
        lines = [header, *(f"{100 * frame},{row}" for frame in range(3))]
        return write(tmp_path / "numbers.csv", "\n".join(lines))

    return write_numbers


TABLES = [("--strain", "step,strain", "0.1"), ("--cell", "step,lx,ly,lz", "4,4,4")]


@pytest.mark.parametrize(("option", "header", "row"), TABLES)
def test_numbers_of_the_frames_that_have_changed_are_refused(
    compute, numbers, tmp_path, capsys, option, header, row
):
    table, file = tmp_path / "table.csv", numbers(header, row)
    assert compute(table, option, str(file)) == (0, 3)
    assert str(file) in {one["path"] for one in read_manifest(table)["inputs"]}
    before = table.read_bytes()
    text = file.read_text()
    # the second is the last number with one digit more
    for changed in (text.replace(f"100,{row}", f"100,{row}1"), text + "5"):
        file.write_text(changed)
        assert compute(table, option, str(file), "--resume") == (2, 0)
        assert f"{file} has changed since, in more than new lines" in capsys.readouterr().err
        assert table.read_bytes() == before


@pytest.mark.parametrize(("option", "header", "row"), TABLES)
def test_numbers_of_the_frames_may_get_more_lines(
    compute, numbers, five_frames, dumps, tmp_path, option, header, row
):
    table, whole, file = tmp_path / "table.csv", tmp_path / "whole.csv", numbers(header, row)
    assert compute(table, option, str(file)) == (0, 3)
    file.write_text(f"{file.read_text()}\n300,{row}\n400,{row}\n")
    add_frames(five_frames, dumps)
    assert compute(table, option, str(file), "--resume") == (0, 2)
    assert compute(whole, option, str(file)) == (0, 5)
    assert table.read_bytes() == whole.read_bytes()


def test_strains_that_frames_get_later_are_refused(compute, dumps, tmp_path, capsys):
    """Their rows have none."""
    table, file = tmp_path / "table.csv", write(tmp_path / "s.csv", "step,strain\n0,0\n100,0.1\n")
    assert compute(table, "--strain", str(file)) == (0, 3)
    assert compute(table, "--strain", str(file), "--resume") == (0, 0)
    file.write_text(f"{file.read_text()}200,0.2\n")
    assert compute(table, "--strain", str(file), "--resume") == (2, 0)
    assert f"{file} has changed since" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("grains", "cell"),
    [
        ("before-spheres-*", "before-periCell-*"),
        ("rec_spheres.*", "rec_pericell.*"),
        ("saved_spheres.*", "saved_*.xml*"),
    ],
)
def test_a_cell_beside_the_grains_is_an_input(compute, tmp_path, capsys, grains, cell):
    """As YADE has them."""
    folder = shutil.copytree(SAMPLE_DATA / "yade_strained", tmp_path / "yade")
    table = tmp_path / "table.csv"
    words = ("--variants", "a", "--contacts", "geometric")
    assert compute(table, *words, sources=(folder / grains,)) == (0, 3)
    cells = sorted(folder.glob(cell))
    listed = {one["path"] for one in read_manifest(table)["inputs"]}
    assert {str(path) for path in cells} <= listed
    assert compute(table, *words, "--resume", sources=(folder / grains,)) == (0, 0)
    cells[0].write_bytes(gzip.compress(b"something else"))
    # the first bytes are those of the step, without which a saved state is none
    assert compute(table, *words, "--resume", sources=(folder / grains,)) == (2, 0)
    assert f"{cells[0]} " in capsys.readouterr().err


@pytest.mark.parametrize("last", ["prepared_table", "write_manifest", "ResultFile.remove_part"])
@pytest.mark.parametrize("is_new", [True, False])
def test_a_run_killed_before_its_last_step(compute, tmp_path, monkeypatch, capsys, last, is_new):
    """FILE.part is still there; a table that is complete counts, others go on to the same bytes."""
    table, whole = tmp_path / "t.csv", tmp_path / "whole.csv"
    assert compute(whole) == (0, 3)
    # a table of other settings, which is not to be taken for one of these
    assert is_new or compute(table, "--tolerance", "0.5") == (0, 3)
    merge = ["merge", str(table), "-o", str(tmp_path / "merged.csv")]

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(f"scanfab.pipeline.job.{last}", killed)
        assert compute(table) == (130, 3)
    if last == "ResultFile.remove_part":
        assert run(merge) == 0
        assert (tmp_path / "merged.csv").read_bytes() == whole.read_bytes()
    else:
        assert run(merge) == 1
        assert f"{table}: is not finished" in capsys.readouterr().err
    assert compute(table, "--resume") == (0, 0)
    assert table.read_bytes() == whole.read_bytes()
    assert read_manifest(table) == read_manifest(whole)
    assert {one.name for one in tmp_path.glob("t.*")} == {"t.csv", "t.csv.manifest.json"}
