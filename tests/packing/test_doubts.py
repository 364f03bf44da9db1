"""What looks wrong in a frame is said, and grains that flew away move neither extents nor RV."""

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, ScanfabWarning, Settings, compute, find_contacts
from scanfab.packing.doubts import cell_hint, doubts_of
from scanfab.pipeline.plan import make_plan
from scanfab.pipeline.strain import axial_length
from tests.helpers import truth
from tests.helpers.lattices import ball_points, shaken_cubic, simple_cubic
from tests.helpers.packed import along_x, sample_of

BOX, CLUMPS = truth.BOX / "dump_40000.txt.gz", truth.SAMPLE_DATA / "clumps"
SOUND = [
    BOX,
    truth.CELL / "dump_30000.txt.gz",
    truth.FLOOR / "tutorial.txt",
    truth.TRIAXIAL / "triaxial-spheres-00000000.vtk.gz",
    truth.SHEAR / "shear.200000.lammpstrj.gz",
]
pytestmark = pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")


def doubts(packing, **named):
    return {one.code: one.text for one in doubts_of(sample_of(packing), **named)}


@pytest.fixture(scope="module")
def loose():
    """A packing without anything remarkable."""
    return scanfab.read(BOX, contacts="geometric")


@pytest.mark.parametrize("path", SOUND)
def test_sound_samples_raise_no_doubt(path):
    assert doubts(scanfab.read(path, contacts="geometric")) == {}


@pytest.mark.parametrize(
    ("name", "grains", "spheres"),
    [("clumps.xml.bz2", 60, 90), ("clumps_spheres.0.vtu", 60, 90), ("multisphere_2.txt", 40, 80)],
)
def test_clumps_that_are_read_as_bodies_raise_no_doubt(name, grains, spheres):
    packing = scanfab.read(CLUMPS / name)
    assert (packing.bodies.count(np.ones(len(packing), bool)), len(packing)) == (grains, spheres)
    assert "spread_bodies" not in doubts(packing)


def clumps_in_a_row(count, **options):
    """Pairs of spheres in a row of 10 diameters and more, the last one through the face."""
    number = np.repeat(np.arange(count), 2)
    x = (number * 4.0 + np.tile([3.0, 4.5], count)) % (4.0 * count)
    return Packing(along_x(x), 1.0, bodies=number, **options)


def test_bodies_that_a_periodic_face_cuts_are_told_without_the_cell():
    whole = clumps_in_a_row(12, cell=Cell([48.0, 10.0, 10.0]))
    assert "spread_bodies" not in doubts(whole)
    # along an open axis a body may be longer than the cell
    pipe, places = Cell([48.0, 2.0, 9.0], (True, False, False)), np.zeros((24, 3))
    places[:, 0], places[::2, 1] = np.repeat(np.arange(12) * 4.0, 2), 1.5
    upright = Packing(places, 1.0, bodies=np.repeat(np.arange(12), 2), cell=pipe)
    assert "spread_bodies" not in doubts(upright)
    text = doubts(clumps_in_a_row(12))["spread_bodies"]
    assert text.startswith("1 body of several spheres, such as number 11, reach")
    assert "name its cell (`cell`, `periodic`)" in text


@pytest.mark.parametrize("cell", [None, Cell([0.035, 0.035, 0.035])])
def test_numbers_that_spheres_all_over_the_sample_share_are_told(loose, cell):
    number = np.arange(len(loose)) % 2
    packing = Packing(loose.position, loose.radius, bodies=number, cell=cell)
    text = doubts(packing)["spread_bodies"]
    assert "2 bodies of several spheres, such as number 0" in text
    assert f"reach through more than half of the {'sample' if cell is None else 'cell'}" in text


def test_bodies_that_span_a_thin_sample_raise_no_doubt():
    """A layer one clump high."""
    steps = np.arange(16.0)
    base = np.column_stack([4 * (steps % 4), 4 * (steps // 4), 0 * steps])
    position = np.vstack([base, base + np.array([0, 0, 1.5])])
    assert "spread_bodies" not in doubts(Packing(position, 1.0, bodies=np.tile(np.arange(16), 2)))


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (2.5, "contacts a grain by geometry (radii"),
        (1e-3, "no contact at all by geometry: right for a gas, else check the units"),
    ],
)
def test_many_contacts_and_none_ask_for_the_units(loose, factor, words):
    (doubt,) = doubts(Packing(loose.position, loose.radius * factor)).values()
    assert words in doubt
    assert "check the units of radius and position" in doubt


def test_contacts_among_the_boundary_alone_are_no_contacts_of_the_grains(loose):
    """Spheres of a boundary overlap; they must not hide that no grain touches anything."""
    position = np.vstack([loose.position, [[1.0, 0, 0], [1.0001, 0, 0]]])
    packing = Packing(position, np.append(loose.radius * 0.5, [0.001, 0.001]))
    sample = sample_of(packing, np.arange(len(loose), len(packing)))
    assert [one.code for one in doubts_of(sample)] == ["no_contacts"]
    # a contact list says itself that nothing touches
    assert doubts(Packing(loose.position, loose.radius * 0.5, contacts=[])) == {}


def test_a_period_that_is_half_empty_is_named_if_it_is_the_user_s():
    dump = scanfab.read(BOX, contacts="geometric", periodic="xyz")
    assert doubts(dump) == {}
    (doubt,) = doubts(dump, cell_is_named=True).values()
    assert "of the cell's period along x (0.04), the rest of it is empty" in doubt


def test_a_sheet_of_discs_is_told_where_they_are_read_as_spheres():
    sheet = truth.SAMPLE_DATA / "lammps_discs" / "sheet.3000.lammpstrj"
    told = doubts(scanfab.read(sheet, dim=3))
    assert told["plane"].startswith("all 300 centres lie in the plane x-y (z = 0), but are taken")
    assert told["own_images"].startswith("300 grains touch themselves")
    with pytest.warns(scanfab.ScanfabNote, match=r"lie in the plane x-y \(z = 0\).*`dim=3`"):
        assert doubts(scanfab.read(sheet)) == {}


@pytest.mark.parametrize(
    ("carries", "cure"), [("nothing", "`cell=(LX, LY, LZ)`"), ("box", '`periodic="xyz"`')]
)
def test_a_format_without_a_cell_is_told(loose, carries, cure):
    assert cell_hint(sample_of(loose), "cell") == ""
    assert f"{cure} if the sample is periodic" in cell_hint(sample_of(loose), carries)
    whole = Packing(loose.position, loose.radius, cell=Cell([1.0, 1.0, 1.0]))
    assert cell_hint(sample_of(whole), carries) == ""


# grains that flew away

SPHERES = shaken_cubic(np.random.default_rng(5), 9)


def with_flown(*places, radius=0.5, cell=None) -> Packing:
    """729 grains in a cube of edge 9, and some elsewhere."""
    position = np.vstack([SPHERES.position, np.reshape(places, (-1, 3))])
    radii = np.concatenate([SPHERES.radius, np.full(len(places), radius)])
    return Packing(position, radii, cell=cell)


def escaped_of(packing: Packing) -> list[int]:
    """Those that the extents leave out."""
    return np.flatnonzero(~sample_of(packing).gathered).tolist()


def test_a_grain_far_away_moves_neither_the_rv_nor_the_result_in_it():
    alone, flown = (find_contacts(one) for one in (with_flown(), with_flown((25, 25, 4))))
    assert escaped_of(flown) == [729]
    lines = {"variants": "cd", "directions": "lebedev:9", "spacing": 0.1}
    with pytest.warns(
        ScanfabWarning, match=r'all others: 1 grain \(id 729\), .* at \(25, 25, 4\); .*"id=729"'
    ):
        found = compute(flown, **lines)
    for one, other in zip(compute(alone, **lines), found, strict=True):
        assert one == other


def test_grains_that_flew_away_together_and_to_several_sides_are_all_found():
    packing = with_flown((30, 4, 4), (31, 4, 4), (4, -30, 4), (4, 4, 1e6))
    assert escaped_of(packing) == [729, 730, 731, 732]


@pytest.mark.parametrize("far", [3.0, 13.0])
@pytest.mark.parametrize("number", [8, 9, 16, 30])
def test_more_than_a_few_stay_but_not_without_a_word(number, far):
    """One in a hundred of 729, and up to four times as many, each on its own."""
    random = np.random.default_rng(number)
    directions = random.normal(size=(number, 3))
    directions /= np.abs(directions).max(axis=1, keepdims=True)
    packing = with_flown(*(4 + directions * (5 + far + 2 * np.arange(number)[:, None])))
    assert escaped_of(packing) == []
    told = doubts(packing)["escaped"]
    assert "include them, as they are too many to be left out" in told
    assert '`boundary="id=7' in told


@pytest.mark.parametrize("solid_fraction", [1e-6, 1e-3, 0.03])
@pytest.mark.parametrize("count", [60, 1000])
def test_in_a_gas_no_grain_is_farther_out_than_others(count, solid_fraction):
    """Neither in a box, nor in a ball, nor in a pyramid with its thin tip."""
    random = np.random.default_rng(count)
    radius = random.uniform(0.5, 1.5, count)
    edge = np.cbrt(4 / 3 * np.pi * np.sum(radius**3) / solid_fraction)
    for box in random.random((20, count, 3)):
        ball = ball_points(random, count, 0.6)
        pyramid = np.column_stack([box[:, :2] * np.cbrt(box[:, 2:]), np.cbrt(box[:, 2])])
        for shape in (box, ball, pyramid):
            assert not sample_of(Packing(edge * shape, radius)).escaped.any()


def test_one_grain_of_a_small_sample_may_escape_but_not_a_second_part_of_a_sample():
    """Although it is more than one of a hundred, as eight of 737 grains are."""
    packing = Packing(np.vstack([simple_cubic(4).position, [20.0, 2.0, 2.0]]), 0.5)
    assert escaped_of(packing) == [64]
    corners = np.array([[60.0, y, z] for y in (0, 1) for z in range(4)])
    assert escaped_of(with_flown(*corners)) == []


def test_through_a_periodic_face_nothing_is_far_away():
    """Open along z alone: a grain above the sample has escaped, one beside it has not."""
    cell = Cell(np.diag([9.0, 9.0, 9.0]), (True, True, False))
    assert escaped_of(with_flown((25, 4, 4), cell=cell)) == []
    assert escaped_of(with_flown((4, 4, 40), cell=cell)) == [729]


def test_strain_of_the_grains_does_not_follow_one_that_flies_away():
    lengths = [
        axial_length(sample_of(with_flown((25, 4, 4 + 30 * k))), "grains", (0.0, 0.0, 1.0))
        for k in range(2)
    ]
    assert lengths[0] == lengths[1] < 10


def test_a_few_bodies_of_many_spheres_are_no_crowd():
    """Each at a place of its own: none is far away from a crowd that there is not."""
    for count in (2, 7, 20):
        random = np.random.default_rng(3)
        bodies = np.arange(60) % count
        position = 10.0 * random.random((count, 3))[bodies] + random.random((60, 3))
        packing = Packing(position, 0.5, bodies=bodies)
        assert not sample_of(packing).escaped.any()


@pytest.mark.parametrize("distance", [0.5, 1.0, 1.5, 2.0, 6.0])
def test_a_grain_farther_outside_than_any_other_does_not_move_the_rv(distance):
    flown = with_flown((9 + distance, 4, 4))
    assert escaped_of(flown) == ([729] if distance > 1.0 else [])
    centers = [make_plan(Settings(), sample_of(one)).window.center for one in (flown, with_flown())]
    assert np.array_equal(*centers) == (distance > 1.0)
