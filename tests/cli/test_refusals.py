"""What cannot be: one message and the exit code, no file touched; and broken frames."""

import errno
import json
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import FAST, PROGRAM
from tests.helpers.tables import curve
from tests.helpers.truth import SAMPLE_DATA

FILES = {
    "out.csv": "precious",
    "notes": "-",
    "g.csv": "x,y,z,radius\n1,1,1,1\n1,1,3,1\n",
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
    ("computee", 2, "there is no command 'computee': did you mean 'compute'?"),
    ("compute nowhere", 2, "nowhere: there is no such file, folder or glob"),
    ("compute -", 2, "standard input needs --format"),
    ("compute - . --format table", 2, "cannot be combined with other sources"),
    # values of options
    ("compute cube --format nonsense", 2, "there is no reader called 'nonsense', only edem"),
    ("compute cube --columns radius", 2, "--columns: expected NAME=COLUMN"),
    ("compute cube --follow-for -1", 2, "--follow-for"),
    ("compute cube --follow-for 0 --frames -2:", 1, "counts from the end of the series"),
    ("compute cube --follow-for 0 --frames :-1", 1, "counts from the end of the series"),
    ("compute cube --follow-for 0 --frames ::-1", 1, "counts from the end of the series"),
    ("compute cube cube/dump_0.txt --follow", 2, "--follow takes one folder, or one file"),
    ("compute cube --rv -1 -o out.csv", 2, "--rv: expected a fraction above 0"),
    ("map cube --slices 2 --frame 1", 2, "--frame: there is no frame 1: cube has 1, counted"),
    ("map cube --slices 2 --frame 0 --frames 0", 2, "--frame"),
    ("map cube --grid 2,2", 2, "three numbers of blocks, such as 4,4,8, found '2,2'"),
    # files to be written
    ("compute cube -o table.docx", 2, "results can be written as .csv"),
    ("compute cube --fields frame,alpha_v", 2, "no column 'alpha_v': did you mean 'alpha_vs'?"),
    ("compute cube --resume", 2, "--resume needs -o FILE"),
    ("compute cube --vtk v --scheduler tcp://x:1", 2, "--vtk cannot be used with --scheduler"),
    ("compute cube --scheduler x --scheduler-file f", 2, "--scheduler"),
    ("compute cube --vtk out.csv/vtk", 2, "out.csv/vtk"),
    ("compute cube --figure rose", 2, "--figure goes with --plot FILE"),
    ("compute cube --plot x.docx", 2, "figures can be written as .png, .svg, .pdf, not as"),
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
    ("report row.csv -o r.pdf", 2, "reports are HTML"),
    ("report row.csv -o nowhere/r.html", 2, "there is no folder"),
    ("report row.csv --label a --label b -o r.html", 2, "expected one per table: 1, found 2"),
    ("report head.csv -o r.html", 1, "nothing to report"),
    ("convert cube - --to csv", 2, "nothing is written to standard output"),
    ("view cube --screenshot x.jpg", 2, "screenshots are PNG files"),
    ("view cube --screenshot absent/x.png", 2, "there is no folder absent to write to"),
    # what does not fit the sample
    ("compute notes", 1, "no reader knows this format"),
    ("compute cube --spacing 50 -o out.csv", 1, "spacing: expected a length from"),
    ("calibrate one --tolerance 0.1 --max-chords 1e5", 1, "variant c has no void fabric at any"),
    ("calibrate none", 1, "no frame has any grains"),
    ("view cube --screenshot x.png --frame 9", 1, "there is no frame 9"),
    # an output that is an input, by whatever name or link
    ("compute g.csv -o g.csv", 2, "g.csv: would replace the input g.csv"),
    ("compute link.csv -o ./g.csv", 2, "g.csv: would replace the input link.csv"),
    ("compute g.csv -o u.csv --manifest g.csv", 2, "would replace the input"),
    ("compute cube --strain row.csv -o row.csv", 2, "would replace the input"),
    ("map g.csv --slices 1 -o g.csv", 2, "would replace the input"),
    ("calibrate g.csv -o g.csv", 2, "would replace the input"),
    ("compare row.csv -o row.csv", 2, "would replace the input"),
    ("merge row.csv -o row.csv", 2, "would replace the input"),
    ("convert g.csv link.csv", 2, "would replace the input"),
    ("convert g.csv link.csv --frames 0:0", 2, "--frames chooses none"),
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
    before = {**FILES, **dumps}
    for name, text in before.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        write(tmp_path / name, text)
    os.symlink("g.csv", "link.csv")
    answer = ask(*shlex.split(line.format(DISCS=DISCS)), code=code)
    assert message in answer.told
    assert "error: " in answer.err.lower()
    assert answer.out == ""
    assert os.readlink("link.csv") == "g.csv"
    left = [path for path in tmp_path.rglob("*") if path.is_file() and not path.is_symlink()]
    assert {str(path.relative_to(tmp_path)): path.read_text() for path in left} == before


# frames that are broken, or of which little is left


def grains(folder: Path, rows=None, name="dump_0.txt", **options) -> Path:
    """A dump of a small cube of grains, or of the given rows."""
    rows = cubic_rows() if rows is None else rows
    return write(folder / name, dump_text(rows, box=((0, 4),) * 3, **options))


def test_a_device_takes_a_table_and_an_old_table_beside_the_dumps_is_no_input(tmp_path, ask):
    grains(tmp_path)
    for output in ("/dev/null", tmp_path / "t.csv", tmp_path / "t.csv"):
        ask("compute", tmp_path, *FAST, "-o", output)


def changed(column: int, value: object) -> list[list[object]]:
    """The cube's rows with another value for the grain 7."""
    rows = [list(row) for row in cubic_rows()]
    rows[6][column] = value
    return rows


def test_broken_frames_can_be_skipped_also_the_first(tmp_path, ask):
    """Of three frames two have a radius of zero."""
    for frame, rows in enumerate((changed(5, 0), changed(5, 0), cubic_rows())):
        grains(tmp_path, rows, name=f"dump_{frame}.txt", step=frame)
    answer = ask("compute", *FAST, tmp_path, "--on-error", "skip", code=1)
    assert {row["frame"] for row in answer.rows} == {"2"}
    assert f"frame 1 skipped: {tmp_path}/dump_1.txt: grain 7" in answer.err


def test_one_grain_far_away_is_too_far_for_the_whole_alone(tmp_path, ask):
    file = grains(tmp_path, changed(4, 4000.0))
    assert "far away from all others" in ask("compute", *FAST, file, code=1).err
    assert '--boundary "id=7"' in ask("compute", *FAST, file, "--variants", "c").err


def test_an_rv_at_the_surface_is_a_warning(tmp_path, ask):
    file, told = grains(tmp_path, cubic_rows(8)), "comes closer to the sample's surface than the"
    for rv, is_told in (("0.9", True), ("0.7", False)):
        assert (told in ask("compute", *FAST, file, "--rv", rv, "--variants", "c").err) == is_told


def test_grains_that_are_removed_leave_no_void_fabric_and_no_solid(tmp_path, ask):
    answer = ask("compute", *FAST, grains(tmp_path), "--min-contacts", "99", "--variants", "abd")
    whole, without, inside = answer.rows
    assert whole["alpha_vs"] != ""
    assert without["alpha_vs"] == without["coordination"] == without["alpha_c"] == ""
    assert (without["grains"], without["rattlers"], without["contacts"]) == ("0", "64", "0")
    assert (inside["solid_fraction"], inside["alpha_vs"], inside["mean_length"]) == ("0.0", "", "")
    assert "nan" not in answer.out.lower()
    assert "variant b: no grain but rattlers is left" in answer.err
    assert "variant d: no grain but rattlers reaches into the RV" in answer.err
    alone = ask("compute", *FAST, grains(tmp_path, cubic_rows()[:1]), "--variants", "abc", code=1)
    assert {row["alpha_vs"] for row in alone.rows} == {""}


FORBIDDEN = [
    ("scanfab.io.files.open", ()),
    ("os.listdir", ()),
    ("pathlib.Path.write_text", ("-o", "{}/table.csv")),
]


@pytest.mark.parametrize(("where", "words"), FORBIDDEN)
def test_what_nobody_may_read_or_write(tmp_path, ask, monkeypatch, where, words):
    def forbidden(path, *_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    grains(tmp_path)
    monkeypatch.setattr(where, forbidden, raising=False)
    answer = ask("compute", *FAST, tmp_path, *(word.format(tmp_path) for word in words), code=1)
    assert answer.out == ""
    assert re.search(rf"error: {tmp_path}.*Permission denied", answer.err)
    assert not (tmp_path / "table.csv").exists()


CLOSED = [
    ("formats >&-", "standard output is closed"),
    ("compute - --format liggghts <&-", "standard input: expected a dump"),
]


@pytest.mark.skipif(shutil.which("sh") is None, reason="needs a POSIX shell to close a stream")
@pytest.mark.parametrize(("words", "message"), CLOSED)
def test_a_standard_stream_that_is_closed(words, message):
    command = ["sh", "-c", f"{shlex.join(PROGRAM)} {words}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert message in done.stderr
    assert not re.search("Traceback|Exception", done.stderr)
