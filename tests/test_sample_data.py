"""The sample data against the programs' own numbers: contacts, rattlers, fabric and strain."""

from __future__ import annotations

import numpy as np
import pytest

import scanfab
from scanfab.packing.sample import VARIANTS, Sample
from scanfab.pipeline.state import sample_state
from tests.helpers.truth import (
    BOX,
    COMPONENTS,
    FLOOR,
    PERIODIC,
    SAMPLE_DATA,
    TRIAXIAL,
    YADE,
    csv_rows,
)

SCAN = {"directions": 25, "spacing": "3rmin"}
SHELL = csv_rows(TRIAXIAL / "engine.csv")
PLATES = csv_rows(BOX / "engine.csv")


def triaxial(**options):
    return scanfab.compute(
        scanfab.read_series(TRIAXIAL, **options),
        boundary="mask=3",
        rv_radius=float(SHELL["rv_radius"][0]),
        rv_center=(0.0, 0.0, 0.0),
        **SCAN,
    )


def box(strain, **options):
    return scanfab.compute(scanfab.read_series(BOX, **options), strain=strain, **SCAN)


@pytest.fixture(scope="module")
def triaxial_table():
    with pytest.warns(scanfab.ScanfabNote, match="skipped .* neither grains nor contacts"):
        return triaxial()


@pytest.fixture(scope="module")
def strain_file(tmp_path_factory):
    """LIGGGHTS' own strain, from the distance of the plates: the dumps do not hold them."""
    path = tmp_path_factory.mktemp("box") / "strain.csv"
    rows = zip(PLATES["step"].tolist(), PLATES["strain"].tolist(), strict=True)
    path.write_text("step,strain\n" + "".join(f"{step},{strain!r}\n" for step, strain in rows))
    return path


@pytest.fixture(scope="module")
def box_table(strain_file):
    with pytest.warns(scanfab.ScanfabNote, match="skipped .* neither grains nor contacts"):
        return box(strain_file)


def assert_fabric(table, engine, prefix):
    for name in COMPONENTS:
        np.testing.assert_allclose(
            table[f"gc_{name}"], engine[f"{prefix}_{name}"], rtol=0, atol=1e-5, err_msg=name
        )


@pytest.mark.parametrize("name", ["triaxial_table", "box_table"])
def test_every_frame_has_all_variants_with_a_void_fabric(name, request):
    table = request.getfixturevalue(name)
    assert [(row.frame, row.variant) for row in table] == [
        (frame, variant) for frame in range(7) for variant in "abcd"
    ]
    assert np.isfinite(table["alpha_vs"]).all()
    assert np.isfinite(table["alpha_c"]).all()
    assert set(table["contacts_from"].tolist()) == {"file"}


def test_yades_counts_are_exact(triaxial_table):
    whole = triaxial_table.select(variant="a")
    np.testing.assert_array_equal(whole["grains"], SHELL["grains"])
    np.testing.assert_array_equal(whole["contacts"], SHELL["contacts"])
    np.testing.assert_array_equal(whole["rattlers"], SHELL["rattlers"])
    np.testing.assert_array_equal(whole["coordination"], SHELL["coordination"])
    rv = triaxial_table.select(variant="c")
    np.testing.assert_array_equal(rv["contacts"], SHELL["contacts_rv"])


def test_yades_contact_fabric_is_met(triaxial_table):
    assert_fabric(triaxial_table.select(variant="a"), SHELL, "gc")
    assert_fabric(triaxial_table.select(variant="c"), SHELL, "gcrv")


def test_yades_strain_is_that_of_the_boundary(triaxial_table):
    for variant in "abcd":
        strain = triaxial_table.select(variant=variant)["strain"]
        np.testing.assert_allclose(strain, SHELL["strain"], rtol=0, atol=1e-4)


def test_removing_rattlers_removes_those_that_yade_counts(triaxial_table):
    removed = triaxial_table.select(variant="b")
    np.testing.assert_array_equal(removed["grains"], SHELL["grains"] - SHELL["rattlers"])


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_yades_contacts_are_found_by_geometry_but_for_a_few():
    whole = triaxial(contacts="geometric").select(variant="a")
    assert set(whole["contacts_from"].tolist()) == {"geometric"}
    assert np.abs(whole["contacts"] - SHELL["contacts"]).max() <= 3
    assert np.abs(whole["rattlers"] - SHELL["rattlers"]).max() <= 3


def test_liggghts_counts_are_exact(box_table):
    whole = box_table.select(variant="a")
    np.testing.assert_array_equal(whole["step"], PLATES["step"])
    np.testing.assert_array_equal(whole["grains"], PLATES["grains"])
    np.testing.assert_array_equal(whole["contacts"], PLATES["contacts"])
    np.testing.assert_array_equal(whole["rattlers"], PLATES["rattlers"])
    np.testing.assert_allclose(whole["coordination"], PLATES["coordination"], rtol=1e-14)


def test_liggghts_contact_fabric_is_met(box_table):
    assert_fabric(box_table.select(variant="a"), PLATES, "gc")


def test_liggghts_strain_comes_from_a_file(box_table):
    strain = box_table.select(variant="a")["strain"]
    np.testing.assert_allclose(strain, PLATES["strain"], rtol=0, atol=1e-4)


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_the_extent_of_the_grains_follows_the_plates():
    strain = box("grains").select(variant="a")["strain"]
    np.testing.assert_allclose(strain, PLATES["strain"], rtol=0, atol=1e-2)


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_without_walls_in_the_table_there_is_no_strain_by_itself():
    assert np.isnan(box("auto")["strain"]).all()


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_liggghts_contacts_are_found_by_geometry_but_for_a_few(strain_file):
    whole = box(strain_file, contacts="geometric").select(variant="a")
    assert np.abs(whole["contacts"] - PLATES["contacts"]).max() <= 3


@pytest.mark.parametrize(
    ("state", "files"),
    [
        ("floor", [FLOOR / "tutorial.txt", FLOOR / "pairs_all.txt.gz", FLOOR / "walls_all.txt"]),
        ("periodic", [PERIODIC / "precise.txt", PERIODIC / "pairs.txt"]),
    ],
)
def test_the_small_liggghts_states_have_their_true_numbers(state, files):
    truth = next(row for row in csv_rows(FLOOR.parent / "truth.csv") if row["state"] == state)
    (frame,) = scanfab.read_series(files)
    packing = frame.read()
    sample = Sample(packing, np.zeros(len(packing), bool))
    assert len(packing) == truth["grains"]
    assert len(packing.contacts) == truth["contacts"]
    assert packing.wall_contacts.sum() == truth["contacts_wall"]
    assert sample.rattlers.sum() == truth["rattlers"]
    assert sample.contact_numbers.mean() == pytest.approx(truth["coordination"], rel=1e-13)
    fabric = scanfab.contact_fabric(packing.contacts.normal).components()
    for name in COMPONENTS:
        assert fabric[name] == pytest.approx(truth[f"gc_{name}"], abs=1e-5)


@pytest.mark.parametrize(
    ("prefix", "grains", "contacts", "options"),
    [
        ("", "id-spheres-00000000.vtk.gz", "id-intrs-00000000.vtk.gz", {}),
        ("", "ascii_spheres.30000.vtu", "ascii_intrs.30000.vtp", {}),
        ("", "zlib_spheres.30000.vtu", "zlib_intrs.30000.vtp", {}),
        (
            "periodic_",
            "periodic-spheres-00000000.vtk.gz",
            "periodic-intrs-00000000.vtk.gz",
            {"cell": (0.02863940766875124, 0.03212233831079451, 0.03546973927065077)},
        ),
    ],
)
def test_the_small_yade_states_have_their_true_numbers(prefix, grains, contacts, options):
    truth = csv_rows(YADE / f"{prefix}truth_contacts.csv")
    packing = scanfab.read(YADE / grains, contacts=YADE / contacts, **options)
    assert len(packing.contacts) == len(truth)
    normal = np.column_stack([truth["nx"], truth["ny"], truth["nz"]])
    expected = scanfab.contact_fabric(normal).components()
    fabric = scanfab.contact_fabric(packing.contacts.normal).components()
    for name in COMPONENTS:
        assert fabric[name] == pytest.approx(expected[name], abs=1e-5)


POURED, SHEARED = SAMPLE_DATA / "liggghts_clumps", SAMPLE_DATA / "yade_clumps"
COUNTS = ("contacts", "rattlers", "coordination")


def assert_counts(packing, engine):
    """What a program says of its clumps and single spheres, to the last one."""
    sample = Sample(packing, np.zeros(len(packing), bool))
    found = (len(packing.contacts), sample.number(sample.rattlers))
    assert found == (engine["contacts"], engine["rattlers"])
    assert (len(packing), sample.number(sample.grains)) == (engine["spheres"], engine["grains"])
    assert len(packing.contacts.neighbours(packing.bodies)) == engine["neighbours"]
    coordination = sample.coordination(VARIANTS["a"], None)
    assert coordination == pytest.approx(engine["coordination"], rel=1e-14)


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")
@pytest.mark.parametrize("contacts", ["file", "geometric"])
def test_liggghts_clumps_have_its_own_counts(contacts):
    """Through periodic faces, on a wall, and with spheres that are no part of a clump (-1)."""
    for frame, engine in zip(
        scanfab.read_series(POURED), csv_rows(POURED / "engine.csv"), strict=True
    ):
        packing = frame.read()
        if contacts == "geometric":
            packing = scanfab.find_contacts(packing)
        assert packing.wall_contacts.sum() == engine["contacts_wall"]
        assert engine["contacts_inside"] == 0
        assert_counts(packing, engine)
        numbers = np.bincount(packing.contacts.pairs.ravel(), minlength=len(packing))
        np.testing.assert_array_equal(numbers, packing.columns["c_ca"])


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")
def test_yade_clumps_have_its_own_counts_places_and_fabric():
    """In a cell that is tilted in the last frame; once more from the VTK files of that frame."""
    engine, places = csv_rows(SHEARED / "engine.csv"), csv_rows(SHEARED / "places.csv")
    series = [scanfab.read(SHEARED / f"saved_{row['step']}.xml.bz2") for row in engine]
    last = scanfab.read(SHEARED / "last-spheres-00000000.vtk.gz")
    for packing, row in [*zip(series, engine, strict=True), (last, engine[-1])]:
        assert_counts(packing, row)
        fabric = scanfab.contact_fabric(packing.contacts.normal).components()
        for name in COMPONENTS:
            assert fabric[name] == pytest.approx(row[f"gc_{name}"], abs=1e-5)
        own = places[places["step"] == row["step"]]
        where = dict(zip(packing.bodies.number.tolist(), packing.bodies.place, strict=True))
        found = np.array([where[number] for number in own["clump"].tolist()])
        off = found - np.column_stack([own[axis] for axis in "xyz"])
        off += packing.cell.nearest_image(off) @ packing.cell.vectors
        assert np.abs(off).max() < (1e-7 if packing is last else 1e-15)


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")
def test_tables_of_clumps_have_the_counts_of_the_programs():
    for source, name in [(POURED, POURED), (SHEARED / "saved_*.xml.bz2", SHEARED)]:
        table = scanfab.compute(scanfab.read_series(source), variants="ab", **SCAN)
        engine = csv_rows(name / "engine.csv")
        whole, without = table.select(variant="a"), table.select(variant="b")
        for column in ("grains", *COUNTS):
            np.testing.assert_allclose(whole[column], engine[column], rtol=1e-14)
        np.testing.assert_array_equal(without["grains"], engine["grains"] - engine["rattlers"])


def test_the_stress_of_clumps_is_what_yade_controlled():
    """30 kPa within 1 %; branches from sphere to sphere would give a fifth less."""
    packing = scanfab.read(SHEARED / "saved_86500.xml.bz2")
    sample = Sample(packing, np.zeros(len(packing), bool))
    stress = sample_state(sample, VARIANTS["a"], None).stress
    np.testing.assert_allclose(np.diag(stress), 3e4, rtol=0.01)
