"""Data files of LIGGGHTS and LAMMPS: three grains in a row, in any order of the columns."""

HEAD = """{title}

3 atoms
1 atom types
-1 3 xlo xhi
0 2 ylo yhi
0 2 zlo zhi

Atoms{style}

"""
CENTRES = ((0.5, 1.0, 1.0), (1.5, 1.0, 1.0), (2.25, 1.0, 1.0))
DIAMETERS = (1.0, 1.0, 0.5)
TITLE = "LIGGGHTS data file"


def data_file(order="plain", *, title=TITLE, style="", behind="", density=2500, velocities=True):
    """Rows as atom_style granular has them, or hybrid ones; other columns behind."""
    text = HEAD.format(title=title, style=style)
    for id, (centre, diameter) in enumerate(zip(CENTRES, DIAMETERS, strict=True), start=1):
        place = " ".join(map(str, centre))
        size = f"{diameter} {density}"
        row = f"{size} {place}" if order == "plain" else f"{place} {size}"
        text += f"{id} 1 {row}{behind}\n"
    if velocities:
        text += "\nVelocities\n\n" + "".join(f"{id} 9 9 9 0 0 0\n" for id in (1, 2, 3))
    return text
