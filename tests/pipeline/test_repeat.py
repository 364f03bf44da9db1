"""The manifest: what a result was made of, and from it back to the command and the source."""

import hashlib
import json
import shlex
from importlib.metadata import version
from pathlib import Path
from unittest.mock import Mock

import pytest

from scanfab.base.errors import ReadError
from scanfab.cli.main import run
from scanfab.io import ReadOptions
from scanfab.pipeline import record
from scanfab.pipeline.record import asked_for, read_manifest, repeat_command, restored_settings
from scanfab.pipeline.settings import Settings
from tests.conftest import ROOT, SAMPLE
from tests.helpers.dumps import cubic_rows, dump_text, pairs_text, write

FAST = ("--directions", "9", "--spacing", "0.5rmin", "--cutoff", "0.2rmin", "--variants", "a")


def test_a_result_file_has_its_manifest_beside_it(tmp_path, capsys):
    """Or, without a result file, where it is asked for."""
    series = tmp_path / "series"
    series.mkdir()
    for frame in (0, 1):
        write(series / f"dump_{frame}.txt", dump_text(cubic_rows(), step=frame))
        write(series / f"pairs_{frame}.txt", pairs_text(step=frame))
    output, path = tmp_path / "table.csv", tmp_path / "what.json"
    words = ["compute", str(series), *FAST, "--seed", "5"]
    assert run([*words, "-o", str(output)]) == run([*words, "--manifest", str(path)]) == 0
    assert capsys.readouterr().out == output.read_text()
    found = json.loads(path.read_text())
    assert read_manifest(output) == found
    names = ["settings", "seed", "versions", "inputs", "warnings", "notes", "frames"]
    assert list(found) == names
    assert found["frames"] == {str(series): 2}
    assert found["seed"] == found["settings"]["seed"] == 5
    assert found["versions"]["scanfab"] == version("scanfab")
    for one, file in zip(found["inputs"], sorted(series.iterdir()), strict=True):
        data = file.read_bytes()
        digest = hashlib.sha256(data).hexdigest()
        assert one == {"path": str(file), "size": len(data), "sha256": digest}


COMMANDS = [
    "dumps",
    "dumps 'a b/*.txt' --boundary type=2 --boundary 'id>=100'",
    "d --variants cd --rv 0.65 --cutoff 0.2rmean --spacing 0.1rmin --directions lebedev:11",
    "d --rv-radius 0.0045 --rv-center 0 -1.5 2e-07 --axis 1,2,-2 --strain grains",
    "d --rv-shape box --rv-size 1 2 3 --axis=-1,0,0 --directions 13 --cutoffs 0:1rmin:0.5rmin",
    "d --frames -1: --seed 7 --on-error skip --min-contacts 4 --contact-tolerance 0.0001",
    "d --rattlers recursive --frames 3 --rv 0.4,0.5 --with harmonics,forces",
    "d --frames ::2 --tolerance 1e-3 --cutoff 0.000123456789 --rv-shape cylinder --rv-size 1 2",
    "d --cell 1 2 3 0.5 0 0.25 --periodic xy --radius 0.5 --contacts geometric --format liggghts",
    "d --columns 'radius=radius,x=x' --contact-columns 'pos id force'",
]


@pytest.fixture
def asked_by(tmp_path, monkeypatch):
    """What a command line asks for, as its manifest says, which gives back its settings."""
    monkeypatch.chdir(tmp_path)
    for folder in ("dumps", "d", "a b"):
        (tmp_path / folder).mkdir()
        write(tmp_path / folder / "dump_0.txt", dump_text(cubic_rows()))

    def asked_by(words):
        remember = Mock(side_effect=ReadError("enough"))
        monkeypatch.setattr("scanfab.pipeline.job.asked_for", remember)
        assert run(["compute", *words]) == 1
        asked = json.loads(json.dumps(asked_for(*remember.call_args.args)))
        assert restored_settings(asked, Path("table.csv")) == remember.call_args.args[2]
        return asked

    return asked_by


@pytest.mark.parametrize("command", COMMANDS)
def test_the_command_asks_for_the_same(command, asked_by):
    asked = asked_by(shlex.split(command))
    assert set(Settings.__dataclass_fields__) - set(asked) == {"workers"}
    repeated = shlex.split(repeat_command(asked, "table.csv"))
    assert repeated[:2] == ["scanfab", "compute"]
    assert repeated[-2:] == ["-o", "table.csv"]
    again = asked_by(repeated[2:-2])
    axes = [one.pop("axis") for one in (again, asked)]
    assert axes[0] == axes[1] or axes[0] == pytest.approx(axes[1], abs=1e-15)
    assert again == asked


def test_the_source_is_opened_as_it_was(monkeypatch):
    monkeypatch.chdir(ROOT)
    reading = ReadOptions(contacts="geometric", format="yade")
    asked = json.loads(json.dumps(asked_for([SAMPLE], reading, Settings())))
    with pytest.warns(match="skipped"):
        series = record.reopen(asked)
    assert (series.name, series.contacts_from) == (SAMPLE, "geometric")
    for source, told in (("-", "standard input"), ("gone/away", "gone/away: there is no such")):
        with pytest.raises(ReadError, match=told):
            record.reopen(asked_for([source], ReadOptions(), Settings()))


ROWS = ("--directions", "9", "--spacing", "1rmin", "--cutoff", "0.2rmin", "--frames", "0")


REPEATED = [
    (("compute", "--fields", "frame,variant,alpha_vs_axial", "--digits", "4"), "--digits 4"),
    (("compute", "--variants", "ac", "--rv", "0.7,0.5"), "--rv 0.5,0.7"),
    (("map", "--grid", "2,1,1"), "--grid 2,1,1"),
    (("map", "--slices", "1"), "--slices 1"),
]


@pytest.mark.parametrize(("words", "named"), REPEATED)
def test_the_command_of_a_manifest_gives_the_same_bytes(tmp_path, monkeypatch, words, named):
    monkeypatch.chdir(ROOT)
    table, again = tmp_path / "table.csv", tmp_path / "again.csv"
    command, *more = words
    assert run([command, SAMPLE, "--boundary", "mask=3", *ROWS, *more, "-o", str(table)]) == 0
    asked = read_manifest(table)["settings"]
    repeated = repeat_command(asked, str(again))
    assert repeated.startswith(f"scanfab {command} {SAMPLE} ")
    assert f" {named} " in repeated
    assert run(shlex.split(repeated)[1:]) == 0
    assert again.read_bytes() == table.read_bytes()
    assert restored_settings(asked, table).seed == 0
