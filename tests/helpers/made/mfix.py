"""MFiX' particle_input.dat, version 2."""

HEADER = """Version 2.0
=====================
Instructions: Data starts at line 35
=====================
Dimension:    {dimension}
Particles:    2
=====================
Variable      Read(T/F)     Default value (when Read=F)
=====================
Coordinates:     T          Must always be T
Phase_ID:        F          1
Diameter:        {diameter}
Density:         T          2000.
Velocity:        T          0.0  0.0  0.0
Temperature:     T          (Ignored if energy eq. is not solved)
=====================
|       x       |       y       |
=====================
"""
ROWS = ("0.5D-01 0.25D+0 1 {size}2650 7 8 9", "0.15 0.25 1.0 {size}2650 7 8 9")


def version_2(diameter="F  0.0017", size="", dimension=3, behind=""):
    rows = [row.format(size=size) for row in ROWS]
    if dimension == 2:
        rows = [" ".join(word for k, word in enumerate(row.split()) if k != 2) for row in rows]
        rows = [row.rsplit(" ", 1)[0] for row in rows]
    text = "".join(f"  {row}{behind}\n" for row in rows)
    return HEADER.format(diameter=diameter, dimension=dimension) + text
