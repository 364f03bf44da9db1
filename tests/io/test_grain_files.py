"""Which files are the grains, which contact files are theirs, and what is said where that fails."""

from __future__ import annotations

import os
import shutil
import warnings

import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote
from scanfab.cli.main import run
from scanfab.table.result_file import ResultFile
from tests.helpers.dumps import PAIRS, dump_text, pairs_text, write
from tests.helpers.truth import FLOOR, SAMPLE_DATA

NO_RADIUS = "id type x y z c_rad"


@pytest.fixture
def folder(tmp_path):
    """Two frames of one series with contacts, in a folder of their own."""
    folder = tmp_path / "dumps"
    folder.mkdir()
    for step in (9, 10):
        series(folder, "dump", "contacts", step)
    return folder


def series(folder, grains, contacts, step, pairs=PAIRS):
    write(folder / f"{grains}_{step}.txt", dump_text(step=step))
    write(folder / f"{contacts}_{step}.txt", pairs_text(pairs, step=step))


def contacts_of(source, **options):
    return [
        None if packing.contacts is None else len(packing.contacts)
        for packing in (frame.read() for frame in scanfab.read_series(source, **options))
    ]


def test_one_file_is_read_with_its_contacts_as_its_folder_is(folder):
    with pytest.warns(ScanfabNote, match=r"contacts are read from .*contacts_9.txt, beside"):
        packing = scanfab.read(folder / "dump_9.txt")
    assert len(packing.contacts) == 2


def test_several_files_are_read_with_their_contacts(folder):
    with pytest.warns(ScanfabNote):
        assert contacts_of(sorted(folder.glob("dump_*"))) == [2, 2]


def test_the_command_line_reads_one_file_as_python_does(folder, capsys):
    assert run(["inspect", str(folder / "dump_9.txt")]) == 0
    printed = capsys.readouterr()
    assert "contacts_from file" in printed.out
    assert "note: contacts are read from" in printed.err


@pytest.mark.parametrize("how", ["geometric", "named"])
def test_contacts_beside_are_left_alone_if_others_are_asked_for(folder, how):
    other = write(folder / "other_9.txt", pairs_text(PAIRS[:1], step=9))
    with warnings.catch_warnings():
        warnings.simplefilter("error", ScanfabNote)
        contacts = "geometric" if how == "geometric" else other
        expected = [None] if how == "geometric" else [1]
        assert contacts_of(folder / "dump_9.txt", contacts=contacts) == expected


def test_contacts_of_another_step_are_not_beside(folder):
    write(folder / "dump_11.txt", dump_text(step=11))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert contacts_of(folder / "dump_11.txt") == [None]


def test_contacts_of_another_folder_are_not_beside(folder, tmp_path):
    alone = shutil.copy(folder / "dump_9.txt", tmp_path)
    assert contacts_of(alone) == [None]


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")
def test_of_two_series_each_has_the_contacts_of_its_own_prefix(folder):
    series(folder, "run1_dump", "run1_contacts", 9, PAIRS[:1])
    series(folder, "run2_dump", "run2_contacts", 9)
    assert contacts_of(folder / "run1_dump_9.txt") == [1]
    assert contacts_of(folder / "run2_dump_9.txt") == [2]


def test_contacts_that_may_be_another_s_are_not_taken(folder):
    write(folder / "cloud_9.txt", dump_text(step=9))
    with pytest.warns(
        ScanfabNote, match=r"skipped contacts_9.txt.*neither step nor name.*`contacts`"
    ):
        assert contacts_of(folder / "dump_9.txt") == [None]


def test_two_lists_beside_are_an_error(folder):
    for step in (9, 10):
        write(folder / f"again_{step}.txt", pairs_text(step=step))
    with pytest.warns(ScanfabNote), pytest.raises(ReadError, match="two contact lists for one"):
        contacts_of(folder / "dump_9.txt")


def test_of_two_lists_beside_the_nearest_by_name_is_taken(folder):
    write(folder / "dump_pairs_9.txt", pairs_text(PAIRS[:1], step=9))
    with pytest.warns(ScanfabNote) as told:
        assert contacts_of(folder / "dump_9.txt") == [1]
    (text,) = [str(one.message) for one in told]
    assert text.startswith(f"contacts are read from {folder}/dump_pairs_9.txt")


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_the_advice_of_several_series_names_the_contacts_that_are_read(tmp_path):
    """Points without a radius are no rivals of grains, nor are the frames of other steps."""
    series(tmp_path, "ex_dump", "ex_contacts", 9)
    write(tmp_path / "ex_points_9.txt", dump_text(step=9, names=NO_RADIUS))
    write(tmp_path / "other_7.txt", dump_text(step=7))
    with pytest.raises(ReadError, match=r"ex_dump_9.txt; contacts: .*ex_contacts_9.txt"):
        scanfab.read_series(tmp_path)
    assert contacts_of(tmp_path / "ex_dump_9.txt") == [2]


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_the_advice_of_several_series_keeps_the_contacts(folder):
    series(folder, "p5_dump", "p5_contacts", 9, PAIRS[:1])
    with pytest.raises(ReadError, match="several series of grains") as told:
        scanfab.read_series(folder)
    advice = next(line for line in str(told.value).splitlines() if "p5_dump" in line)
    assert "contacts: " in advice
    assert "p5_contacts" in advice
    assert contacts_of(advice.partition(";")[0].strip()) == [1]


def test_a_series_without_radius_is_among_those_to_choose_from(folder):
    write(folder / "cloud_9.txt", dump_text(step=9))
    write(folder / "tracers_9.txt", dump_text(step=9, names=NO_RADIUS))
    with pytest.raises(ReadError, match=r"tracers_9.txt; it has no radius: `radius=L`"):
        scanfab.read_series(folder)


def test_a_column_that_may_be_the_radius_is_suggested(tmp_path):
    path = write(tmp_path / "dump_9.txt", dump_text(names=NO_RADIUS))
    with pytest.raises(ReadError, match=r'`columns=."radius": "c_rad".` \(if that is one\)'):
        scanfab.read(path)
    assert len(scanfab.read(path, columns={"radius": "c_rad"})) == 3


@pytest.mark.parametrize("ending", ["csv", "tsv", "json", "jsonl"])
def test_a_fabric_table_is_known(tmp_path, ending, capsys):
    grid = [[x, y, z] for x in range(4) for y in range(4) for z in range(4)]
    lines = {"variants": "a", "directions": 9, "spacing": 0.5, "contact_tolerance": 0.3}
    table = scanfab.compute(scanfab.Packing(grid, 0.4), **lines)
    path = tmp_path / f"fabric.{ending}"
    with ResultFile(path, scanfab.Row).writer({}) as writer:
        for row in table:
            writer.write(row)
    assert run(["compute", str(path)]) == 1
    message = "this is a fabric table, not a dump: scanfab compare or scanfab report"
    assert message in capsys.readouterr().err


def test_folders_below_that_hold_series_are_named(folder):
    with pytest.raises(ReadError, match=r"holds no dumps itself, but .*dumps"):
        scanfab.read_series(folder.parent)
    write(folder.parent / "notes.txt", "hello\n")
    with pytest.raises(ReadError, match=r"no reader knows its files, but .*dumps"):
        scanfab.read_series(folder.parent)


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")
def test_globs_in_quotes_are_expanded(folder, capsys):
    assert contacts_of(f"{folder}/dump_*.txt") == [2, 2]
    assert scanfab.read_series(f"{folder}/dump_*.txt").name == str(folder)
    assert run(["inspect", f"{folder}/dump_*.txt", "--json"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_a_glob_that_meets_nothing_is_wrong_usage(folder, capsys):
    assert run(["inspect", f"{folder}/grains_*.txt"]) == 2
    assert "grains_*.txt' matches nothing: there is no file" in capsys.readouterr().err


def test_contacts_beside_that_cannot_be_read_say_how_to_leave_them_alone(folder):
    write(folder / "contacts_9.txt", pairs_text([(1, 77)], step=9))
    message = r'contacts_9.txt: cannot tell.*`contacts="geometric"` leaves it alone'
    with pytest.raises(ReadError, match=message), pytest.warns(ScanfabNote):
        scanfab.read(folder / "dump_9.txt")


def test_a_mesh_of_walls_is_no_list_of_contacts(folder):
    mesh = FLOOR / "mesh_30000.vtk"
    with pytest.raises(ReadError, match="expected contacts, found neither grains nor contacts"):
        scanfab.read_series(folder, contacts=mesh)


def test_what_editors_leave_is_no_frame(folder):
    for name in ("dump_9.txt~", "dump_11.txt.part", "dump_12.txt.tmp", "dump_13.txt.bak"):
        write(folder / name, dump_text(step=11))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert contacts_of(folder) == [2, 2]


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")
def test_the_command_line_takes_a_file_of_cells(tmp_path, capsys):
    strained = SAMPLE_DATA / "yade_strained"
    words = ["inspect", str(strained / "rec_spheres.27500.vtu"), "--json"]
    assert run([*words, "--cell", str(strained / "truth.csv")]) == 0
    assert "0.0035473249830325487" in capsys.readouterr().out
    assert run([*words, "--cell", str(tmp_path / "nowhere.csv")]) == 2
    assert "CSV file with those of each frame" in capsys.readouterr().err


def test_a_pipe_in_a_folder_is_told_of(folder):
    os.mkfifo(folder / "dump_200.txt")
    with pytest.warns(ScanfabNote, match=r"skipped .*dump_200.txt: it is a pipe"):
        assert len(scanfab.read_series(folder).grains.files) == 2


def test_a_lone_dump_above_folders_of_dumps_is_told_of(folder):
    shutil.copy(next(folder.glob("dump_*")), folder.parent / "dump_7.txt")
    with pytest.warns(ScanfabNote, match=r"dump_7.txt alone is read, but .*: .*dumps"):
        scanfab.read_series(folder.parent)
