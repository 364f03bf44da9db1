"""scanfab.toml beside the dumps: any option, below the command line."""

from pathlib import Path

import pytest

from scanfab.pipeline.record import read_manifest, repeat_command
from tests.helpers.dumps import cubic_rows, dump_text, write

FAST = 'directions = 9\nspacing = "0.5rmin"\ncutoff = "0.2rmin"\n'


@pytest.fixture
def series(tmp_path):
    write(tmp_path / "dump_0.txt", dump_text(cubic_rows()))
    return tmp_path


TAKEN = [
    ('variants = "a"', (), "a", "64"),
    ('variants = "a"', ("--variants", "abcd"), "abcd", "64"),
    ('variants = "a"\nboundary = "id>=63"', (), "a", "62"),
    ('variants = "a"\nboundary = ["id=63", "id=64"]', (), "a", "62"),
    ('variants = "c"\nrv = 0.5\ncell = [4, 4, 4]', (), "c", "8"),
    ('variants = "c"\nrv-radius = 1.0\nrv-center = [2, 2, 2]', (), "c", "8"),
    ('variants = "ac"\nrv = [0.5, 0.7]', (), "acc", "64"),
    ('variants = "a"\ncutoffs = ["0.2rmin", "0.3rmin"]', (), "aa", "64"),
]


@pytest.mark.parametrize(("text", "words", "variants", "grains"), TAKEN)
def test_options_of_the_line_come_before_the_file(series, ask, text, words, variants, grains):
    write(series / "scanfab.toml", f"[compute]\n{FAST}{text}\n")
    for source in (series, series / "dump_0.txt"):
        answer = ask("compute", source, *words)
        assert "".join(row["variant"] for row in answer.rows) == variants
        assert {row["directions"] for row in answer.rows} == {"13"}
        assert answer.rows[0]["grains"] == grains
        assert answer.err.count(f"note: options from {series}/scanfab.toml: directions, ") == 1


def test_a_file_is_looked_for_beside_the_settings_file_first(
    series, ask, monkeypatch, tmp_path_factory
):
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    write(series / "strain.csv", "frame,strain\n0,0.25\n")
    write(series / "box.csv", "frame,lx,ly,lz\n0,4,4,4\n")
    write(Path("elsewhere.csv"), "frame,strain\n0,0.5\n")
    text = 'cell = "box.csv"\ncontacts = "geometric"\nvariants = "a"\nstrain ='
    for name, strain in (("strain.csv", "0.25"), ("elsewhere.csv", "0.5")):
        write(series / "scanfab.toml", f'[compute]\n{FAST}{text} "{name}"\n')
        (row,) = ask("compute", series).rows
        assert row["strain"] == strain
        # without a cell a whole has no solid fraction
        assert row["solid_fraction"] != ""


MEANINGLESS = [
    ("[view]\ncolour = 1", "'view' is not known: put options into the section [compute]"),
    ('[compute]\nvariant = "a"', "'variant' cannot be set in a settings file: did you mean"),
    ("[compute]\nresume = true", "'resume' cannot be set"),
    (f"[compute]\nrv = {'[' * 20_000}{']' * 20_000}", ""),
    ("[compute]\ncutoff = 1rmin # one", "text needs quotes"),
    ("[compute]\nrv-center = [[1, 2], 2, 3]", "rv-center: expected three finite numbers"),
    ("[compute]\nrv = false", "rv: expected a fraction above 0"),
    ('[compute]\nseed = "many"', "seed: expected 0 or more, found 'many'"),
    ('[compute]\nrv-axis = "x"', "--rv-axis: has no meaning if --rv-shape is sphere"),
]


@pytest.mark.parametrize(("text", "message"), MEANINGLESS, ids=lambda text: text[:40])
def test_what_has_no_meaning_is_refused_with_the_name_of_the_file(series, ask, text, message):
    write(series / "scanfab.toml", f"{text}\n")
    told = ask("compute", series, code=2).told
    assert f"{series}/scanfab.toml" in told
    assert message in told


def test_every_command_says_which_options_it_takes(series, ask):
    """Those that the line does not name, and that are options of the command."""
    text = 'rv = 0.6\nboundary = "id=1"\nmin-contacts = 3\nseed = 3\n'
    write(series / "scanfab.toml", f"[compute]\n{text}")
    told = ask("inspect", series, "--min-contacts", "2").err
    assert f"scanfab: note: options from {series}/scanfab.toml: rv, boundary\n" in told
    named = ["--min-contacts", "2", "--boundary", "id=2", "--rv", "0.5"]
    assert "options from" not in ask("inspect", series, *named).err


def test_the_manifest_lists_what_came_from_the_file(series, tmp_path_factory, ask):
    output, file = tmp_path_factory.mktemp("out") / "table.csv", f"{series}/scanfab.toml"
    write(series / "scanfab.toml", f"[compute]\n{FAST}rv = 0.6\n")
    ask("compute", series, "--rv", "0.7", "-o", output)
    found, used = read_manifest(output), ["directions", "spacing", "cutoff"]
    assert found["settings_file"] == {"path": file, "used": used, "not_used": ["rv"]}
    assert found["notes"] == [f"options from {file}: directions, spacing, cutoff"]
    # the file would take its place where the command is repeated
    command = repeat_command(found["settings"], named=found["settings_file"]["not_used"])
    assert "--rv 0.7" in command
    assert "--spacing 0.5rmin" in command
