"""The triaxial test of YADE's tutorial: growing spheres, then loading along y; saved by VTK."""

from math import radians

from yade import export, pack

YOUNG, FRICTION, POROSITY, PRESSURE = 5e6, 30.0, 0.43, 10_000.0
FRAMES, STEPS = 20, 2000

O.materials.append(
    FrictMat(
        young=YOUNG, poisson=0.5, frictionAngle=radians(FRICTION), density=2600, label="spheres"
    )
)
O.materials.append(FrictMat(young=YOUNG, poisson=0.5, frictionAngle=0, density=0, label="walls"))
corners = (0, 0, 0), (1, 1, 1)
O.bodies.append(aabbWalls(corners, thickness=0, material="walls"))
cloud = pack.SpherePack()
cloud.makeCloud(*corners, -1, 0.3333, 1000, False, 0.95, seed=1)
O.bodies.append([sphere(center, radius, material="spheres") for center, radius in cloud])

triax = TriaxialStressController(
    maxMultiplier=1 + 2e4 / YOUNG,
    finalMaxMultiplier=1 + 2e3 / YOUNG,
    thickness=0,
    stressMask=7,
    internalCompaction=True,
    goal1=-PRESSURE,
    goal2=-PRESSURE,
    goal3=-PRESSURE,
)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FrictPhys()],
        [Law2_ScGeom_FrictPhys_CundallStrack()],
    ),
    GlobalStiffnessTimeStepper(active=1, timeStepUpdateInterval=100, timestepSafetyCoefficient=0.8),
    triax,
    NewtonIntegrator(damping=0.2),
]
saver = export.VTKExporter("triaxial")


def save():
    saver.exportSpheres(what={"radius": "b.shape.radius"})
    saver.exportInteractions(what={"fn": "i.phys.normalForce.norm()"})


while True:
    O.run(1000, True)
    if unbalancedForce() < 0.01 and abs(triax.meanStress + PRESSURE) < 0.001 * PRESSURE:
        break
save()
friction = FRICTION
while triax.porosity > POROSITY:
    friction *= 0.95
    setContactFriction(radians(friction))
    O.run(500, True)
triax.internalCompaction = False
setContactFriction(radians(FRICTION))
triax.stressMask, triax.goal2 = 5, -0.02
O.engines[-1].damping = 0.1
for _ in range(FRAMES):
    save()
    O.run(STEPS, True)
