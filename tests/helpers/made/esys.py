"""Snapshots of ESyS-Particle, as its source writes them: no line end closes a header."""

from tests.helpers.dumps import write

HEADER = """V 3
1000
0.5
{step}
ESyS-Particle 2.3.5-1200
BoundingBox 0 -1 0 4 5 6
PeriodicBoundaries 1 0 0
Dimension 3D
{files}"""
# the other vectors of a particle lie elsewhere
OTHERS = " 2500 9 9 9 8 8 8 7 7 7 6 6 6 0 0 0"
TURNS = " 1 0 0 0 5 5 5"


def row(id, x, behind=""):
    return f"{x} 1 2 0.25 {id} 77{OTHERS}{behind}\n"


def run(folder, step=30, behind="", prefix="/home/someone/run/"):
    stem = f"snap_t={step}_"
    bonds = "TMIG 1\nBonded 2\n4 5 0 0 0 0\n"
    write(folder / f"{stem}1.txt", f"2\n{row(4, 1, behind)}{row(5, 1.5, behind)}{bonds}")
    write(folder / f"{stem}2.txt", f"1\n{row(1, 3.75, behind)}TMIG 1\nBonded 0\n")
    files = " ".join(f"{prefix}{stem}{k}.txt" for k in (1, 2))
    return write(folder / f"{stem}0.txt", HEADER.format(step=step, files=files))
