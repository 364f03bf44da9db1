"""Sources as users name them: globs, and standard input, which messages call by that name."""

import gzip
import json

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, write

CASES = {
    "x,y,z\n1,2,3\n": "scanfab: error: standard input: no radius",
    "x,y,z,radius\n1,2,3,nan\n": "scanfab: error: standard input: grain 0: position and radius",
    "x,y,z,radius\n1,2,3,4\n1,2,3": "scanfab: error: standard input, line 3: expected 4 columns",
    "x,y,z,radius\n1,2,3,4": " standard input: the last line has no end",
}


class Stdin:
    """Bytes that another program has written."""

    def __init__(self, buffer):
        self.buffer = buffer


@pytest.fixture
def by_stdin(tmp_path, monkeypatch, ask):
    def told(data, *words, code=0):
        file = tmp_path / "stdin"
        file.write_bytes(data)
        with open(file, "rb") as stream:
            monkeypatch.setattr("sys.stdin", Stdin(stream))
            return ask(*words, "-", "--format", "table", code=code)

    return told


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(("text", "message"), CASES.items())
def test_errors_and_warnings_name_standard_input(by_stdin, text, message, packed):
    data = gzip.compress(text.encode()) if packed else text.encode()
    answer = by_stdin(data, "inspect", "--verbose", code=int("error" in message))
    assert message in answer.err + answer.out
    assert "scanfab-" not in answer.err + answer.out


def test_so_do_warnings_in_results_and_manifests(by_stdin, tmp_path):
    answer = by_stdin(b"x,y,z,radius\n1,2,3,4", "inspect", "--json")
    assert json.loads(answer.out)["warnings"][0].startswith("standard input: the last line")
    words = ("compute", "--on-error", "skip", "-o", tmp_path / "out.csv")
    by_stdin(b"x,y,z,radius\n1,2,3,-4\n", *words, code=1)
    (first, *_) = json.loads((tmp_path / "out.csv.manifest.json").read_text())["warnings"]
    assert first.startswith("frame 0 skipped: standard input: grain 0: the radius")


def test_notes_name_the_series_if_there_are_several(ask, tmp_path):
    for name in ("loose", "dense"):
        (tmp_path / name).mkdir()
        write(tmp_path / name / "dump_0.txt", dump_text(cubic_rows(2)))
    words = ("--variants", "a", "--directions", "9", "--spacing", "0.5rmin")
    told = ask("compute", tmp_path / "loose", tmp_path / "dense", *words).err
    for name in ("loose", "dense"):
        assert f"note: {tmp_path / name}, frame 0, variant a: fewer than 10 grains" in told
    assert "note: frame 0, variant a: few" in ask("compute", tmp_path / "loose", *words).err
