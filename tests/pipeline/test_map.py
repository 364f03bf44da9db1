"""Maps: what a row holds, what is refused, and that layers are told apart."""

import warnings

import numpy as np
import pytest

import scanfab
from scanfab import Cell, Packing, SettingsError, compute, fabric_map
from tests.helpers.lattices import shaken_cubic, simple_cubic

LINES = {"directions": "lebedev:7", "spacing": 0.15}


def mapped(packing, **options):
    """A map, and what was told."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        table = fabric_map(packing, **{"max_chords": 2e6, **LINES, **options})
    return table, [str(one.message) for one in caught]


@pytest.fixture(scope="module")
def packing():
    position, radius = shaken_cubic(np.random.default_rng(0), 9, overlap=1.0)
    return scanfab.find_contacts(Packing(position, radius, cell=Cell([9.0] * 3)))


def test_a_row_for_each_variant_and_block_x_fastest(packing):
    """One worker gives the same, another seed does not."""
    words = {"grid": (3, 2, 1), "variants": "ac", "spacing": 0.6}
    ways = ({}, {"workers": 1}, {"seed": 1})
    grid, same, other = (mapped(packing, **words, **one)[0] for one in ways)
    assert grid["variant"].tolist() == ["a"] * 6 + ["c"] * 6
    assert grid["block"].tolist() == [*range(6), *range(6)]
    assert grid["x"][:6].tolist() == pytest.approx([1.5, 4.5, 7.5] * 2)
    assert grid["y"][:6].tolist() == pytest.approx([2.25] * 3 + [6.75] * 3)
    assert grid["at_surface"].tolist() == [0] * 6 + [1] * 6
    assert same == grid
    assert other["alpha_vs_axial"][0] != grid["alpha_vs_axial"][0]


def test_the_ellipsoid_of_an_open_whole_has_more_blocks_at_its_surface(packing):
    """It lies inside the hull of the centres, where the whole ends by the rule clip."""
    whole = scanfab.find_contacts(Packing(packing.position, packing.radius))
    clip, ends = (
        mapped(whole, grid=(5, 5, 5), edge=edge, spacing=0.6)[0]["at_surface"]
        for edge in ("clip", "ends")
    )
    assert np.all(ends >= clip)
    assert 0 < clip.sum() < ends.sum() < 5**3


@pytest.mark.parametrize("variants", ["a", "b"])
def test_blocks_together_are_the_row_of_compute(packing, variants):
    blocks, _ = mapped(packing, grid=(3, 2, 1), variants=variants, max_chords=1e7)
    (whole,) = row = compute(packing, variants=variants, **LINES)
    for name in ("segments", "grains", "rattlers", "contacts"):
        assert blocks[name].sum() == whole[name]
    # blocks are of one volume here
    assert blocks["solid_fraction"].mean() == pytest.approx(whole.solid_fraction, abs=3e-3)
    for name, weight in (("coordination", "grains"), ("mean_length", "segments")):
        mean = np.average(blocks[name], weights=blocks[weight])
        assert mean == pytest.approx(whole[name], rel=1e-9 if weight == "grains" else 1e-3)
    gc = np.average(blocks.tensor("gc"), axis=0, weights=blocks["contacts"])
    np.testing.assert_allclose(gc, row.tensor("gc")[0], atol=1e-12)
    # one block is the whole, but for the scan of its parts
    ((block,), _) = mapped(packing, slices=1, variants=variants)
    for name in ("mean_length", "gvs_zz", "gvs_xy", "alpha_vs", "alpha_vs_axial_se"):
        assert block[name] == pytest.approx(whole[name], rel=1e-9), name
    for name in ("segments", "grains", "contacts", "alpha_c_axial_se", "spacing", "cutoff"):
        assert block[name] == whole[name], name


def test_segments_are_counted_for_the_second_moment_too(packing):
    first, second = (mapped(packing, slices=2, spacing=0.6, moment=k)[0] for k in (1, 2))
    assert first["segments"].tolist() == second["segments"].tolist()
    assert np.all(first["mean_length"] < second["mean_length"])


def test_what_the_rule_start_leaves_out_is_told(packing):
    """Few segments of an RV leave the sample from deep inside."""
    whole = scanfab.find_contacts(Packing(packing.position, packing.radius))
    for rv, is_told in ((0.3, False), (0.9, True)):
        _, told = mapped(whole, variants="c", rv=rv, edge="start", shells=1, spacing=0.6)
        assert any("leave the sample and are left out" in one for one in told) == is_told


def test_slices_tell_two_layers_of_known_fabric_apart():
    """Spheres in the lower half, in the upper disks of overlapping ones."""
    position = simple_cubic(10).position
    position = position + np.random.default_rng(1).uniform(-0.2, 0.2, position.shape)
    upper = position[position[:, 2] > 5]
    # grains of three spheres side by side along x and y show lines along z their broad side
    bars = [upper + 0.5 * np.eye(3)[axis] for axis in (0, 1)]
    spheres = np.concatenate([position, *bars])
    layers = scanfab.find_contacts(Packing(spheres, 0.42, cell=Cell([10.0] * 3)))
    table, told = mapped(layers, slices=4, cutoff=0.2, spacing=0.3)
    lower, upper = table["alpha_vs_axial"][:2], table["alpha_vs_axial"][2:]
    errors = np.hypot(table["alpha_vs_axial_se"], table["alpha_vs_axial_sample_se"])
    assert lower.min() - upper.max() > 6 * errors.max()
    assert any("this is not a homogeneous sample" in one for one in told)


def test_blocks_of_a_homogeneous_medium_agree_with_the_whole():
    random = np.random.default_rng(3)
    count = random.poisson(0.15 * 20**3)
    position, radius = random.uniform(0, 20, (count, 3)), random.uniform(0.5, 1.5, count)
    packing = Packing(position, radius, cell=Cell([20.0] * 3))
    beta, solid = 0.15 * np.pi * 13 / 12, 1 - np.exp(-0.15 * 4 / 3 * np.pi * 1.25)
    for kind in ({"grid": (2, 2, 2)}, {"shells": 2}):
        table, told = mapped(packing, spacing=0.5, **kind)
        errors = np.hypot(table["alpha_vs_axial_se"], table["alpha_vs_axial_sample_se"])
        assert np.all(np.abs(table["alpha_vs_axial"]) < 4 * errors)
        # the errors of eight parts are uncertain, and this sample's density is off by chance
        for name, expected in (("mean_length", 0.5 + 1 / beta), ("solid_fraction", solid)):
            assert np.all(np.abs(table[name] - expected) < 6 * table[f"{name}_se"])
        assert not any("the sample is not homogeneous" in one for one in told if "no s" not in one)


@pytest.mark.parametrize(("kind", "inner"), [({"grid": (3, 3, 3)}, 1), ({"shells": 3}, 2)])
def test_solid_fraction_is_that_of_a_lattice_and_empty_at_an_open_surface(kind, inner):
    position, radius = simple_cubic(12)
    packing = Packing(position, radius * 0.98)
    table, _ = mapped(packing, contact_tolerance=0.05, spacing=0.3, **kind)
    outer = table["at_surface"] == 1
    assert np.count_nonzero(~outer) == inner
    assert np.isnan(table["solid_fraction"][outer]).all()
    # shells cut a lattice's cells, of which the innermost holds but 33
    expected = pytest.approx([np.pi / 6 * 0.98**3] * inner, abs=0.04 if inner > 1 else 0.01)
    assert table["solid_fraction"][~outer].tolist() == expected


def test_dilute_blocks_within_a_surface_have_no_solid_fraction():
    """Void segments are longer than shells are thick: their middles gather in the innermost."""
    places = np.random.default_rng(2).uniform(0, 13.9, (500, 3))
    # a periodic medium has no surface
    for cell, is_empty in ((None, True), (Cell([13.9] * 3), False)):
        packing = Packing(places, 0.6, cell=cell)
        table, _ = mapped(packing, shells=3, directions=11, spacing=0.8)
        assert np.isnan(table["solid_fraction"]).tolist() == [is_empty] * 3


@pytest.mark.parametrize("edge", ["clip", "start", "ends"])
def test_the_rv_and_its_rules(packing, edge):
    """The window's blocks hold what the window holds, by each rule at its surface."""
    words = {"variants": "c", "edge": edge, "rv": 0.9, "max_chords": 1e7}
    table, _ = mapped(packing, grid=(2, 2, 2), **words)
    row = compute(packing, **LINES, **words)[0]
    assert table["segments"].sum() == pytest.approx(row.segments, abs=4)
    assert table["grains"].sum() == row.grains
    assert table["contacts"].sum() == row.contacts
    assert table["solid_fraction"].mean() == pytest.approx(row.solid_fraction, abs=0.01)
    assert table["at_surface"].all() == (edge != "start")
    assert ("edge" in table.names) == (edge != "clip")


def test_the_median_block_meets_the_tolerance(packing):
    words = {"directions": "auto", "spacing": "auto", "tolerance": 4e-3, "max_chords": None}
    table, _ = mapped(packing, grid=(3, 3, 3), **words)
    assert np.median(table["alpha_vs_axial_se"]) <= 4e-3
    assert table["alpha_vs_axial_se"].max() > 4e-3 / 3
    _, told = mapped(packing, grid=(3, 3, 3), **{**words, "tolerance": 1e-5, "max_chords": 1e6})
    assert any("the tolerance is 1e-05: the scan stopped" in one for one in told)


def test_blocks_of_later_frames_and_of_frames_without_grains():
    """Blocks follow a cell that deforms; those of an open sample stay where they were."""
    position, radius = simple_cubic(8)
    words = {"slices": 2, "contact_tolerance": 0.2, "spacing": 0.6}
    first, last = [8.0, 8.0, 8.0], [8.4, 8.4, 7.2]
    frames = [Packing(position / 8 * one, 0.9 * radius, cell=Cell(one)) for one in (first, last)]
    table, _ = mapped(frames, **words)
    assert table["grains"].tolist() == [256] * 4
    assert table["z"].tolist() == pytest.approx([2.0, 6.0, 1.8, 5.4], abs=0.06)
    empty = Packing(np.zeros((0, 3)), np.zeros(0))
    sunk = Packing(position * [1.0, 1.0, 0.8], 0.9 * radius)
    table, _ = mapped([empty, Packing(position, 0.9 * radius), sunk], **words)
    assert table["grains"].tolist() == [0, 0, 256, 256, 320, 192]
    assert [row.alpha_vs_axial is None for row in table] == [True] * 2 + [False] * 4
    assert [row.z for row in table] == 3 * [row.z for row in table[:2]]


def test_what_holds_for_one_frame_is_told_for_it(packing):
    """The blocks of an open sample stay, and each frame scatters in a way of its own."""
    other = Packing(packing.position[::-1], packing.radius, cell=packing.cell)
    _, told = mapped([packing, other], slices=4, spacing=0.4)
    frames = [one[:7] for one in told if "of 4 blocks scatters" in one]
    assert frames == ["frame 0", "frame 1"]
    position, radius = simple_cubic(8)
    frames = [Packing(one * position, 0.9 * radius, contacts=[[0, 1]]) for one in (1.0, 1.1)]
    _, told = mapped(frames, grid=(2, 2, 2), spacing=0.6)
    (outside,) = [one for one in told if "lie outside the blocks" in one]
    edges = ((1.1 * position < position.min()) | (1.1 * position > position.max())).any(axis=1)
    assert outside.startswith(f"frame 1, variant a: {edges.sum()} of 512 grains")


REFUSED = [
    ({}, "exactly one of `grid`, `slices` and `shells`, found none"),
    ({"shells": 2.5}, "shells: expected 1 or more"),
    ({"slices": 2, "cutoffs": "0,1"}, "cutoffs: a map has one RV, one cut"),
    ({"slices": 2, "rv": "0.4,0.6"}, "rv: a map has one RV"),
    ({"slices": 2, "with_": "state"}, "with_: .* no further columns"),
    ({"slice": 3}, "no option 'slice': did you mean 'slices'"),
    ({"grid": (20, 1, 1)}, r"grid: makes blocks 0.45 thick.*choose fewer"),
    ({"slices": 2, "axis": (1, 0, 1)}, "45 degrees off the axis"),
]


@pytest.mark.parametrize(("options", "message"), REFUSED)
def test_what_is_no_map_is_refused(packing, options, message):
    with pytest.raises((TypeError, SettingsError), match=message):
        fabric_map(packing, **options)


def test_thin_blocks_are_doubted(packing):
    _, told = mapped(packing, slices=6)
    assert any("`slices` makes blocks 1.5 thick" in one for one in told)


def test_blocks_without_segments_are_empty_and_said():
    position, _ = simple_cubic(6)
    lower, cell = position[position[:, 2] < 3], Cell([6.0] * 3, (True, True, False))
    frames = [Packing(lower, 0.49, cell=cell), Packing(lower * [1, 1, 0.5], 0.24, cell=cell)]
    table, told = mapped(frames, slices=2, cutoff=0.05)
    assert (table[3].alpha_vs_axial, table[3].grains) == (None, 0)
    assert any("1 of 2 blocks have no void fabric" in one for one in told)


# ends of slices of a sphere and, by the area of segments of a circle, of a cylinder across its axis
Z, X = np.linspace(-1, 1, 6), np.linspace(-1, 1, 4)
ARCS = np.diff(X * np.sqrt(1 - X**2) + np.arcsin(X))
# of three shells out to the corners of a cube of edge 2 the second lacks six caps of a ball
R = np.array([0.0, 1.0, 2.0]) / np.sqrt(3.0)
CAPS = 6 * np.pi * (R[2] - 1) ** 2 * (R[2] - (R[2] - 1) / 3)
IN_CUBE = np.diff([*(4 / 3 * np.pi * R**3 - [0, 0, CAPS]), 8.0])


BLOCKS = [
    ({"slices": 5}, "sphere", np.diff(3 * Z - Z**3)),
    ({"grid": (3, 1, 1)}, "cylinder", ARCS),
    ({"shells": 3}, "box", IN_CUBE),
]


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
@pytest.mark.parametrize(("kind", "shape", "volumes"), BLOCKS)
def test_the_solid_in_all_blocks_of_an_rv_is_what_is_in_the_rv(packing, kind, shape, volumes):
    words = {"variants": "c", "rv": 0.8, "rv_shape": shape, "spacing": 0.1}
    words["directions"] = "lebedev:11"
    table = fabric_map(packing, **words, **kind)
    mean = np.average(table["solid_fraction"], weights=volumes)
    assert mean == pytest.approx(compute(packing, **words)[0].solid_fraction, abs=2e-3)
