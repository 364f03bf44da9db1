"""Series of frames: sources, contacts of a step, frames by number and slice, very many of them."""

import json
import os
import pickle
import shutil
import time
import weakref

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import NoFrameError, ScanfabNote, ScanfabWarning, SettingsError
from scanfab.cli.main import run
from scanfab.io import frame as frame_module
from scanfab.io.formats.lammps import LiggghtsReader
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.settings import Settings
from tests.helpers.dumps import PAIRS, cubic_rows, dump_text, pairs_text, refuses, write
from tests.helpers.truth import FLOOR, SAMPLE_DATA, id_pairs

STEPS = (9, 10, 100)


@pytest.fixture
def folder(tmp_path):
    """Three frames of grains and contacts; the first two pairs, but one in the last frame."""
    for step in STEPS:
        write(tmp_path / f"dump_{step}.txt", dump_text(step=step))
        pairs = PAIRS[:1] if step == 100 else PAIRS
        write(tmp_path / f"pairs_{step}.txt", pairs_text(pairs, step=step))
    return tmp_path


def frames_of(source, **options):
    return [frame.read() for frame in scanfab.read_series(source, **options)]


def test_contacts_are_found_by_step_in_files_of_one_snapshot_or_many(folder, tmp_path):
    found = [(frame.step, len(frame.contacts)) for frame in frames_of(folder)]
    assert found == [(9, 2), (10, 2), (100, 1)]
    dump = write(tmp_path / "dumps", "".join(dump_text(step=step) for step in STEPS))
    pairs = [pairs_text(PAIRS[:count], step=step) for count, step in ((1, 100), (0, 10), (2, 9))]
    contacts = write(tmp_path / "pairs", "".join(pairs))
    assert [len(frame.contacts) for frame in frames_of(dump, contacts=contacts)] == [2, 0, 1]


def test_a_single_contact_file_in_a_format_without_steps_belongs_to_the_single_frame(tmp_path):
    shutil.copy(FLOOR / "pairs_pos_id_force_30000.vtk", tmp_path / "lines_8.vtk")
    packing = scanfab.read(FLOOR / "tutorial.txt", contacts=tmp_path / "lines_8.vtk")
    assert len(packing.contacts) == 368


def test_a_missing_contact_file(folder):
    (folder / "pairs_10.txt").unlink()
    message = r"dump_10.txt: no contact file for step 10 among .*pairs_\*.txt"
    refuses(folder, message, contacts="file", frame=1)
    with pytest.warns(ScanfabWarning, match=f"{message}: contacts are found by geometry"):
        frames = frames_of(folder)
    assert [frame.contacts is None for frame in frames] == [False, True, False]
    # where there is no file for any frame, nothing is missed
    for step in (9, 100):
        (folder / f"pairs_{step}.txt").unlink()
    assert frames_of(folder)[0].contacts is None
    refuses(folder, 'there is no contact file, which `contacts="file"` needs', contacts="file")


def test_contacts_may_be_named_and_must_be_there(tmp_path):
    for folder in ("g", "c"):
        (tmp_path / folder).mkdir()
    write(tmp_path / "g" / "dump_9.txt", dump_text(step=9))
    for step in STEPS:
        write(tmp_path / "c" / f"other_{step}.txt", pairs_text(step=step))
    for named in ("c", "c/other_*.txt", "c/other_9.txt"):
        (packing,) = frames_of(tmp_path / "g", contacts=tmp_path / named)
        assert id_pairs(packing) == set(PAIRS)
    for named, said in (
        ("g/dump_9.txt", "expected contacts, found grains"),
        ("nowhere.txt", "there is no such file"),
        ("nowhere_*.txt", "matches nothing"),
    ):
        refuses(tmp_path / "g", said, contacts=tmp_path / named)


def test_a_series_is_named_as_the_user_named_it(folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    files = [f"{folder.name}/dump_{step}.txt" for step in STEPS]
    for source, name in ((folder.name, folder.name), (files[0], files[0]), (files, folder.name)):
        assert scanfab.read_series(source).name == name
    monkeypatch.chdir(folder)
    assert scanfab.read_series([f"dump_{step}.txt" for step in STEPS]).name == "."


COUNT = 7


@pytest.fixture(params=["files", "one file"])
def series(request, tmp_path):
    """Seven frames, of which frame k has the step 10 k."""
    texts = [dump_text(step=10 * number) for number in range(COUNT)]
    if request.param == "one file":
        return scanfab.read_series(write(tmp_path / "dump.txt", "".join(texts)))
    for number, text in enumerate(texts):
        write(tmp_path / f"dump_{10 * number}.txt", text)
    return scanfab.read_series(tmp_path)


def numbers(frames):
    return [frame.number for frame in frames]


SLICES = [
    slice(2, 5), slice(None), slice(5, None), slice(-3, None), slice(None, -2), slice(1, None, 3),
    slice(-5, -1, 2), slice(4, 2), slice(3, 99), slice(-99, 2),
]  # fmt: skip


@pytest.mark.parametrize("one", SLICES, ids=str)
def test_slices_and_slices_of_slices_are_those_of_a_list(series, one):
    wanted, part = list(range(COUNT))[one], series[one]
    assert numbers(part) == wanted
    assert (len(part), bool(part)) == (len(wanted), bool(wanted))
    for other in SLICES:
        assert numbers(part[other]) == wanted[other]
    for index in (0, 1, -1, -2, COUNT, 99, -COUNT - 1):
        if -len(wanted) <= index < len(wanted):
            assert part[index].number == wanted[index]
        else:
            with pytest.raises(NoFrameError, match=f"no frame {index}: it has {len(wanted)} "):
                part[index]
    is_all = one == slice(None)
    assert (part.is_whole, part == series) == (is_all, is_all)
    assert part.whole == series
    assert part.name == series.name


def test_what_is_no_number_or_goes_backwards_is_an_error(series):
    for index in ("2:5", 1.0, None, (1, 2)):
        with pytest.raises(TypeError):
            series[index]
    with pytest.raises(SettingsError, match=r"stay in the order .* list\(series\)\[::-1\]"):
        series[::-1]


@pytest.fixture
def looked_into(monkeypatch):
    """The files that the reader has looked for frames in."""
    found = []
    snapshots = LiggghtsReader.snapshots

    def watched(self, path):
        found.append(path.name)
        return snapshots(self, path)

    monkeypatch.setattr(LiggghtsReader, "snapshots", watched)
    return found


def test_a_file_is_looked_through_once_and_only_when_its_turn_comes(series, looked_into):
    several = len(series.grains.files) > 1
    assert series[1].number == 1
    assert numbers(series[:2]) == [0, 1]
    assert bool(series)
    assert len(set(looked_into)) == (2 if several else 1)
    assert len(list(series)) == len(series) == COUNT
    assert series[-1].number == series[2:][-1].number == COUNT - 1
    assert len(looked_into) == len(set(looked_into)) == len(series.grains.files)


def test_a_frame_that_goes_to_another_process_leaves_the_others_behind(series):
    assert series[-1].read().step == 60
    twin = pickle.loads(pickle.dumps(series[2:][1].alone()))
    assert not twin.series.known.snapshots
    assert len(twin.series.grains.files) <= 2
    assert (twin.number, twin.step, twin.read().step) == (3, 30, 30)


def test_a_file_that_has_grown_is_looked_through_again(tmp_path):
    path = write(tmp_path / "dump.txt", dump_text(step=0))
    series = scanfab.read_series(path)
    assert len(series) == 1
    write(path, dump_text(step=0) + dump_text(step=1))
    assert len(series) == 2


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


OTHER_KINDS = [
    *(
        ("sample_data", {name: 3}, f"{name}: expected")
        for name in ("columns", "contacts", "contact_columns", "format")
    ),
    ("nowhere", {"max_unpacked": 0}, "max_unpacked: expected a number above 0"),
    ("nowhere", {"max_unpacked": "many"}, "max_unpacked: expected a number above 0"),
    *((source, {}, "source: expected the path of a folder or file") for source in ([], 3, [3])),
]


@pytest.mark.parametrize(("source", "options", "said"), OTHER_KINDS)
def test_a_value_of_another_kind_is_told_by_its_option(source, options, said):
    with pytest.raises(SettingsError, match=said):
        scanfab.read_series(source, **options)


SCAN = {"directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin", "variants": "a"}
FRAMES = 8


@pytest.fixture
def long_series(tmp_path):
    for frame in range(FRAMES):
        text = dump_text(cubic_rows(squeeze=1 - 0.01 * frame), step=frame)
        write(tmp_path / f"dump_{frame}.txt", text)
    return scanfab.read_series(tmp_path)


@pytest.mark.filterwarnings("ignore:.*no contact at all by geometry")
def test_a_series_may_start_with_frames_of_boundary_alone(tmp_path):
    text = dump_text(cubic_rows()[:16]) + dump_text(cubic_rows(), step=1)
    series = scanfab.read_series(write(tmp_path / "dump.txt", text))
    table = scanfab.compute(series, boundary="id<=16", **SCAN)
    assert table["grains"].tolist() == [0, 48]
    assert np.isnan(table["alpha_vs"]).tolist() == [True, False]


def test_thousands_of_files_open_within_seconds(tmp_path):
    first = write(tmp_path / "dump_0.txt", dump_text())
    for step in range(1, 4_000):
        os.link(first, tmp_path / f"dump_{step}.txt")
    start = time.perf_counter()
    assert len(next(iter(scanfab.read_series(tmp_path))).read()) == 3
    assert time.perf_counter() - start < 2


def test_memory_holds_one_frame_a_worker_and_all_give_the_same_rows(long_series, monkeypatch):
    found = []

    class Watched(scanfab.Packing):
        def __init__(self, *words, **named):
            super().__init__(*words, **named)
            found.append(weakref.ref(self))

    monkeypatch.setattr(frame_module, "Packing", Watched)
    tables = []
    for workers in (1, 3, 16):
        found.clear()
        tables.append([])
        for row in compute_rows(long_series, Settings(workers=workers, **SCAN)):
            tables[-1].append(row)
            # one more for each row that is taken while the next frame is read
            assert sum(reference() is not None for reference in found) <= workers + 2
        assert len(found) == FRAMES
    assert tables[0] == tables[1] == tables[2]


def test_contacts_that_convert_wrote_beside_the_dumps_belong_to_its_own_files(tmp_path):
    for step in (30000, 60000):
        for kind in ("dump", "contacts"):
            name = f"{kind}_{step}.txt.gz"
            (tmp_path / name).write_bytes((SAMPLE_DATA / "liggghts_periodic" / name).read_bytes())
    before = scanfab.read(tmp_path).contacts.pairs
    scanfab.convert(tmp_path, tmp_path / "x_{step}.csv")
    for source in (tmp_path, tmp_path / "x_30000.csv"):
        np.testing.assert_array_equal(scanfab.read(source).contacts.pairs, before)


def test_unknown_files_are_passed_over_with_one_note(folder):
    for name in ("log.liggghts", "in.deck", "floor.stl", "README.md", "a.png", "b.pdf", "c.xyz"):
        write(folder / name, "hello\n")
    with pytest.warns(ScanfabNote, match=r"skipped .* and 2 more: they hold neither grains") as e:
        assert len(scanfab.read_series(folder)) == 3
    assert len(e) == 1
