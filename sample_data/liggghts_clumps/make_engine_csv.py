"""
LIGGGHTS' own numbers of the frames, from its ms_id and id_multisphere alone: writes engine.csv.

Nothing here knows positions: which spheres touch, and of which bodies they are, LIGGGHTS says itself.
"""

import csv
import gzip
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent


def table(name):
    with gzip.open(FOLDER / name, "rt") as file:
        return np.loadtxt(file, skiprows=9, ndmin=2)


def body(numbers, ids):
    """The body of each sphere; a sphere without one (-1) is its own, by its id."""
    return [("body", int(n)) if n >= 0 else ("sphere", int(i)) for n, i in zip(numbers, ids)]


rows = []
for step in (20000, 40000, 60000):
    grains, pairs, walls = (table(f"{kind}_{step}.txt.gz") for kind in ("dump", "contacts", "walls"))
    of = dict(zip(grains[:, 0].astype(int), body(grains[:, 7], grains[:, 0])))
    one, two = body(pairs[:, 13], pairs[:, 6]), body(pairs[:, 14], pairs[:, 7])
    assert all(a == of[i] and b == of[j] for a, b, i, j in zip(one, two, pairs[:, 6], pairs[:, 7]))
    inside = sum(a == b for a, b in zip(one, two))
    neighbours = {frozenset(both) for both in zip(one, two)}
    number = dict.fromkeys(of.values(), 0)
    for a, b in map(tuple, neighbours):
        number[a] += 1
        number[b] += 1
    for i in walls[:, 8].astype(int):
        number[of[i]] += 1
    rows.append(
        {
            "step": step,
            "spheres": len(grains),
            "bodies": int(len(set(grains[grains[:, 7] >= 0, 7]))),
            "grains": len(number),
            "contacts": len(pairs),
            "contacts_inside": inside,
            "contacts_atom": int(grains[:, 8].sum()),
            "contacts_wall": len(walls),
            "neighbours": len(neighbours),
            "rattlers": sum(n < 2 for n in number.values()),
            "coordination": repr(sum(number.values()) / len(number)),
        }
    )
with open(FOLDER / "engine.csv", "w", newline="") as file:
    out = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
    out.writeheader()
    out.writerows(rows)
