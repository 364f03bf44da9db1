"""What a computation tells: kept once, and shown, hidden or raised as the caller's filters say."""

from __future__ import annotations

import warnings

import pytest

from scanfab.base.errors import ScanfabNote, ScanfabWarning, SkippedFrameWarning
from scanfab.pipeline.told import recorded


def tell() -> None:
    for _ in range(2):
        warnings.warn("choose another `rv`", ScanfabWarning, stacklevel=1)
    warnings.warn("a note", ScanfabNote, stacklevel=1)
    warnings.warn("frame 1 skipped", SkippedFrameWarning, stacklevel=1)
    warnings.warn("frame 2 skipped", SkippedFrameWarning, stacklevel=1)
    warnings.warn("of others", RuntimeWarning, stacklevel=1)


def test_each_text_is_kept_and_passed_on_once():
    with warnings.catch_warnings(record=True) as shown:
        warnings.simplefilter("always")
        with recorded() as told:
            tell()
    skipped = ["frame 1 skipped", "frame 2 skipped"]
    assert told.warnings == ["choose another --rv", *skipped]
    assert told.notes == ["a note"]
    assert told.skipped == 2
    said = ["choose another `rv`", "a note", *skipped, "of others"]
    assert [str(one.message) for one in shown] == said
    assert shown[0].filename == __file__


@pytest.mark.parametrize(
    ("choice", "shown"),
    [
        ({"category": ScanfabWarning}, ["a note"]),
        ({"category": ScanfabNote}, ["choose another `rv`", "frame 1 skipped", "frame 2 skipped"]),
        ({"message": "frame 1"}, ["choose another `rv`", "a note", "frame 2 skipped"]),
        ({"module": __name__.replace(".", r"\.")}, []),
        ({"module": "elsewhere"}, ["choose another `rv`", "a note", "frame 1 skipped", "frame 2 "]),
    ],
)
def test_what_filters_hide_is_kept_but_not_passed_on(choice, shown):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", category=RuntimeWarning)
        warnings.filterwarnings("ignore", **choice)
        with recorded() as told:
            tell()
    texts = [str(one.message) for one in caught]
    assert [text[: len(start)] for text, start in zip(texts, shown, strict=True)] == shown
    assert len(told.warnings) == 3


def test_filters_may_make_errors_of_them():
    with warnings.catch_warnings():
        warnings.simplefilter("error", ScanfabWarning)
        with recorded() as told, pytest.raises(ScanfabWarning, match="choose another"):
            tell()
    assert told.warnings == ["choose another --rv"]


def test_filters_are_as_they_were_afterwards():
    before, show = list(warnings.filters), warnings.showwarning
    with recorded():
        pass
    assert warnings.filters == before
    assert warnings.showwarning is show
