"""The first part of docs/validation.md: what it says of known tables, and of those here."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

from tests.campaigns import paper
from tests.conftest import ROOT
from tests.test_docs import script

FRAMES = 41
SLOPE = 0.1
# of the whole beside the RV: ends leaves two thirds of the difference that clip makes
WHOLE = {("a", "default"): 0.25, ("a", "ends"): 0.5}
ENGINE = {
    "porosity": 0.39, "coordination": 4.7, "rattlers": 100, "overlap": 0.018, "contacts": 9000,
    "contacts_rv": 9000,
    "inertial_number": 3.4e-4, "gc_xy": 0.0, "gc_xz": 0.0, "gc_yz": 0.0,
}  # fmt: skip


@pytest.fixture
def page(tmp_path, monkeypatch):
    """The script of the page with tables of a line through the origin, at no scatter."""
    folder = tmp_path / "sample_data" / "paper"
    folder.mkdir(parents=True)
    for name, run in paper.RUNS.items():
        write(folder / f"{name}_engine.csv", engine_rows(run))
        for measure in run.measures:
            write(folder / f"{name}_{measure}.csv", table_rows(run, measure))
    shutil.copy(paper.TABLES / "others.csv", folder)
    monkeypatch.chdir(tmp_path)
    made = script("make_validation")
    monkeypatch.setattr(made.paper_tables, "TABLES", folder)
    return made


def write(path: Path, rows: list[dict]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def contact(frame: int) -> float:
    """The axial anisotropy of the contacts."""
    return 0.08 * (frame / 40) ** 0.5


def tensor(frame: int) -> dict[str, float]:
    axial = contact(frame)
    return {"gc_xx": (1 - axial) / 3, "gc_yy": (1 - axial) / 3, "gc_zz": (1 + 2 * axial) / 3}


def step_of(run: paper.Run, frame: int) -> int:
    """A run that goes on from frame 40 goes back."""
    return 40 - frame if run.frames == "40:" else frame


def engine_rows(run: paper.Run) -> list[dict]:
    p = 400.0 if run.is_plane else 200e3
    stress = {"p": p, "p_whole": p, "rv_radius": 0.02}
    rows = [
        {"frame": k, "strain": 0.005 * k, **ENGINE, **stress, **tensor(step_of(run, k))}
        for k in range(FRAMES)
    ]
    return [{**row, "q": 0.7 * p, "q_whole": 0.5 * p} for row in rows]


def table_rows(run: paper.Run, measure: str) -> list[dict]:
    columns = paper.MEASURES[measure].columns
    several = {
        "cutoff": [0.5e-3 * one for one in (0, 0.3, 0.5, 1, 1.5, 2, 3)],
        "rv": [0.4, 0.5, 0.6],
    }
    kind = next((one for one in several if one in columns), None)
    rows = []
    for frame in range(FRAMES):
        step = step_of(run, frame)
        for variant in "abcd":
            for value in several.get(kind, [0]):
                row = dict.fromkeys(columns, 0.0) | {"source": run.folder, "frame": frame}
                row |= {"strain": 0.005 * step, "variant": variant, **ENGINE, **tensor(step)}
                level = contact(step) * WHOLE.get((variant, measure), 1.0)
                row |= {name: level for name in columns if name.startswith("alpha_c")}
                row |= {name: SLOPE * level for name in columns if is_void(name)}
                row |= {name: 1e-4 for name in columns if name.endswith("_se")}
                row |= {name: 0.02 for name in columns if name.endswith("_a2")}
                rows.append({name: row[name] for name in columns} | ({kind: value} if kind else {}))
    return rows


def is_void(name: str) -> bool:
    return name == "alpha_vs_axial" or name.startswith("alpha_vs_axial_without")


def test_known_tables_give_their_slope_everywhere(page) -> None:
    lines = [line for line in page.claims.slopes().splitlines()[2:] if line]
    # variants, rules, runs
    assert len(lines) == 4 * 4 * 5
    assert all(
        "| 0.100 (0.100 to 0.100) | 0.100 (0.100 to 0.100) | 0.100 | no |" in line for line in lines
    )
    choices = page.choices().splitlines()[2:]
    assert len(choices) == len(page.CHOICES)
    assert all(" 0.100 ± 0.000 | " in line and "nan" not in line for line in choices)


def test_counts_that_are_equal_are_said_to_be_equal(page) -> None:
    lines = page.claims.counted().splitlines()[2:]
    assert len(lines) == len(paper.RUNS)
    assert all("| 41 of 41 | 41 of 41 | 0e+00 |" in line for line in lines)


def test_one_contact_more_is_told(page) -> None:
    path = page.paper_tables.TABLES / "yade_2_engine.csv"
    path.write_text(path.read_text("utf-8").replace(",9000,", ",9001,", 1), encoding="utf-8")
    assert "| `yade_2` | 40 of 41 | 41 of 41 |" in page.claims.counted()


def test_the_sentences_hold_the_numbers_of_the_tables(page) -> None:
    """Slopes of 0.1 without scatter are 0.004 above the paper's; voids follow contacts at once."""
    words = page.words
    assert words.slope_misses().startswith(
        "0 of 32 intervals; the others miss it: `yade_1` a by clip (by 0.0040)"
    )
    assert words.left_by_ends(0.08) == "67"
    assert words.disc_ratio() == "0.10"
    assert words.contact_share() == words.void_share() == "71"
    assert words.normalised_worst() == "0.00"
    assert words.best_cutoff(0.2) == "0"
    assert words.order_four("vs") == "0"


def test_every_part_of_the_page_is_filled(page) -> None:
    text = page.section()
    assert "{{" not in text
    assert "nan" not in text
    assert "$ scanfab compare sample_data/paper/yade_1_default.csv" in text


def test_the_page_is_that_of_the_stored_tables(monkeypatch) -> None:
    monkeypatch.chdir(ROOT)
    made = script("make_validation")
    text = made.PAGE.read_text("utf-8")
    assert text == made.page(), "run python docs/make_validation.py"
