"""Figures, views and ParaView files of discs: drawn in their plane."""

import numpy as np
import pytest
import pyvista
from matplotlib.figure import Figure

import scanfab
from scanfab import Cell, Packing, SettingsError, Window, sphere
from scanfab.pipeline.compute import compute_rows
from scanfab.pipeline.settings import Settings
from scanfab.viz.compute_file import VtkFolder
from scanfab.viz.figures.projection import places_of
from scanfab.viz.figures.rose import AROUND, contact_ring
from scanfab.viz.scene import scene_of, section_lines, towards_viewer

XY, ZX = (scanfab.base.space.Space(k) for k in (2, 1))


@pytest.fixture(scope="module")
def packing():
    random = np.random.default_rng(3)
    place, radius = random.random((150, 2)) * 12, random.uniform(0.3, 0.6, 150)
    return scanfab.find_contacts(Packing(place, radius, cell=Cell([12.0, 12.0, 1.0])))


def test_a_rose_has_one_ring_and_a_projection_is_a_curve(packing):
    frames = scanfab.scan_frames(packing, variants="c", tolerance=0.05)
    ax = Figure().subplots(subplot_kw={"projection": "polar"})
    frames.plot.rose(ax=ax)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["in the plane x-y"]
    assert "from x towards y" in ax.get_legend().get_title().get_text()
    with pytest.raises(SettingsError, match="no polar angles, found 30"):
        frames.plot.rose(ax=ax, angles=(30.0,))
    ax = frames.plot.projection(ax=Figure().subplots())
    assert ax.get_xlim() == (0, 180)
    assert "from x to y" in ax.get_xlabel()
    assert frames.plot.histogram(ax=Figure().subplots()).get_ylabel()


def test_the_ring_of_contacts_counts_all_of_them():
    """As many on each side of isotropy; the curve is 1 + n·F·n with F = 4 (G - I/2)."""
    angle = np.linspace(0, np.pi, 5000, endpoint=False)
    angle = angle + 0.05 * np.sin(2 * angle)
    normals = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    ring = contact_ring(normals, 90.0, XY)
    assert ring.value.mean() == pytest.approx(1.0)
    np.testing.assert_allclose(np.interp(ring.theta, AROUND, ring.curve), ring.value, atol=0.02)


def test_directions_of_a_plane_begin_at_its_first_axis():
    angle, directions = places_of(ZX)
    np.testing.assert_allclose(directions[[0, 90]], [[1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert angle[90] == 90.0


def test_the_viewer_sees_the_first_axis_on_the_right():
    unit = dict(zip("xyz", np.eye(3), strict=True))
    for across, right, up in ((2, "x", "y"), (0, "y", "z"), (1, "x", "z")):
        toward = towards_viewer(unit[up], scanfab.base.space.Space(across))
        np.testing.assert_array_equal(np.cross(unit[up], toward), unit[right])


def test_the_lines_of_a_section_lie_in_the_plane(packing):
    window = Window([6.0, 6.0, 0.0], sphere(5.0, XY))
    scene = scene_of(scanfab.Sample(packing, np.zeros(150, bool)), window)
    lines = section_lines(scene, (0.0, 1.0, 0.0))
    assert len(lines.length) > 20
    assert not lines.ends[..., 2].any()


def test_paraview_files_lie_in_the_plane(tmp_path, packing):
    settings = Settings(variants="c", tolerance=0.05, rv_shape="box")
    list(compute_rows(packing, settings, observe=VtkFolder(tmp_path)))
    for name in ("grains", "contacts", "window", "lines-c", "distribution-c", "ellipsoids-c"):
        mesh = pyvista.read(tmp_path / f"{name}_000000.vtp")
        assert mesh.n_points > 3
        assert not np.asarray(mesh.points)[:, 2].any(), name
