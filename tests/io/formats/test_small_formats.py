"""What the readers of small formats refuse, and what all readers must do with damaged files."""

from __future__ import annotations

import pytest

import scanfab
from scanfab.io.reader import ReadOptions
from scanfab.io.registry import reader_named
from scanfab.testing import check_reader
from tests.helpers.sound_files import SMALL

# file, what is replaced in it, by what, and words of the message
WRONG = {
    "esys": [
        ("snap_t=30_0.txt", "V 3", "V 9", "expected version 2 or 3, found 9"),
        ("snap_t=30_0.txt", "_2.txt", "_1.txt", "expected the names of its workers' files"),
        ("snap_t=30_0.txt", "_2.txt", "_7.txt", "there is no such file"),
        ("snap_t=30_1.txt", "2\n1 1", "9\n1 1", "30_1.txt: the header counts 9 particles"),
        ("snap_t=30_1.txt", "2\n1 1", "1\n1 1", "30_1.txt: .* counts 1 particles, but more rows"),
        ("snap_t=30_1.txt", "0.25 4 77", "0.25 4", "30_1.txt: .* columns of particles, found 21"),
        ("snap_t=30_1.txt", "0.25 5 77", "0.25 5", "30_1.txt, line 3: expected 22 columns"),
        ("snap_t=30_1.txt", "0.25 4 77", "0.25 1 77", "the id 1 occurs twice"),
        ("snap_t=30_2.txt", "1\n3.75", "x\n3.75", "30_2.txt: expected the number of particles"),
    ],
    "kratos": [
        ("a.mdpa", "7  1 0.2\n", "", "the sphere at node 7 and 0 more have no radius"),
        ("a.mdpa", "7 0.5 0.25", "8 0.5 0.25", "the node 7 has a radius, but no place"),
        ("a.mdpa", "SphericParticle3D", "Cluster3D", "expected elements that are spheres"),
        ("a.mdpa", "7  1 0.2", "7  1", "line 21: expected 3 columns, found 2"),
        ("a.mdpa", "End Nodes", "", "incomplete"),
        ("a.mdpa", "End SubModelPart\n", "", "has no end: the file is incomplete"),
        ("a.mdpa", "RADIUS", "MASS", "no grains: expected points with a radius"),
    ],
    "lf-dem": [
        ("par.dat", "# Lz 6", "# Lz", "expected lines '# Lx'"),
        ("par.dat", "#2: radius", "#2: size", "no reader knows|expected points with a radius"),
        ("par.dat", "0 1 0 0 2.5 9", "0 1 0 0 2.5 9 9", "line 13: expected 8 columns, found 9"),
        ("par.dat", "#6-8:", "#0:", "line 13: expected 5 columns, found 8"),
        ("par.dat", "2 1 4 3 0 9", "2 1 4 3 x 9", "line 15: expected a number"),
        ("par.dat", "# 0.0 1.0", "# 0.0 x", "above '0 1 0 0 2.5"),
    ],
    "mercurydpm": [
        ("run.restart", "BaseParticle id 10", "SuperQuadricParticle id 10", "expected spheres"),
        ("run.restart", "Particles 3", "Particles 30", "expected 30 Particles, found"),
        ("run.restart", "Particles 3", "Particles 2", "expected 2 Particles, found more"),
        ("run.restart", "Interactions 4", "Interactions -1", "number of Interactions, found '-1'"),
        ("run.restart", "Interactions 4", "Interactions 3", "expected 3 Interactions, found more"),
        ("run.restart", "Interactions 4", "Interaction 4", "'Interactions N': the file is incompl"),
        ("run.restart", "radius 0.1", "radius", "radius in .* expected 1 numbers"),
        ("run.restart", "particleIds 10 30", "particleIds 10 31", "names the grain 31, which is"),
        ("run.restart", "particleIds 10 30", "particleIds 10 10", "names the grain 10 twice"),
        ("run.restart", "force -2 0.5", "force nan 0.5", "expected finite numbers as contact forc"),
        ("run.restart", "PeriodicBoundary", "LeesEdwardsBoundary", "a LeesEdwardsBoundary repeats"),
        ("run.restart", "xMin 0", "zmin 0", "expected 6 numbers"),
        ("run.restart", "shift 1 0 0", "shift 0 0 0", "make no cell"),
        ("run.data", "0.29 1 1", "0.29 x 1", "run.data, line 3: expected a number in the column y"),
    ],
    "mfix": [
        ("a.dat", "Version 2.0", "Version 3.0", "expected version 2.0, found 3.0"),
        ("a.dat", "Particles:    2", "Particles:    3", "the header counts 3 particles, found 2"),
        ("a.dat", "F  0.0017", "F  none", "expected T, or F and a number"),
        ("a.dat", "Density: ", "Weight: ", "found none of Density"),
        ("a.dat", "0.15 0.25 1.0", "0.15 0.25", "line 20: expected 7 columns, found 6"),
    ],
    "musen": [
        ("a.txt", "0 1 1 1 5 0.1", "0 1 1 1 5 word", "line 2: expected 12 numbers, found '1 word"),
        ("a.txt", "0 1 1 1 5 0.1", "0 1 1 5 0.1", "line 2: expected 0 ID 1 TYPE 5"),
        ("a.txt", "0 1 1 1 5 0.1", "7 1 1 1 5 0.1", "line 2: expected 0 ID 1 TYPE 5"),
        ("a.txt", "0 1 1 1 5 0.1 0.4", "0 1 1 1 5 0.1", "line 2: expected the properties of the"),
        ("a.txt", " 36 9", " 99 9", "line 1: expected the number of a property, found '99'"),
        ("a.txt", "28 0 0", "28 1 1", "its periodic domain"),
    ],
}
CASES = [(name, *case) for name, cases in WRONG.items() for case in cases]
# files that no cut may make a smaller sample
COUNTED = ("a.mdpa", "a.dat", "flat.data", "run.restart", "a.gsd")


@pytest.mark.parametrize(("format", "name", "old", "new", "message"), CASES)
def test_what_is_wrong(tmp_path, format, name, old, new, message):
    path = SMALL[format](tmp_path)[0]
    file = tmp_path / name
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(scanfab.ScanfabError, match=message):
        scanfab.read_series(path if format == "esys" else file, contacts="geometric")[0].read()


@pytest.mark.parametrize("format", SMALL)
def test_the_kit(tmp_path, format):
    reader = reader_named(format)
    (tmp_path / "damaged").mkdir()
    paths = SMALL[format](tmp_path)
    for path in paths if format == "esys" else []:
        (tmp_path / "damaged" / path.name).write_bytes(path.read_bytes())
    for path in paths:
        if reader.kind(path) == "grains":
            check_reader(reader, [path], tmp_path / "damaged", counts=path.name in COUNTED)


@pytest.mark.parametrize("format", ["esys", "gsd", "kratos", "mfix", "musen"])
def test_there_are_no_contacts(tmp_path, format):
    reader = reader_named(format)
    snapshot = reader.snapshots(SMALL[format](tmp_path)[0])[0]
    grains = reader.read_grains(snapshot, ReadOptions())
    with pytest.raises(scanfab.ReadError, match="hold no contacts"):
        reader.read_contacts(snapshot, ReadOptions(), grains)
