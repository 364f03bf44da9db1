"""Notes: sentences with what they are about, each once."""

from __future__ import annotations

import pickle

import pytest

from scanfab.base.errors import ScanfabWarning, SkippedFrameWarning
from scanfab.base.note import SKIPPED, Note, joined, tell


def test_a_sentence_is_said_once_of_all_its_variants():
    notes = [Note("a", "dense", ("b",)), Note("a", "loose", ("c",)), Note("a", "dense", ("d",))]
    assert joined(notes) == (Note("a", "dense", ("b", "d")), Note("a", "loose", ("c",)))


def test_what_is_of_another_kind_is_another_note():
    notes = (Note("a", "dense"), Note("b", "dense"))
    assert joined(notes) == notes


def test_it_says_what_it_is_about():
    assert Note("a", "dense").told("") == "dense"
    assert Note("a", "dense").told("frame 1") == "frame 1: dense"
    assert Note("a", "dense", ("c",)).told("frame 1") == "frame 1, variant c: dense"


def test_each_is_a_warning():
    with pytest.warns(ScanfabWarning, match="frame 1: dense") as told:
        tell([Note("a", "dense")], "frame 1")
    assert [one.category for one in told] == [ScanfabWarning]


def test_a_frame_that_was_left_out_is_a_warning_of_its_kind():
    with pytest.warns(SkippedFrameWarning, match="frame 1 skipped: dump: no grains"):
        tell([Note(SKIPPED, "dump: no grains")], "frame 1")


def test_it_goes_to_another_process_and_back():
    note = Note("a", "dense", ("c",))
    assert pickle.loads(pickle.dumps(note)) == note
