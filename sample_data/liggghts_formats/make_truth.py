"""Writes truth.csv, and truth_grains.csv and truth_contacts.csv in floor and periodic. Needs numpy only.

Positions and radii come from precise.txt (17 digits), the pairs from LIGGGHTS' list of contacts.
Everything is worked out in the plainest way.
"""
import numpy as np


def table(name):
    """The rows of a LIGGGHTS text dump with one snapshot, the box and which directions are periodic."""
    with open(name) as f:
        lines = f.read().splitlines()
    assert lines[0] == "ITEM: TIMESTEP" and lines[1] == "30000"
    count = int(lines[3])
    flags = [word == "pp" for word in lines[4].split()[-3:]]
    box = np.array([[float(word) for word in line.split()] for line in lines[5:8]])
    rows = np.array([[float(word) for word in line.split()] for line in lines[9:]])
    assert len(rows) == count
    return rows, box, flags


def column_mean(name, column):
    """Mean of the named column of a dump."""
    with open(name) as f:
        names = f.read().splitlines()[8].split()[2:]
    rows, box, flags = table(name)
    return rows[:, names.index(column)].mean()


def branch(a, b, box, flags):
    """From a to the nearest image of b, and whether that image lies behind a periodic face."""
    d = b - a
    crossing = False
    for k in range(3):
        length = box[k, 1] - box[k, 0]
        if flags[k]:
            if d[k] > length / 2:
                d[k] -= length
                crossing = True
            elif d[k] < -length / 2:
                d[k] += length
                crossing = True
    return d, crossing


out = []
for state, pair_file, id_column, coordination_file in (
    ("floor", "floor/pairs_id_force.txt", 0, "floor/shuffled.txt"),
    ("periodic", "periodic/pairs.txt", 6, "periodic/dump.txt"),
):
    grains, box, flags = table(state + "/precise.txt")
    # id type x y z ix iy iz radius mass
    grains = grains[np.argsort(grains[:, 0])]
    where = {int(g[0]): g[2:5] for g in grains}
    radius = {int(g[0]): g[8] for g in grains}
    degree = {i: 0 for i in where}
    with open(state + "/truth_grains.csv", "w") as f:
        f.write("id,type,x,y,z,ix,iy,iz,radius\n")
        for g in grains:
            f.write("%d,%d,%.17g,%.17g,%.17g,%d,%d,%d,%.17g\n" % tuple(g[:9]))

    pairs, pair_box, pair_flags = table(pair_file)
    listed = {}
    for row in pairs:
        i, j, flag = (int(v) for v in row[id_column:id_column + 3])
        key = (min(i, j), max(i, j))
        assert key not in listed
        listed[key] = flag
    nn = np.zeros((3, 3))
    overlaps = []
    relative = []
    crossing_count = 0
    with open(state + "/truth_contacts.csv", "w") as f:
        f.write("id1,id2,crossing,nx,ny,nz,distance,overlap\n")
        for (i, j) in sorted(listed):
            d, crossing = branch(where[i], where[j], box, flags)
            distance = np.sqrt((d ** 2).sum())
            n = d / distance
            nn += np.outer(n, n)
            overlap = radius[i] + radius[j] - distance
            overlaps.append(overlap)
            relative.append(overlap / (radius[i] + radius[j]))
            assert crossing == listed[i, j]
            crossing_count += crossing
            degree[i] += 1
            degree[j] += 1
            f.write("%d,%d,%d,%.12g,%.12g,%.12g,%.12g,%.12g\n" % (i, j, crossing, *n, distance, overlap))
    nn /= len(listed)

    ids = sorted(where)
    geometric = set()
    for a in ids:
        for b in ids:
            if a < b:
                d, crossing = branch(where[a], where[b], box, flags)
                if (d ** 2).sum() < (radius[a] + radius[b]) ** 2:
                    geometric.add((a, b))

    touching = set()
    if state == "floor":
        rows, wall_box, wall_flags = table("floor/walls_all.txt")
        for row in rows:  # mesh, triangle and id of the grain in columns 13 to 15
            touching.add((int(row[12]), int(row[14])))
        for wall, i in touching:
            degree[i] += 1

    lengths = box[:, 1] - box[:, 0]
    out.append({
        "state": state,
        "step": 30000,
        "grains": len(grains),
        "xlo": box[0, 0], "xhi": box[0, 1], "ylo": box[1, 0], "yhi": box[1, 1], "zlo": box[2, 0], "zhi": box[2, 1],
        "pair_rows": len(pairs),
        "contacts": len(listed),
        "contacts_crossing": crossing_count,
        "contacts_geometric": len(geometric),
        "contacts_in_both": len(geometric & set(listed)),
        "contacts_wall": len(touching),
        "rattlers": sum(1 for i in degree if degree[i] < 2),
        "without_contact": sum(1 for i in degree if degree[i] == 0),
        "coordination": (2 * len(listed) + len(touching)) / len(grains),
        "coordination_grains": 2 * len(listed) / len(grains),
        "engine_coordination": column_mean(coordination_file, "c_ca"),
        "gc_xx": nn[0, 0], "gc_yy": nn[1, 1], "gc_zz": nn[2, 2],
        "gc_xy": nn[0, 1], "gc_xz": nn[0, 2], "gc_yz": nn[1, 2],
        "mean_overlap": np.mean(overlaps),
        "min_overlap": np.min(overlaps),
        "mean_overlap_over_diameter": np.mean(relative),
    })

with open("truth.csv", "w") as f:
    f.write(",".join(out[0]) + "\n")
    for row in out:
        f.write(",".join(v if isinstance(v, str) else "%d" % v if isinstance(v, int) else "%.15g" % v
                         for v in row.values()) + "\n")
