"""Files of LF_DEM: three spheres in a sheared cell, at two strains; and a bent chain of three."""

import numpy as np

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


FORCES = PAIRS.rstrip("\n") + (
    "\n#8: {lubrication}\n"
    "#9-11: tangential part of the lubrication force\n"
    "#12: norm of the normal part of the contact force\n"
    "#13-15: tangential part of the contact force\n"
    "#16: norm of the normal repulsive force\n\n"
)
SIGNED = "normal part of the lubrication force"
UNSIGNED = "normal part of the lubrication force (positive for compression)"
# 1 touches 0 and 2, one beside and one above it
CHAIN = np.array([(-2.0, 0, 0), (0, 0, 0), (1.2, 0, 1.6)])
THROUGH = np.array([1.0, 0.25, 0.5])
"""The force that 0 exerts on 1; 2 exerts the opposite one, so that 1 is at rest."""


def chain_texts(pairs=((0, 1), (1, 2)), lubrication=SIGNED, push=abs):
    """Grains and pairs with forces, as the program's source has them: on particle 1 of a pair."""
    head = "# 0 0 0.2 0 0 \n"
    grains = "".join(f"{k} 1 {x} {y} {z} 9 9 9 \n" for k, (x, y, z) in enumerate(CHAIN))
    rows = ""
    for one, two in pairs:
        normal = (CHAIN[two] - CHAIN[one]) / 2
        on_first = -THROUGH if one < two else THROUGH
        tangential = on_first - (on_first @ normal) * normal
        lubrication_forces, push_on_first = [7] * 4, push(-on_first @ normal)
        numbers = [one, two, 2, *normal, -0.01, *lubrication_forces, push_on_first, *tangential, 7]
        rows += " ".join(map(str, numbers)) + " \n"
    legend = FORCES.format(lubrication=lubrication)
    return HEAD + GRAINS + head + grains, HEAD + legend + head + rows


# of a run of the program itself (v2.0-525, 200 grains at a shear rate of 20): six contacts
RUN_GRAINS = """\
1 1 -6.684 -4.81302 1.37064
12 1 -4.89605 -3.63168 -1.16582
74 1 4.8003 6.77159 -3.97426
130 1 2.75014 6.15229 -3.86655
142 1 -5.59838 -5.26347 -0.247317
154 1.4 5.84067 3.26628 5.55795
155 1.4 5.16993 -5.71985 2.06974
185 1.4 -2.99583 -4.31443 5.16005
188 1.4 -4.37254 -3.22669 -6.62096
191 1.4 2.46192 -5.71776 -2.72726
196 1.4 5.70018 -5.71191 -5.63614
197 1.4 -5.33584 3.37705 5.30646
"""
# ids, state, normal, gap; push and tangential part of the contact; what it adds to the viscosity
RUN_PAIRS = """\
1 155 2 -0.878797 -0.377929 0.291352 -0.000425511 122.547 41.9777 -9.13174 114.771 -585.179
154 197 3 0.995171 0.0395651 -0.0898315 -0.000282069 110.571 10.5544 -19.5413 108.318 3340.84
185 188 2 -0.491751 0.388533 0.779245 -0.000277981 108.968 -75.6874 39.7367 -67.5761 1524.14
12 142 3 -0.351179 -0.815931 0.45927 -9.28202e-05 18.564 -2.13415 -8.33945 -16.4476 203.267
74 196 2 0.374971 0.616325 -0.692489 -0.000108689 31.3024 23.2819 -20.218 -5.38757 -42.6687
130 191 2 -0.120094 0.87191 0.474711 -3.07473e-05 8.85522 -1.87134 -4.33609 7.49075 -17.6037
"""
RUN_VISCOSITY = np.array([float(line.split()[-1]) for line in RUN_PAIRS.splitlines()])


def run_texts():
    """The excerpt as files: of lubrication a title is left, and of repulsion nothing."""
    edges = "# Lx 13.9626\n# Ly 13.9626\n# Lz 13.9626\n"
    head = f"# LF_DEM version v2.0-525-gc482fc8\n# np 12\n# VF 0.45\n{edges}"
    frame = "# 1 13.9626 20 0 1 \n"
    grains = GRAINS.replace("#6-8: velocity (x, y, z)\n", "") + frame + RUN_GRAINS
    titles = (
        f"#8: {SIGNED}",
        "#8: norm of the normal part of the contact force",
        "#9-11: tangential part of the contact force",
        "#12: Viscosity contribution of contact xF\n\n",
    )
    return head + grains, head + PAIRS.rstrip("\n") + "\n" + "\n".join(titles) + frame + RUN_PAIRS
