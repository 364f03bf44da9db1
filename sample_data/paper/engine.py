"""Writes engine.csv of a run of in.periodic (LIGGGHTS) or in.biaxial (LAMMPS): python3 engine.py FOLDER. Needs numpy only.

Every number is worked out in the plainest way from what the program itself wrote: dump_STEP.txt (grains),
contacts_STEP.txt (its own list of contacts), engine.txt (what it printed every 100 steps).
"""
import glob
import os
import sys

import numpy as np

DENSITY = 2600.0
NAMES = ("xx", "yy", "zz", "xy", "xz", "yz")
COLUMNS = ["frame", "step", "strain", "p", "q", "p_off", "inertial_number", "kinetic_energy", "porosity", "overlap", "grains",
           "contacts", "rattlers", "coordination"] + ["gc_" + name for name in NAMES]
AXES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def dump(name):
    """The edges of the cell, and the rows of a text dump with one snapshot by the names of their columns."""
    with open(name) as f:
        lines = f.read().splitlines()
    low, high = np.array([[float(word) for word in line.split()] for line in lines[5:8]]).T
    rows = np.array([[float(word) for word in line.split()] for line in lines[9:]])
    assert len(rows) == int(lines[3])
    return high - low, dict(zip(lines[8].split()[2:], rows.T))


def normals(edges, grains, first, second):
    """From centre to centre, over the nearest image, and how far the two overlap over the sum of their radii."""
    place = np.column_stack([grains[axis] for axis in "xyz"])
    branch = place[second] - place[first]
    branch -= edges * np.round(branch / edges)
    distance = np.sqrt((branch**2).sum(axis=1))
    radii = grains["radius"][first] + grains["radius"][second]
    return branch / distance[:, None], 1 - distance / radii


def printed(folder):
    """engine.txt by column; of lines that were printed twice, before and after a restart, the later."""
    with open(os.path.join(folder, "engine.txt")) as f:
        head, *lines = [line.split() for line in f if line.strip()]
    rows = {int(line[0]): [float(word) for word in line] for line in lines if line != head}
    return dict(zip(head, np.array([rows[step] for step in sorted(rows)]).T))


def inertial_number(plane, radius, p, rate):
    """Of the mean grain; in the plane p is a force over a length."""
    mass = DENSITY * 4 / 3 * np.pi * radius.mean() ** 3
    return rate * (np.sqrt(mass / p) if plane else 2 * radius.mean() * np.sqrt(DENSITY / p))


def stress(log, at, plane):
    if plane:
        return log["p"][at], log["syy"][at] - log["sxx"][at]
    return log["p"][at], log["szz"][at] - 0.5 * (log["sxx"][at] + log["syy"][at])


def frame(folder, step):
    edges, grains = dump(os.path.join(folder, "dump_%d.txt" % step))
    _, list_ = dump(os.path.join(folder, "contacts_%d.txt" % step))
    plane = np.ptp(grains["z"]) == 0
    row_of = {int(number): row for row, number in enumerate(grains["id"])}
    ids = ("c_ids[1]", "c_ids[2]") if plane else ("c_con[7]", "c_con[8]")
    pairs = {tuple(sorted((row_of[int(a)], row_of[int(b)]))) for a, b in zip(*(list_[name] for name in ids))}
    first, second = np.array(sorted(pairs)).T
    normal, overlap = normals(edges, grains, first, second)
    number = np.bincount(np.concatenate([first, second]), minlength=len(grains["id"]))
    radius = grains["radius"]
    if plane:
        solid = (np.pi * radius**2).sum() / (edges[0] * edges[1])
    else:
        solid = (4 / 3 * np.pi * radius**3).sum() / edges.prod()
    tensor = normal.T @ normal / len(normal)
    row = dict(step=step, grains=len(radius), contacts=len(pairs), rattlers=int((number < 2).sum()), coordination=number.mean(),
               porosity=1 - solid, overlap=overlap.mean(), length=edges[1 if plane else 2])
    row.update({"gc_" + name: tensor[axis] for name, axis in zip(NAMES, AXES)})
    return row, plane, radius


def engine_rows(folder, p0):
    log = printed(folder)
    step_length = np.median(np.diff(log["time"]) / np.diff(log["step"]))  # s
    steps = sorted(int(os.path.basename(name)[5:-4]) for name in glob.glob(os.path.join(folder, "dump_*.txt")))
    rows, lines = [], [int(np.searchsorted(log["step"], step)) for step in steps]
    for k, (step, line) in enumerate(zip(steps, lines)):
        assert log["step"][line] == step
        row, plane, radius = frame(folder, step)
        rows.append(row)
        last = rows[max(k - 1, 0)]
        rate = (last["length"] - row["length"]) / row["length"] / max(step_length * (step - last["step"]), step_length)
        p, q = stress(log, line, plane)
        since = log["p"][lines[max(k - 1, 0)] : line + 1]
        row.update(frame=k, strain=1 - row["length"] / rows[0]["length"], p=p, q=q, p_off=abs(since / p0 - 1).max(),
                   inertial_number=inertial_number(plane, radius, p, abs(rate)), kinetic_energy=log["kinetic_energy"][line])
    return rows


def main(folder):
    plane = "lz" not in printed(folder)
    p0 = 400.0 if plane else 200e3
    rows = engine_rows(folder, p0)
    with open(os.path.join(folder, "engine.csv"), "w") as f:
        f.write(",".join(COLUMNS) + "\n")
        for row in rows:
            f.write(",".join(repr(row[name].item() if hasattr(row[name], "item") else row[name]) for name in COLUMNS) + "\n")
    inertial, ever = max(row["inertial_number"] for row in rows), max(row["p_off"] for row in rows)
    off = max(abs(row["p"] / p0 - 1) for row in rows)
    print("inertial number at most %.2g, p at the frames within %.2f %%, ever within %.2f %%" % (inertial, 100 * off, 100 * ever))
    if off > 0.02 or inertial > 1e-3:
        sys.exit("NOT HELD: the inertial number must be 1e-3 at most and p within 2 %")


if __name__ == "__main__":
    main(sys.argv[1])
