"""From a manifest back: the command repeats what was asked for, and the source is found."""

from __future__ import annotations

import json
import shlex

import pytest

from scanfab.base.errors import ReadError
from scanfab.cli.compute import compute
from scanfab.cli.main import run
from scanfab.pipeline.record import asked_for, read_manifest
from scanfab.pipeline.repeat import reopen, repeat_command, restored_settings
from scanfab.pipeline.settings import Settings
from tests.conftest import ROOT, SAMPLE

COMMANDS = [
    "dumps",
    "dumps 'a b/*.txt' --boundary type=2 --boundary 'id>=100'",
    "d --variants cd --rv 0.65 --cutoff 0.2rmean --spacing 0.1rmin --directions lebedev:11",
    "d --rv-radius 0.0045 --rv-center 0 -1.5 2e-07 --axis 1,2,-2 --strain grains",
    "d --frames -1: --seed 7 --on-error skip --min-contacts 4 --contact-tolerance 0.0001",
    "d --rattlers recursive",
    "d --frames 3",
    "d --frames ::2 --tolerance 1e-3 --cutoff 0.000123456789",
    "d --cell 1 2 3 --periodic xy --radius 0.5 --contacts geometric --format vtk",
    "d --columns 'radius=c rad,x=px' --contact-columns 'pos id force'",
]


def asked_by(command, monkeypatch, tmp_path):
    """What a command line asks for, as its manifest says."""
    found = {}
    words = shlex.split(command)
    for word in words:
        if not word.startswith("-"):
            (tmp_path / word).parent.mkdir(exist_ok=True, parents=True)
    monkeypatch.setattr("scanfab.cli.rows.open_series", lambda *_: [])

    def remember(*given):
        found.update(asked_for(*given))
        raise ReadError("enough")

    monkeypatch.setattr("scanfab.pipeline.job.asked_for", remember)
    # sources need not exist for this
    monkeypatch.setattr(compute.params[0].type, "exists", False)
    with pytest.raises(ReadError, match="enough"):
        compute.main(words, standalone_mode=False)
    return json.loads(json.dumps(found))


@pytest.mark.parametrize("command", COMMANDS)
def test_the_command_asks_for_the_same(command, monkeypatch, tmp_path):
    asked = asked_by(command, monkeypatch, tmp_path)
    repeated = shlex.split(repeat_command(asked, "table.csv"))
    assert repeated[:2] == ["scanfab", "compute"]
    assert repeated[-2:] == ["-o", "table.csv"]
    again = asked_by(shlex.join(repeated[2:-2]), monkeypatch, tmp_path)
    assert again.pop("axis") == pytest.approx(asked.pop("axis"), abs=1e-15)
    assert again == asked


def test_what_is_usual_is_not_repeated():
    asked = asked_for(["dumps"], {"contacts": "auto"}, Settings())
    assert repeat_command(json.loads(json.dumps(asked))) == "scanfab compute dumps"


def test_settings_come_back():
    settings = Settings(
        boundary=["type=2", "id>=9"], cutoff="0.3rmax", frames="1:9:2", axis="x", workers=1
    )
    asked = json.loads(json.dumps(asked_for(["d"], {}, settings)))
    restored = restored_settings(asked)
    assert restored.boundary == settings.boundary
    assert restored.cutoff == settings.cutoff
    assert restored.frames == settings.frames
    assert restored.axis == settings.axis


def test_the_source_is_opened_as_it_was(monkeypatch):
    monkeypatch.chdir(ROOT)
    reading = {"contacts": "geometric", "columns": None, "format": "yade"}
    with pytest.warns(match="skipped"):
        series = reopen(json.loads(json.dumps(asked_for([SAMPLE], reading, Settings()))))
    assert series.name == SAMPLE
    assert series.contacts_from == "geometric"


@pytest.mark.parametrize(
    ("source", "message"), [("-", "standard input"), ("gone/away", "gone/away is not there")]
)
def test_sources_that_are_gone_are_an_error(source, message):
    with pytest.raises(ReadError, match=message):
        reopen(asked_for([source], {}, Settings()))


@pytest.mark.parametrize("text", ["{", "[]", "{}", '{"settings": 3}', '{"settings": {}}', "\udcff"])
def test_what_is_no_manifest_is_an_error(tmp_path, text):
    path = tmp_path / "t.csv.manifest.json"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(ReadError, match=r"t\.csv\.manifest\.json: "):
        read_manifest(tmp_path / "t.csv")


def test_no_manifest_is_none(tmp_path):
    assert read_manifest(tmp_path / "t.csv") is None


def test_columns_and_digits_are_repeated(tmp_path, monkeypatch):
    """The command of the manifest gives the same bytes."""
    monkeypatch.chdir(ROOT)
    table, again = tmp_path / "table.csv", tmp_path / "again.csv"
    words = [SAMPLE, "--boundary", "mask=3", "--frames", "0", "--directions", "9"]
    words += ["--spacing", "1rmin", "--fields", "frame,variant,alpha_vs_axial", "--digits", "4"]
    assert run(["compute", *words, "-o", str(table)]) == 0
    asked = read_manifest(table)["settings"]
    command = shlex.split(repeat_command(asked, str(again)))
    assert run(command[1:]) == 0
    assert again.read_bytes() == table.read_bytes()
    assert table.read_text().startswith("frame,variant,alpha_vs_axial\n")
    assert restored_settings(asked).seed == 0
