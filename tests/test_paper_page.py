"""The first part of docs/validation.md: it is that of the stored tables, and true of known ones."""

from __future__ import annotations

import csv

from tests.campaigns import paper
from tests.conftest import ROOT
from tests.test_docs import script


def test_the_page_is_that_of_the_stored_tables(monkeypatch) -> None:
    monkeypatch.chdir(ROOT)
    made = script("make_validation")
    text = made.PAGE.read_text("utf-8")
    assert text == made.page(), "run python docs/make_validation.py"


def test_tables_of_a_known_slope_give_it_in_every_row(tmp_path, monkeypatch) -> None:
    """The void fabric of each stored table is made a tenth of its contact fabric."""
    for stored in paper.TABLES.glob("*.csv"):
        with stored.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            for name in row:
                contact = row.get(name.replace("alpha_vs", "alpha_c"))
                if name.startswith("alpha_vs_axial_half"):
                    row[name] = "0"
                elif name == "alpha_vs_axial" or name.startswith("alpha_vs_axial_without"):
                    row[name] = repr(0.1 * float(contact)) if contact else ""
        with (tmp_path / stored.name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
    monkeypatch.chdir(ROOT)
    made = script("make_validation")
    monkeypatch.setattr(made.paper_tables, "TABLES", tmp_path)
    lines = [line for line in made.claims.slopes().splitlines()[2:] if line]
    assert len(lines) > 60  # of runs, variants and rules
    assert all("| 0.100 (0.100 to 0.100) |" in line and "| 0.100 |" in line for line in lines)
