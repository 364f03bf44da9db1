"""The first part of docs/validation.md: it is that of the stored tables, and true of known ones."""

from __future__ import annotations

import csv

import pytest

from tests.campaigns import paper
from tests.conftest import ROOT
from tests.test_docs import script

# what the made-up tables below say, by the name of a number of the page
NUMBERS = {
    "start_worst": "2.0",
    "normalised_worst": "0.00",
    "disc_misses": "a by 0.131, b by 0.131, c by 0.131, d by 0.131",
    "disc_ratio": "0.10",
    "slope_small_rv": "0.100 (0.100 to 0.100)",
    "cutoff_slopes": "0.100, 0.100, 0.100",
    "spacing_change": "0.0000",
    "predicted_off": "20",
    "left_12": "100",
    "slope_back": "0.100",
    "voids_left": "0",
    "null_tests": "Of 181 anisotropies of hard spheres 117 are more than one error from 0, 61 more "
    "than two, 61 more than three",
    "order_four_voids": "5",
    "order_four_discs": "5",
    "order_four_contacts": "2",
    "stress_smooth": "0.80",
    "printed_radius": "30.6",
    "printed_rv_grains": "44",
    "overlap_usual": "1.2",
    "reversal_pressure": "5.0",
}


def known(row: dict[str, str]) -> dict[str, float]:
    """Numbers of a row that replace the stored ones where there are any."""
    found = {"p": 210e3, "q": 105e3, "p_whole": 1e5, "q_whole": 4e4, "porosity": 0.4}
    found["overlap"] = 0.012
    for fabric, share in (("vs", 0.05), ("c", 0.02)):
        if f"{fabric}_a2" in row:
            found[f"{fabric}_a4"] = share * float(row[f"{fabric}_a2"])
    for end in ("", *(f"_without_{block}" for block in range(1, 9))):
        if contact := row.get(f"alpha_c_axial{end}"):
            found[f"alpha_vs_axial{end}"] = 0.1 * float(contact)
    if contact := row.get("alpha_c_axial"):
        found["alpha_vs_axial_contacts"] = 0.12 * float(contact)
        found["alpha_vs_axial_se"] = 0.03 * abs(float(contact))
        found["alpha_vs_axial_sample_se"] = 0.04 * abs(float(contact))
    for axis, errors in (("x", 0.5), ("y", 1.5), ("z", 3.5)):
        if error := row.get(f"alpha_vs_{axis}_se"):
            found[f"alpha_vs_{axis}"] = errors * float(error)
    return found | {f"alpha_vs_axial_half_{block}": 0.0 for block in range(1, 9)}


@pytest.fixture
def made(monkeypatch):
    monkeypatch.chdir(ROOT)
    return script("make_validation")


@pytest.fixture
def made_up(made, tmp_path, monkeypatch):
    """The page's script, with made-up numbers in the tables that are stored."""
    for stored in paper.TABLES.glob("*.csv"):
        with stored.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            row |= {name: repr(value) for name, value in known(row).items() if row.get(name)}
        with (tmp_path / stored.name).open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
    monkeypatch.setattr(made.paper_tables, "TABLES", tmp_path)
    return made


def test_the_page_is_that_of_the_stored_tables(made) -> None:
    text = made.PAGE.read_text("utf-8")
    assert text == made.page(), "run python docs/make_validation.py"


def test_known_tables_give_known_numbers(made_up) -> None:
    """The errors of hard spheres are known along x 64 times, along y 56 and along z 61 times."""
    lines = [line for line in made_up.claims.slopes().splitlines()[2:] if line]
    assert len(lines) > 60  # of runs, variants and rules
    assert all("| 0.100 (0.100 to 0.100) |" in line and "| 0.100 |" in line for line in lines)
    assert {name: made_up.PARTS[name]() for name in NUMBERS} == NUMBERS
    assert made_up.PARTS["void_share"]() == made_up.PARTS["contact_share"]()
    assert made_up.PARTS["voids_back"]() == made_up.PARTS["contacts_back"]()
    assert made_up.PARTS["slope_misses"]().count("(by 0.0040)") == 24
