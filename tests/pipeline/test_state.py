"""Stress, void ratio, groups of columns: closed forms, naive ways, the programs' own numbers."""

import json
from copy import copy

import numpy as np
import pytest

import scanfab
from scanfab import Cell, ContactList, Packing, Window, sphere
from scanfab.base.errors import PackingError
from scanfab.base.shapes import box, cylinder
from scanfab.base.space import Space
from scanfab.fabric.registry import GROUPS
from scanfab.packing.contacts import WallForces
from scanfab.packing.sample import VARIANTS
from scanfab.pipeline.state import cut_volumes, sample_state
from scanfab.pipeline.values import GROUP_NAMES
from scanfab.table.columns import COLUMNS
from tests.helpers.lattices import shaken_cubic, simple_cubic
from tests.helpers.packed import sample_of
from tests.helpers.truth import BOX, CELL, OF_SHEAR, SAMPLE_DATA, TRIAXIAL, branches, csv_rows

FAST = {"directions": 13, "spacing": "2rmin", "workers": 1, "variants": "a"}
PUSH = np.diag([1.0, 2.0, 4.0])
YADE, LAMMPS = SAMPLE_DATA / "yade_forces", SAMPLE_DATA / "lammps_forces"
SAME, SAVED = SAMPLE_DATA / "same_forces", YADE / "forces.xml.bz2"


def state_of(packing, window=None, boundary=()):
    return sample_state(sample_of(packing, boundary), VARIANTS["c" if window else "a"], window)


def in_window(packing, shape, center=(0.0, 0.0, 0.0), boundary=()):
    return state_of(packing, Window(np.asarray(center, float), shape), boundary)


def cubic():
    """A simple cubic lattice whose contacts bear PUSH times their normal."""
    found = scanfab.find_contacts(Packing(*simple_cubic(6), cell=Cell([6.0] * 3)), 1e-6)
    contacts = found.contacts
    force = contacts.normal @ PUSH
    return found.with_contacts(ContactList(contacts.pairs, contacts.image, force))


# of two images of a grain or of a branch both may reach into them
SHAPES = [sphere(2.9), box((3.1, 3.7, 5.8)), cylinder(2.0, 5.8, (0.0, 0.0, 1.0))]


@pytest.mark.parametrize("shape", SHAPES)
def test_branches_and_grains_are_cut_at_the_surface(shape):
    """Against the naive way: many points along each branch of all images, and in the RV."""
    packing, center = cubic(), np.array([0.4, 5.7, 3.45])
    found = in_window(packing, shape, center)
    steps, shifts = (np.arange(1000) + 0.5) / 1000, 6.0 * np.array([*np.ndindex(3, 3, 3)]) - 6.0
    total = np.zeros((3, 3))
    contacts = packing.contacts
    for one, branch, force in zip(
        contacts.pairs[:, 0], branches(packing), contacts.force, strict=True
    ):
        places = packing.position[one] + steps[:, None] * branch - center + shifts[:, None]
        share = np.mean(shape.contains(places.reshape(-1, 3))) * len(shifts)
        total += share * np.outer(force, branch)
    np.testing.assert_allclose(found.stress, total / shape.volume, rtol=2e-3, atol=1e-12)
    points = np.random.default_rng(1).uniform(-4, 4, (200_000, 3))
    from_grain = points[shape.contains(points)] + center - packing.position[0]
    solid = np.linalg.norm(from_grain - np.round(from_grain), axis=1) < 0.5
    assert 1 / (1 + found.void_ratio) == pytest.approx(solid.mean(), abs=0.004)


def test_boundary_is_a_wall():
    """The branch ends where the grain touches it, at half the way between equal spheres."""
    packing = Packing([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 0.5)
    for turn in (1, -1):
        pairs, force = np.array([[0, 1], [1, 2]])[:, ::turn], turn * np.outer([3, 5], [1.0, 0, 0])
        listed = packing.with_contacts(ContactList(pairs, force=force))
        state = in_window(listed, sphere(10.0), boundary=[2])
        assert state.stress[0, 0] == pytest.approx((3 * 1 + 5 * 0.5) / sphere(10.0).volume)


@pytest.mark.parametrize("frame", [0, 6])
def test_the_stress_of_a_box_is_the_pressure_on_its_walls(frame):
    """
    Of the space between LIGGGHTS' walls: Love-Weber with the walls is the moment of their forces.

    The frames are close to rest; without the walls the stress would be a tenth too low.
    """
    packing, engine = scanfab.read_series(BOX)[frame].read(), csv_rows(BOX / "engine.csv")[frame]
    low, high, *pressures = (
        np.array([engine[f"{name}{axis}{end}"] for axis in "xyz"])
        for name in ("", "engine_p") for end in ("lo", "hi")
    )  # fmt: skip
    space, center, pressure = box(high - low), 0.5 * (low + high), np.mean(pressures, axis=0)
    found = np.diag(in_window(packing, space, center).stress)
    np.testing.assert_allclose(found, pressure, rtol=5e-4)
    without = copy(packing)
    without.wall_forces = None
    assert np.all(np.diag(in_window(without, space, center).stress) < 0.92 * pressure)


def test_walls_press_on_clumps_through_a_periodic_face():
    """The branch is from the wall to the clump's place, whichever image the point is written at."""
    cell = Cell([10.0, 10.0, 10.0])
    position = [[0.5, 5, 5], [9.5, 5, 5]]
    for image in (0.0, 10.0, -20.0):
        walls = WallForces([1], [[9.5 + image, 5, 4.0]], [[0, 1.0, 3.0]])
        packing = Packing(
            position, 1.0, bodies=[7, 7], cell=cell, wall_contacts=[0, 1], wall_forces=walls,
            contacts=ContactList(np.zeros((0, 2), int), force=np.zeros((0, 3))),
        )  # fmt: skip
        # from (-0.5, 5, 4) to (0, 5, 5)
        force, branch = np.array([0, 1.0, 3.0]), np.array([0.5, 0, 1.0])
        expected = np.outer(force, branch) / 1000
        np.testing.assert_allclose(state_of(packing).stress, 0.5 * (expected + expected.T))


@pytest.mark.parametrize("beyond", [-1.2, -0.4, 0.0, 0.7])
def test_a_disc_in_a_rectangle_is_cut_at_its_side(beyond):
    """What lies outside is a segment of the circle: its sector less a triangle."""
    plane = Space(2)
    angle = 2 * np.arccos(np.clip(-beyond, -1, 1))
    area = np.pi - (angle - np.sin(angle)) / 2
    place = np.array([[2.0 + beyond, 0.0, 0.0]])
    found = cut_volumes(place, np.ones(1), box((4.0, 6.0), None, plane), plane)
    assert found == pytest.approx(area, abs=0.01 * np.pi)


@pytest.mark.parametrize(("center", "variants"), [(0.0, "a, c"), (3.0, "a")])
def test_walls_whose_forces_are_unknown_are_told(center, variants):
    """Of an RV those in it."""
    packing = cubic()
    packing.wall_contacts = np.all(packing.position < 1.0, axis=1).astype(int)
    words = {"rv_radius": 1.5, "rv_center": 3 * (center,), "with_": "state", "cutoff": 0}
    told = f"variants? {variants}: grains touch walls, but the forces of these"
    with pytest.warns(scanfab.ScanfabWarning, match=told):
        scanfab.compute(packing, **{**FAST, **words, "variants": "ac"})


# the programs' own numbers


def table(packing):
    return scanfab.compute(packing, with_="forces,state", **FAST)


def six(matrix):
    return matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


@pytest.fixture(scope="module")
def yade():
    return scanfab.read(SAVED)


@pytest.fixture(scope="module")
def lammps():
    series = scanfab.read_series(
        LAMMPS / "forces.*.lammpstrj.gz",
        contacts=LAMMPS / "forces.*.local.gz", contact_columns=OF_SHEAR,
    )  # fmt: skip
    return [frame.read() for frame in series]


@pytest.mark.parametrize("frame", [0, 1])
def test_fabric_forces_and_stress_are_those_of_lammps(lammps, frame):
    """
    Its compute fabric, and its virial.

    That within a thousandth of the kinetic part, which the forces' damping at another moment makes.
    Off the diagonal LAMMPS has one of the two components whose mean is taken here.
    """
    packing, found = lammps[frame], table(lammps[frame])
    told = np.loadtxt(LAMMPS / "fabric.txt")[frame, 1:].reshape(4, 6)
    fabric = 7.5 * (found.tensor("gc")[0] - np.eye(3) / 3)
    for one, theirs in zip(
        (fabric, found.tensor("bn")[0], found.tensor("fn")[0]), told[:3], strict=True
    ):
        np.testing.assert_allclose(six(one), theirs, rtol=0, atol=1e-13)
    told = np.loadtxt(LAMMPS / "stress.txt")[frame, 1:]
    kinetic = np.abs(told[6:9] - told[:3]).max()
    assert np.all(np.abs(np.diag(state_of(packing).stress) - told[:3]) < kinetic)
    volume = abs(np.linalg.det(packing.cell.vectors))
    product = branches(packing).T @ packing.contacts.force / volume
    np.testing.assert_allclose(six(product), told[:6], atol=3e-6 * told[:3].mean())


def test_stress_is_that_of_liggghts():
    """
    Its sum of compute stress/atom over the grains, pair part alone; forces have six digits.

    At rest that is all; while the cell moves, LIGGGHTS sums up before it moves and dumps behind.
    """
    engine = np.genfromtxt(CELL / "engine.txt", names=True, comments=None)
    for place, (frame, told) in enumerate(zip(scanfab.read_series(CELL), engine, strict=True)):
        volume = told["lx"] * told["ly"] * told["lz"]
        expected = [-told[f"s{axis}"] / volume for axis in "xyz"]
        found = np.diag(state_of(frame.read()).stress)
        np.testing.assert_allclose(found, expected, rtol=1e-4 if place else 2e-6)


def test_stress_and_strong_and_weak_contacts_are_those_of_yade(yade):
    told = json.loads((YADE / "engine.json").read_text())
    found, contacts = table(yade), yade.contacts
    assert len(contacts) == told["contacts"]
    assert contacts.force_n.mean() == pytest.approx(told["mean_normal_force"], rel=1e-7)
    # normals are those of the positions, which YADE saves after the step
    for name, theirs in (("gc", ""), ("gc_strong", "_strong"), ("gc_weak", "_weak")):
        expected = np.array(told[f"fabricTensor{theirs}"])
        np.testing.assert_allclose(found.tensor(name)[0], expected, rtol=0, atol=1e-6)
    stress = np.array(told["getStress"])
    expected = -(stress + stress.T) / 2
    np.testing.assert_allclose(found.tensor("stress")[0], expected, rtol=0, atol=1e-6)


WRITTEN = [
    # its box has six digits
    ("liggghts.1.txt.gz", "liggghts_contacts.1.txt.gz", 3e-6),
    ("yade.xml.bz2", None, 1e-11),
    ("yade-spheres-00000000.vtk.gz", "yade-intrs-00000000.vtk.gz", 1e-5),
]


@pytest.fixture(scope="module")
def same():
    columns = (
        "id1=c_ids[1],id2=c_ids[2],fx=c_pair[2],fy=c_pair[3],fz=c_pair[4],"
        "tx=c_pair[5],ty=c_pair[6],tz=c_pair[7]"
    )
    listed = {"contacts": SAME / "lammps.0.local.gz", "contact_columns": columns}
    return table(scanfab.read(SAME / "lammps.0.lammpstrj.gz", **listed))


@pytest.mark.filterwarnings("ignore::scanfab.ScanfabWarning", "ignore::scanfab.ScanfabNote")
@pytest.mark.parametrize(("grains", "contacts", "tolerance"), WRITTEN)
def test_one_state_written_by_each_program_has_the_same_tensors(same, grains, contacts, tolerance):
    listed = {"contacts": SAME / contacts} if contacts else {}
    found = table(scanfab.read(SAME / grains, **listed))
    assert found["contacts"][0] == 1819
    for name in ("gc", "bn", "fn", "ft", "gc_strong", "gc_weak", "stress"):
        one, two = same.tensor(name)[0], found.tensor(name)[0]
        scale = np.abs(one).max() if name == "stress" else 1.0
        np.testing.assert_allclose(two, one, rtol=0, atol=tolerance * scale)
    assert found["void_ratio"][0] == pytest.approx(same["void_ratio"][0], rel=2e-5)


def test_stress_force_and_fabric_go_together(lammps, yade):
    """q/p is 0.4 (a_c + a_n + 1.5 a_t + a_b) to first order (Ouadfel and Rothenburg 2001)."""
    for packing in (lammps[1], yade):
        row = table(packing)[0]
        along = 7.5 * row.alpha_c_axial + row.alpha_fn_axial + row.alpha_bn_axial
        expected = 0.4 * (along + 1.5 * row.alpha_ft_axial)
        assert row.q / row.p > 0.6
        assert row.q / row.p == pytest.approx(expected, rel=0.05)


def names(*groups):
    return [one.name for group in GROUP_NAMES if group in groups for one in GROUPS[group].columns]


@pytest.mark.parametrize("asked", ["forces,state", ["state", "forces"]])
def test_several_groups_stand_behind_the_others_in_one_order(yade, asked):
    row = scanfab.compute(yade, with_=asked, **{**FAST, "spacing": "1rmin"})[0]
    assert list(row) == [*COLUMNS[:-24], *names("state", "forces"), *COLUMNS[-24:]]
    assert None not in [row[name] for name in names("state", "forces")]


def test_without_forces_their_columns_are_an_error_and_stress_is_empty_with_one_note():
    packing = scanfab.read(SAVED, contacts="geometric")
    with pytest.raises(PackingError, match=r"forces of contacts, but these are found by geometry"):
        scanfab.compute(packing, with_="forces", **FAST)
    with pytest.warns(scanfab.ScanfabWarning) as told:
        found = scanfab.compute(packing, with_="state", **{**FAST, "variants": "ac"})
    (text,) = [str(one.message) for one in told if "stress" in str(one.message)]
    assert "variants a, c: the contacts have no forces" in text
    for row in found:
        assert row.void_ratio > 0
        assert row.coordination_mechanical > 2
        assert row.stress_xx is row.p is row.acst_vs is row.angle_c_stress is None


POOR_FORCES = [
    (lambda one: {"force_n": one.force_n}, "normal part of", ("ft", "stress")),
    (lambda one: {"force": -one.force}, "the mean normal force is tension", ("fn", "ft")),
]


@pytest.mark.parametrize(("force", "told", "empty"), POOR_FORCES)
def test_forces_that_do_not_suffice_leave_columns_empty(yade, force, told, empty):
    contacts = yade.contacts
    packing = yade.with_contacts(ContactList(contacts.pairs, contacts.image, **force(contacts)))
    with pytest.warns(scanfab.ScanfabWarning, match=told):
        row = table(packing)[0]
    full = table(yade)[0]
    for name in names("forces"):
        if any(one in name for one in empty):
            assert row[name] is None
        elif "gc_" not in name or "stress" in empty:
            assert row[name] == pytest.approx(full[name], abs=1e-12)
    assert (row.stress_xx is None) == ("stress" in empty)


def test_a_force_that_is_no_number_is_named_and_no_contacts_are_no_error(yade):
    contacts, force = yade.contacts, yade.contacts.force.copy()
    force[3, 1] = np.nan
    packing = yade.with_contacts(ContactList(contacts.pairs, contacts.image, force))
    with pytest.raises(PackingError, match="has a force that is no finite number"):
        scanfab.compute(packing, with_="forces", **FAST)
    spheres = shaken_cubic(np.random.default_rng(1), 4, overlap=0.6)
    packing = Packing(*spheres, contacts=[], cell=Cell([4.0, 4.0, 4.0]))
    row = table(packing)[0]
    assert row.fn_xx is None
    assert row.void_ratio > 0


def test_strain_and_directions_of_a_series():
    series = scanfab.read_series(CELL)
    first, last = scanfab.compute(series, with_="state", frames="::4", **FAST)
    assert first.volumetric_strain == 0.0
    assert abs(last.volumetric_strain) < 1e-5
    assert abs(first.q) < 0.02 * first.p
    assert last.angle_c_stress < 10


def test_an_open_whole_has_no_volume_and_says_so():
    packing, words = scanfab.read_series(TRIAXIAL)[0].read(), {**FAST, "variants": "ac"}
    with pytest.warns(scanfab.ScanfabWarning, match="they need the volume of an RV"):
        a, c = scanfab.compute(packing, with_="state", boundary="mask=3", **words)
    assert a.void_ratio is a.stress_zz is None
    assert c.p == pytest.approx(200e3, rel=0.2)
    assert 0.4 < c.void_ratio < 0.8
