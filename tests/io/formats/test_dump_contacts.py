"""Contacts of three programs: columns by their values, and forces in equilibrium."""

import gzip

import numpy as np
import pytest

import scanfab
from scanfab import ReadError
from tests.helpers.dumps import PAIRS, ROWS, dump_text, local_text, pairs_text, write
from tests.helpers.truth import BOX, CELL, OF_SHEAR, SHEAR, YADE, csv_rows, id_pairs


def joined(tmp_path, local, rows=ROWS, columns=None, format=None, **options):
    grains = write(tmp_path / "dump_0.txt", dump_text(rows, **options))
    contacts = write(tmp_path / "pairs_0.txt", local)
    return scanfab.read(grains, contacts=contacts, contact_columns=columns, format=format)


def chain(first, step=0.1):
    """Eight grains in a row with ids from a number on, and the seven pairs that touch."""
    rows = [(first + k, 1, step * k, 0.5, 0.5, 0.06) for k in range(1, 9)]
    return rows, [(first + k, first + k + 1) for k in range(1, 8)]


@pytest.mark.parametrize("scale", [1e-9, 50.0])
def test_no_length_is_absolute(tmp_path, scale):
    rows = [(id, type, *(scale * value for value in rest)) for id, type, *rest in ROWS]
    box = {"box": [(0, scale)] * 3, "flags": " pp pp pp"}
    packing = joined(tmp_path, pairs_text(), rows, **box)
    assert id_pairs(packing) == set(PAIRS)
    assert id_pairs(scanfab.find_contacts(packing)) == set(PAIRS)


@pytest.mark.parametrize("rows", [ROWS, []])
@pytest.mark.parametrize("format", ["liggghts", "lammps"])
def test_no_contacts_at_all_are_an_empty_list(tmp_path, rows, format):
    packing = joined(tmp_path, local_text([]), rows, format=format)
    assert (len(packing.contacts), packing.contacts.source) == (0, "file")


SHEAR_PAIRS = SHEAR / "pairs.0.local.gz"
NAMED = "id1=c_con[2],id2=c_con[4],fx=c_con[5],fy=c_con[6],fz=c_con[7]"
APART = [*ROWS[:2], (3, 2, 0.61, 0.5, 0.5, 0.1)]


RIGHT = [
    # pairs that are listed twice are one contact
    ([(1, 2, 0), (2, 1, 0), (2, 3, 0), (1, 2, 0)], ROWS, None, None, PAIRS, None),
    # the force stands behind the flag, on the first grain; history has any number of values
    ([(*pair, 0, -1, 0, 0) for pair in PAIRS], ROWS, None, None, PAIRS, [1, 0, 0]),
    (
        [(*pair, 0, -1, 0, 0, *[7] * 5, 0.5) for pair in PAIRS],
        *(ROWS, "contactArea id force history:5", None, PAIRS, [1, 0, 0]),
    ),
    ([(*pair, 0, -1e308, 0, 0) for pair in PAIRS], ROWS, None, None, PAIRS, [1e308, 0, 0]),
    # normal and tangential parts add up
    (
        [(*pair, 0, -2, 0, 0, 0, 3, 1) for pair in PAIRS],
        *(ROWS, "id force_normal force_tangential", None, PAIRS, [2, -3, -1]),
    ),
    ([(*pair, 0, -2, 0, 0) for pair in PAIRS], ROWS, "id force_normal", None, PAIRS, None),
    # columns of any compute: a number, both ids apart, the force; no periodic flag
    ([(0.5, a, 7, b, -1.5, 0, 2) for a, b in PAIRS], ROWS, NAMED, None, PAIRS, [1.5, 0, -2]),
    # of pairs within a cut-off those are left that overlap, or have a force
    (PAIRS, APART, "id1=c_con[1],id2=c_con[2]", None, PAIRS[:1], None),
    (
        [(1, 2, 0.5), (2, 3, 0.0), (1, 3, 0.0)],
        *(ROWS, "id1=c_con[1],id2=c_con[2],fx=c_con[3],fy=c_con[3],fz=c_con[3]", "lammps"),
        *(PAIRS[:1], [-0.5] * 3),
    ),
    # %g writes a million as 1e+06, and loses nothing of short ids
    ([(*pair, 0) for pair in chain(1234560)[1]], chain(1234560)[0], None, None, None, None),
    ([("1e+06", 3, 0)], [(1000000, *ROWS[0][1:]), (3, *ROWS[1][1:])], None, None, None, None),
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("local", "rows", "columns", "format", "pairs", "force"), RIGHT)
def test_columns_are_found_or_named(tmp_path, local, rows, columns, format, pairs, force):
    packing = joined(tmp_path, local_text(local), rows, columns, format)
    expected = [tuple(sorted((int(float(one)), int(float(two))))) for one, two, *_ in local]
    assert id_pairs(packing) == set(expected if pairs is None else pairs)
    if "force_normal" in (columns or ""):
        np.testing.assert_array_equal(packing.contacts.force_n, 2)
    if force is None:
        assert packing.contacts.force is None
    else:
        np.testing.assert_array_equal(packing.contacts.force, [force] * len(pairs))


FLAGGED = [(*pair, 0, -1, 0, 0) for pair in PAIRS]
ROUNDED = [(f"{one:g}", f"{two:g}", 0, -1, 0, 0) for one, two in chain(1234561)[1]]
AT_WALLS = [(*row[2:5], 0, 0, id) for row, id in zip(ROWS, (1, 2, 9), strict=True)]
TRIPLES = [(*pair, 1.5) for pair in PAIRS]
TWO = "id1=c_con[1],id2=c_con[2]"
# no ids; two choices; types; ids of other grains
UNSURE = [[(1.5, 2.5), (2.5, 3.5)], [(1, 2, 3), (2, 3, 1)], [(1, 2)] * 5, [(10, 20), (20, 30)]]
WRONG = ["id1=c_con[1]", f"{TWO},fx=c_con[3]", f"{TWO},size=c_con[3]", "id1=,id2"]
WRONG += [f"{TWO},tx=c_con[3],ty=c_con[3],tz=c_con[3]"]


REFUSED = [
    ([(1, 2, 0), (2, 3, 0), (3, 4, 0), (4, 99, 0)], chain(0)[0], None, "liggghts", "grain 99"),
    ([(101, 102, 0), (102, 103, 0)], ROWS, None, "liggghts", "surely ids of these"),
    ([(1, 2, 0, 2, 3, 0), (2, 3, 0, 1, 2, 0)], ROWS, None, "liggghts", "no two columns"),
    *((rows, ROWS, None, "lammps", "surely ids of these grains") for rows in UNSURE),
    ([(1.5, 2), (2.5, 3)], ROWS, TWO, "lammps", "columns 1 and 2: ids must be whole"),
    ([(1, 2), (2, 77)], ROWS, TWO, "lammps", "contact 2 names the grain 77, which is not in"),
    # contacts with walls: where they are, two numbers of the wall, and the id
    (AT_WALLS, ROWS, None, "liggghts", "names the grain 9, which is not"),
    (FLAGGED, ROWS, "pos force", None, "id among them"),
    (FLAGGED, ROWS, "id forces", None, "or keywords, id among them"),
    (FLAGGED, ROWS, "id force torque", None, "for 6 columns; .* is for 9"),
    (FLAGGED, ROWS, "id1=c_con[2],id2=c_con[9]", None, r"c_con\[9\].*; the columns are c_con"),
    (ROUNDED, chain(1234561)[0], None, "liggghts", r"rounded to six digits.*%\.0f"),
    # each rounded id is that of another grain
    (ROUNDED, chain(1234560, 0.01)[0], "id force", None, r"rounded to six digits.*%\.0f"),
    *((TRIPLES, ROWS, columns, None, "expected id1=NAME,id2=NAME") for columns in WRONG),
]


@pytest.mark.parametrize(("local", "rows", "columns", "format", "told"), REFUSED)
def test_contacts_that_cannot_be_right_are_refused(tmp_path, local, rows, columns, format, told):
    for name in ("liggghts", "lammps") if format is None else (format,):
        with pytest.raises(ReadError, match=told):
            joined(tmp_path, local_text(local), rows, columns, name)


def test_contacts_by_id_need_ids_in_the_grain_file(tmp_path):
    with pytest.raises(ReadError, match="the grain file has no ids"):
        joined(tmp_path, pairs_text(), [row[1:] for row in ROWS], names="type x y z radius")


def on_each_grain(packing):
    """The sum of the contact forces on each grain, shape (N, 3)."""
    contacts, total = packing.contacts, np.zeros((len(packing), 3))
    np.add.at(total, contacts.pairs[:, 1], contacts.force)
    np.add.at(total, contacts.pairs[:, 0], -contacts.force)
    return total


@pytest.mark.parametrize("keywords", [None, "pos id force delta contactPoint"])
def test_forces_of_liggghts_add_up_to_those_it_dumps(keywords):
    """
    With the columns fx fy fz; those of the walls carry what other grains do not.

    The list is from just before the step whose forces are dumped, so some contacts differ a little.
    """
    files = [BOX / f"{name}_120000.txt.gz" for name in ("dump", "contacts", "walls")]
    packing = scanfab.read_series(files, contact_columns=keywords)[0].read()
    dumped = np.column_stack([packing.columns[f"f{axis}"] for axis in "xyz"])
    total, at_wall = on_each_grain(packing), packing.wall_contacts > 0
    inside = np.abs(total - dumped).max(axis=1)[~at_wall]
    assert np.median(np.abs(dumped)) > 10 * np.median(inside)
    assert np.mean(inside < 1e-6) > 0.6
    assert inside.max() < 0.003 * np.abs(packing.contacts.force).max()
    walls = packing.wall_forces
    assert len(walls.row) == packing.wall_contacts.sum() > 300
    np.add.at(total, walls.row, walls.force)
    off = np.abs(total - dumped).max(axis=1)[at_wall]
    size = np.linalg.norm(walls.force, axis=1)
    assert np.median(off) < 0.01 * np.median(size)
    assert np.quantile(off, 0.95) < 0.1 * np.median(size)
    away = np.linalg.norm(walls.point - packing.position[walls.row], axis=1)
    np.testing.assert_allclose(away, packing.radius[walls.row], rtol=0.1)


def test_a_heap_of_yade_stands_still_on_walls_that_press_as_it_lists():
    """Contacts with grains (saved) and walls (YADE's own list) carry the weight of each grain."""
    packing = scanfab.read(YADE / "formats.xml.bz2")
    truth = csv_rows(YADE / "truth_walls.csv")
    pressed = np.column_stack([truth[f"f{axis}"] for axis in "xyz"])
    total = on_each_grain(packing)
    np.add.at(total, np.searchsorted(packing.id, truth["sphere"]), pressed)
    np.testing.assert_allclose(total[:, :2], 0.0, atol=1e-10)
    density = total[:, 2] / (4 / 3 * np.pi * packing.radius**3 * 9.81)
    nearest = np.where(density < 2000, 1500.0, 2600.0)
    np.testing.assert_allclose(density, nearest, rtol=1e-10)
    walls = packing.wall_forces
    found = np.column_stack([packing.id[walls.row], walls.force])
    listed = np.column_stack([truth["sphere"], pressed])
    np.testing.assert_allclose(found[np.lexsort(found.T)], listed[np.lexsort(listed.T)], rtol=1e-9)
    away = np.linalg.norm(walls.point - packing.position[walls.row], axis=1)
    np.testing.assert_allclose(away, packing.radius[walls.row], rtol=0.02)


@pytest.mark.filterwarnings("ignore:.*lists contacts with walls only")
def test_of_walls_whose_columns_are_not_proved_the_force_is_not_known(tmp_path):
    """Without the contact point in front of the centre, or with a force that pulls."""
    text = gzip.decompress((BOX / "walls_120000.txt.gz").read_bytes()).decode()
    head, _, rows = text.partition("ITEM: ENTRIES")
    values = np.loadtxt(rows.splitlines()[1:])
    changed = {"pulls": values * ([1] * 9 + [-1] * 3 + [1]), "short": values[:, :9]}
    for name, table in changed.items():
        names = " ".join(f"c_w[{k}]" for k in range(1, table.shape[1] + 1))
        head_of, walls = f"{head}ITEM: ENTRIES {names}", tmp_path / f"{name}.txt"
        np.savetxt(walls, table, "%.9g", header=head_of, comments="")
        packing = scanfab.read(BOX / "dump_120000.txt.gz", contacts=walls)
        assert packing.wall_forces is None
        assert packing.wall_contacts.sum() == len(values)
    # the forces of one list alone are not those of all walls
    files = [BOX / "dump_120000.txt.gz", BOX / "walls_120000.txt.gz", tmp_path / "short.txt"]
    packing = scanfab.read_series(files)[0].read()
    assert packing.wall_forces is None
    assert packing.wall_contacts.sum() == 2 * len(values)


AT_REST = [
    (CELL / "dump_30000.txt.gz", {"contacts": CELL / "contacts_30000.txt.gz"}),
    (SHEAR / "shear.0.lammpstrj.gz", {"contacts": SHEAR_PAIRS, "contact_columns": OF_SHEAR}),
]


@pytest.mark.parametrize(("grains", "options"), AT_REST)
def test_grains_at_rest_in_periodic_cells_are_in_equilibrium(grains, options):
    packing = scanfab.read(grains, **options)
    crossing = np.any(packing.contacts.image != 0, axis=1)
    assert crossing.sum() >= 80
    rest = np.linalg.norm(on_each_grain(packing), axis=1)
    assert np.median(rest) < 0.02 * np.mean(np.linalg.norm(packing.contacts.force, axis=1))
    assert np.mean(packing.contacts.force_n > 0) > 0.95
