"""Files sorted into families: natural order, several series, and two files for one step."""

from __future__ import annotations

import gzip

import pytest

import scanfab
from scanfab.base.errors import ReadError, UnknownFormatError
from scanfab.io.families import sort_into_families
from tests.helpers.dumps import dump_text, pairs_text, write


def families_of(tmp_path, names, text=None, format=None):
    files = []
    for name in names:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        files.append(write(path, dump_text() if text is None else text))
    return sort_into_families(files, format)


def steps(family):
    return list(family.files)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["dump_10.txt", "dump_9.txt", "dump_100.txt"], [9, 10, 100]),
        (["dump_0010.txt", "dump_0009.txt"], [9, 10]),
        (["dump10.txt", "dump9.txt"], [9, 10]),
        (["p.10.liggghts", "p.9.liggghts"], [9, 10]),
        (["run2_dump_10.txt", "run2_dump_9.txt"], [9, 10]),
        (["dump_10_v2.txt", "dump_9_v2.txt"], [9, 10]),
        (["a_0000_s.17650.vtu", "a_0003_s.34850.vtu"], [17650, 34850]),
        (["dump_10.txt.gz", "dump_9.txt"], [9, 10]),
    ],
)
def test_files_are_in_the_natural_order_of_their_steps(tmp_path, names, expected):
    (family,) = families_of(tmp_path, names)
    assert steps(family) == expected
    assert family.kind == "grains"


def test_a_step_may_be_the_ending_of_a_name(tmp_path):
    (family,) = families_of(tmp_path, ["dump.1000", "dump.900", "dump.10000"])
    assert steps(family) == [900, 1000, 10000]


def test_a_single_file_has_the_last_number_of_its_name(tmp_path):
    (family,) = families_of(tmp_path, ["run2_dump_500.txt"])
    assert steps(family) == [500]


def test_a_name_without_a_number_has_no_step(tmp_path):
    (family,) = families_of(tmp_path, ["dump.txt"])
    assert steps(family) == [None]


def test_the_ending_of_a_name_is_no_step(tmp_path):
    path = tmp_path / "dump.bz2"
    path.write_bytes(gzip.compress(dump_text().encode()))
    (family,) = sort_into_families([path], None)
    assert steps(family) == [None]


def test_other_letters_are_another_family(tmp_path):
    found = families_of(tmp_path, ["a_1.txt", "b_1.txt", "a_2.txt", "b_2.txt"])
    assert [family.pattern.split("/")[-1] for family in found] == ["a_*.txt", "b_*.txt"]


def test_other_endings_are_another_family(tmp_path):
    assert len(families_of(tmp_path, ["a_1.txt", "a_1.dump"])) == 2


def test_files_of_several_folders_may_be_one_family(tmp_path):
    """The single files of one command line form one series."""
    (family,) = families_of(tmp_path, ["one/a_1.txt", "two/a_2.txt"])
    assert steps(family) == [1, 2]


def test_runs_that_differ_in_a_number_are_several_series(tmp_path):
    names = [f"run{run}_dump_{step}.txt" for run in (1, 2) for step in (100, 200)]
    found = families_of(tmp_path, names)
    assert [steps(family) for family in found] == [[100, 200], [100, 200]]
    assert [family.pattern.split("/")[-1] for family in found] == [
        "run1_dump_*.txt",
        "run2_dump_*.txt",
    ]


def test_runs_of_unequal_length_are_several_series(tmp_path):
    names = ["run1_100.txt", "run1_200.txt", "run2_100.txt"]
    assert [steps(family) for family in families_of(tmp_path, names)] == [[100, 200], [100]]


def test_numbers_that_rise_together_are_one_series(tmp_path):
    names = [f"t{k}_step{10 * k}.txt" for k in (1, 2, 3)]
    (family,) = families_of(tmp_path, names)
    assert steps(family) == [10, 20, 30]
    assert family.pattern.endswith("t*_step*.txt")


@pytest.mark.parametrize(
    "names", [("dump_1.txt", "dump_1.txt.gz"), ("dump_01.txt", "dump_1.txt"), ("d.txt", "d.txt.xz")]
)
def test_two_files_for_one_step_are_an_error_that_names_both(tmp_path, names):
    (family,) = families_of(tmp_path, names)
    with pytest.raises(
        ReadError, match=r"two files for one step: .* and .*: name one of them"
    ) as e:
        family.check()
    assert all(name in str(e.value) for name in names)


def test_two_files_that_no_reader_knows_may_be_of_one_step(tmp_path):
    (family,) = families_of(tmp_path, ["log_1.txt", "log_01.txt"], text="hello\n")
    assert family.reader is None


def test_the_kind_is_that_of_the_largest_file(tmp_path):
    write(tmp_path / "dump_0.txt", dump_text(rows=[], names="id type"))
    write(tmp_path / "dump_1.txt", dump_text())
    (family,) = sort_into_families(sorted(tmp_path.iterdir()), None)
    assert family.kind == "grains"


def test_contacts_and_unknown_files_are_families_of_their_own(tmp_path):
    write(tmp_path / "dump_1.txt", dump_text())
    write(tmp_path / "pairs_1.txt", pairs_text())
    write(tmp_path / "log.txt", "hello\n")
    found = sort_into_families(sorted(tmp_path.iterdir()), None)
    assert [(family.kind, family.reader is None) for family in found] == [
        ("grains", False),
        ("other", True),
        ("contacts", False),
    ]


def test_the_named_reader_is_used_for_all(tmp_path):
    (family,) = families_of(tmp_path, ["dump_1.txt"], format="liggghts")
    assert family.reader.name == "liggghts"


def test_a_reader_that_does_not_exist_is_an_error(tmp_path):
    with pytest.raises(UnknownFormatError, match="no reader called 'rocky'"):
        families_of(tmp_path, ["dump_1.txt"], format="rocky")


def test_contacts_of_a_table_are_its_own_also_where_a_dump_lies_beside(tmp_path):
    (tmp_path / "g.csv").write_text("id,x,y,z,radius\n1,0,0,0,1\n2,1.9,0,0,1\n")
    (tmp_path / "g.contacts.csv").write_text("id1,id2,area\n1,2,7\n")
    write(tmp_path / "other.txt", dump_text())
    with pytest.warns(scanfab.ScanfabNote, match="contacts are read from .*g.contacts.csv"):
        packing = scanfab.read(tmp_path / "g.csv")
    assert len(packing.contacts) == 1
