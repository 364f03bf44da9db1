"""Frames of a series by number and slice: as those of a list, but with the numbers of the whole."""

from __future__ import annotations

import pickle

import pytest

import scanfab
from scanfab.base.errors import NoFrameError, SettingsError
from scanfab.io.formats.liggghts import LiggghtsReader
from tests.helpers.dumps import dump_text, write

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
            with pytest.raises(NoFrameError, match=f"{len(wanted)} frames, .* no frame {index}"):
                part[index]
    is_all = one == slice(None)
    assert (part.is_whole, part == series) == (is_all, is_all)
    assert part.whole == series
    assert part.name == series.name


@pytest.mark.parametrize("index", ["2:5", 1.0, None, (1, 2)])
def test_what_is_no_number_is_an_error(series, index):
    with pytest.raises(TypeError):
        series[index]


def test_frames_do_not_go_backwards(series):
    with pytest.raises(SettingsError, match=r"stay in the order .* list\(series\)\[::-1\]"):
        series[::-1]
    assert numbers(list(series)[::-1]) == list(range(COUNT))[::-1]


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
    assert series[-1].read().step == 1
