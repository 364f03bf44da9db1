"""What is wrong with a file is told; odd files, some found by fuzzing, are read or refused."""

import time

import pytest

import scanfab
from tests.helpers.dumps import ROWS, dump_text, refuses, write
from tests.helpers.fuzzing import only_scanfabs_warnings
from tests.helpers.sound_files import made

TIME = "ITEM: TIME\nnow\nITEM: TIMESTEP"
# file, what is replaced in it, by what, and words of the message
WRONG = {
    "esys": [
        ("snap_t=30_0.txt", "_2.txt", "_1.txt", "each worker's file once"),
        ("snap_t=30_0.txt", " snap_t=30_2.txt", "", "and 1 other files: it is cut"),
        ("snap_t=30_1.txt", "2\n1 1", "1\n1 1", "30_1.txt: .* counts 1 particles, found 2"),
        ("snap_t=30_1.txt", "0.25 4 77", "0.25 4", "30_1.txt: .* counts 2 particles, found 0"),
        ("snap_t=30_2.txt", "1\n3.75", "x\n3.75", "30_2.txt: expected the number of particles"),
    ],
    "kratos": [
        ("a.mdpa", "7  1 0.2\n", "", "no place or RADIUS for 1 nodes, such as 7"),
        ("a.mdpa", "SphericParticle3D", "Cluster3D", "elements that are spheres"),
        ("a.mdpa", "End Nodes", "", "incomplete"),
        ("a.mdpa", "End SubModelPart\n", "", "incomplete"),
        ("a.mdpa", "RADIUS", "MASS", "no grains: expected points with a radius"),
    ],
    "lammps": [
        ("a.yaml", "natoms: 3", "natoms: 4", "counts 4 rows, found 3"),
        ("a.yaml", "0.39", "oops", "a.yaml, line 19: .* found 'oops'"),
        ("a.yaml", "p, f", "p, q", "expected three boundary flags"),
        ("a.yaml", "box:", "bax:", "expected 6 numbers"),
        ("a.yaml", "data:\n  - [", "", "whole number"),
    ],
    "lf-dem": [
        ("par.dat", "# Lz 6", "# Lz", "'# Lz': expected 4 numbers"),
        ("par.dat", "#2: radius", "#2: size", "no reader knows|expected points with a radius"),
        ("par.dat", "0 1 0 0 2.5 9", "0 1 0 0 2.5 9 9", "line 13: expected 8 columns, found 9"),
        ("par.dat", "#6-8:", "#0:", "line 13: expected 5 columns, found 8"),
        ("par.dat", "# 0.0 1.0", "# 0.0 x", "above '0 1 0 0 2.5"),
    ],
    "liggghts": [
        ("one.txt", "ATOMS\n3", "ATOMS\n", "whole number"),
        ("one.txt", "ATOMS\n3", "ATOMS\n-1", "whole number"),
        ("one.txt", "ATOMS\n3", "ATOMS\n" + "9" * 30, "whole number"),
        ("one.txt", "STEP\n0", "STEP\n1.5", "whole number"),
        ("one.txt", "STEP\n0", "STEP\n" + "9" * 5000, "whole number"),
        ("one.txt", "ff ff ff", "zz zz zz", "BOX BOUNDS.*expected"),
        ("one.txt", "ITEM: TIMESTEP\n0\n", "", "expected the header of a frame"),
        ("one.txt", "ff ff ff\n0 1\n", "ff ff ff\n", "BOX BOUNDS.*expected 6 numbers"),
        ("one.txt", "ITEM: TIMESTEP", TIME, "ITEM: TIME: expected 1 num"),
        ("one.txt", "ATOMS\n3", "ATOMS\n9", "step 0: .*counts 9 rows, found 3: .* incomplete"),
        ("plain.data", "data file", "Description", "expected diameters.*YADE's radii"),
        ("plain.data", " 1.0 2500 0", " 1.0 0 2500", "density, found '1 1 1 0 2500.*names them"),
        ("plain.data", " 1.0 2500", " 0 2500", "expected a positive diameter"),
        ("plain.data", "-1 3 xlo", "90 94 xlo", "the centre in the box, found '1 1 1 2500"),
        ("plain.data", "types", "types\n3 ellipsoids", "expected diameters.*found ellipsoids"),
        ("plain.data", "Atoms\n", "Atoms # atomic\n", "found 'Atoms # atomic'"),
        ("plain.data", "Atoms\n", "Masses\n", "expected .* a section Atoms"),
        ("plain.data", "3 atoms", "99999 atoms", "counts 99999 atoms, found 3"),
        ("plain.data", "-1 3 xlo", "-1 xlo", "xlo xhi.*: expected 6 numbers"),
        ("plain.data", "2 1 1.0", "2 1 word", "line 12: expected a number .* found 'word'"),
        ("plain.data", "Atoms\n\n1 1 1.0", "Atoms # sphere\n\n1 1 nan", "must be finite"),
    ],
    "mercurydpm": [
        ("run.restart", "BaseParticle id 10", "SuperQuadricParticle id 10", "spheres in 'SuperQ"),
        ("run.restart", "Particles 3", "Particles 2", "'Particles N' with N rows"),
        ("run.restart", "Interactions 4", "Interactions 3", "'Interactions N'"),
        ("run.restart", "radius 0.1", "radius", "spheres in .* expected 6 numbers"),
        ("run.restart", "particleIds 10 30", "particleIds 10 31", "names the grain 31"),
        ("run.restart", "force -2 0.5", "force nan 0.5", "finite numbers"),
        ("run.restart", "PeriodicBoundary", "LeesEdwardsBoundary", "a PeriodicBoundary"),
        ("run.restart", "shift 1 0 0", "shift 0 0 0", "no volume"),
        ("run.data", "0.29 1 1", "0.29 x 1", "run.data, line 3: expected a number in the column y"),
    ],
    "mfix": [
        ("a.dat", "Version 2.0", "Version 3.0", "version 2.0 .* found 3.0"),
        ("a.dat", "Particles:    2", "Particles:    3", "the header counts 3 particles, found 2"),
        ("a.dat", "F  0.0017", "F  none", "Diameter: expected T, or F and a number"),
        ("a.dat", "Density: ", "Weight: ", "T or F .* Density"),
    ],
    "musen": [
        ("a.txt", "0 1 1 1 5 0.1", "0 1 1 1 5 word", "line 2: expected a number"),
        ("a.txt", "0 1 1 1 5 0.1", "0 1 1 5 0.1", "line 2: expected 0 ID 1 TYPE 5"),
        ("a.txt", "1 1 1 5 0.1 0.4 23", "1 1 1 5 0.1 0.4 22", "the same properties in the rows"),
        ("a.txt", " 36 9", " 99 9", "expected properties 0 ID"),
        ("a.txt", "28 0 0", "28 1 1", "its periodic domain"),
    ],
    "yade": [
        ("save.xml", "</scene>", "</scen>", "cannot be read as a simulation that YADE saved"),
        ("save.xml", "<radius>0.1</radius>", "", "<px> has no <radius>"),
        ("save.xml", "<radius>0.1</radius>", "<radius>nan</radius>", "must be finite"),
        ("save.xml", "<id>1</id>", "<id>1.5</id>", "ids must be whole numbers"),
        ("save.xml", "<id>3</id>", "<id>0</id>", "names the body 3, which is not there"),
        ("save.xml", "<m00>1.0</m00>", "<m00>0.0</m00>", "span no volume"),
        ("attrs.txt", "r_attrs", "r_nothing", "line 1 names 5 columns, but the rows have 6"),
        ("attrs.txt", "1 2 3\n", "oops 2 3\n", "attrs.txt, line 3: .*oops"),
        # a sign of a comment inside a row is damage, which must not cut the row short
        ("pack.txt", "2 0 0 1 -1", "2 0 0 1 -1#5", "line 3: expected a number .* found '-1#5'"),
        ("pack.txt", "4 4 4", "4 4", "line 1: expected 3 numbers"),
        ("pack.txt", "4 4 4", "4 4 0", "pack.txt"),
    ],
}


CASES = [(name, *case) for name, cases in WRONG.items() for case in cases]


@pytest.mark.parametrize(("format", "name", "old", "new", "message"), CASES)
def test_a_damage_is_told(tmp_path, format, name, old, new, message):
    path, file = made(format, tmp_path)[0], tmp_path / name
    text = file.read_text()
    assert old in text
    write(file, text.replace(old, new, 1))
    with pytest.raises(scanfab.ScanfabError, match=message):
        scanfab.read_series(path if format == "esys" else file, contacts="geometric")[0].read()


FAR = [(1, 1e30, 0.5, 0.5, 0.1)]
FAR_CELL = (
    '1\nLattice="1 0 0 0 1 0 0 0 1" Origin="1e30 0 0" Properties=pos:R:3:radius:R:1\n0 0 0 1\n'
)
LONG = ["9" * 5000 + "x", "9" * 5000 + ".5.5", "1" * 5000 + "e"]
TEXTS = [
    *((f"##PERIODIC:: 1 1 {edge}\n0 0 0 1 -1\n", "must be finite numbers")
      for edge in ("1e200", "-1e200", "inf", "nan")),
    (dump_text(ROWS[:1]).replace("1 1 0.2 0.5 0.5 0.1", ""), "counts 1 rows, found 0"),
    *((dump_text([(1, value, 0.5, 0.5, 0.1)], "id xs ys zs radius"), "")
      for value in ("inf", "nan", "1e300")),
    (dump_text([(1, 1e200, 0.5, 0.5, 0.5)], "id x y z radius"), "grain 1: .* cannot be a length"),
    (dump_text([(1, 0.5, 0.5, 0.5, 1e200)], "id x y z radius"), "grain 1: .* cannot be a length"),
    (dump_text(FAR, "id x y z radius", flags=" pp pp pp"), r"grain 1 lies 1e\+30 from the origin"),
    (dump_text(box=((-1e30, 1 - 1e30), (0, 1), (0, 1)), flags=" pp pp pp"), "no volume"),
    ("2 samples of sand from France\nwere sheared by hand in a wooden box\n", "no reader knows"),
    (FAR_CELL, r"grain 1 lies 1e\+30 from the origin"),
    *((dump_text([(id, 1, 0.5, 0.5, 0.5, 0.1)]), "ids must be whole numbers")
      for id in ("1e300", "nan", "inf", "0.5")),
    # a pattern that could cut the digits anywhere tried all places: 32 s for a table of these
    *(("id,x,y,z,radius\n" + f"1,0,{word},0,1\n" * 40, "") for word in LONG),
]  # fmt: skip
TABLES = [
    ("".join(f"{k}e300 0 0 1e-300\n" for k in range(12)), "below 1e-100"),
    ("", "expected a table, found no row"),
    ("x,y,z,radius,q\n1,2,3,4\n", "expected 5 columns, one for each name, found 4"),
    ("x,y,z,radius\n1,2,3,4\x01\n", "line 2: expected text, found the byte 1"),
    ("x,y,z,radius\r1,2,3,4\r", "without a line end"),
    ("1 " * 5000 + "\n", "at most 4096 columns, found 5000"),
    ("x,y,z,radius\n" + "1," * 300_000 + "1\n", "line 2: expected 4 columns, found 300001"),
]


@pytest.mark.parametrize("number", range(len(TEXTS + TABLES)))
def test_a_text_that_cannot_be_right_is_refused_at_once(tmp_path, number):
    text, told = (TEXTS + TABLES)[number]
    path, format = write(tmp_path / "a.txt", text), None if number < len(TEXTS) else "table"
    began = time.monotonic()
    with only_scanfabs_warnings():
        refuses(path, rf"a\.txt.*{told}", error=scanfab.ScanfabError, format=format)
    assert time.monotonic() - began < 5


ODD = [
    # bounds without an end are no box: their difference made NumPy warn
    ("a.data", "1 0.5 inf 0 inf 2 \n0.1 1 9 9 0.1 0 0 0\n", 1),
    ("a.txt", dump_text(box=((-1e300, 1e300), (0, 1), (0, 1))), 3),
]


@pytest.mark.parametrize(("name", "text", "count"), ODD)
def test_an_odd_text_is_read(tmp_path, name, text, count):
    with only_scanfabs_warnings():
        packing = scanfab.read(write(tmp_path / name, text))
    assert (len(packing), packing.cell) == (count, None)
