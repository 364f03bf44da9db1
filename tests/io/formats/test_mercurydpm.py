"""MercuryDPM: pairs listed from both sides, walls, times, planes, periodic boundaries."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab import ReadError, ScanfabWarning
from tests.helpers.dumps import write
from tests.helpers.made.mercurydpm import (
    CENTRES,
    IDS,
    NORMAL,
    RADIUS,
    TANGENT,
    contacts_at,
    data_frame,
    fstat_frame,
    restart,
)


@pytest.fixture
def run(tmp_path):
    """Grains at three times, contacts at two of them."""
    write(tmp_path / "run.data", "".join(map(data_frame, (0.1, 0.2, 0.3))))
    write(
        tmp_path / "run.fstat",
        fstat_frame(0.1) + fstat_frame("0.3000000001", contacts_at(0.3)),
    )
    return tmp_path


def test_contacts_go_by_their_time_and_forces_act_on_the_second_grain(run):
    series = scanfab.read_series(run, cell=(1, 2, 3))
    assert [frame.snapshot.time for frame in series] == [0.1, 0.2, 0.3]
    assert len(series[0].read().contacts) == 0
    with pytest.warns(ScanfabWarning, match="no contact file for time 0.2 among"):
        assert series[1].read().contacts is None
    packing = series[2].read()
    contacts = packing.contacts
    # each pair once
    assert contacts.pairs.tolist() == [[0, 1], [2, 0]]
    # pushed off the first grain, through the face as well
    np.testing.assert_array_equal(contacts.force, [[NORMAL, -TANGENT, 0], [NORMAL, 0, -TANGENT]])
    np.testing.assert_allclose(contacts.normal, [[1, 0, 0], [1, 0, 0]])
    assert packing.wall_contacts.tolist() == [0, 0, 1]
    # the domain is not said to repeat
    cell = scanfab.read_series(run)[0].read().cell
    assert (cell.periodic, cell.vectors.diagonal().tolist()) == ((False,) * 3, [1, 2, 3])


def test_planes_and_frames_without_grains(tmp_path):
    rows = "0.1 1 9 9 0.1 0 0 0\n0.29 1 9 9 0.1 0 0 1\n"
    packing = scanfab.read(write(tmp_path / "a.data", f"2 0.5 0 0 1 2 \n{rows}"), dim=2)
    np.testing.assert_array_equal(packing.position, [[0.1, 1, 0], [0.29, 1, 0]])
    np.testing.assert_array_equal(packing.radius, 0.1)
    assert packing.columns["species"].tolist() == [0, 1]
    assert packing.time == 0.5
    path = write(tmp_path / "a.data", "0 0 0 0 0 1 2 3 \n" + data_frame(1))
    assert [len(frame.read()) for frame in scanfab.read_series(path)] == [0, 3]


def test_a_restart_has_contacts_and_its_period(tmp_path):
    path = write(tmp_path / "a.restart", restart())
    packing = scanfab.read(path)
    np.testing.assert_array_equal(packing.position, CENTRES)
    np.testing.assert_array_equal(packing.radius, RADIUS)
    assert packing.id.tolist() == list(IDS)
    assert packing.time == 0.5
    assert packing.cell.periodic == (True, False, False)
    assert packing.contacts.pairs.tolist() == [[0, 1], [2, 0]]
    np.testing.assert_array_equal(packing.contacts.force, [[2, -0.5, 0]] * 2)
    np.testing.assert_allclose(packing.contacts.normal, [[1, 0, 0]] * 2)
    assert packing.wall_contacts.tolist() == [0, 0, 2]
    # a period of another kind can be named
    write(path, restart().replace("PeriodicBoundary", "LeesEdwardsBoundary"))
    assert scanfab.read(path, cell=(1, 2, 3)).cell.periodic == (True, True, True)


@pytest.mark.parametrize(
    ("version", "first", "periods"),
    [
        (2, "", "WallsPeriodic 1\nnormal 0 1 0 pos_left 0.5 pos_right 2.5 shift 0 2 0"),
        (3, "TSP BP ", "Boundaries 1\nPeriodicBoundary normal 0 1 0 position_left 0.5 shift 0 2 0"),
    ],
)
def test_an_old_restart(tmp_path, version, first, periods):
    rows = "".join(f"{first}{x} {y} {z} 9 9 9 {RADIUS} 0 0 0\n" for x, y, z in CENTRES)
    text = (
        f"restart_version {version}\nname a\nxmin 0 xmax 1 ymin 0 ymax 2 zmin 0 zmax 3\n"
        f"dt 1 t 0.5 tmax 1\n{periods}\nParticles 3\n{rows}FixedParticles 0\n"
    )
    packing = scanfab.read(write(tmp_path / "a.restart", text))
    np.testing.assert_array_equal(packing.radius, RADIUS)
    np.testing.assert_array_equal(packing.position, CENTRES)
    assert packing.time == 0.5
    assert packing.cell.periodic == (False, True, False)
    assert packing.cell.origin.tolist() == [0, 0.5, 0]
    assert packing.contacts is None


def test_contacts_of_other_grains_and_forces_that_are_no_numbers(run):
    path = run / "run.fstat"
    with pytest.raises(ReadError, match="names the grain 1, which is not in the grain file"):
        scanfab.read(write(run / "a.data", data_frame(0.3, count=1)), contacts=path)
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
    with pytest.raises(ReadError, match=r"the file is incomplete"):
        scanfab.read(write(run / "b.data", data_frame(1)[:-50]))


def test_a_text_that_begins_with_a_number_is_no_frame(tmp_path):
    path = write(
        tmp_path / "a.txt", "2 samples of sand from France\nwere sheared by hand in a wooden box\n"
    )
    with pytest.raises(scanfab.ScanfabError, match="no reader knows this format"):
        scanfab.read(path)


@pytest.mark.filterwarnings("error")
def test_bounds_without_an_end_are_no_box(tmp_path):
    """Found by fuzzing: their difference made NumPy warn."""
    text = "1 0.5 inf 0 inf 2 \n0.1 1 9 9 0.1 0 0 0\n"
    assert scanfab.read(write(tmp_path / "a.data", text)).cell is None
