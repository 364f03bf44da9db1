"""What is said beside the result: progress, --quiet and --verbose."""

import logging
import re
import time

import pytest

from scanfab.cli import console
from scanfab.cli.console import working
from tests.helpers.dumps import write
from tests.helpers.interruptions import write_series

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "ac")


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    folder = write_series(tmp_path_factory.mktemp("talk") / "series", 3)
    write(folder / "scanfab.toml", "[compute]\nrv = 0.6\n")
    return folder


@pytest.fixture
def said(series, ask):
    """Standard output, and what was said, as lines."""

    def call(command: str, *words: str, code: int = 0) -> tuple[str, list[str]]:
        answer = ask(command, series, *words, code=code)
        return answer.out, answer.err.splitlines()

    return call


def notes(lines: list[str]) -> list[str]:
    return [line for line in lines if line.startswith("scanfab: note: ")]


def test_quiet_leaves_out_notes_but_no_warning_and_no_error(said):
    words = (*FAST[2:], "--directions", "equal-angle:30")
    # first, as kernels that no earlier run has needed are compiled with a word
    quiet_result, quiet = said("compute", *words, "--quiet")
    result, lines = said("compute", *words)
    assert result == quiet_result
    assert len(notes(lines)) > 1
    assert [line for line in lines if line not in notes(lines)] == quiet
    assert any("an isotropic sample would get alpha = " in line for line in quiet)
    _, lines = said("compute", "--quiet", "--boundary", "type=9", code=1)
    assert lines[-1].startswith("scanfab: error: --boundary: no particle of any frame has type=9")


def test_verbose_says_what_is_used_and_how_long_each_frame_takes(said, series):
    result, lines = said("compute", *FAST, "--verbose", "--workers", "2")
    text = "\n".join(lines)
    assert re.search(r"scanfab: scanfab \S+, numpy [\d.]+, numba [\d.]+, Python .*; 2 work", text)
    assert f"scanfab: {series}: grains from {series}/dump_*.txt by liggghts, 3 files" in lines
    found = re.findall(rf"scanfab: {series}: frame (\d): 64 grains in [\d.e-]+ s", text)
    assert sorted(found) == ["0", "1", "2"]
    assert result == said("compute", *FAST)[0]


@pytest.mark.parametrize(
    ("words", "every", "says"), [((), 0.002, 1), (("--quiet",), 0.002, 0), ((), 60.0, 0)]
)
def test_a_log_gets_a_line_of_progress_each_minute(said, monkeypatch, words, every, says):
    """Here of a few milliseconds; nothing in a run that takes less."""
    assert console.EVERY == 60.0
    monkeypatch.setattr(console, "EVERY", every)
    _, lines = said("compute", "--tolerance", "2e-3", "--workers", "1", "--variants", "ac", *words)
    states = [line for line in lines if re.match(r"scanfab: \d of 3 frames", line)]
    assert bool(states) == bool(says)
    if states:
        assert states[0].startswith("scanfab: 0 of 3 frames")
        assert any(re.match(r"scanfab: [12] of 3 frames, about \d+ s; ", line) for line in states)


def test_time_that_is_left_follows_from_the_frames_of_this_run(monkeypatch):
    """Those that an earlier run has finished took no time."""
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    with working(lambda: 20, 8) as advance:
        work = advance.__self__
        now[0] = 30.0
        advance()
        logging.getLogger("scanfab").info("frame 9: done")
        assert work.state() == "9 of 20 frames, about 6 min; frame 9: done"


@pytest.mark.parametrize(("level", "has_bar"), [("", True), ("verbose", False)])
def test_a_terminal_has_a_bar_unless_each_step_is_a_line(monkeypatch, level, has_bar):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr(console, "level", lambda: level)
    with working(lambda: 3) as advance:
        assert (advance.__self__.bar is not None) == has_bar


def test_the_library_is_listened_to_no_longer_than_it_works():
    logger = logging.getLogger("scanfab")
    before = (list(logger.handlers), logger.level)
    with working(lambda: 3):
        assert logger.handlers != before[0]
    assert (logger.handlers, logger.level) == before
