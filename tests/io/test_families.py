"""Names into families: natural order, several series, two files for one step, steps of names."""

from __future__ import annotations

import pytest

import scanfab
from scanfab.base.errors import ReadError
from tests.helpers.dumps import dump_text, write

STEPLESS = "x,y,z,radius\n0,0,0,1\n"


def opened(tmp_path, names, text=None, **options):
    for name in names:
        write(tmp_path / name, dump_text() if text is None else text)
    return scanfab.read_series(tmp_path, **options)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["dump_10.csv", "dump_9.csv", "dump_100.csv"], [9, 10, 100]),
        (["dump_0010.csv", "dump_0009.csv"], [9, 10]),
        (["dump10.csv", "dump9.csv"], [9, 10]),
        (["dump.1000", "dump.900", "dump.10000"], [900, 1000, 10000]),
        (["run2_dump_10.csv", "run2_dump_9.csv"], [9, 10]),
        (["dump_10_v2.csv", "dump_9_v2.csv"], [9, 10]),
        (["111_10k.spheres", "111_20k.spheres"], [10, 20]),
        (["a_0000_s.17650.csv", "a_0003_s.34850.csv"], [17650, 34850]),
        (["t1_step10.csv", "t2_step20.csv", "t3_step30.csv"], [10, 20, 30]),
        (["dump_10.csv.gz", "dump_9.csv"], [9, 10]),
        # of a single file nobody knows what number is the step
        (["111_10k.spheres"], [None]),
        (["hopper_3d_demo.csv"], [None]),
        (["dump.csv"], [None]),
        (["dump.bz2"], [None]),
    ],
)
def test_files_are_in_the_natural_order_of_their_steps(tmp_path, names, expected):
    assert [frame.step for frame in opened(tmp_path, names, STEPLESS)] == expected


def test_the_names_beside_a_single_file_tell_its_step(tmp_path):
    opened(tmp_path, ["run2_500_v3.csv", "run2_600_v3.csv"], STEPLESS)
    assert scanfab.read(tmp_path / "run2_500_v3.csv").step == 500
    (tmp_path / "run2_600_v3.csv").unlink()
    assert scanfab.read(tmp_path / "run2_500_v3.csv").step is None
    # a step in the file comes before that of its name
    write(tmp_path / "run2_500_v3.csv", dump_text(step=5000))
    assert scanfab.read(tmp_path / "run2_500_v3.csv").step == 5000


RUNS = [f"run{run}_dump_{step}.txt" for run in (1, 2) for step in (100, 200)]


@pytest.mark.parametrize(
    ("names", "globs"),
    [
        (["a_1.txt", "b_1.txt", "a_2.txt", "b_2.txt"], ["a_*.txt", "b_*.txt"]),
        (["a_1.txt", "a_1.dump"], ["a_1.dump", "a_1.txt"]),
        (RUNS, ["run1_dump_*.txt", "run2_dump_*.txt"]),
        (["run1_100.txt", "run1_200.txt", "run2_100.txt"], ["run1_*.txt", "run2_100.txt"]),
        # a star alone would match the other series
        (["a_1.txt", "a_2.txt", "a_b_1.txt"], ["a_[0-9]*.txt", "a_b_1.txt"]),
    ],
)
def test_several_series_are_an_error_that_lists_their_globs(tmp_path, names, globs):
    with pytest.raises(ReadError, match="several series of grains") as told:
        opened(tmp_path, names)
    lines = [line.strip() for line in str(told.value).splitlines()[1:]]
    assert lines == [f"{tmp_path}/{glob}" for glob in globs]


def test_files_of_several_folders_may_be_one_series(tmp_path):
    files = [tmp_path / "one" / "a_1.csv", tmp_path / "two" / "a_2.csv"]
    for file in files:
        file.parent.mkdir()
        write(file, STEPLESS)
    assert [frame.step for frame in scanfab.read_series(files)] == [1, 2]


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
@pytest.mark.parametrize(
    "names", [("dump_1.txt", "dump_1.txt.gz"), ("dump_01.txt", "dump_1.txt"), ("d.txt", "d.txt.xz")]
)
def test_two_files_for_one_step_are_an_error_that_names_both(tmp_path, names):
    # files that no reader knows may be of one step
    write(tmp_path / "log_1.txt", "hello\n")
    write(tmp_path / "log_01.txt", "hello\n")
    with pytest.raises(ReadError, match=r"two files for one step: .* and .*: name one") as told:
        opened(tmp_path, names)
    assert all(name in str(told.value) for name in names)
    (tmp_path / names[0]).unlink()
    assert len(scanfab.read_series(tmp_path)) == 1


def test_the_largest_file_tells_the_kind_and_a_named_reader_reads_all(tmp_path):
    write(tmp_path / "dump_0.txt", dump_text(rows=[], names="id type"))
    assert len(opened(tmp_path, ["dump_1.txt"])) == 2
    assert opened(tmp_path, [], format="lammps").grains.reader.name == "lammps"
