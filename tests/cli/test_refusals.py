"""What cannot be: one message and the exit code, nothing printed, and no file touched."""

import json
import shlex
import shutil
import sys

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.tables import curve
from tests.helpers.truth import SAMPLE_DATA

FILES = {
    "out.csv": "precious",
    "old.html": "precious",
    "notes": "-",
    "head.csv": "source,frame\n",
    "row.csv": json.dumps(curve()[0]),
    "map.csv": json.dumps({**curve()[0], "block": 0}),
    "one/scanfab.toml": "[compute]\n",
    "none/scanfab.toml": "[compute]\n",
}
DISCS = SAMPLE_DATA / "lammps_biaxial" / "discs.0.lammpstrj.gz"


LINES = [
    # words
    ("compute cube --quiet --verbose", 2, "--quiet and --verbose contradict each other"),
    ("compute one none", 2, "the sources have several settings files"),
    ("computee", 2, "No such command 'computee'. Did you mean 'compute'?"),
    ("nonsense", 2, "No such command 'nonsense'. Choose from compute, merge, compare, inspect"),
    ("compute nowhere", 2, "nowhere: there is no such file, folder or glob"),
    ("compute -", 2, "standard input needs --format"),
    ("compute - . --format table", 2, "cannot be combined with other sources"),
    ("compute cube --tolerence 1", 2, "No such option '--tolerence'"),
    # values of options
    ("compute cube --format nonsense", 2, "there is no reader called 'nonsense', only edem"),
    ("compute cube --columns radius", 2, "--columns: expected NAME=COLUMN"),
    ("compute cube --follow-for -1", 2, "--follow-for"),
    ("compute cube cube/dump_0.txt --follow", 2, "--follow takes one folder, or one file"),
    ("compute cube --rv -1 -o out.csv", 2, "--rv: expected a fraction above 0"),
    ("map cube --slices 2 --frame 1", 2, "--frame: there is no frame 1: cube has 1, counted"),
    ("map cube --slices 2 --frame 0 --frames 0", 2, "--frame"),
    ("map cube --grid 2,2", 2, "three numbers of blocks, such as 4,4,8, found '2,2'"),
    # files to be written
    ("compute cube -o table.docx", 2, "results can be written as .csv"),
    ("compute cube --fields frame,alpha_v", 2, "no column 'alpha_v': did you mean alpha_vs?"),
    ("compute cube --resume", 2, "--resume needs -o FILE"),
    ("compute cube --vtk v --scheduler tcp://x:1", 2, "--vtk cannot be used with --scheduler"),
    ("compute cube --scheduler x --scheduler-file f", 2, "--scheduler"),
    ("compute cube --vtk out.csv/vtk", 2, "out.csv/vtk"),
    ("compute cube --figure rose", 2, "--figure goes with --plot FILE"),
    ("compute cube --plot x.docx", 2, "figures can be written as .png, .svg, .pdf, not as"),
    ("compute cube --plot x", 2, "without a suffix"),
    ("compute cube --plot no/x.png", 2, "there is no folder"),
    ("compute cube --plot x.png --figure pie", 2, "--figure: expected evolution"),
    ("compute cube other --plot x.png --figure rose", 2, "draws one series"),
    ("compare out.csv --summary --differences", 2, "print different tables"),
    ("compare nowhere.csv", 2, "nowhere.csv"),
    ("compare head.csv -o out.csv", 1, "the tables hold no frames"),
    ("compare head.csv --summary --no-paper-line", 2, "goes with --plot FILE"),
    ("compare row.csv --differences", 1, "hold no two variants of one frame"),
    ("compare map.csv", 1, "a table of scanfab map, which scanfab report shows"),
    ("compare row.csv --variants ab", 1, "expected variants of the tables, c, found 'ab'"),
    ("compare row.csv --variants x", 2, "--variants: expected letters out of abcd, found 'x'"),
    ("report row.csv -o r.pdf", 2, "reports are HTML"),
    ("report row.csv -o nowhere/r.html", 2, "there is no folder"),
    (
        "report row.csv --label a --label b -o r.html",
        2,
        "--label: expected one per table: 1, found 2",
    ),
    ("report row.csv", 2, "Missing option '-o'"),
    ("report head.csv -o old.html", 1, "nothing to report"),
    ("convert cube - --to csv", 2, "nothing is written to standard output"),
    ("view cube --screenshot x.jpg", 2, "screenshots are PNG files"),
    ("view cube --screenshot absent/x.png", 2, "there is no folder absent to write to"),
    # what does not fit the sample
    ("compute notes", 1, "no reader knows this format"),
    ("compute cube --spacing 50 -o out.csv", 1, "spacing: expected a length from"),
    ("calibrate one", 1, "variant c has no void fabric at any cut-off"),
    ("calibrate none", 1, "no frame has grains, so there is nothing to calibrate"),
    ("view cube --screenshot x.png --frame 9", 1, "there is no frame 9"),
    # what is of space, of discs
    ("compute {DISCS} --axis 0,1,1", 2, "--axis: the axis (0, 0.7071, 0.7071) leads out of"),
    ("map {DISCS}", 2, "a map needs spheres, but all grains are discs"),
]


@pytest.mark.parametrize(("line", "code", "message"), LINES)
def test_one_message_and_nothing_else(tmp_path, monkeypatch, ask, line, code, message):
    """Nor is any file touched, such as a result of earlier days."""
    monkeypatch.chdir(tmp_path)
    dumps = {
        f"{name}/dump_0.txt": dump_text(cubic_rows()[:count], box=((0, 4),) * 3)
        for name, count in (("cube", 64), ("other", 64), ("one", 1), ("none", 0))
    }
    for name, text in {**FILES, **dumps}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        write(tmp_path / name, text)
    answer = ask(*shlex.split(line.format(DISCS=DISCS)), code=code)
    assert message in answer.told
    assert "error: " in answer.err.lower()
    assert answer.out == ""
    left = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert {str(path.relative_to(tmp_path)): path.read_text() for path in left} == {
        **FILES,
        **dumps,
    }


# no command writes over a file that it reads, by whatever name or link

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--variants", "a", "--quiet")


@pytest.fixture
def files(tmp_path, monkeypatch, ask):
    """A packing as CSV with a link to it, and its table."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "dump.1", dump_text(cubic_rows(), box=((0, 4),) * 3))
    ask("convert", "dump.1", "g.csv", "--quiet")
    (tmp_path / "link.csv").symlink_to("g.csv")
    ask("compute", "g.csv", *FAST, "-o", "t.csv")
    return {path.name: path.read_bytes() for path in tmp_path.iterdir()}


OVER_INPUTS = [
    ("compute", "g.csv", *FAST, "-o", "g.csv"),
    ("compute", "link.csv", *FAST, "-o", "./g.csv"),
    ("compute", "g.csv", *FAST, "-o", "u.csv", "--manifest", "g.csv"),
    ("map", "g.csv", "--slices", "1", *FAST, "-o", "g.csv"),
    ("calibrate", "g.csv", "-o", "g.csv"),
    ("compare", "t.csv", "-o", "t.csv"),
    ("merge", "t.csv", "-o", "t.csv"),
    ("convert", "g.csv", "g.csv"),
    ("convert", "g.csv", "link.csv", "--frames", "0:0"),
    ("compute", "dump.1", "--strain", "t.csv", *FAST, "-o", "t.csv"),
]


@pytest.mark.parametrize("command", OVER_INPUTS)
def test_an_output_that_is_an_input_is_refused(files, tmp_path, ask, command):
    answer = ask(*command, code=2)
    assert "input" in answer.told or "chooses none" in answer.told
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == files


def test_a_device_takes_a_table_and_an_old_table_is_replaced(files, tmp_path, ask):
    before = sys.stdout
    ask("compute", "g.csv", *FAST, "-o", "/dev/null")
    ask("compute", "g.csv", *FAST, "-o", "/dev/null", "--plot", "x.doc", code=2)
    assert sys.stdout is before
    assert not sys.stdout.closed
    # an old table beside the dumps is no input
    (tmp_path / "dumps").mkdir()
    shutil.copy("dump.1", "dumps")
    for _ in range(2):
        ask("compute", "dumps", *FAST, "-o", "dumps/t.csv")
