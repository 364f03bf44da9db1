"""scanfab.toml beside the dumps: any option, below the command line."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import pytest

from scanfab.cli.main import run
from scanfab.pipeline.record import read_manifest
from scanfab.pipeline.repeat import repeat_command
from tests.helpers.dumps import cubic_rows, dump_text, write

FAST = 'directions = 9\nspacing = "0.5rmin"\ncutoff = "0.2rmin"\n'


@pytest.fixture
def series(tmp_path):
    write(tmp_path / "dump_0.txt", dump_text(cubic_rows()))
    return tmp_path


@pytest.fixture
def compute(series, capsys):
    """The rows of a computation with the given settings file."""

    def ask(text: str, *words: str, source: Path = series) -> list[dict[str, str]]:
        write(series / "scanfab.toml", f"[compute]\n{FAST}{text}")
        code = run(["compute", str(source), *words])
        printed = capsys.readouterr()
        assert code == 0, printed.err
        assert printed.err.count(f"scanfab: note: options from {series}/scanfab.toml: ") == 1
        return list(csv.DictReader(io.StringIO(printed.out)))

    return ask


def refused(series: Path, text: str, capsys: pytest.CaptureFixture[str]) -> str:
    write(series / "scanfab.toml", text)
    assert run(["compute", str(series)]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert re.search(f"{series}/scanfab.toml(, line [0-9]+)?: ", printed.err)
    return printed.err


def test_options_are_those_of_the_file(compute):
    rows = compute('variants = "a"\n')
    assert [(row["variant"], row["directions"]) for row in rows] == [("a", "13")]


def test_the_file_serves_single_files_beside_it_too(compute, series):
    assert len(compute('variants = "ac"\n', source=series / "dump_0.txt")) == 2


def test_the_command_line_wins(compute):
    rows = compute('variants = "a"\n', "--variants", "cd")
    assert [row["variant"] for row in rows] == ["c", "d"]


def test_the_command_line_wins_with_a_default_too(compute):
    assert len(compute('variants = "a"\n', "--variants", "abcd")) == 4


@pytest.mark.parametrize("text", ['boundary = "id>=63"', 'boundary = ["id=63", "id=64"]'])
def test_an_option_that_may_be_repeated_is_a_word_or_a_list(compute, text):
    (row,) = compute(f'variants = "a"\n{text}\n')
    assert row["grains"] == "62"


@pytest.mark.parametrize("cell", ["[4, 4, 4]", '"4 4 4"'])
def test_a_cell_is_a_list_or_a_word(compute, cell):
    assert len(compute(f'variants = "c"\nrv = 0.5\ncell = {cell}\n')) == 1


def test_several_numbers_are_a_list(compute):
    (row,) = compute('variants = "c"\nrv-radius = 1.0\nrv-center = [2, 2, 2]\n')
    assert 0 < float(row["solid_fraction"]) < 1


@pytest.mark.parametrize("command", ["compute", "inspect", "calibrate", "view"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[view]\ncolour = 1\n", "the section [view] has no meaning: options stand in the sec"),
        ("[computee]\nrv = 0.6\n", "the section [computee] has no meaning"),
        ("rv = 0.6\n[compute]\n", "the key 'rv' has no meaning: options stand in the section"),
        ('[compute]\nvariant = "a"\n', "compute has no option 'variant': did you mean 'varian"),
        (
            "[compute]\nresume = true\n",
            "'resume' cannot be set in scanfab.toml, which says how samples are computed: what is",
        ),
        ("[compute]\nquiet = true\n", "told stand on the command line: --quiet"),
        ('[compute]\nvtk = "v"\n', "'vtk' cannot be set in scanfab.toml"),
        ('[compute]\noutput = "t.csv"\n', "told stand on the command line: -o"),
        (
            "[compute]\nrv = 0.6\nboundary = mask=3\n",
            'line 3: text needs quotes: boundary = "mask=3"',
        ),
        ("[compute]\ncutoff = 1rmin # one\n", 'line 2: text needs quotes: cutoff = "1rmin"'),
    ],
)
def test_what_has_no_meaning_is_refused_by_every_command(series, capsys, command, text, message):
    write(series / "scanfab.toml", text)
    assert run([command, str(series)]) == 2
    assert message in capsys.readouterr().err


def test_every_command_says_which_options_it_takes(series, capsys):
    """Those that the line does not name, and that are options of the command."""
    write(series / "scanfab.toml", '[compute]\nrv = 0.6\nboundary = "id=1"\nmin-contacts = 3\n')
    assert run(["inspect", str(series), "--min-contacts", "2"]) == 0
    told = capsys.readouterr().err
    assert f"scanfab: note: options from {series}/scanfab.toml: rv, boundary\n" in told
    named = ["--min-contacts", "2", "--boundary", "id=2", "--rv", "0.5"]
    assert run(["inspect", str(series), *named]) == 0
    assert "options from" not in capsys.readouterr().err


def test_the_manifest_lists_what_came_from_the_file(series, tmp_path):
    output = tmp_path / "out" / "table.csv"
    output.parent.mkdir()
    write(series / "scanfab.toml", f"[compute]\n{FAST}rv = 0.6\n")
    assert run(["compute", str(series), "--rv", "0.7", "-o", str(output)]) == 0
    found = read_manifest(output)
    assert found["settings_file"] == {
        "path": f"{series}/scanfab.toml",
        "used": ["directions", "spacing", "cutoff"],
        "not_used": ["rv"],
    }
    assert found["notes"] == [f"options from {series}/scanfab.toml: directions, spacing, cutoff"]
    # the file would take its place where the command is repeated
    command = repeat_command(found["settings"], named=found["settings_file"]["not_used"])
    assert "--rv 0.7" in command
    assert "--spacing 0.5rmin" in command


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[compute\n", "Expected"),
        ("compute = 3\n", "expected a section [compute]"),
        ('[compute]\nseed = "many"\n', "seed: "),
        ("[compute]\nrv-center = [1, 2]\n", "rv-center: "),
        ("[compute]\nrv-center = [[1, 2], 2, 3]\n", "rv-center: expected numbers or text in quo"),
        ("[compute]\nrv-center = [{x = 1}, 2, 3]\n", "found a table"),
        ("[compute]\nrv-center = [true, 2, 3]\n", "one or a list of them, found true"),
        ("[compute]\nrv = false\n", "rv: expected numbers or text in quotes"),
        ("[compute]\naxis = {x = 1}\n", "axis: expected numbers or text in quotes"),
        ("[compute.rv]\nradius = 1\n", "rv: expected numbers or text in quotes"),
        ("[compute]\nboundary = [[3]]\n", "found a list in a list"),
        ("[compute]\nframes = 2020-01-01\n", "found a date or time, 2020-01-01"),
    ],
)
def test_a_broken_file_is_named(series, capsys, text, message):
    assert message in refused(series, text, capsys)


def test_a_value_that_cannot_be_used_is_wrong_usage(series, capsys):
    write(series / "scanfab.toml", '[compute]\nvariants = "x"\n')
    assert run(["compute", str(series)]) == 2
    assert (
        f"{series}/scanfab.toml: variants: expected letters out of abcd" in capsys.readouterr().err
    )


def test_different_files_of_several_sources_are_refused(tmp_path, capsys):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write(tmp_path / name / "dump_0.txt", dump_text(cubic_rows()))
        write(tmp_path / name / "scanfab.toml", "[compute]\n")
    assert run(["compute", str(tmp_path / "one"), str(tmp_path / "two")]) == 2
    assert "the sources have several settings files" in capsys.readouterr().err
