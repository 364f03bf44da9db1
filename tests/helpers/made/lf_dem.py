"""Files of LF_DEM: three spheres in a sheared cell, at two strains."""

from __future__ import annotations

HEAD = "# LF_DEM version v2\n# np 3\n# VF 0.4\n# Lx 10\n# Ly 8\n# Lz 6\n"
GRAINS = "#1: particle index\n#2: radius\n#3-5: position (x, y, z)\n#6-8: velocity (x, y, z)\n\n"
PAIRS = (
    "#1: particle 1 label\n#2: particle 2 label\n#3: contact state (0 = no contact, 1 = ...)\n"
    "#4-6: normal vector, oriented from particle 1 to particle 2\n#7: gap\n\n"
)
# 0 and 1 touch through the face above, whose images are shifted along x
CENTRES = ((0, 0, 2.5), (-1.5, 0, -2.25), (4, 3, 0))
SHIFTS = (1.0, 1.5)


def grains_text(head=HEAD):
    rows = "".join(f"{k} 1 {x} {y} {z} 9 9 9 \n" for k, (x, y, z) in enumerate(CENTRES))
    frames = [f"# {0.1 * k} {shift} 0.2 0 0 \n{rows}" for k, shift in enumerate(SHIFTS)]
    return head + GRAINS + "".join(frames)


def pairs_text():
    rows = "0 1 2 0 0 1 -0.75\n0 2 0 1 0 0 0.3\n"
    return HEAD + PAIRS + f"# 0.1 1.5 0.2 0 0\n{rows}# 0.2 2 0.2 0 0\n"
