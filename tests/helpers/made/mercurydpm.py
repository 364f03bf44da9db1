"""Files of MercuryDPM: three grains, of which two touch through a face."""

# rows 0 and 1 touch, and rows 0 and 2 through the face of a cell of 1 x 2 x 3
CENTRES = ((0.1, 1, 1), (0.29, 1, 1), (0.91, 1, 1))
RADIUS = 0.1
NORMAL, TANGENT = 2.0, 0.5


def data_frame(time, count=3):
    rows = "".join(
        f"{x} {y} {z} 9 9 9 {RADIUS} 0 0 0 0 0 0 {row}\n"
        for row, (x, y, z) in enumerate(CENTRES[:count])
    )
    return f"{count} {time} 0 0 0 1 2 3 \n{rows}"


def contact(time, i, j, normal, tangent=(0, 1, 0), fn=NORMAL):
    numbers = [time, i, j, 0, 0, 0, 0.01, 0, fn, TANGENT, *normal, *tangent]
    return " ".join(map(str, numbers)) + "\n"


def fstat_frame(time, rows=""):
    return f"# {time} 1\n# 0 0 0 1 2 3\n# {RADIUS} {RADIUS} 0 0 0 0\n{rows}"


def contacts_at(time):
    """The pair from both sides; the image from one; a wall below grain 2, with its own normal."""
    return (
        contact(time, 0, 1, (-1, 0, 0))
        + contact(time, 1, 0, (1, 0, 0), (0, -1, 0))
        + contact(time, 2, 0, (-1, 0, 0), (0, 0, 1))
        + contact(time, 2, -1, (0, 0, -1))
    )


RESTART = """MercuryDPM 1.0 name a
xMin 0 xMax 1 yMin 0 yMax 2 zMin 0 zMax 3
timeStep 0.1 time 0.5 ntimeSteps 5 timeMax 1
Walls 1
InfiniteWall id 0 indSpecies 0 position 9 9 9 radius 9
Boundaries 2
PeriodicBoundary id 0 normal 1 0 0 scaleFactor 1 distanceLeft 0 distanceRight 1 shift 1 0 0
CubeInsertionBoundary id 1 BaseParticle id 0 indSpecies 0 position 7 7 7 radius 7
Particles 3
{particles}Interactions 4
{interactions}NUM_BUCKETS 3
"""
IDS = (10, 30, 20)


def restart(text=RESTART, species="LinearViscoelastic"):
    particles = "".join(
        f"BaseParticle id {id} indSpecies 0 position {x} {y} {z} orientation 1 0 0 0 force 0 0 0 "
        f"radius {RADIUS} invMass 1\n"
        for id, (x, y, z) in zip(IDS, CENTRES, strict=True)
    )
    rows = (("particleIds 10 30", -2), ("particleIds 20 10", -2), ("particleWallIds 20 0", 1))
    interactions = "".join(
        f"{species}Interaction {who} timeStamp 5 contactPoint 0 0 0 force {push} 0.5 0 torque 0 0\n"
        for who, push in (*rows, ("particleWallIds 20 1", 1))
    )
    return text.format(particles=particles, interactions=interactions)
