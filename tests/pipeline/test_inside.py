"""What other programs hold in memory is the same packing as what they write to files."""

import os
import re
import shutil
import subprocess
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import scanfab
from tests.helpers.truth import SAMPLE_DATA

DOCS = Path(__file__).parents[2] / "docs" / "howto"
YADE = shutil.which("yade")
OWN_PYTHON = f"python3.{sys.version_info.minor}"
# packings of overlapping spheres, whose interactions exist after a few steps
SCENES = """
import numpy as np
import scanfab
from scanfab.testing import differences

def live_and_saved(kind):
    O.reset()
    generator = np.random.default_rng(1)
    if kind == "periodic":
        O.periodic = True
        O.cell.hSize = Matrix3(7, 1, 0, 0, 8, 2, 0, 0, 9)
    elif kind == "walls":
        O.bodies.append([wall(0, axis=2), box((4, 4, 8.5), (4, 4, 0.5))])
        O.bodies.append(geom.facetBox((4, 4, 4), (4, 4, 4), wallMask=15))
    for number in range(150):
        place = generator.uniform(-2, 9, 3).tolist()
        place[2] = 1.5 if kind == "discs" else place[2]
        O.bodies.append(sphere(place, 0.7, mask=number % 3 + 1))
    if kind != "discs":
        O.bodies.appendClumped([sphere((6.8, 4, 4), 0.8), sphere((7.3, 4, 4), 0.8)])
    O.bodies.erase(40)
    shapes = [Bo1_Sphere_Aabb(), Bo1_Facet_Aabb(), Bo1_Wall_Aabb(), Bo1_Box_Aabb()]
    geometries = [
        Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(),
        Ig2_Box_Sphere_ScGeom(),
    ]
    laws = [Law2_ScGeom_FrictPhys_CundallStrack()]
    O.engines = [
        ForceResetter(),
        InsertionSortCollider(shapes),
        InteractionLoop(geometries, [Ip2_FrictMat_FrictMat_FrictPhys()], laws),
        NewtonIntegrator(),
    ]
    O.dt = 1e-9
    O.run(3, True)
    O.save(kind + ".xml")
    return scanfab.from_yade(), scanfab.read(kind + ".xml")

for kind in ("periodic", "walls", "discs"):
    live, file = live_and_saved(kind)
    assert live.step == 3 and len(live) == (149 if kind == "discs" else 151), live
    assert len(live.contacts) > 50 and live.contacts.force is not None
    assert differences(file, live) == [], differences(file, live)
    assert (live.wall_forces is not None) == (kind == "walls")
    if kind == "walls":
        assert live.wall_contacts.sum() == len(live.wall_forces.row) > 10
    assert live.is_periodic == (kind == "periodic")
    assert live.space.is_plane == (kind == "discs")
O.reset()
assert len(scanfab.from_yade()) == 0
print("all three are the same")
"""


def page_script(name: str) -> str:
    """The Python of a page, as one script."""
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    return "\n".join(re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL))


def in_yade(script: str, folder: Path) -> str:
    """What a script prints that YADE runs with the packages of this environment."""
    if YADE is None:
        pytest.skip("YADE is not installed")
    head = Path(YADE).read_bytes()[:100].decode("utf-8", "replace").splitlines()[0]
    if OWN_PYTHON not in head:
        pytest.skip(f"YADE does not run in {OWN_PYTHON}: {head}")
    (folder / "script.py").write_text(script)
    packages = [path for path in sys.path if path.endswith("site-packages")]
    path = os.pathsep.join([str(Path(scanfab.__file__).parents[1]), *packages])
    done = subprocess.run(
        [YADE, "-n", "-x", "script.py"], cwd=folder, env={**os.environ, "PYTHONPATH": path},
        capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_scene_of_yade_is_what_it_saves_and_the_page_on_it_runs(tmp_path: Path) -> None:
    """The page on 100 grains in place of 300, at the same density, by rougher scans."""
    page = page_script("inside-yade").replace("num=300", "num=100").replace("= 0.1 *", "= 0.07 *")
    page = re.sub(r"tolerance=\de-3", "tolerance=1e-2", page)
    told = in_yade(f"{SCENES}\n{page}\nprint(len(packings), plot.data)", tmp_path)
    assert "all three are the same" in told
    assert re.search(r"\b\d+ \{'i': \[", told)
    rows = scanfab.load(tmp_path / "fabric.csv")
    assert rows["strain"].tolist() == pytest.approx([0, 0.021, 0.042, 0.063], abs=2e-3)


@pytest.mark.skipif(find_spec("yade") is not None, reason="this Python runs inside YADE")
def test_outside_yade_there_is_no_scene() -> None:
    with pytest.raises(scanfab.ScanfabError, match="not run inside YADE: run the script by `yade "):
        scanfab.from_yade()


def ovito(pattern: str):
    """The pipeline of a file; OVITO needs no screen for it."""
    io = pytest.importorskip("ovito.io", reason="OVITO is not installed")
    return io.import_file(str(SAMPLE_DATA / pattern))


def assert_same(live: scanfab.Packing, file: scanfab.Packing) -> None:
    """The same grains; OVITO rounds radii to single precision."""
    np.testing.assert_array_equal(live.id, file.id)
    np.testing.assert_array_equal(live.position, file.position)
    np.testing.assert_allclose(live.radius, file.radius, rtol=1e-7)
    assert (live.step, live.space, repr(live.cell)) == (file.step, file.space, repr(file.cell))
    np.testing.assert_array_equal(live.columns["type"], file.columns["type"])
    one, two = (None if it.bodies is None else it.bodies.head.tolist() for it in (live, file))
    assert one == two


DUMPS = [
    "liggghts_periodic/dump_30000.txt.gz",
    "liggghts_clumps/dump_40000.txt.gz",
    "liggghts_box/dump_40000.txt.gz",
    "lammps_shear/shear.80000.lammpstrj.gz",
    "lammps_biaxial/discs.20000.lammpstrj.gz",
]


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")
@pytest.mark.parametrize("name", DUMPS)
def test_the_data_of_ovito_are_those_of_the_file(name: str) -> None:
    live = scanfab.from_ovito(ovito(name).compute())
    file = scanfab.read(SAMPLE_DATA / name, contacts="geometric")
    assert live.contacts is None
    assert_same(live, file)


@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabNote")
def test_bonds_of_ovito_are_contacts_through_their_images() -> None:
    pipeline = ovito("lammps_shear/shear.*.lammpstrj.gz")
    from ovito.modifiers import LoadTrajectoryModifier

    loaded = LoadTrajectoryModifier()
    pipeline.modifiers.append(loaded)
    ends = ["Particle Identifiers.1", "Particle Identifiers.2"]
    listed = str(SAMPLE_DATA / "lammps_shear" / "pairs.*.local.gz")
    loaded.source.load(listed, columns=["", *ends, *[""] * 8])
    live = scanfab.from_ovito(pipeline.compute(4))
    file = scanfab.read(SAMPLE_DATA / "lammps_shear" / "shear.160000.lammpstrj.gz")
    assert_same(live, file)
    np.testing.assert_array_equal(live.contacts.pairs, file.contacts.pairs)
    np.testing.assert_allclose(live.contacts.normal, file.contacts.normal, atol=1e-12)


def test_in_two_dimensions_ovito_ignores_the_third() -> None:
    data = made_up(radius=0.5)
    data.cell_[2, 2], data.cell_.is2D = 0.0, True
    packing = scanfab.from_ovito(data)
    assert (packing.space.dimension, packing.cell.periodic) == (2, (True, True, False))
    np.testing.assert_array_equal(packing.position[:, :2], [[1, 1], [2, 1]])
    assert len(scanfab.find_contacts(packing, tolerance=1e-6).contacts) == 1


def made_up(radius: float | None = None, of_type: float = 0.0):
    """Two particles in a periodic box."""
    pytest.importorskip("ovito.data", reason="OVITO is not installed")
    from ovito.data import DataCollection, Particles, SimulationCell

    data = DataCollection()
    data.objects.append(SimulationCell(pbc=(True, True, True)))
    data.cell_[:, :3] = np.diag([4.0, 4.0, 4.0])
    data.objects.append(Particles(count=2))
    data.particles_.create_property("Position", data=[[1, 1, 0.3], [2, 1, 0.1]])
    types = data.particles_.create_property("Particle Type", data=[1, 1])
    types.add_type_id(1, data.particles_).radius = of_type
    if radius is not None:
        data.particles_.create_property("Radius", data=[radius, radius])
    return data


def test_radii_of_types_stand_in_for_those_of_particles() -> None:
    packing = scanfab.from_ovito(made_up(of_type=0.25))
    assert (packing.radius.tolist(), packing.id.tolist()) == ([0.25, 0.25], [0, 1])
    assert (packing.step, packing.time) == (None, None)


def test_what_ovito_has_that_is_no_packing_is_refused() -> None:
    with pytest.raises(scanfab.PackingError, match="have no radii: give particles the property"):
        scanfab.from_ovito(made_up())
    long = made_up(radius=0.5)
    long.particles_.create_property("Aspherical Shape", data=[[1, 1, 1], [1, 1, 2]])
    with pytest.raises(scanfab.PackingError, match="aspherical shapes: expected spheres"):
        scanfab.from_ovito(long)
    with pytest.raises(scanfab.PackingError, match="OVITO's data holds no particles"):
        scanfab.from_ovito(type(long)())


def test_the_modifier_adds_what_compute_gives() -> None:
    pipeline = ovito("liggghts_periodic/dump_*.txt.gz")
    options = {"variants": "ac", "rv": "0.5,0.6", "directions": 12, "spacing": "1rmin"}
    options["with_"] = "harmonics"
    pipeline.modifiers.append(scanfab.ovito_modifier(**options))
    attributes = pipeline.compute(1).attributes
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table = scanfab.compute(scanfab.from_ovito(pipeline.source.compute(1)), **options)
    assert attributes["scanfab.a.alpha_vs_axial"] == table[0].alpha_vs_axial
    assert attributes["scanfab.c RV 0.6.vs_a2"] == table[2].vs_a2
    assert {"scanfab.c RV 0.5.alpha_c", "scanfab.a.contacts_from"} < {*attributes}
    odd = [name for name in attributes if re.search(r"strain|tensor4|_without_|frame$", name)]
    assert odd == []


def test_the_page_on_ovito_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ovito", reason="OVITO is not installed")
    (tmp_path / "sample_data").symlink_to(SAMPLE_DATA)
    monkeypatch.chdir(tmp_path)
    found: dict[str, object] = {}
    exec(compile(page_script("inside-ovito"), "inside-ovito.md", "exec"), found)
    lines = (tmp_path / "fabric.txt").read_text().splitlines()
    assert len(lines) == 6
    assert float(lines[1].split()[1]) == found["data"].attributes["scanfab.a.alpha_vs_axial"]


def test_wrong_options_are_refused_when_the_modifier_is_made() -> None:
    with pytest.raises(TypeError, match="variants"):
        scanfab.ovito_modifier(variant="a")
    with pytest.raises(scanfab.SettingsError, match="choose one `cutoff`"):
        scanfab.ovito_modifier(cutoffs="0,1rmin")
