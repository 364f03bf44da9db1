"""A table for people: key columns always, others where there is room, and no head is ever cut."""

from __future__ import annotations

import re

import pytest

from scanfab.cli.console import KEYS, MORE, print_table
from scanfab.table.columns import table_columns
from scanfab.table.row import Row
from scanfab.table.writing import Excerpt
from tests.table.test_table import a_row

ROWS = [
    a_row(
        frame=frame,
        strain=0.0123456,
        variant="d",
        grains=123456,
        contacts=1234567,
        coordination=4.98765,
        solid_fraction=0.61234,
        mean_length=0.00123456,
        alpha_vs=0.0123456,
        alpha_vs_axial=-0.0123456,
        alpha_vs_axial_se=3e-4,
        alpha_vs_axial_sample_se=4e-4,
        alpha_c_axial=-0.0876543,
    )
    for frame in range(3)
]


# those that only maps have are left out
OWN_KEYS, OWN_MORE = (
    {name: title for name, title in every.items() if name in ROWS[0] or name == "total"}
    for every in (KEYS, MORE)
)


@pytest.fixture
def shown(capsys, monkeypatch):
    """The lines of a table on a terminal of some columns."""

    def show(width: int, excerpt: Excerpt | None = None) -> list[str]:
        monkeypatch.setenv("COLUMNS", str(width))
        print_table(ROWS, excerpt or Excerpt())
        return capsys.readouterr().out.splitlines()

    return show


def titles(head: str) -> list[str]:
    return re.split(" {2,}", head.strip())


@pytest.mark.parametrize("width", [40, 60, 80, 100, 119, 120, 121, 200])
def test_heads_are_whole_in_every_width(shown, width):
    head, *rows = shown(width)
    assert "…" not in head + "".join(rows)
    columns = titles(head)
    assert set(OWN_KEYS.values()) <= set(columns) <= {*OWN_KEYS.values(), *OWN_MORE.values()}
    assert len(rows) == 3
    for row in rows:
        assert len(row.split()) == len(columns)


def test_a_map_says_which_block_a_row_is_of(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    place = {"block": 7, "x": 1.0, "y": 2.0, "z": 3.0, "at_surface": 0}
    print_table([Row(**ROWS[0], **place)], Excerpt())
    head, row = capsys.readouterr().out.splitlines()
    assert dict(zip(titles(head), row.split(), strict=True))["block"] == "7"
    assert {"x", "y", "z", "at surface"} <= set(titles(head))
    assert "from r" not in titles(head)


def test_what_does_not_fit_is_left_out_least_telling_first(shown):
    counts = []
    for width in range(60, 201):
        head = shown(width)[0]
        present = [title in titles(head) for title in OWN_MORE.values()]
        assert present == sorted(present, reverse=True)
        if any(present):
            assert len(head) <= width
        counts.append(sum(present))
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (0, len(OWN_MORE))


def test_error_is_that_of_scan_and_sample_together(shown):
    head, row, *_ = shown(200)
    numbers = row.split()
    assert numbers[numbers.index("-0.0123") + 1 :][:3] == ["0.0005", "0.0003", "0.0004"]
    assert [head.index(title) for title in ("± total", "± scan", "± sample")] == sorted(
        head.index(title) for title in ("± total", "± scan", "± sample")
    )


def test_columns_and_digits_that_were_asked_for_are_shown(shown):
    excerpt = Excerpt.make(table_columns(), "variant,alpha_vs_axial", 5)
    assert [line.split() for line in shown(80, excerpt)[:2]] == [
        ["variant", "alpha_vs_axial"],
        ["d", "-0.012346"],
    ]
