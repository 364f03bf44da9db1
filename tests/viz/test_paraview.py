"""ParaView files, read back by pyvista: every array is there, and says what the table says."""

import numpy as np
import pytest
import pyvista

import scanfab
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.map_settings import MapSettings
from scanfab.pipeline.settings import Settings
from scanfab.table.columns import COLUMNS
from scanfab.viz.compute_file import VtkFolder
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.lattices import shaken_cubic

ARRAYS = {
    "grains": {"radius", "id", "contacts", "rattler", "boundary", "in_window"},
    "contacts": {"normal", "force", "boundary", "in_window"},
    "window": set(),
    "lines": {"length", "void", "kept", "state", "line"},
    "distribution": {"mean_length", "weight", "direction", "deviation"},
    "ellipsoids": {"kind"},
    "tensors": {"gvs", "gc"},
}
KINDS = ["grains", "contacts", "window"]
KINDS += [f"{kind}-{v}" for v in "abcd" for kind in ARRAYS if kind not in KINDS]
FAST = {"variants": "c", "directions": 9, "spacing": "0.5rmin", "cutoff": "0.2rmin"}


def tensor(row, name):
    xx, yy, zz, xy, xz, yz = (row[f"{name}_{c}"] for c in ("xx", "yy", "zz", "xy", "xz", "yz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def written(folder, source, **options):
    """The rows of a computation whose files go to the folder."""
    return list(compute_rows(source, Settings(**FAST | options), observe=VtkFolder(folder)))


def times_of(folder, kind="grains"):
    return pyvista.get_reader(folder / f"{kind}.pvd").time_values


def dumps_of(folder, *steps):
    """A series of 64 grains a frame, without any at the step 1."""
    folder.mkdir()
    for step in steps:
        text = dump_text(cubic_rows() if step != 1 else [], step=step)
        write(folder / f"dump_{step}.txt", text)
    return scanfab.read_series(folder)


def test_every_file_has_its_arrays_and_the_row(computed):
    for kind in KINDS:
        files = sorted(computed.vtk.glob(f"{kind}_*.vtp"))
        assert len(files) == 3
        for file in files:
            mesh = pyvista.read(file)
            assert mesh.n_points > 0
            arrays = {*mesh.point_data, *mesh.cell_data}
            assert arrays >= ARRAYS[kind.split("-")[0]]
            assert {name.removeprefix("row_") for name in mesh.field_data} == set(COLUMNS)
            frame = int(mesh.field_data["frame"][0])
            rows = [row for row in computed.rows if row["frame"] == frame]
            rows = [row for row in rows if "-" not in kind or row["variant"] == kind[-1]]
            assert list(mesh.field_data["variant"]) == [row["variant"] for row in rows]
            expected = [row["alpha_vs_axial"] for row in rows]
            assert mesh.field_data["alpha_vs_axial"].tolist() == expected
        reader = pyvista.get_reader(computed.vtk / f"{kind}.pvd")
        assert reader.time_values == [0.0, 3.0, 6.0]
        reader.set_active_time_value(6.0)
        assert reader.read()[0].field_data["frame"][0] == 6


def test_the_surface_gives_back_the_tensor(computed):
    for row in computed.rows:
        mesh = pyvista.read(computed.vtk / f"distribution-{row['variant']}_{row['frame']:06d}.vtp")
        direction = mesh.points / np.linalg.norm(mesh.points, axis=1)[:, None]
        assert direction == pytest.approx(np.asarray(mesh["direction"]), abs=1e-12)
        share = mesh["weight"] * mesh["mean_length"]
        found = np.einsum("p,pi,pj->ij", share, direction, direction) / share.sum()
        # a small part of the scan's error, as both come from the same sums
        assert np.abs(found - tensor(row, "gvs")).max() < 0.2 * row["alpha_vs_axial_se"]
        assert share.sum() == pytest.approx(row["mean_length"], rel=2e-3)


def test_the_surface_has_the_moment_of_the_table(tmp_path):
    packing = scanfab.find_contacts(scanfab.Packing(*shaken_cubic(np.random.default_rng(0), 6)))
    even = {"directions": "lebedev:23", "cutoff": "1rmin"}
    (row,) = written(tmp_path, packing, moment=2, **even)
    mesh = pyvista.read(tmp_path / "distribution-c_000000.vtp")
    assert np.sum(mesh["weight"] * mesh["mean_length"]) == pytest.approx(row.mean_length, rel=1e-2)


def test_the_surface_is_closed_and_looks_outward(computed):
    mesh = pyvista.read(computed.vtk / "distribution-c_000006.vtp")
    assert mesh.is_manifold
    assert mesh.n_open_edges == 0
    assert np.all(np.sum(mesh.face_normals * mesh.cell_centers().points, axis=1) > 0)


def test_ellipsoids_have_the_principal_values_as_half_axes(computed):
    row = next(row for row in computed.rows if (row["frame"], row["variant"]) == (6, "c"))
    mesh = pyvista.read(computed.vtk / "ellipsoids-c_000006.vtp")
    for kind, name in enumerate(("gvs", "gc")):
        points = mesh.points[mesh["kind"] == kind]
        points = points - 0.5 * (points.min(axis=0) + points.max(axis=0))
        distance = np.linalg.norm(points, axis=1)
        values = np.linalg.eigvalsh(tensor(row, name))
        assert distance.max() / distance.min() == pytest.approx(values[2] / values[0], rel=0.01)
        # as they are for Tensor Glyph
        matrix = pyvista.read(computed.vtk / "tensors-c_000006.vtp")[name]
        assert matrix.reshape(3, 3) == pytest.approx(tensor(row, name))


def test_grains_and_contacts_are_those_of_the_table(computed):
    for row in (row for row in computed.rows if row["variant"] == "c"):
        grains = pyvista.read(computed.vtk / f"grains_{row['frame']:06d}.vtp")
        inside = (grains["in_window"] == 1) & (grains["boundary"] == 0)
        assert inside.sum() == row["grains"]
        assert (inside & (grains["rattler"] == 1)).sum() == row["rattlers"]
        contacts = pyvista.read(computed.vtk / f"contacts_{row['frame']:06d}.vtp")
        inside = (contacts.cell_data["in_window"] == 1) & (contacts.cell_data["boundary"] == 0)
        assert inside.sum() == row["contacts"]
        normal = contacts.cell_data["normal"][inside]
        assert normal.T @ normal / inside.sum() == pytest.approx(tensor(row, "gc"))


def test_pieces_of_lines_are_kept_from_the_cut_off_on(computed):
    mesh = pyvista.read(computed.vtk / "lines-c_000006.vtp")
    length, void, kept = (np.asarray(mesh.cell_data[name]) for name in ("length", "void", "kept"))
    cutoff = mesh.field_data["cutoff"][0]
    assert np.array_equal(kept == 1, (void == 1) & (length >= cutoff))
    assert mesh.cell_data["state"].tolist() == (void.astype(int) + kept).tolist()
    ends = np.asarray(mesh.points).reshape(-1, 2, 3)
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) == pytest.approx(length)


def test_files_of_a_cut_off_that_nothing_reaches_have_no_distribution(tmp_path):
    spheres = shaken_cubic(np.random.default_rng(0), 5)
    packing = scanfab.Packing(spheres.position, spheres.radius, step=7, contacts=[])
    with pytest.warns(scanfab.ScanfabWarning, match="no void segment"):
        written(tmp_path, packing, cutoff=100.0)
    assert not (tmp_path / "distribution-c_000000.vtp").exists()
    lines = pyvista.read(tmp_path / "lines-c_000000.vtp")
    assert np.isnan(lines.field_data["alpha_vs"][0])
    assert pyvista.read(tmp_path / "contacts_000000.vtp").n_cells == 0
    assert times_of(tmp_path) == [7.0]


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_a_collection_is_kept_only_with_the_table_that_is_resumed(tmp_path):
    """Otherwise it would mix frames of two samples."""
    for name, steps in (("one", (3, 7)), ("two", (4,))):
        series, vtk = dumps_of(tmp_path / name, *steps), tmp_path / "vtk"
        for frames in ("-1:", ":"):
            words = {**FAST, "vtk": vtk, "resume": True, "frames": frames}
            scanfab.compute_file(series, tmp_path / f"{name}.csv", **words)
        assert times_of(vtk) == list(steps)


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_a_frame_without_grains_and_a_name_beyond_ascii(tmp_path):
    vtk = tmp_path / "vtk"
    assert len(written(vtk, dumps_of(tmp_path / 'grüße<&">', 0, 1, 2))) == 3
    empty = pyvista.read(vtk / "grains_000001.vtp")
    assert empty.n_points == 0
    assert empty.field_data["grains"][0] == 0
    assert empty.field_data["source"][0].endswith(r'gr\xfc\xdfe<&">')
    assert times_of(vtk) == [0, 1, 2]
    assert times_of(vtk, "distribution-c") == [0, 2]


@pytest.fixture(scope="module")
def periodic():
    spheres = shaken_cubic(np.random.default_rng(0), 6, overlap=1.0)
    return scanfab.find_contacts(scanfab.Packing(*spheres, cell=scanfab.Cell([6.0] * 3)))


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_shells_of_a_map_have_their_volumes_and_values(periodic, tmp_path):
    settings = MapSettings(shells=3, directions=9, spacing=0.5)
    rows = list(compute_rows(periodic, settings, observe=VtkFolder(tmp_path)))
    mesh = pyvista.read(tmp_path / "map-a_000000.vtu")
    volumes = mesh.compute_cell_sizes()["Volume"]
    for row in rows:
        shell = np.flatnonzero(mesh["block"] == row.block)
        expected = 4 / 3 * np.pi * (row.r_outer**3 - row.r_inner**3)
        assert volumes[shell].sum() == pytest.approx(expected, rel=0.02)
        value = np.array(row.alpha_vs_axial, float)
        np.testing.assert_array_equal(mesh["alpha_vs_axial"][shell], value)


def test_lines_of_a_periodic_whole_pass_through_its_images(periodic, tmp_path):
    """The middle of each piece lies in void or in a grain, as the file says."""
    written(tmp_path, periodic, variants="a")
    mesh = pyvista.read(tmp_path / "lines-a_000000.vtp")
    branch = mesh.cell_centers().points[:, None] - periodic.position
    branch -= 6.0 * np.rint(branch / 6.0)
    is_void = (np.linalg.norm(branch, axis=2) > periodic.radius).all(axis=1)
    assert is_void.tolist() == (np.asarray(mesh["void"]) == 1).tolist()
    # lines are cut at a ball, which reaches out of the cell
    assert np.abs(mesh.points - 3.0).max() > 3.0


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_tensors_that_one_variant_alone_has_are_in_tables_only(periodic, tmp_path):
    words = {"variants": "ac", "rv": 0.06, "with_": "harmonics"}
    whole, inner = written(tmp_path, periodic, spacing=0.1, **words)
    assert whole.c_tensor4 is not None
    assert inner.c_tensor4 is None
    fields = pyvista.read(tmp_path / "grains_000000.vtp").field_data
    assert list(fields["variant"]) == ["a", "c"]
    assert not {"c_tensor2", "c_tensor4"} & set(fields)
