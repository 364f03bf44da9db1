"""What is said beside the result: progress, --quiet and --verbose."""

from __future__ import annotations

import logging
import re
import time

import pytest

from scanfab.cli import talk
from scanfab.cli.main import run
from scanfab.cli.talk import working
from tests.helpers.dumps import write
from tests.helpers.interruptions import write_series

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin")


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    folder = write_series(tmp_path_factory.mktemp("talk") / "series", 3)
    write(folder / "scanfab.toml", "[compute]\nrv = 0.6\n")
    return folder


@pytest.fixture
def said(series, capsys):
    """Exit code, standard output and what was said, as lines."""

    def ask(command: str, *words: str) -> tuple[int, str, list[str]]:
        code = run([command, str(series), *words])
        printed = capsys.readouterr()
        return code, printed.out, printed.err.splitlines()

    return ask


def notes(lines: list[str]) -> list[str]:
    return [line for line in lines if line.startswith("scanfab: note: ")]


def test_quiet_leaves_out_notes_but_no_warning(said):
    words = ("--directions", "equal-angle:30", "--spacing", "0.5rmin", "--cutoff", "0.2rmin")
    # first, as kernels that no earlier run has needed are compiled with a word
    quiet_code, quiet_result, quiet = said("compute", *words, "--quiet")
    code, result, lines = said("compute", *words)
    assert (code, result) == (quiet_code, quiet_result) == (0, result)
    assert len(notes(lines)) == 1
    assert [line for line in lines if line not in notes(lines)] == quiet
    assert any("an isotropic sample would get alpha = " in line for line in quiet)


def test_quiet_leaves_errors(said):
    _, _, lines = said("compute", "--quiet", "--boundary", "type=9")
    assert lines[-1].startswith("scanfab: error: --boundary: no particle of any frame has type=9")


def test_verbose_says_what_is_used_and_how_long_each_frame_takes(said, series):
    _, result, lines = said("compute", *FAST, "--verbose", "--workers", "2")
    text = "\n".join(lines)
    assert re.search(
        r"scanfab: scanfab [\d.]+, numpy [\d.]+, numba [\d.]+, Python .*; 2 work", text
    )
    assert f"scanfab: {series}: grains from {series}/dump_*.txt by liggghts, 3 files" in lines
    for frame in range(3):
        assert re.search(rf"scanfab: {series}: frame {frame}: 64 grains in [\d.e-]+ s", text)
    assert result == said("compute", *FAST)[1]


def test_verbose_says_how_near_a_long_scan_is(said):
    _, _, lines = said("compute", "--tolerance", "3e-4", "--frames", "0", "--verbose")
    state = r"scanfab: frame 0: error [\d.e-]+ of 0\.0003\d*, about \d+ s"
    assert any(re.fullmatch(state, line) for line in lines)


@pytest.mark.parametrize("command", ["compute", "inspect", "calibrate"])
def test_quiet_and_verbose_exclude_one_another(said, command):
    code, _, lines = said(command, "--quiet", "--verbose")
    assert code == 2
    assert "--quiet and --verbose exclude one another" in lines[-1]


@pytest.mark.parametrize("words", [(), ("--quiet",)])
def test_a_log_gets_a_line_of_progress_each_minute(said, monkeypatch, words):
    """Here of a few milliseconds."""
    monkeypatch.setattr(talk, "EVERY", 0.002)
    _, _, lines = said("compute", "--tolerance", "1e-3", "--workers", "1", *words)
    states = [line for line in lines if re.match(r"scanfab: \d of 3 frames", line)]
    assert bool(states) is not bool(words)
    if states:
        assert states[0].startswith("scanfab: 0 of 3 frames")
        assert any(re.match(r"scanfab: [12] of 3 frames, about \d+ s; ", line) for line in states)


def test_a_run_of_less_than_a_minute_says_nothing(said):
    assert talk.EVERY == 60.0
    _, _, lines = said("compute", *FAST)
    assert not [line for line in lines if " frames" in line]


def test_time_that_is_left_follows_from_the_frames_of_this_run(capsys, monkeypatch):
    """Those that an earlier run has finished took no time."""
    now = iter([0.0, 60.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(now))
    work = talk._Work(lambda: 20, 8)
    work.done += 2
    assert work.state("frame 9: done") == "10 of 20 frames, about 5 min; frame 9: done"


def test_the_library_is_listened_to_no_longer_than_it_works(capsys):
    logger = logging.getLogger("scanfab")
    before = (list(logger.handlers), logger.level)
    with working(lambda: 3):
        assert logger.handlers != before[0]
    assert (logger.handlers, logger.level) == before


def test_inspect_and_calibrate_take_the_words_too(said):
    assert notes(said("inspect", "--quiet")[2]) == []
    _, _, lines = said("inspect", "--verbose")
    assert any("grains from" in line for line in lines)
