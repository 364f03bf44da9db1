"""The syntax of ITEM: text dumps: snapshots, headers, boxes, and what makes a file unreadable."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, ScanfabWarning
from scanfab.io.formats import text_dump
from scanfab.io.registry import reader_named
from tests.helpers.dumps import NAMES, ROWS, dump_text, write

TIMES = "ITEM: UNITS\nsi\nITEM: TIME\n{}\n"


def read(tmp_path, text, **options):
    return scanfab.read(write(tmp_path / "dump", text), **options)


def steps(tmp_path, text):
    return [frame.step for frame in scanfab.read_series(write(tmp_path / "dump", text))]


@pytest.mark.parametrize(
    "text",
    [
        dump_text(),
        dump_text(separator="   ", end="  \n"),
        dump_text(separator="\t", end="\n"),
        dump_text(end="\n"),
        dump_text(rows=[(f"   {row[0]}", *row[1:]) for row in ROWS]),
        dump_text(after="ITEM: LABEL\nGRAINS\n"),
        dump_text(before=TIMES.format(0.5)).replace("\n", "\r\n"),
        "\ufeff" + dump_text(),
        dump_text(
            rows=[(*row[:2], "Si", *row[2:]) for row in ROWS], names="id type element x y z r"
        ),
        dump_text(flags="", names=NAMES.replace("id", "tag")),
    ],
)
def test_grains_are_those_of_the_file(tmp_path, text):
    packing = read(tmp_path, text)
    rows = np.array(ROWS)
    assert packing.id.tolist() == rows[:, 0].tolist()
    assert packing.columns["type"].tolist() == rows[:, 1].tolist()
    np.testing.assert_array_equal(packing.position, rows[:, 2:5])
    np.testing.assert_array_equal(packing.radius, rows[:, 5])
    np.testing.assert_array_equal(packing.cell.vectors, np.eye(3))


def test_words_of_elements_are_kept(tmp_path):
    rows = [(*row, word) for row, word in zip(ROWS, ("Si", "1", "O"), strict=True)]
    packing = read(tmp_path, dump_text(rows, f"{NAMES} element"))
    assert packing.columns["element"].tolist() == ["Si", "1", "O"]


def test_large_ids_keep_all_digits(tmp_path):
    ids = [2**53 + 1, 2**62 + 1, 7]
    rows = [(id, *row[1:]) for id, row in zip(ids, ROWS, strict=True)]
    assert read(tmp_path, dump_text(rows)).id.tolist() == ids


@pytest.mark.parametrize("piece", [1, 64, 1 << 20])
@pytest.mark.parametrize("place", ["before", "after"])
def test_every_snapshot_is_found_in_the_order_of_its_step(tmp_path, monkeypatch, piece, place):
    monkeypatch.setattr(text_dump, "PIECE", piece)
    order = (8, 10, 9)
    texts = [
        dump_text(ROWS[: step % 4], step=step, **{place: TIMES.format(step / 4)}) for step in order
    ]
    frames = list(scanfab.read_series(write(tmp_path / "dump", "\ufeff" + "".join(texts))))
    assert [frame.step for frame in frames] == [8, 9, 10]
    assert [frame.snapshot.time for frame in frames] == [2.0, 2.25, 2.5]
    assert [len(frame.read()) for frame in frames] == [0, 1, 2]


@pytest.mark.parametrize("keep", [0.97, 0.8, 0.6, 0.2, 0.06])
def test_an_incomplete_last_snapshot_is_left_out_with_a_warning(tmp_path, keep):
    last = dump_text(step=10)
    with pytest.warns(ScanfabWarning, match="the last snapshot, number 2, is incomplete"):
        assert steps(tmp_path, dump_text() + last[: int(keep * len(last))]) == [0]


@pytest.mark.parametrize("before", ["", dump_text(step=-1)])
def test_a_last_line_without_its_end_is_read_with_a_warning(tmp_path, before):
    text = before + dump_text(end="\n")[:-1]
    with pytest.warns(ScanfabWarning, match="dump: the last line has no end"):
        assert len(read(tmp_path, text, frame=-1)) == 3


@pytest.mark.parametrize(
    ("flags", "periodic"),
    [(" pp pp pp", (1, 1, 1)), (" pp ff mm", (1, 0, 0)), (" fm ms pp", (0, 0, 1)), ("", (0, 0, 0))],
)
def test_only_pp_is_periodic(tmp_path, flags, periodic):
    assert read(tmp_path, dump_text(flags=flags)).cell.periodic == periodic


@pytest.mark.parametrize(
    "tilt", [(0.0, 0, 0), (0.4, 0.2, -0.3), (-0.4, 0.2, 0.3), (-0.4, -0.2, 0.1)]
)
def test_the_bounds_are_those_of_the_box_around_a_tilted_one(tmp_path, tilt):
    vectors = np.diag([2.0, 3.0, 4.0])
    vectors[[1, 2, 2], [0, 0, 1]] = tilt
    origin = np.array([-0.5, 0.25, 1.0])
    corners = origin + np.array(list(itertools.product((0, 1), repeat=3))) @ vectors
    box = np.column_stack([corners.min(axis=0), corners.max(axis=0), tilt]).tolist()
    cell = read(tmp_path, dump_text(box=box, flags=" xy xz yz pp pp ff")).cell
    np.testing.assert_allclose(cell.vectors, vectors, atol=1e-15)
    np.testing.assert_allclose(cell.origin, origin, atol=1e-15)
    assert cell.periodic == (True, True, False)


def test_a_general_triclinic_header(tmp_path):
    box = ((1, 0.5, 0, -1), (-0.25, 1, 0, 2), (0, 0.125, 1, 3))
    rows = [(1, 1, -1, 2, 3, 0.1)]
    cell = read(tmp_path, dump_text(rows, flags=" abc origin pp pp ff", box=box)).cell
    np.testing.assert_array_equal(cell.vectors, np.array(box)[:, :3])
    np.testing.assert_array_equal(cell.origin, [-1, 2, 3])


@pytest.mark.parametrize("edge", [(0, 0), (1, 0), ("nan", "nan"), (0, "inf"), (0, 1e200)])
def test_only_a_periodic_box_must_have_a_volume(tmp_path, edge):
    box = (edge, (0, 1), (0, 1))
    assert read(tmp_path, dump_text(box=box)).cell is None
    with pytest.raises(ReadError, match=r"BOX BOUNDS ff pp ff: the box repeats.* no volume"):
        read(tmp_path, dump_text(box=box, flags=" ff pp ff"))


BAD = (2, 1, "oops", 0.5, 0.5, 0.1)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("ITEM: NUMBER OF ATOMS\n0\n", "expected a line ITEM: TIMESTEP, found none"),
        (dump_text()[:60], "header is incomplete: no ITEM: ATOMS"),
        (dump_text()[:-8], "step 0: .*counts 3 rows.* after 2 complete lines.*incomplete"),
        (dump_text().replace("ATOMS\n3", "ATOMS\n9"), "counts 9 rows.*incomplete"),
        (dump_text().replace("ATOMS\n3", "ATOMS\n2"), "counts 2 rows, found 3"),
        (dump_text().replace("ATOMS\n3", "ATOMS\n0"), "counts 0 rows, found 3"),
        *(
            (dump_text().replace("ATOMS\n3", f"ATOMS\n{count}"), "whole number after ITEM: NUMBER")
            for count in ("", "many", "-1", "9" * 30)
        ),
        *(
            (dump_text().replace("STEP\n0", f"STEP\n{step}"), "whole number after ITEM: TIMESTEP")
            for step in ("", "ten", "1.5", "9" * 5000)
        ),
        (dump_text([ROWS[0], BAD, ROWS[2]]), "dump, line 11: .* found 'oops'"),
        (dump_text([ROWS[0], ROWS[1][:4], ROWS[2]]), "dump, line 11: expected 6 columns, found 4"),
        (dump_text(step=-1) + dump_text([*ROWS[:2], BAD]), "dump, line 24: .* found 'oops'"),
        (dump_text(names="id x y z radius"), "line 10: expected 5 columns, found 6"),
        *(
            (dump_text(flags=flags, box=box), "BOX BOUNDS.*expected three")
            for flags, box in (
                (" zz zz zz", ((0, 1),) * 3),
                (" pp pp", ((0, 1),) * 3),
                (" xy xz yz pp pp", ((0, 1, 0),) * 3),
                (" ff ff ff", ((0, 1),) * 2),
                (" ff ff ff", ((0, "one"), (0, 1), (0, 1))),
                (" xy xz yz pp pp pp", ((0, 1),) * 3),
                (" abc origin pp pp pp", ((1, 0, 0),) * 3),
            )
        ),
    ],
)
def test_what_is_wrong_with_a_dump(tmp_path, text, told):
    with pytest.raises(ReadError, match=told):
        scanfab.read_series(write(tmp_path / "dump", text), format="liggghts")[-1].read()


def test_very_wide_dumps_keep_their_names(tmp_path):
    names = " ".join(f"c_{number}" for number in range(3000))
    packing = read(tmp_path, dump_text([(*ROWS[0], *range(3000))], f"{NAMES} {names}"))
    assert packing.columns["c_2999"].tolist() == [2999]


@pytest.mark.parametrize("left", [0, 100, 8192, 20000])
def test_a_file_that_is_cut_while_it_is_indexed_is_an_error(tmp_path, monkeypatch, left):
    """A program starts again and writes the dump anew: whoever has it mapped is killed."""
    path = write(tmp_path / "dump", "".join(dump_text(step=step) for step in range(200)))
    found = text_dump._starts

    def cut(stream):
        starts = found(stream)
        with open(path, "r+b") as other:
            other.truncate(left)
        return starts

    monkeypatch.setattr(text_dump, "_starts", cut)
    with pytest.raises(ReadError, match="expected a whole number after ITEM: TIMESTEP"):
        reader_named("liggghts").snapshots(path)
