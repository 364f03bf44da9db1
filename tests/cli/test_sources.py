"""What comes by standard input is called that in all that is told."""

from __future__ import annotations

import gzip
import json

import pytest

from scanfab.cli.main import run

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
def by_stdin(tmp_path, monkeypatch, capsys):
    def told(data, *words):
        file = tmp_path / "stdin"
        file.write_bytes(data)
        with open(file, "rb") as stream:
            monkeypatch.setattr("sys.stdin", Stdin(stream))
            code = run([*words, "-", "--format", "table"])
        return code, capsys.readouterr()

    return told


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(("text", "message"), CASES.items())
def test_errors_and_warnings_name_standard_input(by_stdin, text, message, packed):
    data = gzip.compress(text.encode()) if packed else text.encode()
    code, streams = by_stdin(data, "inspect", "--verbose")
    assert code == int("error" in message)
    assert message in streams.err + streams.out
    assert "scanfab-" not in streams.err + streams.out


def test_so_do_warnings_in_results_and_manifests(by_stdin, tmp_path):
    _, streams = by_stdin(b"x,y,z,radius\n1,2,3,4", "inspect", "--json")
    assert json.loads(streams.out)["warnings"][0].startswith("standard input: the last line")
    out = tmp_path / "out.csv"
    words = ("compute", "--on-error", "skip", "-o", str(out))
    by_stdin(b"x,y,z,radius\n1,2,3,-4\n", *words)
    (first, *_) = json.loads((tmp_path / "out.csv.manifest.json").read_text())["warnings"]
    assert first.startswith("frame 0 skipped: standard input: grain 0: the radius")
