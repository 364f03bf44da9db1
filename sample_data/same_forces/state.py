"""The last state of ../lammps_forces as grains alone: state.csv, and data files for two programs."""

import gzip
from pathlib import Path

HERE = Path(__file__).parent
DUMP = HERE.parent / "lammps_forces" / "forces.60000.lammpstrj.gz"

lines = gzip.open(DUMP, "rt").read().splitlines()
start = next(k for k, line in enumerate(lines) if line.startswith("ITEM: ATOMS"))
box = next(k for k, line in enumerate(lines) if line.startswith("ITEM: BOX"))
edges = [list(map(float, line.split()[:2])) for line in lines[box + 1 : box + 4]]
rows = [line.split() for line in lines[start + 1 :]]
grains = [(int(r[0]), float(r[8]), *map(float, r[2:5])) for r in rows]

with open(HERE / "state.csv", "w") as file:
    file.write("id,radius,x,y,z\n")
    for id, radius, x, y, z in grains:
        file.write(f"{id},{radius!r},{x!r},{y!r},{z!r}\n")
with open(HERE / "cell.csv", "w") as file:
    file.write("lo,hi\n")
    for low, high in edges:
        file.write(f"{low!r},{high!r}\n")
with open(HERE / "state.data", "w") as file:
    file.write(f"the state of state.csv\n\n{len(grains)} atoms\n1 atom types\n\n")
    for (low, high), name in zip(edges, "xyz"):
        file.write(f"{low!r} {high!r} {name}lo {name}hi\n")
    file.write("\nAtoms\n\n")
    for id, radius, x, y, z in grains:
        file.write(f"{id} 1 {2 * radius!r} 2600 {x!r} {y!r} {z!r}\n")
