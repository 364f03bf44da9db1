"""Tables read back, told apart by their content, and those that are broken."""

from __future__ import annotations

import pytest

from scanfab.base.errors import ReadError
from scanfab.table.reading import read_rows
from tests.helpers.dumps import write


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
    rows = read_rows(write(tmp_path / "table.txt", text))
    assert rows == [
        {"source": "1e3", "frame": 0, "alpha": 0.5},
        {"source": "b", "frame": 1, "alpha": None},
    ]
    assert type(rows[0]["frame"]) is int


def test_a_table_without_rows_is_empty(tmp_path):
    assert read_rows(write(tmp_path / "table.csv", "source,frame\n")) == []


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "expected a table, found nothing"),
        (b"a,b\n1,2\n1\n", "line 3: expected 2 cells, found 1"),
        (b"a,b\n1,2,3\n", "line 2: expected 2 cells, found 3"),
        (b'{"a": 1}\n{"a": \n', "cannot be read as JSON"),
        (b"[{]", "cannot be read as JSON"),
        (b"[1, 2]", "expected JSON objects, one for each row"),
        (b"[" * 100_000, "cannot be read as JSON"),
        (b'[{"a": ' + b"9" * 5000 + b"}]", "cannot be read as JSON"),
        (b"\xff\xfe\x00\x01", "expected a table as text or Parquet, found other bytes"),
        (b"PAR1 and nothing else", "cannot be read as Parquet"),
    ],
)
def test_a_broken_table_is_named(tmp_path, content, message):
    path = tmp_path / "table.dat"
    path.write_bytes(content)
    with pytest.raises(ReadError, match=message) as caught:
        read_rows(path)
    assert str(caught.value).startswith(str(path))


def test_a_table_that_does_not_exist(tmp_path):
    with pytest.raises(ReadError, match=r"nowhere.csv: cannot be read: No such file"):
        read_rows(tmp_path / "nowhere.csv")
