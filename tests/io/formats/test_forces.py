"""Forces in the files of the three programs: their signs, by equilibrium and by other files."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

import scanfab
from tests.helpers.dumps import write, yade_lines, yade_spheres
from tests.helpers.truth import BOX, CELL, SHEAR, YADE, csv_rows

LAMMPS = (
    "id1=c_ids[1],id2=c_ids[2],fx=c_pair[3],fy=c_pair[4],fz=c_pair[5],"
    "tx=c_pair[6],ty=c_pair[7],tz=c_pair[8]"
)


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
    head, rows = text.split("c_wcon[13] \n")
    values = np.loadtxt(rows.splitlines())
    changed = {"pulls": values * ([1] * 9 + [-1] * 3 + [1]), "short": values[:, :9]}
    for name, table in changed.items():
        names_of = " ".join(f"c_w[{k}]" for k in range(1, table.shape[1] + 1))
        lines = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in table)
        first = head[: head.index("ITEM: ENTRIES")]
        walls = write(tmp_path / f"{name}.txt", f"{first}ITEM: ENTRIES {names_of}\n{lines}\n")
        packing = scanfab.read(BOX / "dump_120000.txt.gz", contacts=walls)
        assert packing.wall_forces is None
        assert packing.wall_contacts.sum() == len(values)


@pytest.mark.parametrize(
    ("grains", "options"),
    [
        (CELL / "dump_30000.txt.gz", {"contacts": CELL / "contacts_30000.txt.gz"}),
        (
            SHEAR / "shear.0.lammpstrj.gz",
            {"contacts": SHEAR / "pairs.0.local.gz", "contact_columns": LAMMPS},
        ),
        (YADE / "periodic.xml.bz2", {}),
    ],
)
def test_grains_at_rest_in_periodic_cells_are_in_equilibrium(grains, options):
    packing = scanfab.read(grains, **options)
    crossing = np.any(packing.contacts.image != 0, axis=1)
    assert crossing.sum() >= 80
    rest = np.linalg.norm(on_each_grain(packing), axis=1)
    assert np.median(rest) < 0.02 * np.mean(np.linalg.norm(packing.contacts.force, axis=1))
    assert np.mean(packing.contacts.force_n > 0) > 0.95


@pytest.mark.parametrize(
    ("grains", "contacts", "rtol"),
    [
        ("zlib_spheres.30000.vtu", "ascii_intrs.30000.vtp", 1e-6),
        ("zlib_spheres.30000.vtu", "zlib_intrs.30000.vtp", 1e-6),
        ("id-spheres-00000000.vtk.gz", "id-intrs-00000000.vtk.gz", 1e-5),
    ],
)
def test_files_of_yade_have_the_normal_force(grains, contacts, rtol):
    packing = scanfab.read(YADE / grains, contacts=YADE / contacts)
    assert packing.contacts.force is None
    found, expected = {}, {}
    saved = scanfab.read(YADE / "formats.xml.bz2")
    for forces, one in ((found, packing), (expected, saved)):
        pairs = map(frozenset, one.id[one.contacts.pairs].tolist())
        forces.update(zip(pairs, one.contacts.force_n.tolist(), strict=True))
    scale = np.mean(list(expected.values()))
    assert found == pytest.approx(expected, rel=20 * rtol, abs=rtol * scale)


def test_a_file_with_another_number_of_forces_is_refused(tmp_path):
    position = [[0, 0, 0], [1.9, 0, 0]]
    spheres = yade_spheres(tmp_path / "a-spheres-0.vtk", position, [1, 1], id=[5, 6])
    lines = yade_lines(tmp_path / "a-intrs-0.vtk", [position], {"force": [[2, 0, 0]] * 2})
    with pytest.raises(scanfab.ScanfabError, match=r"a-intrs-0\.vtk"):
        scanfab.read(spheres, contacts=lines)
