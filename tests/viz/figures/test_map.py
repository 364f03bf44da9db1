"""The figure of maps: what is drawn where only some blocks, or some frames, have a value."""

import numpy as np
import pytest
from matplotlib import pyplot

import scanfab
from scanfab import Cell, Packing
from scanfab.scan.blocks import Blocks
from scanfab.viz.figures.figure import drawn_page
from scanfab.viz.figures.map import Map, lattice_of
from tests.helpers.lattices import shaken_cubic

pytestmark = pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")


@pytest.fixture(scope="module")
def packing():
    position, radius = shaken_cubic(np.random.default_rng(0), 6, overlap=1.0)
    return scanfab.find_contacts(Packing(position, radius, cell=Cell([6.0] * 3)))


def mapped(packings, **blocks):
    """Rows that may be changed."""
    table = scanfab.fabric_map(packings, directions=9, spacing=0.7, **blocks)
    return [dict(row) for row in table]


def page_of(figure):
    with drawn_page([figure]) as page:
        page.canvas.draw()
    return page


def meshes(page):
    return [mesh for axes in page.axes for mesh in axes.collections if mesh.get_array() is not None]


def test_a_value_that_one_block_alone_has_is_of_one_colour_in_all_planes(packing):
    rows = mapped(packing, grid=(3, 3, 3))
    for row in rows:
        row["solid_fraction"] = 0.6 if row["block"] == 13 else None
    planes = meshes(page_of(Map(rows, quantity="solid_fraction")))[:3]
    assert len(planes) == 3
    assert len({tuple(one.to_rgba([0.6])[0]) for one in planes}) == 1
    assert planes[0].norm.vmin < 0.6 < planes[0].norm.vmax


def test_a_cell_that_leans_more_than_it_is_high_has_all_its_blocks():
    edges = np.array([[20.0, 0, 0], [0, 8.0, 0], [9.0, 0, 8.0]])
    numbers, steps = lattice_of(Blocks(np.zeros(3), edges, (2, 2, 2)).middles)
    assert numbers.tolist() == [[k % 2, k // 2 % 2, k // 4] for k in range(8)]
    np.testing.assert_allclose(steps, edges / 2)


def test_a_grid_without_one_of_its_blocks_is_refused(packing):
    rows = mapped(packing, grid=(2, 2, 2))
    for lost in range(8):
        with pytest.raises(scanfab.SettingsError, match="rows are missing"):
            Map(rows[:lost] + rows[lost + 1 :])


def test_frames_without_grains_are_not_drawn(packing):
    nothing = Packing(np.zeros((0, 3)), 1.0, contacts=np.zeros((0, 2), int), cell=packing.cell)
    figure = Map(mapped([nothing, packing, nothing], grid=(2, 2, 2)))
    assert [[row["frame"] for row in rows] for rows in figure.frames] == [[1] * 8]
    page_of(figure)


def test_a_quantity_that_the_last_frame_lacks_leaves_its_planes_empty(packing):
    rows = mapped([packing, packing], grid=(2, 2, 2))
    for row in rows:
        row["coordination"] = None if row["frame"] else row["coordination"]
        row |= dict.fromkeys(("alpha_c_axial", "mean_length", "solid_fraction"))
    found = meshes(page_of(Map(rows, quantity=None)))
    assert any(np.ma.getmaskarray(one.get_array()).all() for one in found)


@pytest.mark.parametrize(
    ("blocks", "told"),
    [
        ({"grid": (4, 4, 4)}, "Hatched blocks lie at the surface"),
        ({"slices": 2}, "All blocks lie at the surface"),
        ({"shells": 3}, "variant a."),
    ],
)
def test_one_quantity_on_given_axes_and_blocks_at_the_surface(packing, blocks, told):
    rows = mapped(scanfab.find_contacts(Packing(packing.position, packing.radius)), **blocks)
    figure, axes = Map(rows), pyplot.figure().subplots()
    figure.draw(axes)
    assert told in figure.caption
    hatched = [patch for patch in axes.patches if patch.get_hatch()]
    # in the lower one of the two planes next to the middle
    planes = sorted({row["y"] for row in rows})
    in_plane = [row for row in rows if row["y"] == planes[len(planes) // 3]]
    expected = [row for row in in_plane if row["at_surface"]]
    assert len(hatched) == (len(expected) if "grid" in blocks else 0)
    assert bool(axes.get_title("left")) == ("grid" in blocks)
    pyplot.close(axes.figure)
    # on a page of its own, too
    page_of(Map(rows, quantity="alpha_vs_axial"))


def test_blocks_at_a_surface_do_not_set_the_scale_of_a_profile(packing):
    rows = mapped([packing, packing], slices=4)
    for row in rows:
        row |= {"alpha_vs_axial": 0.01 * row["frame"], "alpha_vs_axial_se": None}
        if row["block"] in (0, 3):
            row |= {"alpha_vs_axial": 5.0 - 9.0 * row["frame"], "at_surface": 1}
    axes = Map(rows, quantity="alpha_vs_axial").on(pyplot.figure().subplots())
    assert -1 < axes.get_ylim()[0] < 0 < 10 < axes.get_ylim()[1] < 11
    grey = [line for line in axes.lines if line.get_color() == "0.75"]
    assert [line.get_ydata().tolist() for line in grey] == [[5000.0] * 2, [-4000.0] * 2]
    pyplot.close("all")
