"""Sources on a command line, and readers found through entry points."""

from __future__ import annotations

import json

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import SettingsError, UnknownFormatError
from scanfab.cli.main import run
from scanfab.io.reader import installed_readers, reader_for
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.truth import FLOOR, SAMPLE_DATA


@pytest.mark.parametrize("again", ["dumps", "./dumps/", "latest", "dum*"])
def test_a_folder_that_is_named_twice_is_read_once(tmp_path, monkeypatch, capsys, again):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dumps").mkdir()
    write(tmp_path / "dumps" / "dump_0.txt", dump_text(cubic_rows()))
    (tmp_path / "latest").symlink_to("dumps")
    assert run(["inspect", "dumps", again, "--json"]) == 0
    printed = capsys.readouterr()
    assert [json.loads(line)["source"] for line in printed.out.splitlines()] == ["dumps"]
    said = f"{again.replace('*', 'ps')}: named twice among the sources, but read once"
    assert printed.err.count(said) == 1


def test_a_series_may_start_with_frames_of_boundary_alone(tmp_path):
    walls = [(1, 2, 5, 0, 0, 0.1), (2, 2, 0, 5, 0, 0.1)]
    grains = [(3, 1, 0, 0, 0, 1), (4, 1, 2, 0, 0, 1), (5, 1, 0, 2, 0, 1)]
    names = "id type x y z radius"
    text = dump_text(walls, names, step=0) + dump_text(walls + grains, names, step=1)
    scan = {"rv": 1.5, "directions": 9, "cutoff": 0, "spacing": 0.1, "variants": "c"}
    series = scanfab.read_series(write(tmp_path / "dump.txt", text))
    table = scanfab.compute(series, boundary="type=2", **scan)
    assert table["grains"].tolist() == [0, 3]
    assert np.isnan(table["alpha_vs"]).tolist() == [True, False]


OTHER_KINDS = [
    *(
        ("sample_data", {name: 3}, f"{name}: expected")
        for name in ("columns", "contacts", "contact_columns", "format")
    ),
    *(
        ("nowhere", {"max_unpacked": wrong}, "max_unpacked: expected a number above 0")
        for wrong in (0, -1, "many")
    ),
    *((source, {}, "source: expected the path of a folder or file") for source in ([], 3, [3])),
]


@pytest.mark.parametrize(("source", "options", "said"), OTHER_KINDS)
def test_a_value_of_another_kind_is_told_by_its_option(source, options, said):
    with pytest.raises(SettingsError, match=said):
        scanfab.read_series(source, **options)


@pytest.mark.parametrize("read", [scanfab.read, scanfab.read_series])
def test_an_unknown_option_is_told_with_the_nearest(read):
    with pytest.raises(TypeError, match=f"{read.__name__} has no option .*: did you mean 'format'"):
        read("sample_data", formt="yade")


def test_a_name_that_does_not_exist_is_an_error_that_lists_those_that_do():
    assert installed_readers()["yade"].package == "scanfab"
    with pytest.raises(UnknownFormatError, match=r"called 'rocky'.* liggghts, .*, vtk, xyz, yade"):
        scanfab.read(FLOOR / "tutorial.txt", format="rocky")


def test_the_name_of_a_file_does_not_matter(tmp_path):
    for name in ("log.txt", "deck.vtk", "notes.dump", "x.vtu", "no_ending_at_all"):
        assert reader_for(write(tmp_path / name, "hello\n")) is None
        assert reader_for(write(tmp_path / name, dump_text())).name == "liggghts"


def test_contacts_that_convert_wrote_beside_the_dumps_belong_to_its_own_files(tmp_path):
    for step in (30000, 60000):
        for kind in ("dump", "contacts"):
            name = f"{kind}_{step}.txt.gz"
            (tmp_path / name).write_bytes((SAMPLE_DATA / "liggghts_periodic" / name).read_bytes())
    before = scanfab.read(tmp_path).contacts.pairs
    scanfab.convert(tmp_path, tmp_path / "x_{step}.csv")
    for source in (tmp_path, tmp_path / "x_30000.csv"):
        np.testing.assert_array_equal(scanfab.read(source).contacts.pairs, before)
