"""Notes: sentences with what they are about, each once."""

from __future__ import annotations

import pytest

from scanfab.base.errors import SKIPPED, Note, SkippedFrameWarning, joined, tell


def test_a_sentence_is_said_once_of_all_its_variants():
    notes = [Note("a", "dense", ("b",)), Note("a", "loose", ("c",)), Note("a", "dense", ("d",))]
    assert joined(notes) == (Note("a", "dense", ("b", "d")), Note("a", "loose", ("c",)))


def test_without_a_place_it_says_the_sentence_alone():
    assert Note("a", "dense", ("c",)).told("") == "dense"


def test_a_frame_that_was_left_out_is_a_warning_of_its_kind():
    with pytest.warns(SkippedFrameWarning, match="frame 1 skipped: dump: no grains"):
        tell([Note(SKIPPED, "dump: no grains")], "frame 1")
