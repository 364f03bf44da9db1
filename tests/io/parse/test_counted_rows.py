"""Counted rows: the same numbers from short and long tables, and what is wrong in which line."""

from __future__ import annotations

import io

import numpy as np
import pytest

from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io.parse import text_table as module
from scanfab.io.parse.counted_rows import counted_rows, leave_out_last, skip_rows, text_of
from scanfab.io.reader import Snapshot
from tests.helpers.dumps import write

VALUES = np.random.default_rng(0).normal(size=(50, 3))


def table(blank, end):
    return "".join(blank.join(map(repr, row)) + end for row in VALUES.tolist())


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize("blank", [" ", "  ", "\t"])
@pytest.mark.parametrize("end", ["\n", " \n", "\r\n", "  \n  "])
def test_the_same_numbers_whatever_the_blanks(tmp_path, monkeypatch, long, blank, end):
    monkeypatch.setattr(module, "LONG", 0 if long else 1 << 30)
    path = write(tmp_path / "a", f"head\n\n{table(blank, end)}\n\n")
    data = text_of(Snapshot(path))
    values = counted_rows(Snapshot(path), data, 4, len(data), count=50, widths=(3,), names="rows")
    np.testing.assert_array_equal(values, VALUES)


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("\n5 5 5\n", "\n5 x 5\n", "line 8: expected a number, found 'x'"),
        ("\n5 5 5\n", "\n5 5\n", "line 8: the number of columns changed"),
        ("\n5 5 5\n", "\n5 5 5 5\n", "line 8: the number of columns changed"),
        ("\n5 5 5\n", "\n", "the header counts 9 rows, found 8"),
        (" 5", "", "expected 3 columns of rows, found 2|number of columns changed"),
        ("\n9 9 9\n", "\n9 9 9", "the last line has no end"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path, monkeypatch, long, old, new, message):
    monkeypatch.setattr(module, "LONG", 0 if long else 1 << 30)
    text = "".join(f"{k} {k} {k}\n" for k in range(1, 10))
    assert old in text
    path = write(tmp_path / "a", "one\ntwo\n\n" + text.replace(old, new, 1))
    # the snapshot begins behind the first line
    snapshot = Snapshot(path, start=4)
    data = text_of(snapshot)
    with pytest.raises(ReadError, match=message):
        counted_rows(snapshot, data, 3, len(data), count=9, widths=(3,), names="rows")


@pytest.mark.parametrize("piece", [1, 7, 1 << 20])
def test_rows_are_skipped_by_their_ends(monkeypatch, piece):
    monkeypatch.setattr(module, "PIECE", piece)
    stream = io.BytesIO(b"a\nbb\n\nccc\nd")
    assert skip_rows(stream, 3) == 3
    assert stream.tell() == 6
    assert skip_rows(stream, 2) == 1


def test_a_last_snapshot_is_left_out_if_there_are_others(tmp_path):
    with pytest.warns(ScanfabWarning, match="number 3, is incomplete and is left out: why"):
        leave_out_last(tmp_path, 2, "why")
    with pytest.raises(ReadError, match="why: the file is incomplete"):
        leave_out_last(tmp_path, 0, "why")
