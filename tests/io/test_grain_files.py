"""Names into families, which files are the grains, and which contact files are theirs."""

import warnings
from itertools import product

import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabNote, ScanfabWarning
from scanfab.cli.main import run
from tests.helpers.dumps import PAIRS, dump_text, local_text, pairs_text, refuses, write
from tests.helpers.truth import SAMPLE_DATA

NO_RADIUS = "id type x y z c_rad"


@pytest.fixture
def folder(tmp_path):
    """Two frames of one series with contacts, in a folder of their own."""
    (folder := tmp_path / "dumps").mkdir()
    for step in (9, 10):
        series(folder, "dump", "contacts", step)
    return folder


def series(folder, grains, contacts, step, pairs=PAIRS):
    write(folder / f"{grains}_{step}.txt", dump_text(step=step))
    write(folder / f"{contacts}_{step}.txt", pairs_text(pairs, step=step))


def contacts_of(source, **options):
    found = [frame.read().contacts for frame in scanfab.read_series(source, **options)]
    return [None if contacts is None else len(contacts) for contacts in found]


def test_one_file_is_read_with_its_contacts_as_its_folder_is(folder, recwarn):
    with pytest.warns(ScanfabNote, match=r"contacts are read from .*contacts_9.txt, beside"):
        assert contacts_of(folder / "dump_9.txt") == [2]
    # they are left alone if others are asked for, or of another step
    recwarn.clear()
    other = write(folder / "other_9.txt", pairs_text(PAIRS[:1], step=9))
    assert contacts_of(folder / "dump_9.txt", contacts="geometric") == [None]
    assert contacts_of(folder / "dump_9.txt", contacts=other) == [1]
    assert contacts_of(write(folder / "dump_11.txt", dump_text(step=11))) == [None]
    assert not recwarn


def test_contacts_that_may_be_another_s_are_not_taken(folder):
    write(folder / "cloud_9.txt", dump_text(step=9))
    with pytest.warns(ScanfabNote, match=r"contacts_9.txt.*neither step nor name.*`contacts`"):
        assert contacts_of(folder / "dump_9.txt") == [None]


def test_two_lists_beside_are_an_error_unless_one_is_nearer_by_name(folder):
    write(folder / "again_9.txt", pairs_text(step=9))
    with pytest.warns(ScanfabNote), pytest.raises(ReadError, match="two contact lists for one"):
        contacts_of(folder / "dump_9.txt")
    write(folder / "dump_pairs_9.txt", pairs_text(PAIRS[:1], step=9))
    with pytest.warns(ScanfabNote, match=f"^contacts are read from {folder}/dump_pairs_9.txt,"):
        assert contacts_of(folder / "dump_9.txt") == [1]


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_points_are_named_behind_the_series_that_have_a_radius(tmp_path):
    """Points without a radius are no rivals of grains, nor are the frames of other steps."""
    series(tmp_path, "ex_dump", "ex_contacts", 9)
    write(tmp_path / "ex_points_9.txt", dump_text(step=9, names=NO_RADIUS))
    write(tmp_path / "other_7.txt", dump_text(step=7))
    refuses(tmp_path, r"(?s)ex_dump_9.*other_7.*ex_points_9.txt; it has no rad")
    assert contacts_of(tmp_path / "ex_dump_9.txt") == [2]


def test_a_fabric_table_is_known(tmp_path, capsys):
    lines = {"variants": "a", "directions": 9, "spacing": 0.5, "contact_tolerance": 0.3}
    table = scanfab.compute(scanfab.Packing([*product(range(4), repeat=3)], 0.4), **lines)
    for ending in ("csv", "tsv", "json", "jsonl"):
        table.save(path := tmp_path / f"fabric.{ending}")
        assert run(["compute", str(path)]) == 1
        assert "not a dump: scanfab compare and scanfab report" in capsys.readouterr().err


def test_folders_below_are_named_where_there_is_no_dump(folder, tmp_path):
    for name in ("a", "b", "c", "empty", "f", "g"):
        (tmp_path / name).mkdir()
    refuses(tmp_path / "empty", "the folder holds no files")
    for _ in range(2):
        refuses(tmp_path, r"holds no dumps, only folders: name .*dumps, .*empty and 2 more")
        write(folder.parent / "notes.txt", "hello\n")


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabNote")
def test_globs_in_quotes_are_expanded(folder, capsys):
    assert contacts_of(f"{folder}/dump_*.txt") == [2, 2]
    assert scanfab.read_series(f"{folder}/dump_*.txt").name == str(folder)
    assert run(["inspect", f"{folder}/dump_*.txt", "--json"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2
    assert run(["inspect", f"{folder}/grains_*.txt"]) == 2
    assert "grains_*.txt: matches nothing: there is no file" in capsys.readouterr().err
    assert run(["inspect", str(folder), "--cell", "nowhere.csv"]) == 2
    assert "CSV file with the cell of each frame" in capsys.readouterr().err


LISTS = (
    (pairs_text([(1, 77)], step=9), "no two columns"),
    (pairs_text(step=9)[:60], "incomplete"),
    ("# vtk DataFile Version 3.0.\ncomment\nASCII\n\nDATASET POLYDATA\nPOINTS 4 double\n0 0 ", ""),
)


@pytest.mark.filterwarnings("ignore:skipped contacts_9", "ignore::scanfab.ScanfabNote")
@pytest.mark.parametrize("source", ["dump_9.txt", "."])
@pytest.mark.parametrize(("contacts", "told"), LISTS)
def test_contacts_that_cannot_be_read_say_how_to_leave_them_alone(folder, source, contacts, told):
    (folder / "dump_10.txt").unlink()
    write(folder / "contacts_9.txt", contacts)
    refuses(folder / source, rf'contacts_9.txt.*{told}.*`contacts="geometric"` ignores it')
    assert scanfab.read(folder / source, contacts="geometric").contacts is None


def test_what_editors_leave_is_no_frame(folder):
    for name in ("dump_9.txt~", "dump_11.txt.part", "dump_12.txt.tmp", "dump_13.txt.bak"):
        write(folder / name, dump_text(step=11))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert contacts_of(folder) == [2, 2]


STEPLESS = "x,y,z,radius\n0,0,0,1\n1.9,0,0,1\n"
CONTACTS = "id1,id2\n0,1\n"


OTHER_SAMPLES = [
    ("a.csv", "b.csv"),
    ("a.csv", "b.contacts.csv"),
    ("a_1.csv", "b_1.contacts.csv"),
    ("a_1.csv", "b_2.csv"),
]


@pytest.mark.parametrize(("grains", "contacts"), OTHER_SAMPLES)
def test_contacts_of_another_sample_are_skipped_with_a_note(tmp_path, grains, contacts):
    path = write(tmp_path / grains, STEPLESS)
    write(tmp_path / contacts, CONTACTS.replace("0,1", "5,6"))
    assert contacts_of(path) == [None]
    if grains == "a.csv":
        write(tmp_path / "a.contacts.csv", CONTACTS)
        assert contacts_of(path) == [1]
        return
    write(tmp_path / "a_1.pairs", CONTACTS)
    with pytest.warns(ScanfabNote, match=r"contacts are read from .*a_1.pairs"):
        assert contacts_of(path) == [1]


DATA = (SAMPLE_DATA / "lammps_shear" / "forms" / "shear.data.gz").read_bytes()
LOCAL = local_text([(0.5, 1.5, -0.25), (2.5, 1, 0.5)], step=9).encode()
BESIDE = [
    ("shear.data.gz", DATA, "it holds grains that a simulation starts"),
    ("other_9.txt", LOCAL, "no two columns"),
    ("photo.vtu", b'<VTKFile type="UnstructuredGrid">', "cannot be read"),
    ("log.gz", b"\x1f\x8b\x08broken", "cannot be"),
    ("restart.1000", b"LammpS RestartT\0\1\0\0\0\2\0\0\0" + bytes(99), "a binary restart"),
]


@pytest.mark.parametrize(("name", "data", "told"), BESIDE)
def test_other_files_beside_the_frames_are_skipped_and_told(folder, name, data, told):
    (folder / name).write_bytes(data)
    with pytest.warns((ScanfabNote, ScanfabWarning), match=f"skipped .*{name}: .*{told}"):
        assert contacts_of(folder) == [2, 2]


ONE_GRAIN = "x,y,z,radius\n0,0,0,1\n"


def opened(tmp_path, names, text=None, **options):
    for name in names:
        write(tmp_path / name, dump_text() if text is None else text)
    return scanfab.read_series(tmp_path, **options)


ORDERS = [
    (["dump_10.csv", "dump_9.csv", "dump_100.csv"], [9, 10, 100]),
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
    (["dump.bz2"], [None]),
]


@pytest.mark.parametrize(("names", "expected"), ORDERS)
def test_files_are_in_the_natural_order_of_their_steps(tmp_path, names, expected):
    assert [frame.step for frame in opened(tmp_path, names, ONE_GRAIN)] == expected


def test_files_of_several_names_that_are_named_are_one_series_in_natural_order(tmp_path):
    names = ["loose_10.csv", "dense.csv", "loose_9.csv"]
    paths = [write(tmp_path / name, "x,y,z,radius\n0,0,0,1\n") for name in names]
    found = [path.name for path in scanfab.read_series(paths).files()]
    assert found == ["dense.csv", "loose_9.csv", "loose_10.csv"]


def test_the_names_beside_a_single_file_tell_its_step(tmp_path):
    opened(tmp_path, ["run2_500_v3.csv", "run2_600_v3.csv"], ONE_GRAIN)
    assert scanfab.read(tmp_path / "run2_500_v3.csv").step == 500
    (tmp_path / "run2_600_v3.csv").unlink()
    assert scanfab.read(tmp_path / "run2_500_v3.csv").step is None
    # a step in the file comes before that of its name
    write(tmp_path / "run2_500_v3.csv", dump_text(step=5000))
    assert scanfab.read(tmp_path / "run2_500_v3.csv").step == 5000


RUNS = [f"run{k}_dump_{step}.txt" for k in (1, 2) for step in (100, 200)]


SEVERAL = [
    (["a_1.txt", "b_1.txt", "a_2.txt", "b_2.txt"], ["a_*.txt", "b_*.txt"]),
    (["a_1.txt", "a_1.dump"], ["a_1.dump", "a_1.txt"]),
    (RUNS, ["run1_dump_*.txt", "run2_dump_*.txt"]),
    (["run1_100.txt", "run1_200.txt", "run2_100.txt"], ["run1_*.txt", "run2_100.txt"]),
    # a star alone would match the other series
    (["a_1.txt", "a_2.txt", "a_b_1.txt"], ["a_[0-9]*.txt", "a_b_1.txt"]),
]


@pytest.mark.parametrize(("names", "globs"), SEVERAL)
def test_several_series_are_an_error_that_lists_their_globs(tmp_path, names, globs):
    with pytest.raises(ReadError, match="several series of grains") as told:
        opened(tmp_path, names)
    lines = [line.strip() for line in str(told.value).splitlines()[1:]]
    assert lines == [f"{tmp_path}/{glob}" for glob in globs]


def test_files_of_several_folders_may_be_one_series(tmp_path):
    files = [tmp_path / "one" / "a_1.csv", tmp_path / "two" / "a_2.csv"]
    for file in files:
        file.parent.mkdir()
        write(file, ONE_GRAIN)
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
