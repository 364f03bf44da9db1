"""Notes: sentences with what they are about, each once."""

from __future__ import annotations

import pytest

from scanfab.base.errors import SkippedFrameWarning
from scanfab.base.note import SKIPPED, Note, joined, tell


def test_a_sentence_is_said_once_of_all_its_variants():
    notes = [Note("a", "dense", ("b",)), Note("a", "loose", ("c",)), Note("a", "dense", ("d",))]
    assert joined(notes) == (Note("a", "dense", ("b", "d")), Note("a", "loose", ("c",)))


def test_it_says_what_it_is_about():
    assert Note("a", "dense").told("") == "dense"
    assert Note("a", "dense").told("frame 1") == "frame 1: dense"
    assert Note("a", "dense", ("c",)).told("frame 1") == "frame 1, variant c: dense"


def test_a_frame_that_was_left_out_is_a_warning_of_its_kind():
    with pytest.warns(SkippedFrameWarning, match="frame 1 skipped: dump: no grains"):
        tell([Note(SKIPPED, "dump: no grains")], "frame 1")
