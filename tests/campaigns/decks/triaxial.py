"""Behind the engines of YADE's tutorial: growing spheres, then loading along y; saved by VTK."""

from yade import export

PRESSURE, FRAMES, STEPS = 10_000.0, 20, 2000

saver = export.VTKExporter("triaxial")


def save():
    saver.exportSpheres(what={"radius": "b.shape.radius"})
    saver.exportInteractions(what={"fn": "i.phys.normalForce.norm()"})


triax.goal1 = triax.goal2 = triax.goal3 = -PRESSURE
while True:
    O.run(1000, True)
    is_at_rest = unbalancedForce() < stabilityThreshold
    if is_at_rest and abs(triax.meanStress + PRESSURE) < 0.001 * PRESSURE:
        break
save()
while triax.porosity > targetPorosity:
    compFricDegree *= 0.95
    setContactFriction(radians(compFricDegree))
    O.run(500, True)
triax.internalCompaction = False
setContactFriction(radians(finalFricDegree))
triax.stressMask, triax.goal2 = 5, rate
newton.damping = 0.1
for _ in range(FRAMES):
    save()
    O.run(STEPS, True)
