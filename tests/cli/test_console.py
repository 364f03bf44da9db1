"""A table for people: key columns always, others where there is room, and no head is ever cut."""

from __future__ import annotations

import re

import pytest

from scanfab.cli.console import KEYS, MORE, print_table
from scanfab.table.table import Row
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
    assert set(KEYS.values()) <= set(columns) <= {*KEYS.values(), *MORE.values()}
    assert len(rows) == 3
    for row in rows:
        assert len(row.split()) == len(columns)


def test_what_does_not_fit_is_left_out_least_telling_first(shown):
    counts = []
    for width in range(60, 201):
        head = shown(width)[0]
        present = [title in titles(head) for title in MORE.values()]
        assert present == sorted(present, reverse=True)
        if any(present):
            assert len(head) <= width
        counts.append(sum(present))
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (0, len(MORE))


def test_error_is_that_of_scan_and_sample_together(shown):
    head, row, *_ = shown(200)
    numbers = row.split()
    assert numbers[numbers.index("-0.0123") + 1 :][:3] == ["0.0005", "0.0003", "0.0004"]
    assert [head.index(title) for title in ("± total", "± scan", "± sample")] == sorted(
        head.index(title) for title in ("± total", "± scan", "± sample")
    )


def test_columns_and_digits_that_were_asked_for_are_shown(shown):
    excerpt = Excerpt.make(Row, "variant,alpha_vs_axial", 5)
    assert [line.split() for line in shown(80, excerpt)[:2]] == [
        ["variant", "alpha_vs_axial"],
        ["d", "-0.012346"],
    ]
