"""The syntax of text dumps (ITEM: and YAML): snapshots, headers, boxes, and what is wrong."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import scanfab
from scanfab import ScanfabWarning
from scanfab.io.formats import shared
from tests.helpers.dumps import NAMES, ROWS, dump_text, holds, refuses, write
from tests.helpers.made.lammps import yaml_text

TIMES = "ITEM: UNITS\nsi\nITEM: TIME\n{}\n"
WORDS = [(*row[:2], word, *row[2:]) for row, word in zip(ROWS, ("Si", "1", "O"), strict=True)]


def read(tmp_path, text, **options):
    return scanfab.read(write(tmp_path / "dump", text), **options)


SPELLINGS = [
    dump_text(separator="   ", end="  \n"),
    dump_text(separator="\t", end="\n"),
    dump_text(rows=[(f"   {row[0]}", *row[1:]) for row in ROWS]),
    dump_text(after="ITEM: LABEL\nGRAINS\n"),
    dump_text(before=TIMES.format(0.5)).replace("\n", "\r\n"),
    dump_text(WORDS, "id type element x y z r"),
    dump_text(flags="", names=NAMES.replace("id", "tag")),
    yaml_text(0),
]


@pytest.mark.parametrize("text", SPELLINGS)
def test_grains_are_those_of_the_file(tmp_path, text):
    packing, rows = read(tmp_path, text), np.array(ROWS)
    holds(packing, step=0, id=rows[:, 0], type=rows[:, 1], radius=rows[:, 5])
    holds(packing, position=packing.cell.wrap(rows[:, 2:5]))
    if "element" in text:
        holds(packing, element=["Si", "1", "O"])
    if "---" not in text:
        holds(packing.cell, vectors=np.eye(3))


def test_of_a_repeated_column_the_first_counts_and_ids_keep_all_digits(tmp_path):
    ids = [2**53 + 1, 2**62 + 1, 7]
    rows = [(id, 5, *row[1:]) for id, row in zip(ids, ROWS, strict=True)]
    wide = " ".join(f"c_{number}" for number in range(3000))
    text = dump_text([(*row, *range(3000)) for row in rows], f"id type {NAMES[3:]} {wide}")
    holds(read(tmp_path, text), id=ids, type=[5, 5, 5], c_2999=[2999] * 3)


def test_a_dump_that_names_no_columns(tmp_path):
    text = dump_text(names="", flags="").replace("ATOMS  \n", "ATOMS\n")
    refuses(write(tmp_path / "dump", text), "the 6 columns have no names", format="lammps")
    packing = read(tmp_path, text, columns={"id": 1, "x": 3, "y": 4, "z": 5, "radius": 6})
    holds(packing, position=np.array(ROWS)[:, 2:5], **{"2": [1, 1, 2]})


@pytest.mark.parametrize("piece", [1, 64, 1 << 20])
@pytest.mark.parametrize("place", ["before", "after"])
def test_every_snapshot_is_found_in_the_order_of_its_step(tmp_path, monkeypatch, piece, place):
    monkeypatch.setattr(shared, "PIECE", piece)
    text = ""
    for step in (8, 10, 9):
        text += dump_text(ROWS[: step % 4], step=step, **{place: TIMES.format(step / 4)})
    frames = list(scanfab.read_series(write(tmp_path / "dump", text)))
    assert [frame.step for frame in frames] == [8, 9, 10]
    assert [frame.snapshot.time for frame in frames] == [2.0, 2.25, 2.5]
    assert [len(frame.read()) for frame in frames] == [0, 1, 2]


@pytest.mark.parametrize("keep", [0.97, 0.8, 0.6, 0.2])
@pytest.mark.parametrize("make", [dump_text, yaml_text])
def test_an_incomplete_last_snapshot_is_left_out_with_a_warning(tmp_path, make, keep):
    last = make(step=10)
    path = write(tmp_path / "dump", make(step=0) + last[: int(keep * len(last))])
    with pytest.warns(ScanfabWarning, match="the last snapshot, number 2, is incomplete"):
        assert [frame.step for frame in scanfab.read_series(path)] == [0]


@pytest.mark.parametrize(
    ("flags", "periodic"),
    [(" pp pp pp", (1, 1, 1)), (" pp ff mm", (1, 0, 0)), (" fm ms pp", (0, 0, 1)), ("", (0, 0, 0))],
)
def test_only_pp_is_periodic(tmp_path, flags, periodic):
    assert read(tmp_path, dump_text(flags=flags)).cell.periodic == periodic


@pytest.mark.parametrize("form", ["text", "yaml", "general"])
@pytest.mark.parametrize("tilt", [(0.4, 0.2, -0.3), (-0.4, 0.2, 0.3), (-0.4, -0.2, 0.1)])
def test_the_bounds_are_those_of_the_box_around_a_tilted_one(tmp_path, tilt, form):
    vectors = np.diag([2.0, 3.0, 4.0])
    vectors[[1, 2, 2], [0, 0, 1]] = tilt
    origin = np.array([-0.5, 0.25, 1.0])
    corners = origin + np.array(list(itertools.product((0, 1), repeat=3))) @ vectors
    box = np.column_stack([corners.min(axis=0), corners.max(axis=0), tilt]).tolist()
    text = dump_text(box=box, flags=" xy xz yz pp ff mm")
    if form == "general":
        text = dump_text(box=np.column_stack([vectors, origin]), flags=" abc origin pp ff mm")
    if form == "yaml":
        lines = "".join(f"  - [ {low}, {high} ]\n" for low, high, _ in box)
        text, old = yaml_text(), yaml_text().partition("box:\n")[2].partition("keywords")[0]
        text = text.replace(old, f"{lines}  - [ {', '.join(map(str, tilt))} ]\n")
    cell = read(tmp_path, text).cell
    np.testing.assert_allclose(cell.vectors, vectors, atol=1e-15)
    np.testing.assert_allclose(cell.origin, origin, atol=1e-15)
    assert cell.periodic == (True, False, False)


@pytest.mark.parametrize("edge", [(0, 0), (1, 0), ("nan", "nan"), (0, "inf"), (0, 1e200)])
def test_only_a_periodic_box_must_have_a_volume(tmp_path, edge):
    box = (edge, (0, 1), (0, 1))
    assert read(tmp_path, dump_text(box=box)).cell is None
    path = write(tmp_path / "dump", dump_text(box=box, flags=" ff pp ff"))
    refuses(path, r"dump, step 0: ITEM: BOX BOUNDS ff pp ff: the cell")


def test_a_bad_line_of_a_later_snapshot_is_counted_from_the_first(tmp_path):
    text = dump_text(step=-1) + dump_text().replace("0.58", "oops")
    refuses(write(tmp_path / "dump", text), r"dump, line 24: .* found 'oops'", frame=-1)
