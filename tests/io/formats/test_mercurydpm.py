"""MercuryDPM and LF_DEM: pairs, periodic boundaries, the sheared cell."""

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, ScanfabWarning
from tests.helpers.dumps import holds, refuses, write
from tests.helpers.made import lf_dem, mercurydpm
from tests.helpers.made.lf_dem import HEAD, RUN_VISCOSITY, THROUGH, UNSIGNED
from tests.helpers.made.mercurydpm import CENTRES, IDS, NORMAL, RADIUS, TANGENT


@pytest.fixture
def run(tmp_path):
    """Grains at three times, contacts at two of them."""
    write(tmp_path / "run.data", "".join(map(mercurydpm.data_frame, (0.1, 0.2, 0.3))))
    last = mercurydpm.fstat_frame("0.3000000001", mercurydpm.contacts_at(0.3))
    write(tmp_path / "run.fstat", mercurydpm.fstat_frame(0.1) + last)
    return tmp_path


def test_contacts_go_by_their_time_and_forces_act_on_the_second_grain(run):
    series = scanfab.read_series(run, cell=(1, 2, 3))
    assert [frame.snapshot.time for frame in series] == [0.1, 0.2, 0.3]
    assert len(series[0].read().contacts) == 0
    with pytest.warns(ScanfabWarning, match="no contact file for time 0.2 among"):
        assert series[1].read().contacts is None
    packing = series[2].read()
    # each pair once, pushed off the first grain, through the face as well
    force = [[NORMAL, -TANGENT, 0], [NORMAL, 0, -TANGENT]]
    holds(packing.contacts, pairs=[[0, 1], [2, 0]], force=force)
    np.testing.assert_allclose(packing.contacts.normal, [[1, 0, 0], [1, 0, 0]])
    holds(packing, wall_contacts=[0, 0, 1])
    # the domain is not said to repeat
    cell = scanfab.read_series(run)[0].read().cell
    holds(cell, periodic=(False,) * 3, vectors=np.diag([1, 2, 3]))


def test_planes_and_frames_without_grains(tmp_path):
    rows = "0.1 1 9 9 0.1 0 0 0\n0.29 1 9 9 0.1 0 0 1\n"
    packing = scanfab.read(write(tmp_path / "a.data", f"2 0.5 0 0 1 2 \n{rows}"), dim=2)
    holds(packing, position=[[0.1, 1, 0], [0.29, 1, 0]], radius=0.1, species=[0, 1], time=0.5)
    path = write(tmp_path / "a.data", "0 0 0 0 0 1 2 3 \n" + mercurydpm.data_frame(1))
    assert [len(frame.read()) for frame in scanfab.read_series(path)] == [0, 3]


def test_a_restart_has_contacts_and_its_period(tmp_path):
    path = write(tmp_path / "a.restart", mercurydpm.restart())
    packing = scanfab.read(path)
    holds(packing, position=CENTRES, radius=RADIUS, id=IDS, time=0.5, wall_contacts=[0, 0, 2])
    holds(packing.contacts, pairs=[[0, 1], [2, 0]], force=[[2, -0.5, 0]] * 2)
    np.testing.assert_allclose(packing.contacts.normal, [[1, 0, 0]] * 2)
    assert packing.cell.periodic == (True, False, False)
    # a period of another kind can be named
    write(path, mercurydpm.restart().replace("PeriodicBoundary", "LeesEdwardsBoundary"))
    assert scanfab.read(path, cell=(1, 2, 3)).cell.periodic == (True, True, True)


VERSIONS = [
    (2, "", "WallsPeriodic 1\nnormal 0 1 0 pos_left 0.5 pos_right 2.5 shift 0 2 0"),
    (3, "TSP BP ", "Boundaries 1\nPeriodicBoundary normal 0 1 0 position_left 0.5 shift 0 2 0"),
]


@pytest.mark.parametrize(("version", "first", "periods"), VERSIONS)
def test_an_old_restart(tmp_path, version, first, periods):
    rows = "".join(f"{first}{x} {y} {z} 9 9 9 {RADIUS} 0 0 0\n" for x, y, z in CENTRES)
    text = (
        f"restart_version {version}\nname a\nxmin 0 xmax 1 ymin 0 ymax 2 zmin 0 zmax 3\n"
        f"dt 1 t 0.5 tmax 1\n{periods}\nParticles 3\n{rows}FixedParticles 0\n"
    )
    packing = scanfab.read(write(tmp_path / "a.restart", text))
    holds(packing, radius=RADIUS, position=CENTRES, time=0.5, contacts=None)
    holds(packing.cell, periodic=(False, True, False), origin=[0, 0.5, 0])


def test_contacts_of_other_grains_and_forces_that_are_no_numbers(run):
    path = run / "run.fstat"
    one = write(run / "a.data", mercurydpm.data_frame(0.3, count=1))
    refuses(one, "names the grain 1, which is not in the grain file", contacts=path)
    path.write_text(path.read_text().replace(f" {NORMAL} ", " 1e308 ").replace(" 0.5 ", " nan "))
    with pytest.raises(scanfab.ScanfabError, match="force"):
        scanfab.read_series(run / "run.data", contacts=path, cell=(1, 2, 3))[2].read()


@pytest.mark.parametrize("ending", ["data", "fstat"])
def test_a_last_frame_that_is_cut_is_left_out(run, ending):
    path = run / f"run.{ending}"
    path.write_bytes(path.read_bytes()[:-20])
    series = scanfab.read_series(run / "run.data", contacts=run / "run.fstat", cell=(1, 2, 3))
    with pytest.warns(ScanfabWarning, match=r"last snapshot, number \d, is incomplete"):
        assert len(series[0].read().contacts) == 0
    assert len(series) == (2 if ending == "data" else 3)
    refuses(write(run / "b.data", mercurydpm.data_frame(1)[:-50]), r"the file is incomplete")


def test_images_above_are_shifted(tmp_path):
    grains = write(tmp_path / "par_a.dat", lf_dem.grains_text())
    pairs = write(tmp_path / "int_a.dat", lf_dem.pairs_text())
    series = scanfab.read_series(grains, contacts=str(pairs))
    packing = series[1].read()
    vectors = [[10, 0, 0], [0, 8, 0], [1.5, 0, 6]]
    holds(packing.cell, vectors=vectors, periodic=(True, True, True))
    holds(packing, radius=[1, 1, 1], **{"velocity (x, y, z)": np.full((3, 3), 9)})
    # the image of 1 stands right above 0, where the file has its normal
    holds(packing.contacts, pairs=[[0, 1]], force=None)
    np.testing.assert_allclose(packing.contacts.normal, [[0, 0, 1]])
    # frames of both files belong together by their strain
    with pytest.raises(ReadError, match="no contact file for time 0 among"):
        series[0].read()


def read_both(folder, texts):
    path = write(folder / "par_a.dat", texts[0])
    return scanfab.read(path, contacts=str(write(folder / "int_a.dat", texts[1])))


@pytest.mark.parametrize("pairs", [((0, 1), (1, 2)), ((1, 0), (2, 1)), ((1, 2), (1, 0))])
def test_a_grain_at_rest_between_two(tmp_path, pairs):
    """Its forces add up to nothing only with the right sign of each part, on the right grain."""
    contacts = read_both(tmp_path, lf_dem.chain_texts(pairs=pairs)).contacts
    assert [sorted(pair) for pair in contacts.pairs.tolist()] == [sorted(pair) for pair in pairs]
    for pair, force in zip(contacts.pairs, contacts.force, strict=True):
        on_middle = force if pair[1] == 1 else -force
        np.testing.assert_allclose(on_middle, THROUGH if 0 in pair else -THROUGH, atol=1e-15)
    # both contacts are pushed together
    assert np.all(contacts.force_n > 0)


def test_what_the_program_says_its_contacts_add_to_the_viscosity(tmp_path):
    """3 pi (r_x f_z + r_z f_x) with the force on particle 1, in its units; friction matters."""
    packing = read_both(tmp_path, lf_dem.run_texts())
    contacts = packing.contacts
    branch = contacts.normal * packing.radius[contacts.pairs].sum(axis=1)[:, None]
    on_first = -contacts.force
    added = 3 * np.pi * (branch[:, 0] * on_first[:, 2] + branch[:, 2] * on_first[:, 0])
    np.testing.assert_allclose(np.sort(added), np.sort(RUN_VISCOSITY), rtol=2e-3)


def test_signs_of_pushes(tmp_path):
    def pull(size):
        return -size

    assert np.all(read_both(tmp_path, lf_dem.chain_texts(push=pull)).contacts.force_n < 0)
    with pytest.warns(ScanfabWarning, match="normal contact forces without sign"):
        contacts = read_both(tmp_path, lf_dem.chain_texts(lubrication=UNSIGNED)).contacts
    assert np.all(contacts.force_n > 0)
    # a file with a pull has signs
    texts = lf_dem.chain_texts(lubrication=UNSIGNED, push=pull)
    assert np.all(read_both(tmp_path, texts).contacts.force_n < 0)
    with pytest.raises(ReadError, match="finite numbers as contact forces"):
        read_both(tmp_path, lf_dem.chain_texts(push=lambda size: np.inf))


def test_a_plane_is_not_periodic_across(tmp_path):
    path = write(tmp_path / "par_a.dat", lf_dem.grains_text(HEAD.replace("Ly 8", "Ly 0")))
    assert scanfab.read_series(path)[0].read().cell.periodic == (True, False, True)


@pytest.mark.parametrize("lost", [3, len(lf_dem.grains_text().splitlines()[-1]) + 1])
def test_a_last_frame_of_lf_dem_that_is_cut_is_left_out(tmp_path, lost):
    """In a row, and between two."""
    path = write(tmp_path / "par_a.dat", lf_dem.grains_text()[:-lost])
    with pytest.warns(ScanfabWarning, match="number 2, is incomplete"):
        assert len(scanfab.read_series(path)) == 1
