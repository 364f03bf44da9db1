"""Writes engine.csv from the files in this folder. Needs numpy only; run it inside the folder.

Every number is worked out in the plainest way from LIGGGHTS' own lists of contacts:
dump_STEP.txt.gz (grains), contacts_STEP.txt.gz (pairs of grains), walls_STEP.txt.gz (grain and wall),
mesh_STEP.stl (the walls), engine.txt (what LIGGGHTS printed while running).
"""
import glob
import gzip

import numpy as np


def table(name):
    """The rows of a LIGGGHTS text dump with one snapshot, as floats, and the step."""
    with gzip.open(name, "rt") as f:
        lines = f.read().splitlines()
    step = int(lines[1])
    count = int(lines[3])
    rows = np.array([[float(word) for word in line.split()] for line in lines[9:]])
    assert len(rows) == count
    return step, rows


def walls(name):
    """Position of the six walls: the mean x (y, z) of the corners of plates 0..5 = xlo xhi ylo yhi zlo zhi."""
    corners = []
    with open(name) as f:
        for line in f:
            words = line.split()
            if words and words[0] == "vertex":
                corners.append([float(w) for w in words[1:4]])
    corners = np.array(corners).reshape(6, 6, 3)  # plate, corner, x y z
    return [corners[k, :, k // 2].mean() for k in range(6)]


names = glob.glob("dump_*.txt.gz")
steps = sorted(int(name.split("_")[1].split(".")[0]) for name in names)

printed = {}
with open("engine.txt") as f:
    head = f.readline().split()
    for line in f:
        values = dict(zip(head, line.split()))
        printed[int(values["step"])] = {k: float(v) for k, v in values.items()}

out = []
for frame, step in enumerate(steps):
    s, grains = table("dump_%d.txt.gz" % step)
    assert s == step
    s, pairs = table("contacts_%d.txt.gz" % step)
    assert s == step
    s, wall_rows = table("walls_%d.txt.gz" % step)
    assert s == step
    plates = walls("mesh_%d.stl" % step)
    engine = printed[step]

    where = {}
    radius = {}
    degree = {}
    for row in grains:  # id type x y z vx vy vz fx fy fz radius
        i = int(row[0])
        where[i] = row[2:5]
        radius[i] = row[11]
        degree[i] = 0
    assert len(where) == len(grains)

    # pairs of grains, each once
    seen = set()
    nn = np.zeros((3, 3))
    overlap = []      # from the positions
    overlap_list = [] # as LIGGGHTS wrote it
    ratio = []
    apart = 0
    for row in pairs:  # x1 y1 z1 x2 y2 z2 id1 id2 periodic fx fy fz delta cx cy cz
        i, j = int(row[6]), int(row[7])
        assert row[8] == 0
        pair = (min(i, j), max(i, j))
        if pair in seen:
            continue
        seen.add(pair)
        branch = where[j] - where[i]
        distance = np.sqrt((branch ** 2).sum())
        n = branch / distance
        nn += np.outer(n, n)
        d = radius[i] + radius[j] - distance
        if d <= 0:
            apart += 1
        overlap.append(d)
        overlap_list.append(row[12])
        ratio.append(d / (radius[i] + radius[j]))
        degree[i] += 1
        degree[j] += 1
    contacts = len(seen)
    nn = nn / contacts
    overlap = np.array(overlap)
    overlap_list = np.array(overlap_list)

    # grain and wall, each once
    touching = set()
    for row in wall_rows:  # cx cy cz x y z wall triangle id fx fy fz delta
        touching.add((int(row[8]), int(row[6])))
    for i, wall in touching:
        degree[i] += 1

    # all pairs that overlap by their positions, without any list
    ids = sorted(where)
    x = np.array([where[i] for i in ids])
    r = np.array([radius[i] for i in ids])
    geometric = set()
    for a in range(len(ids)):
        dist = np.sqrt(((x[a + 1:] - x[a]) ** 2).sum(axis=1))
        for b in np.nonzero(dist < r[a] + r[a + 1:])[0]:
            geometric.add((ids[a], ids[a + 1 + b]))

    lx, ly, lz = plates[1] - plates[0], plates[3] - plates[2], plates[5] - plates[4]
    if frame == 0:
        lz0 = engine["lz"]
    row = {
        "frame": frame,
        "step": step,
        "strain": 1 - engine["lz"] / lz0,
        "strain_log": np.log(lz0 / engine["lz"]),
        "engine_lx": engine["lx"], "engine_ly": engine["ly"], "engine_lz": engine["lz"],
        "engine_pxlo": engine["pxlo"], "engine_pxhi": engine["pxhi"],
        "engine_pylo": engine["pylo"], "engine_pyhi": engine["pyhi"],
        "engine_pzlo": engine["pzlo"], "engine_pzhi": engine["pzhi"],
        "engine_coordination": engine["contacts_per_grain"],
        "engine_kinetic_energy": engine["kinetic_energy"],
        "xlo": plates[0], "xhi": plates[1], "ylo": plates[2], "yhi": plates[3],
        "zlo": plates[4], "zhi": plates[5],
        "grains": len(grains),
        "pair_rows": len(pairs),
        "contacts": contacts,
        "contacts_apart": apart,
        "contacts_geometric": len(geometric),
        "contacts_in_both": len(geometric & seen),
        "wall_rows": len(wall_rows),
        "contacts_wall": len(touching),
        "rattlers": sum(1 for i in degree if degree[i] < 2),
        "without_contact": sum(1 for i in degree if degree[i] == 0),
        "coordination": (2 * contacts + len(touching)) / len(grains),
        "coordination_grains": 2 * contacts / len(grains),
        "porosity": 1 - (4 / 3 * np.pi * r ** 3).sum() / (lx * ly * lz),
        "gc_xx": nn[0, 0], "gc_yy": nn[1, 1], "gc_zz": nn[2, 2],
        "gc_xy": nn[0, 1], "gc_xz": nn[0, 2], "gc_yz": nn[1, 2],
        "mean_overlap": overlap.mean(),
        "mean_overlap_over_diameter": np.mean(ratio),
        "max_overlap": overlap.max(),
        "max_overlap_difference": np.abs(overlap - overlap_list).max(),
    }
    out.append(row)

with open("engine.csv", "w") as f:
    f.write(",".join(out[0]) + "\n")
    for row in out:
        f.write(",".join(str(v) if isinstance(v, int) else "%.12g" % v for v in row.values()) + "\n")
