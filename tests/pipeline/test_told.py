"""What a computation tells: kept once, and shown, hidden or raised as the caller's filters say."""

from __future__ import annotations

import warnings

import pytest

from scanfab.base.errors import ScanfabNote, ScanfabWarning, SkippedFrameWarning
from scanfab.pipeline.options import listening

ALL = ["choose another `rv`", "a note", "frame 1 skipped", "frame 2 skipped"]


def told_in_a_function():
    """As compute_file() does it: what is told is warned of where it is called."""
    with listening() as told:
        for text in (ALL[0], ALL[0]):
            warnings.warn(text, ScanfabWarning, stacklevel=1)
        warnings.warn(ALL[1], ScanfabNote, stacklevel=1)
        for text in ALL[2:]:
            warnings.warn(text, SkippedFrameWarning, stacklevel=1)
        warnings.warn("of others", RuntimeWarning, stacklevel=1)
    return told


@pytest.mark.parametrize(
    ("hidden", "shown"),
    [
        ({"message": "nothing"}, ALL),
        ({"category": ScanfabWarning}, [ALL[1]]),
        ({"category": ScanfabNote}, [ALL[0], *ALL[2:]]),
        ({"module": __name__.replace(".", r"\.")}, []),
    ],
)
def test_each_text_is_kept_and_what_filters_leave_is_passed_on_once(hidden, shown):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", **hidden)
        told = told_in_a_function()
    assert told.warnings == ["choose another --rv", *ALL[2:]]
    assert told.notes == ["a note"]
    assert told.skipped == 2
    others = ["of others"] if "module" not in hidden else []
    assert [str(one.message) for one in caught] == [*others, *shown]
    assert all(one.filename == __file__ for one in caught)


def test_filters_may_make_errors_of_them():
    with warnings.catch_warnings():
        warnings.simplefilter("error", ScanfabWarning)
        with pytest.raises(ScanfabWarning, match="choose another"):
            told_in_a_function()
