"""Tables read back, told apart by their content, and those that are broken."""

from __future__ import annotations

import pytest

from scanfab.base.errors import ReadError
from scanfab.table.formats import read_rows


@pytest.mark.parametrize(
    "text",
    [
        "source,frame,alpha\n1e3,0,0.5\nb,1,\n",
        "\ufeffsource,frame,alpha\r\n1e3,0,0.5\r\nb,1,\r\n",
        "source\tframe\talpha\n1e3\t0\t0.5\nb\t1\t\n",
        '[{"source": "1e3", "frame": 0, "alpha": 0.5}, {"source": "b", "frame": 1, "alpha": null}]',
        '{"source": "1e3", "frame": 0, "alpha": 0.5}\n\n'
        '{"source": "b", "frame": 1, "alpha": null}\n',
    ],
    ids=["csv", "csv of other programs", "tsv", "json", "jsonl"],
)
def test_the_content_tells_the_format(tmp_path, text):
    """A source that looks like a number stays a text."""
    (tmp_path / "table.txt").write_text(text, encoding="utf-8", newline="")
    first, second = read_rows(tmp_path / "table.txt")
    assert first == {"source": "1e3", "frame": 0, "alpha": 0.5}
    assert second == {"source": "b", "frame": 1, "alpha": None}
    assert type(first["frame"]) is int


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read: No such file"),
        (b"", "expected a table, found an empty file"),
        (b"a,b\n1,2\n1\n", "line 3: expected 2 cells as in line 1, found 1: is"),
        (b"a,b\n1,2,3\n", "line 2: expected 2 cells as in line 1, found 3"),
        (b'{"a": 1}\n{"a": \n', "cannot be read as JSON"),
        (b"[{]", "cannot be read as JSON"),
        (b"[1, 2]", "expected JSON objects, one for each row"),
        (b"[" * 100_000, "cannot be read as JSON"),
        (b'[{"a": ' + b"9" * 5000 + b"}]", "cannot be read as JSON"),
        (b"\xff\xfe\x00\x01", "expected text in UTF-8 or Parquet, found other bytes"),
        (b"PAR1 and nothing else", "cannot be read as Parquet"),
    ],
)
def test_a_broken_table_is_named(tmp_path, content, message):
    path = tmp_path / "table.dat"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ReadError, match=message) as caught:
        read_rows(path)
    assert str(caught.value).startswith(str(path))
