"""The syntax of ITEM: text dumps: snapshots, headers, boxes, and what makes a file unreadable."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabWarning
from scanfab.io.parse import text_dump as dump
from scanfab.io.parse.text_dump import index_dump, read_block, row_word
from scanfab.io.reader import Snapshot
from tests.helpers.dumps import ROWS, dump_text, write


@pytest.fixture(autouse=True, params=["small", "large"])
def size(request, monkeypatch):
    """Every file as a small one, and as one large enough for the parser of regular tables."""
    if request.param == "large":
        monkeypatch.setattr(dump, "LARGE", 0)


def only_block(path):
    """The block of a file with one snapshot."""
    (snapshot,) = index_dump(path)
    return read_block(snapshot)


def block_of(tmp_path, text):
    return only_block(write(tmp_path / "dump", text))


def test_snapshots_are_in_the_order_of_their_steps(tmp_path):
    text = "".join(dump_text(step=step) for step in (80, 100, 90))
    found = index_dump(write(tmp_path / "dump", text))
    assert [snapshot.step for snapshot in found] == [80, 90, 100]
    assert [snapshot.start for snapshot in found] == [0, 2 * len(text) // 3 + 1, len(text) // 3]


def test_rows_and_names_are_those_of_the_file(tmp_path):
    block = block_of(tmp_path, dump_text(step=7))
    assert block.step == 7
    assert block.names == ["id", "type", "x", "y", "z", "radius"]
    np.testing.assert_array_equal(block.values, ROWS)


@pytest.mark.parametrize(
    ("separator", "end"),
    [
        pytest.param("   ", "  \n", id="runs of blanks"),
        pytest.param("\t", "\n", id="tabs"),
        pytest.param(" ", "\r\n", id="CRLF"),
        pytest.param(" ", "\n", id="no blank at the end"),
    ],
)
def test_white_space_does_not_matter(tmp_path, separator, end):
    text = dump_text(separator=separator, end=end)
    np.testing.assert_array_equal(block_of(tmp_path, text).values, ROWS)


def test_leading_blanks_do_not_matter(tmp_path):
    text = dump_text(rows=[(f"   {row[0]}", *row[1:]) for row in ROWS])
    np.testing.assert_array_equal(block_of(tmp_path, text).values, ROWS)


def test_a_whole_file_with_crlf_is_read(tmp_path):
    text = dump_text(before="ITEM: UNITS\nsi\n").replace("\n", "\r\n")
    block = block_of(tmp_path, text)
    assert block.names[-1] == "radius"
    np.testing.assert_array_equal(block.values, ROWS)
    np.testing.assert_array_equal(block.cell.vectors, np.eye(3))


def test_a_byte_order_mark_does_not_matter(tmp_path):
    path = tmp_path / "dump"
    path.write_bytes(b"\xef\xbb\xbf" + dump_text(step=3).encode())
    assert only_block(path).step == 3


def test_a_last_line_without_its_end_may_lack_digits(tmp_path):
    whole = dump_text(end="\n")
    for cut in (whole[:-1], whole[:-2]):
        with pytest.raises(ReadError, match=r"counts 3 rows.*after 2 complete lines.*incomplete"):
            block_of(tmp_path, cut)
    with pytest.raises(ReadError, match=r"counts 3 rows, found 2: the snapshot is incomplete"):
        block_of(tmp_path, whole[:-1].replace("\n2 1", "\n\n2 1"))


def test_no_atoms_is_an_empty_block_with_its_names(tmp_path):
    block = block_of(tmp_path, dump_text(rows=[]))
    assert block.values.shape == (0, 6)
    assert block.names[0] == "id"


def test_numbers_that_are_not_finite_are_passed_on(tmp_path):
    block = block_of(tmp_path, dump_text(rows=[(1, "nan", "-nan", "inf", "-inf", 1e-9)]))
    np.testing.assert_array_equal(np.isfinite(block.values[0]), [1, 0, 0, 0, 0, 1])


@pytest.mark.parametrize("count", [1, 2, 5])
def test_every_snapshot_of_a_file_is_found(tmp_path, count):
    steps = [100 * k for k in range(count)]
    text = "".join(dump_text(rows=ROWS[: k % 4], step=step) for k, step in enumerate(steps))
    found = index_dump(write(tmp_path / "dump", text))
    assert [snapshot.step for snapshot in found] == steps
    assert [len(read_block(snapshot).values) for snapshot in found] == [k % 4 for k in range(count)]


def test_a_label_item_shifts_nothing(tmp_path):
    block = block_of(tmp_path, dump_text(after="ITEM: LABEL\nGRAINS\n"))
    np.testing.assert_array_equal(block.values, ROWS)


def test_a_label_renames_the_rows():
    head = dump_text(rows=[(1, 2, 0)], names="c_con[1] c_con[2] c_con[3]", word="CONTACTS")
    assert row_word(head.encode()) == "CONTACTS"


@pytest.mark.parametrize("place", ["before", "after"])
def test_units_and_time_items_belong_to_their_own_snapshot(tmp_path, place):
    texts = [
        dump_text(step=step, **{place: f"ITEM: UNITS\nsi\nITEM: TIME\n{time}\n"})
        for step, time in ((0, 0.0), (10, 0.5), (20, 1.25))
    ]
    found = index_dump(write(tmp_path / "dump", "".join(texts)))
    assert [snapshot.time for snapshot in found] == [0.0, 0.5, 1.25]
    np.testing.assert_array_equal(read_block(found[1]).values, ROWS)


def test_without_a_time_item_the_time_is_not_known(tmp_path):
    (snapshot,) = index_dump(write(tmp_path / "dump", dump_text()))
    assert snapshot.time is None


def test_old_headers_have_no_names_and_no_flags(tmp_path):
    block = block_of(tmp_path, dump_text(names="", flags=""))
    assert block.names == []
    assert block.cell.periodic == (False, False, False)
    np.testing.assert_array_equal(block.values, ROWS)


@pytest.mark.parametrize(
    ("flags", "periodic"),
    [
        (" pp pp pp", (True, True, True)),
        (" pp ff mm", (True, False, False)),
        (" ss pp fs", (False, True, False)),
        (" fm ms pp", (False, False, True)),
        ("", (False, False, False)),
    ],
)
def test_only_pp_is_periodic(tmp_path, flags, periodic):
    assert block_of(tmp_path, dump_text(flags=flags)).cell.periodic == periodic


def test_the_box_is_the_cell(tmp_path):
    cell = block_of(tmp_path, dump_text(box=((-1, 2), (0, 4), ("-1e-1", 0.9)))).cell
    np.testing.assert_allclose(cell.vectors, np.diag([3.0, 4.0, 1.0]))
    np.testing.assert_allclose(cell.origin, [-1.0, 0.0, -0.1])


@pytest.mark.parametrize("tilts", [(0.4, 0.2, -0.3), (-0.4, 0.2, 0.3), (-0.4, -0.2, 0.1)])
def test_the_bounds_of_a_tilted_box_are_those_of_the_box_around_it(tmp_path, tilts):
    xy, xz, yz = tilts
    vectors = np.array([[2.0, 0, 0], [xy, 3.0, 0], [xz, yz, 4.0]])
    origin = np.array([-0.5, 0.25, 1.0])
    corners = [
        origin + a * vectors[0] + b * vectors[1] + c * vectors[2]
        for a in (0, 1)
        for b in (0, 1)
        for c in (0, 1)
    ]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    box = [(float(low[k]), float(high[k]), tilts[k]) for k in range(3)]
    cell = block_of(tmp_path, dump_text(box=box, flags=" xy xz yz pp pp ff")).cell
    np.testing.assert_allclose(cell.vectors, vectors, atol=1e-15)
    np.testing.assert_allclose(cell.origin, origin, atol=1e-15)
    assert cell.periodic == (True, True, False)


@pytest.mark.parametrize("box", [((0, 0), (0, 1), (0, 1)), ((1, 0), (0, 1), (0, 1))])
def test_a_box_without_volume_is_no_cell(tmp_path, box):
    assert block_of(tmp_path, dump_text(box=box)).cell is None


@pytest.mark.parametrize("edge", [(0, 0), (1, 0), ("nan", "nan"), (0, "inf")])
def test_a_periodic_box_must_have_a_volume(tmp_path, edge):
    with pytest.raises(
        ReadError, match=r"BOX BOUNDS ff pp ff: the box repeats, but its bounds .* no vol"
    ):
        block_of(tmp_path, dump_text(box=(edge, (0, 1), (0, 1)), flags=" ff pp ff"))


@pytest.mark.parametrize("flags", [" zz zz zz", " pp pp", " pf pp pp", " xy xz yz pp pp"])
def test_flags_that_nobody_knows_are_an_error(tmp_path, flags):
    box = [(0, 1, 0)] * 3 if "xy" in flags else [(0, 1)] * 3
    with pytest.raises(ReadError, match=r"BOX BOUNDS.*expected three boundary flags such as pp"):
        block_of(tmp_path, dump_text(box=box, flags=flags))


def test_rows_that_the_header_does_not_count_at_all_are_an_error(tmp_path):
    text = dump_text().replace(f"ATOMS\n{len(ROWS)}\n", "ATOMS\n0\n")
    with pytest.raises(ReadError, match=r"the header counts 0 rows, but more follow"):
        block_of(tmp_path, text)


@pytest.mark.parametrize("last", ["", dump_text(step=1)])
def test_more_rows_than_the_header_counts_are_an_error(tmp_path, last):
    text = dump_text().replace(f"ATOMS\n{len(ROWS)}\n", f"ATOMS\n{len(ROWS) - 1}\n")
    with pytest.raises(ReadError, match=rf"step 0: the header counts {len(ROWS) - 1} rows, but mo"):
        read_block(index_dump(write(tmp_path / "dump", text + last))[0])


def test_a_missing_box_is_no_cell(tmp_path):
    text = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ENTRIES\n1\nITEM: ENTRIES c_a[1]\n5\n"
    assert block_of(tmp_path, text).cell is None


@pytest.mark.parametrize(
    ("box", "flags"),
    [
        (((0, 1), (0, 1)), " ff ff ff"),
        (((0, "one"), (0, 1), (0, 1)), " ff ff ff"),
        (((0, 1), (0, 1), (0, 1)), " xy xz yz pp pp pp"),
        (((1, 0, 0), (0, 1, 0), (0, 0, 1)), " abc origin pp pp pp"),
    ],
)
def test_a_box_that_cannot_be_read_names_what_is_expected(tmp_path, box, flags):
    with pytest.raises(ReadError, match=r"BOX BOUNDS.*expected three lines of"):
        block_of(tmp_path, dump_text(box=box, flags=flags))


def test_words_in_the_element_column_are_no_error(tmp_path):
    block = block_of(tmp_path, dump_text(rows=[(1, "Si", 2.0)], names="id element x"))
    np.testing.assert_array_equal(block.values, [[1, np.nan, 2.0]])


def test_numbers_in_the_element_column_are_numbers_as_in_a_large_table(tmp_path):
    rows = [(1, "1", 2.0), (2, "Si", 3.0)]
    block = block_of(tmp_path, dump_text(rows=rows, names="id element x"))
    np.testing.assert_array_equal(block.values, [[1, 1.0, 2.0], [2, np.nan, 3.0]])


def test_a_word_among_numbers_names_file_and_line(tmp_path):
    rows = [ROWS[0], (2, 1, "oops", 0.5, 0.5, 0.1), ROWS[2]]
    with pytest.raises(ReadError, match=r"dump, line 11: expected a number, found 'oops'"):
        block_of(tmp_path, dump_text(rows=rows))


def test_the_line_is_that_of_the_file_in_later_snapshots_too(tmp_path):
    rows = [ROWS[0], ROWS[1], (3, 1, "oops", 0.5, 0.5, 0.1)]
    path = write(tmp_path / "dump", dump_text() + dump_text(rows=rows, step=10))
    with pytest.raises(ReadError, match=r"line 24: .*'oops'"):
        read_block(index_dump(path)[1])


def test_a_short_line_names_its_line(tmp_path):
    with pytest.raises(ReadError, match="dump, line 11: "):
        block_of(tmp_path, dump_text(rows=[ROWS[0], ROWS[1][:4], ROWS[2]]))


def test_lines_and_header_must_agree_on_the_columns(tmp_path):
    with pytest.raises(ReadError, match="header names 5 columns, the lines have 6"):
        block_of(tmp_path, dump_text(names="id type x y z"))


def test_fewer_rows_than_counted_are_an_incomplete_snapshot(tmp_path):
    text = dump_text().replace("ATOMS\n3\n", "ATOMS\n9\n")
    with pytest.raises(ReadError, match=r"step 0: the header counts 9 rows.*incomplete"):
        block_of(tmp_path, text)


@pytest.mark.parametrize("keep", [0.97, 0.8, 0.6])
def test_an_incomplete_last_snapshot_is_left_out_with_a_warning(tmp_path, keep):
    last = dump_text(step=10)
    path = write(tmp_path / "dump", dump_text() + last[: int(keep * len(last))])
    with pytest.warns(ScanfabWarning, match="the last snapshot, number 2, is incomplete"):
        found = index_dump(path)
    assert [snapshot.step for snapshot in found] == [0]


def test_a_header_cut_off_is_an_error(tmp_path):
    with pytest.raises(ReadError, match="header is incomplete: no ITEM: ATOMS line"):
        block_of(tmp_path, dump_text()[:60])


def test_an_empty_file_is_an_error(tmp_path):
    with pytest.raises(ReadError, match="the file is empty"):
        index_dump(write(tmp_path / "dump", ""))


def test_a_file_without_snapshots_is_an_error(tmp_path):
    with pytest.raises(ReadError, match="expected a line ITEM: TIMESTEP, found none"):
        index_dump(write(tmp_path / "dump", "ITEM: NUMBER OF ATOMS\n0\n"))


@pytest.mark.parametrize("step", ["", "ten", "1.5"])
def test_a_step_must_be_a_whole_number(tmp_path, step):
    text = dump_text().replace("TIMESTEP\n0\n", f"TIMESTEP\n{step}\n")
    with pytest.raises(ReadError, match="expected a whole number after ITEM: TIMESTEP"):
        index_dump(write(tmp_path / "dump", text))


@pytest.mark.parametrize("count", ["", "many", "-1"])
def test_a_count_must_be_a_whole_number(tmp_path, count):
    text = dump_text().replace("ATOMS\n3\n", f"ATOMS\n{count}\n")
    with pytest.raises(ReadError, match="expected a whole number after ITEM: NUMBER OF ATOMS"):
        block_of(tmp_path, text)


def test_the_words_of_a_header_may_stand_in_any_order(tmp_path):
    text = (
        "ITEM: NUMBER OF ATOMS\n1\nITEM: TIMESTEP\n5\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\n"
        "ITEM: ATOMS id\n4\n"
    )
    path = write(tmp_path / "dump", text)
    block = read_block(Snapshot(path, step=5))
    np.testing.assert_array_equal(block.values, [[4]])


@pytest.mark.parametrize("head", [b"", b"# vtk DataFile", b"ITEM: TIMESTEP\n0\n", b" ITEM: x"])
def test_other_files_count_nothing(head):
    assert row_word(head) is None


def test_very_wide_dumps_keep_their_names(tmp_path):
    names = " ".join(f"c_{number}" for number in range(3000))
    block = block_of(tmp_path, dump_text(rows=[range(3000)], names=names))
    assert len(block.names) == block.values.shape[1] == 3000


def test_a_file_that_was_cut_meanwhile_is_no_endless_search_for_its_lines(tmp_path):
    text = dump_text(step=1)
    path = write(tmp_path / "dump", text + dump_text(step=2))
    second = index_dump(path)[1]
    path.write_text(text[:20])
    with pytest.raises(ReadError, match="the header is incomplete"):
        read_block(second)
    assert dump.lines_above(second) == text[:20].count("\n")


@pytest.mark.parametrize("piece", [1, 7, 64, 1000])
@pytest.mark.parametrize("before", ["", "ITEM: UNITS\nlj\nITEM: TIME\n0.25\n"])
def test_snapshots_are_found_whatever_is_searched_at_a_time(tmp_path, monkeypatch, piece, before):
    texts = [before + dump_text(step=step) for step in range(20)]
    path = write(tmp_path / "dump", "\ufeff" + "".join(texts) + " ITEM: TIMESTEP")
    expected = index_dump(path)
    monkeypatch.setattr(dump, "PIECE", piece)
    assert index_dump(path) == expected
    assert [snapshot.step for snapshot in expected] == list(range(20))


@pytest.mark.parametrize("left", [0, 100, 8192, 20000])
def test_a_file_that_is_cut_while_it_is_indexed_is_an_error(tmp_path, monkeypatch, left):
    """A program starts again and writes the dump anew: whoever has it mapped is killed."""
    path = write(tmp_path / "dump", "".join(dump_text(step=step) for step in range(200)))
    snapshot = dump._snapshot

    def cut(*words):
        with open(path, "r+b") as stream:
            stream.truncate(left)
        return snapshot(*words)

    monkeypatch.setattr(dump, "_snapshot", cut)
    with pytest.raises(ReadError, match="expected a whole number after ITEM: TIMESTEP"):
        index_dump(path)


def test_a_step_of_thousands_of_digits_is_told_as_such(tmp_path):
    path = write(tmp_path / "dump_1.liggghts", dump_text().replace("\n0\n", f"\n{'9' * 5000}\n", 1))
    with pytest.raises(ReadError, match="expected a whole number after ITEM: TIMESTEP"):
        scanfab.read(path)
