"""Bad input: the message, the exit code, and what is left of the result."""

import errno
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import FAST, PROGRAM


def grains(folder: Path, rows=None, name="dump_0.txt", **options) -> Path:
    """A dump of a small cube of grains, or of the given rows."""
    rows = cubic_rows() if rows is None else rows
    return write(folder / name, dump_text(rows, box=((0, 4),) * 3, **options))


def changed(column: int, value: object) -> list[list[object]]:
    """The cube's rows with another value for the grain 7."""
    rows = [list(row) for row in cubic_rows()]
    rows[6][column] = value
    return rows


def test_a_broken_frame_can_be_skipped_also_the_first(tmp_path, ask):
    """Of three frames the second one has a radius of zero, then the first one, too."""
    for frame, rows in enumerate((cubic_rows(), changed(5, 0), cubic_rows())):
        grains(tmp_path, rows, name=f"dump_{frame}.txt", step=frame)
    answer = ask("compute", *FAST, tmp_path, "--on-error", "skip", code=1)
    assert [row["frame"] for row in answer.rows] == list("0022")
    assert f"frame 1 skipped: {tmp_path}/dump_1.txt: grain 7" in answer.err
    grains(tmp_path, changed(5, 0), step=0)
    answer = ask("compute", *FAST, tmp_path, "--on-error", "skip", code=1)
    assert {row["frame"] for row in answer.rows} == {"2"}


def test_one_grain_far_away_is_too_far_for_the_whole_alone(tmp_path, ask):
    file = grains(tmp_path, changed(4, 4000.0))
    assert "far away from all others" in ask("compute", *FAST, file, code=1).err
    assert '--boundary "id=7"' in ask("compute", *FAST, file, "--variants", "c").err


def test_an_rv_at_the_surface_is_a_warning(tmp_path, ask):
    file, told = grains(tmp_path, cubic_rows(8)), "comes closer to the sample's surface than the"
    for rv, is_told in (("0.9", True), ("0.7", False)):
        assert (told in ask("compute", *FAST, file, "--rv", rv).err) == is_told


def test_grains_that_are_removed_leave_no_void_fabric_and_no_solid(tmp_path, ask):
    answer = ask("compute", *FAST, grains(tmp_path), "--min-contacts", "99", "--variants", "abd")
    whole, without, inside = answer.rows
    assert whole["alpha_vs"] != ""
    assert without["alpha_vs"] == without["coordination"] == without["alpha_c"] == ""
    assert (without["grains"], without["rattlers"], without["contacts"]) == ("0", "64", "0")
    assert (inside["solid_fraction"], inside["alpha_vs"], inside["mean_length"]) == ("0.0", "", "")
    assert "nan" not in answer.out.lower()
    assert "variant b: no grain is left, all 64 are rattlers" in answer.err
    assert "variant d: no grain is left, all 33 that reach into the RV" in answer.err
    alone = ask("compute", *FAST, grains(tmp_path, cubic_rows()[:1]), "--variants", "abc", code=1)
    assert {row["alpha_vs"] for row in alone.rows} == {""}
    assert "nan" not in alone.out.lower()


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
    ("inspect FILE >&-", "standard output is closed"),
    ("formats >&-", "standard output is closed"),
    ("compute - --format liggghts <&-", "standard input: expected a dump"),
]


@pytest.mark.skipif(shutil.which("sh") is None, reason="needs a POSIX shell to close a stream")
@pytest.mark.parametrize(("words", "message"), CLOSED)
def test_a_standard_stream_that_is_closed(tmp_path, words, message):
    command = f"{shlex.join(PROGRAM)} {words.replace('FILE', str(grains(tmp_path)))}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception" not in done.stderr
