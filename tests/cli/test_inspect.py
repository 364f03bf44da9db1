"""scanfab inspect: JSON for scripts, lines for people."""

from __future__ import annotations

import json

import pytest

from scanfab.cli.main import run
from tests.helpers.dumps import cubic_rows, dump_text, pairs_text, write

KEYS = (
    "source frame step time format grains boundary radius_min radius_max contacts contacts_from "
    "rattlers coordination cell periodic columns warnings low high rv_center rv_radius rv_shape "
    "clumps spheres"
)


@pytest.fixture
def series(tmp_path):
    """Two frames in a box that is periodic along x and y; the first one has a contact file."""
    for frame in (0, 1):
        text = dump_text(cubic_rows(), step=10 * frame, box=((0, 4),) * 3, flags=" pp pp ff")
        write(tmp_path / f"dump_{frame}.txt", text)
    write(tmp_path / "pairs_0.txt", pairs_text())
    return tmp_path


@pytest.fixture
def inspect(capsys):
    def ask(*words: object) -> tuple[str, str]:
        assert run(["inspect", *map(str, words)]) == 0
        printed = capsys.readouterr()
        return printed.out, printed.err

    return ask


def test_json_is_an_object_a_line_with_the_keys_that_scripts_rely_on(series, inspect):
    out, _ = inspect(series, "--json")
    frames = [json.loads(line) for line in out.splitlines()]
    assert [list(frame) for frame in frames] == [KEYS.split()] * 2
    assert [(frame["frame"], frame["step"]) for frame in frames] == [(0, 0), (1, 10)]


def test_json_says_what_the_reader_sees(series, inspect):
    out, _ = inspect(series, "--json", "--boundary", "id>=63", "--frames", "0")
    frame = json.loads(out)
    assert (frame["source"], frame["format"]) == (str(series), "liggghts")
    assert (frame["grains"], frame["boundary"]) == (62, 2)
    assert (frame["contacts"], frame["contacts_from"]) == (2, "file")
    assert frame["cell"] == [[4, 0, 0], [0, 4, 0], [0, 0, 4]]
    assert frame["periodic"] == [True, True, False]
    assert set(frame["columns"]) == {"id", "type", "x", "y", "z", "radius"}
    assert 0 < frame["radius_min"] < frame["radius_max"]
    assert frame["time"] is None


def test_warnings_of_a_frame_stand_with_it(series, inspect):
    out, _ = inspect(series, "--json")
    first, second = (json.loads(line)["warnings"] for line in out.splitlines())
    assert first == []
    assert "no contact file for step 10" in second[0]


def test_people_get_lines_without_colour(series, inspect):
    out, _ = inspect(series)
    assert f"{series}, frame 1" in out
    assert "contacts_from geometric" in out
    assert "\x1b" not in out


def test_it_takes_the_reading_options_of_compute(tmp_path, inspect):
    file = write(tmp_path / "dump.txt", dump_text(names="id type x y z mass"))
    words = ("--radius", "0.2", "--cell", "1", "1", "1", "--periodic", "z", "--format", "liggghts")
    frame = json.loads(inspect(file, "--json", *words)[0])
    assert frame["radius_max"] == 0.2
    assert frame["periodic"] == [False, False, True]


def test_a_settings_file_is_told(series, inspect):
    write(series / "scanfab.toml", '[compute]\nboundary = "id>=63"\n')
    out, err = inspect(series, "--json")
    assert json.loads(out.splitlines()[0])["boundary"] == 2
    assert f"options from {series}/scanfab.toml" in err


def test_nothing_is_printed_of_a_broken_file(tmp_path, capsys):
    file = write(tmp_path / "dump.txt", dump_text()[:-20])
    assert run(["inspect", str(file), "--json"]) == 1
    printed = capsys.readouterr()
    assert printed.out == ""
    assert str(file) in printed.err
