"""Snapshots at the end of a file that may be incomplete, and rows that are skipped."""

from __future__ import annotations

import io

import pytest

from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io import text
from scanfab.io.parse.growing import leave_out_last


@pytest.mark.parametrize("piece", [1, 7, 1 << 20])
def test_rows_are_skipped_by_their_ends(monkeypatch, piece):
    monkeypatch.setattr(text, "PIECE", piece)
    stream = io.BytesIO(b"a\nbb\n\nccc\nd")
    assert text.skip_rows(stream, 3) == 3
    assert stream.tell() == 6
    assert text.skip_rows(stream, 2) == 1


def test_a_last_snapshot_is_left_out_if_there_are_others(tmp_path):
    with pytest.warns(ScanfabWarning, match="number 3, is incomplete and is left out: why"):
        leave_out_last(tmp_path, 2, "why")
    with pytest.raises(ReadError, match="why: the file is incomplete"):
        leave_out_last(tmp_path, 0, "why")
