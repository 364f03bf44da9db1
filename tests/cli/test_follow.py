"""A running simulation is followed: the rows, and bytes, of a run over the finished folder."""

import os
import shutil
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

import scanfab
from scanfab.base.errors import ReadError, SettingsError
from scanfab.cli.main import run
from tests.helpers.dumps import cubic_rows, dump_text, pairs_text
from tests.helpers.growing import in_halves, meanwhile, sample_frames, until
from tests.helpers.interruptions import FAST, PROGRAM

QUICK = (*FAST, "--workers", "1")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder; files that do not change for a tenth of a second are taken for complete."""
    monkeypatch.setattr("scanfab.io.follow.QUIET", 0.1)
    monkeypatch.setattr("scanfab.io.follow.PAUSE", 0.01)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dumps").mkdir()
    return tmp_path / "dumps"


@pytest.fixture
def files(series):
    """The dumps of a finished series."""
    return sorted(series.iterdir())


def copied(folder: Path, files: list[Path], pause: float = 0.02) -> list:
    """Steps that write these files one after the other."""
    return [partial(in_halves, path.read_bytes(), folder / path.name, pause) for path in files]


def follow(*words: str, seconds: float) -> int:
    return run(["compute", "dumps", *QUICK, "--follow-for", str(seconds), "-o", "t.csv", *words])


def finished_run(*words: str) -> bytes:
    assert run(["compute", "dumps", *QUICK, "-o", "finished.csv", *words]) in (0, 1)
    return Path("finished.csv").read_bytes()


def is_followed(steps: list, frames: int, *words: str) -> bool:
    """Whether a run beside these steps ends with its last frame, and the bytes of a run behind."""
    words = ("--frames", f":{frames}", *words)
    thread = meanwhile(steps)
    assert follow(*words, seconds=30) == 0
    thread.join()
    assert not Path("t.csv.part").exists()
    return Path("t.csv").read_bytes() == finished_run(*words)


def test_an_empty_folder_waits_for_frames(folder, series):
    """That are whole files: cut ones cannot be read."""
    Path("converted").mkdir()
    assert run(["convert", str(series), "converted/f_{step}.npz"]) == 0
    files = sorted(Path("converted").iterdir())
    assert is_followed([partial(time.sleep, 0.2), *copied(folder, files)], 4)


@pytest.mark.parametrize("beside", ["dumps", "pairs"])
def test_grains_wait_for_their_contacts(folder, beside):
    """As VTK, packed; contact files, of another folder too, come long after their grains."""
    pairs, steps = folder.with_name(beside), []
    pairs.mkdir(exist_ok=True)
    for grains, contacts in sample_frames()[:2]:
        steps += [*copied(folder, [grains]), partial(time.sleep, 0.3), *copied(pairs, [contacts])]
    words = () if pairs == folder else ("--contacts", beside)
    assert is_followed(steps, 2, "--boundary", "mask=3", *words)
    data = Path("t.csv").read_bytes()
    assert b",file," in data
    assert b",geometric," not in data


def test_a_folder_with_contact_files_only_waits(folder):
    (folder / "pairs_0.txt").write_text(pairs_text(step=0))
    write_it = partial(in_halves, dump_text(cubic_rows()).encode(), folder / "dump_0.txt", 0.1)
    assert is_followed([partial(time.sleep, 0.2), write_it], 1, "--reference", "0")


def test_one_file_that_grows(folder, files):
    growing = folder / "dump.txt"
    growing.write_bytes(b"")

    def append(part: bytes) -> None:
        with open(growing, "ab") as stream:
            stream.write(part)
        time.sleep(0.05)

    texts = [path.read_bytes() for path in files]
    halves = [half for text in texts for half in (text[: len(text) // 2], text[len(text) // 2 :])]
    assert is_followed([partial(append, half) for half in halves], 5)


def has_rows(frames: int) -> bool:
    part = Path("t.csv.part")
    return part.exists() and part.read_text().count("\n") > frames


def test_the_first_signal_ends_it_in_order(folder, files, capfd):
    """And it is gone on with, and ended, in the same way."""
    # what is taken over is one line of the part
    for sent, count, lines in ((signal.SIGINT, 2, 2), (signal.SIGTERM, 4, 3)):
        for path in files[:count]:
            shutil.copy(path, folder)
        half = folder / files[count].name
        cut = partial(half.write_bytes, files[count].read_bytes()[:300])
        there = partial(until, partial(has_rows, lines))
        thread = meanwhile([there, cut, partial(os.kill, os.getpid(), sent)])
        assert run(["compute", "dumps", *QUICK, "--follow", "-o", "t.csv", "--resume"]) == 0
        thread.join()
        assert "finishing frames under way" in capfd.readouterr().err
        assert not Path("t.csv.part").exists()
        half.unlink()
        assert Path("t.csv").read_bytes() == finished_run()


def test_a_second_signal_interrupts(folder):
    (folder / "dump_0.txt").write_text(dump_text(cubic_rows(), box=((0, 4),) * 3))
    words = [*PROGRAM, "compute", "dumps", *QUICK, "--follow", "-o", "t.csv"]
    with subprocess.Popen(words) as process:
        for sent in (signal.SIGSTOP, signal.SIGTERM, signal.SIGINT, signal.SIGCONT):
            process.send_signal(sent)
            time.sleep(0.05)
        assert process.wait(60) in (130, 143, -signal.SIGINT, -signal.SIGTERM)
    assert not Path("t.csv").exists()


def test_without_any_frame_the_table_has_no_rows_and_each_note_is_told_once(folder, series, capsys):
    (folder / "log.txt").write_text("nothing yet\n")
    assert follow(seconds=0.1) == 0
    assert Path("t.csv").read_text().count("\n") == 1
    assert "scanfab: note: dumps: no reader knows" in capsys.readouterr().err
    shutil.copytree(series, folder, dirs_exist_ok=True)
    assert follow(seconds=0.3) == 0
    assert capsys.readouterr().err.count("skipped log.txt") == 1


def test_a_broken_file_stops_it_or_is_skipped_and_a_last_one_left_out(folder, files, capsys):
    broken, half = folder / files[1].name, files[1].read_bytes()[:300]
    shutil.copy(files[0], folder)
    broken.write_bytes(half)
    assert follow(seconds=0.3) == 0
    told = f"warning: dumps/{broken.name}: left out, because it was incomplete"
    assert told in capsys.readouterr().err
    broken.unlink()
    assert Path("t.csv").read_bytes() == finished_run()
    for path in files[2:]:
        shutil.copy(path, folder)
    broken.write_bytes(half)
    assert follow(seconds=0.3) == 1
    assert f"dumps/{broken.name}" in capsys.readouterr().err
    assert Path("t.csv.part").read_text().count("\n") == 2
    assert follow("--on-error", "skip", seconds=0.3) == 1
    assert Path("t.csv").read_bytes() == finished_run("--on-error", "skip")


def test_strains_that_are_added_are_taken_and_a_cut_snapshot_is_told(folder, files, capsys):
    strains = Path("strains.csv")
    strains.write_text("step,strain\n0,0\n")
    shutil.copy(files[0], folder)
    steps = [
        partial(until, partial(has_rows, 1)),
        partial(strains.write_text, "step,strain\n0,0\n100,0.5\n"),
        *copied(folder, files[1:2]),
    ]
    assert is_followed(steps, 2, "--strain", "strains.csv", "--contacts", "geometric")
    (folder / "all.txt").write_bytes(files[0].read_bytes() + files[1].read_bytes()[:200])
    capsys.readouterr()
    assert run(["compute", "dumps/all.txt", *QUICK, "--follow-for", "0.3"]) == 0
    assert "the last snapshot, number 2, is incomplete and is left out" in capsys.readouterr().err


def test_a_folder_that_vanishes_is_named_and_nothing_is_lost(folder, series, files, capsys):
    for path in files[:2]:
        shutil.copy(path, folder)
    there = partial(until, partial(has_rows, 2))
    thread = meanwhile([there, partial(shutil.rmtree, folder)])
    assert follow("--on-error", "skip", seconds=30) == 1
    thread.join()
    (error,) = [one for one in capsys.readouterr().err.splitlines() if "error" in one]
    assert error.startswith("scanfab: error: dumps: has vanished while it was followed, after 2 ")
    assert "--resume" in error
    shutil.copytree(series, folder)
    assert follow("--resume", "--on-error", "skip", seconds=0.3) == 0
    assert Path("t.csv").read_bytes() == finished_run()


def test_files_that_change_before_the_next_frame_are_an_error(folder, files):
    for path in files[1:3]:
        shutil.copy(path, folder)
    growing, other = (iter(scanfab.follow_series(folder, seconds=5)) for _ in range(2))
    for frames in (growing, other):
        assert [next(frames).number, next(frames).number] == [0, 1]
    with open(folder / files[2].name, "a") as stream:
        stream.write("\n")
    with pytest.raises(ReadError, match=f"{files[2].name}: was read as frame 1, but since then"):
        next(growing)
    for path in (files[2], files[0]):
        shutil.copy(path, folder)
    with pytest.raises(ReadError, match=f"{files[1].name}: was read as frame 0, but since then"):
        next(other)


def test_the_plot_is_drawn_again(folder, files, monkeypatch):
    drawn, save = [], "scanfab.viz.figures.figure.save_figures"
    monkeypatch.setattr(save, lambda path, figures: drawn.append(path))
    steps = [*copied(folder, files[:2]), partial(until, lambda: drawn), *copied(folder, files[2:])]
    assert is_followed(steps, 5, "--plot", "p.png", "--figure", "evolution")
    assert len(drawn) >= 3


def test_what_cannot_be_followed_is_refused(folder):
    with pytest.raises(ReadError, match="found nothing"):
        scanfab.follow_series("no such folder")
    with pytest.raises(SettingsError, match="seconds: expected 0 or more"):
        scanfab.follow_series(folder, seconds=-1)
