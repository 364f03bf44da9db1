"""What docs/validation.md takes from the stored tables is true of tables whose slope is known."""

import csv

from tests.campaigns import paper
from tests.test_docs import import_module

paper_page = import_module("paper")


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
    monkeypatch.setattr(paper_page, "TABLES", tmp_path)
    lines = paper_page.slopes().splitlines()[2:]
    assert len(lines) > 40  # of runs, rules and settings
    for line in lines:
        cells = [cell.strip() for cell in line.split("|")[2:-1] if cell.strip()]
        assert all(
            cell.split() == ["0.100", "±", "0.000"] or cell.split()[2] == "0.000\\*"
            for cell in cells
        )
