"""What inspect says of a source: JSON for scripts, lines for people; of standard input too."""

import gzip
import json

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, pairs_text, write

CASES = {
    "x,y,z\n1,2,3\n": "scanfab: error: standard input: no radius",
    "x,y,z,radius\n1,2,3,nan\n": "scanfab: error: standard input: grain 0: position and radius",
    "x,y,z,radius\n1,2,3,4\n1,2,3": "scanfab: error: standard input, line 3: expected 4 columns",
    "x,y,z,radius\n1,2,3,4": " standard input: the last line has no end",
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(("text", "message"), CASES.items())
def test_errors_and_warnings_name_standard_input(ask, text, message, packed):
    data = gzip.compress(text.encode()) if packed else text.encode()
    words = ("inspect", "--verbose", "-", "--format", "table")
    answer = ask(*words, stdin=data, code=int("error" in message))
    assert message in answer.err + answer.out
    assert "scanfab-" not in answer.err + answer.out


def test_so_do_warnings_in_results_and_manifests(ask, tmp_path):
    words, data = ("-", "--format", "table"), b"x,y,z,radius\n1,2,3,4"
    answer = ask("inspect", *words, "--json", stdin=data)
    assert json.loads(answer.out)["warnings"][0].startswith("standard input: the last line")
    ask("compute", *words, "-o", tmp_path / "out.csv", stdin=data, code=1)
    told = json.loads((tmp_path / "out.csv.manifest.json").read_text())["warnings"]
    assert any("standard input: the last line" in one for one in told)


KEYS = (
    "source frame step time format grains boundary radius_min radius_max contacts contacts_from "
    "rattlers coordination cell periodic columns warnings low high rv_center rv_radius rv_shape "
    "clumps spheres"
)


def test_json_is_an_object_a_line_with_what_the_reader_sees(tmp_path, ask):
    """Of a box that is periodic along x and y; the first frame has a contact file."""
    for frame in (0, 1):
        text = dump_text(cubic_rows(), step=10 * frame, box=((0, 4),) * 3, flags=" pp pp ff")
        write(tmp_path / f"dump_{frame}.txt", text)
    write(tmp_path / "pairs_0.txt", pairs_text())
    told = ask("inspect", "--json", tmp_path, "--boundary", "id>=63").out
    first, second = map(json.loads, told.splitlines())
    assert list(first) == list(second) == KEYS.split()
    assert [(one["frame"], one["step"]) for one in (first, second)] == [(0, 0), (1, 10)]
    expected = {
        "source": str(tmp_path), "format": "liggghts", "grains": 62, "boundary": 2, "contacts": 2,
        "contacts_from": "file", "cell": [[4, 0, 0], [0, 4, 0], [0, 0, 4]], "time": None,
        "periodic": [True, True, False], "warnings": [],
    }  # fmt: skip
    assert {name: first[name] for name in expected} == expected
    assert set(first["columns"]) == {"id", "type", "x", "y", "z", "radius"}
    assert 0 < first["radius_min"] < first["radius_max"]
    assert "no contact file for step 10" in second["warnings"][0]


def test_notes_name_the_series_if_there_are_several(ask, tmp_path):
    for name in ("loose", "dense"):
        (tmp_path / name).mkdir()
        write(tmp_path / name / "dump_0.txt", dump_text(cubic_rows(2)))
    words = ("--variants", "a", "--directions", "9", "--spacing", "0.5rmin")
    told = ask("compute", tmp_path / "loose", tmp_path / "dense", *words).err
    for name in ("loose", "dense"):
        assert f"note: {tmp_path / name}, frame 0, variant a: fewer than 10 grains" in told
    assert "note: frame 0, variant a: few" in ask("compute", tmp_path / "loose", *words).err


def test_inspect_takes_the_options_of_compute(tmp_path, ask):
    file = write(tmp_path / "dump.txt", dump_text(names="id type x y z mass"))
    words = ("--cell", "2", "2", "2", "--radius", "0.2", "--cell", "1", "1", "1", "--periodic", "z")
    frame = json.loads(ask("inspect", "--json", file, *words, "--rv-shape", "cylinder").out)
    assert frame["radius_max"] == 0.2
    assert frame["cell"] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert frame["periodic"] == [False, False, True]
    assert frame["rv_shape"].startswith("cylinder of radius ")
