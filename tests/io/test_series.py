"""Series of frames: grains and contacts of a step brought together, and what is refused."""

from __future__ import annotations

import shutil
import warnings

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import (
    PackingError,
    ReadError,
    ScanfabNote,
    ScanfabWarning,
    UnknownFormatError,
)
from scanfab.io.sources import open_sources
from tests.helpers.dumps import PAIRS, ROWS, dump_text, pairs_text, write
from tests.helpers.truth import FLOOR, id_pairs

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


def test_a_folder_is_a_series_in_natural_order(folder):
    frames = frames_of(folder)
    assert [frame.step for frame in frames] == [9, 10, 100]
    assert [len(frame.contacts) for frame in frames] == [2, 2, 1]


def test_files_of_a_command_line_are_one_series(folder):
    frames = frames_of(sorted(folder.glob("*_*.txt")))
    assert [frame.step for frame in frames] == [9, 10, 100]


def test_hidden_files_are_passed_over(folder):
    write(folder / ".dump_11.txt", dump_text(step=11))
    assert len(frames_of(folder)) == 3


def test_subfolders_are_passed_over(folder):
    (folder / "more").mkdir()
    write(folder / "more" / "dump_11.txt", dump_text(step=11))
    assert len(frames_of(folder)) == 3


def test_the_step_comes_from_the_file_not_its_name(tmp_path):
    write(tmp_path / "frame_1.txt", dump_text(step=5000))
    assert [frame.step for frame in frames_of(tmp_path)] == [5000]


def test_contacts_of_a_file_with_many_snapshots_are_found_by_step(tmp_path):
    write(tmp_path / "dump.txt", "".join(dump_text(step=step) for step in STEPS))
    pairs = [pairs_text(PAIRS[:count], step=step) for count, step in ((2, 9), (0, 10), (1, 100))]
    write(tmp_path / "pairs.txt", "".join(pairs[::-1]))
    assert [len(frame.contacts) for frame in frames_of(tmp_path)] == [2, 0, 1]


def test_contacts_of_another_step_are_not_taken(tmp_path):
    write(tmp_path / "dump.txt", dump_text(step=9))
    write(tmp_path / "pairs.txt", pairs_text(step=10))
    with pytest.warns(ScanfabWarning, match="no contact file for step 9"):
        (packing,) = frames_of(tmp_path)
    assert packing.contacts is None


def test_a_single_contact_file_in_a_format_without_steps_belongs_to_the_single_frame(tmp_path):
    shutil.copy(FLOOR / "pairs_pos_id_force_30000.vtk", tmp_path / "lines_8.vtk")
    packing = scanfab.read(FLOOR / "tutorial.txt", contacts=tmp_path / "lines_8.vtk")
    assert len(packing.contacts) == 368


@pytest.mark.parametrize("contacts", ["auto", "file"])
def test_a_missing_contact_file(folder, contacts):
    (folder / "pairs_10.txt").unlink()
    message = r"dump_10.txt: no contact file for step 10 among .*pairs_\*.txt"
    if contacts == "file":
        with pytest.raises(ReadError, match=message):
            frames_of(folder, contacts=contacts)
    else:
        with pytest.warns(ScanfabWarning, match=f"{message}: contacts are found by geometry"):
            frames = frames_of(folder, contacts=contacts)
        assert [frame.contacts is None for frame in frames] == [False, True, False]


def test_contacts_by_geometry_need_no_file(folder):
    for step in STEPS:
        (folder / f"pairs_{step}.txt").unlink()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert frames_of(folder)[0].contacts is None
    with pytest.raises(ReadError, match='`contacts="file"` was asked for, but there is no contact'):
        scanfab.read_series(folder, contacts="file")


def test_contact_files_are_left_alone_if_geometry_is_asked_for(folder):
    assert [frame.contacts for frame in frames_of(folder, contacts="geometric")] == [None] * 3


@pytest.mark.parametrize("how", ["folder", "glob", "file"])
def test_contacts_may_be_named(tmp_path, how):
    grains, contacts = tmp_path / "g", tmp_path / "c"
    grains.mkdir(), contacts.mkdir()
    write(grains / "dump_9.txt", dump_text(step=9))
    for step in STEPS:
        write(contacts / f"other_{step}.txt", pairs_text(step=step))
    named = {
        "folder": contacts,
        "glob": f"{contacts}/other_*.txt",
        "file": contacts / "other_9.txt",
    }[how]
    (packing,) = frames_of(grains, contacts=named)
    assert id_pairs(packing) == set(PAIRS)


def test_named_contacts_are_required_for_every_frame(folder):
    with pytest.raises(ReadError, match="no contact file for step 9"):
        frames_of(folder, contacts=folder / "pairs_10.txt")


def test_named_contacts_are_required_for_the_frame_that_is_read_only():
    packing = scanfab.read(FLOOR / "multi.txt", contacts=FLOOR / "pairs_id_force.txt", frame=2)
    assert len(packing.contacts) == 368


MISSING = "there is no such file, folder or glob"


@pytest.mark.parametrize(
    ("contacts", "said"), [("nowhere.txt", MISSING), ("nowhere_*.txt", "matches nothing")]
)
def test_named_contacts_must_exist(folder, contacts, said):
    with pytest.raises(ReadError, match=said):
        scanfab.read_series(folder, contacts=folder / contacts)


def test_named_contacts_must_be_contacts(folder):
    with pytest.raises(ReadError, match="expected contacts, found grains"):
        scanfab.read_series(folder, contacts=folder / "dump_9.txt")


def test_two_contact_lists_for_a_frame_are_an_error_that_names_both(folder):
    for step in STEPS:
        write(folder / f"again_{step}.txt", pairs_text(step=step))
    with pytest.raises(
        ReadError, match=r"two contact lists for one frame: .*again_9.*pairs_9.*`con"
    ):
        frames_of(folder)


def test_several_series_in_a_folder_are_an_error_that_lists_their_globs(folder):
    write(folder / "extra_9.txt", dump_text(step=9))
    with pytest.raises(
        ReadError, match=r"several series of grains(.|\n)*dump_\*.txt(.|\n)*extra_9"
    ):
        scanfab.read_series(folder)


def test_two_files_for_one_step_are_an_error(folder):
    shutil.copy(folder / "dump_9.txt", folder / "dump_09.txt")
    with pytest.raises(ReadError, match="two files for one step"):
        scanfab.read_series(folder)


def test_unknown_files_are_passed_over_with_one_note(folder):
    for name in ("log.liggghts", "in.deck", "floor.stl", "README.md", "a.png", "b.pdf", "c.xyz"):
        write(folder / name, "hello\n")
    with pytest.warns(ScanfabNote, match=r"skipped .* and 2 more: they hold neither grains") as e:
        series = scanfab.read_series(folder)
    assert len(e) == 1
    assert len(list(series)) == 3


@pytest.mark.parametrize("name", ["photo.vtu", "log.gz"])
@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_a_damaged_file_beside_the_series_is_passed_over(folder, name):
    damaged = {"photo.vtu": b'<VTKFile type="UnstructuredGrid">', "log.gz": b"\x1f\x8b\x08broken"}
    (folder / name).write_bytes(damaged[name])
    assert len(frames_of(folder)) == 3


def test_points_without_a_radius_are_used_if_there_is_nothing_else(tmp_path):
    write(tmp_path / "dump_0.txt", dump_text(names="id type x y z mass"))
    (packing,) = frames_of(tmp_path, radius=0.1)
    np.testing.assert_array_equal(packing.radius, 0.1)


def test_points_without_a_radius_are_passed_over_beside_grains(folder):
    write(folder / "tracers_9.txt", dump_text(names="id type x y z mass"))
    with pytest.warns(ScanfabNote, match="skipped tracers_9.*without a radius .*`radius`"):
        assert len(frames_of(folder)) == 3


@pytest.mark.parametrize(
    ("name", "said"), [("nothing", MISSING), ("dump_*.txt", "matches nothing")]
)
def test_a_source_must_exist(tmp_path, name, said):
    with pytest.raises(ReadError, match=said):
        scanfab.read_series(tmp_path / name)


def test_an_empty_folder_is_an_error(tmp_path):
    with pytest.raises(ReadError, match="the folder holds no files"):
        scanfab.read_series(tmp_path)


def test_a_folder_of_unknown_files_is_an_error(tmp_path):
    write(tmp_path / "log.txt", "hello\n")
    with pytest.raises(UnknownFormatError, match="no reader knows the format; scanfab formats"):
        scanfab.read_series(tmp_path)


def test_contacts_without_grains_are_an_error(tmp_path):
    write(tmp_path / "pairs_1.txt", pairs_text())
    with pytest.raises(
        ReadError, match=r"no grains: expected points.*found contacts \(pairs_1.txt\)"
    ):
        scanfab.read_series(tmp_path)


def test_a_file_that_cannot_be_a_packing_is_named(tmp_path):
    path = write(tmp_path / "dump_0.txt", dump_text(rows=[ROWS[0], ROWS[0]]))
    with pytest.raises(PackingError, match=r"dump_0.txt: the id 1 occurs twice"):
        scanfab.read(path)


def test_the_number_of_grains_may_change(tmp_path):
    texts = [dump_text(rows=ROWS[:count], step=step) for step, count in enumerate((0, 2, 3, 1))]
    write(tmp_path / "dump.txt", "".join(texts))
    assert [len(frame) for frame in frames_of(tmp_path)] == [0, 2, 3, 1]


def test_one_frame_of_many_is_read_by_its_number(tmp_path):
    path = write(tmp_path / "dump.txt", "".join(dump_text(step=step) for step in STEPS))
    assert [scanfab.read(path, frame=k).step for k in (0, 1, 2, -1, -3)] == [9, 10, 100, 100, 9]


@pytest.mark.parametrize("frame", [3, -4])
def test_a_frame_that_does_not_exist_is_an_error(tmp_path, frame):
    path = write(tmp_path / "dump.txt", "".join(dump_text(step=step) for step in STEPS))
    with pytest.raises(ReadError, match=f"has 3 frames, there is no frame {frame}"):
        scanfab.read(path, frame=frame)


def test_one_frame_is_in_memory_at_a_time(folder):
    frames = iter(scanfab.read_series(folder))
    next(frames)
    (folder / "dump_100.txt").unlink()
    next(frames).read()


def test_a_series_can_be_gone_through_twice(folder):
    series = scanfab.read_series(folder)
    assert [frame.snapshot.step for frame in series] == [frame.snapshot.step for frame in series]


def test_a_series_is_named_as_the_user_named_it(folder, monkeypatch):
    monkeypatch.chdir(folder.parent)
    assert scanfab.read_series(folder.name).name == folder.name
    assert scanfab.read_series(f"{folder.name}/dump_9.txt").name == f"{folder.name}/dump_9.txt"
    files = [f"{folder.name}/dump_{step}.txt" for step in STEPS]
    assert scanfab.read_series(files).name == folder.name
    monkeypatch.chdir(folder)
    assert scanfab.read_series([f"dump_{step}.txt" for step in STEPS]).name == "."


def test_single_files_of_a_command_line_are_one_series_and_folders_their_own(tmp_path):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write(tmp_path / name / "dump_1.txt", dump_text(step=1))
    files = [write(tmp_path / f"dump_{step}.txt", dump_text(step=step)) for step in (5, 4)]
    series = open_sources([files[0], tmp_path / "two", files[1], tmp_path / "one"])
    assert [one.name for one in series] == [
        str(tmp_path),
        str(tmp_path / "two"),
        str(tmp_path / "one"),
    ]
    assert [frame.snapshot.step for frame in series[0]] == [4, 5]
