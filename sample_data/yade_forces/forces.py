# Triaxial compression of 400 spheres in a periodic cell, with what YADE itself says of fabric and
# stress.
#
#     yade -n -x -j1 forces.py
#
# Writes into the folder of this script: forces.xml.bz2 (O.save), forces-spheres-00000000.vtk,
# forces-intrs-00000000.vtk, forces-periCell-00000001.vtk (VTKExporter) and engine.json.
# SI units throughout; fixed seed.
import json
import os
import random
import sys

from yade import export, utils

FOLDER = os.path.dirname(os.path.abspath(sys.argv[0]))
rng = random.Random(7)
O.periodic = True
O.cell.hSize = Matrix3(0.026, 0, 0, 0, 0.028, 0, 0, 0, 0.030)
mat = O.materials.append(FrictMat(young=1e7, poisson=0.3, density=2600, frictionAngle=0.1))
placed = []
while len(placed) < 400:
	r = rng.choice((0.8e-3, 1.0e-3, 1.3e-3))
	c = Vector3(*(rng.uniform(0, O.cell.size[k]) for k in range(3)))
	def gap(d):
		v = c - d
		return Vector3(*(v[k] - O.cell.size[k] * round(v[k] / O.cell.size[k]) for k in range(3))).norm()
	if all(gap(d) > 0.8 * (r + s) for d, s in placed):
		placed.append((c, r))
for c, r in placed:
	O.bodies.append(utils.sphere(c, r, material=mat))
O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=0.1e-3),
        InteractionLoop(
                [Ig2_Sphere_Sphere_ScGeom()],
                [Ip2_FrictMat_FrictMat_FrictPhys(kn=MatchMaker(algo='val', val=2e4), ks=MatchMaker(algo='val', val=1e4))],
                [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        PeriTriaxController(label='triax', goal=(-5e4, -5e4, -5e4), stressMask=7, maxStrainRate=(2., 2., 2.), globUpdate=5, dynCell=False, mass=1e-3, maxUnbalanced=1e-3, relStressTol=1e-2, doneHook='done()'),
        NewtonIntegrator(damping=0.3),
]
O.dt = 2.5e-6
state = {'done': False}


def done():
	state['done'] = True


while not state['done'] and O.iter < 400000:
	O.run(2000, True)
print('isotropic', O.iter, triax.stress)
for i in O.interactions:
	if i.isReal:
		i.phys.tangensOfFrictionAngle = 0.5
O.materials[mat].frictionAngle = 0.4636
# compression along z, the lateral stress held
state['done'] = False
O.cell.trsf = Matrix3.Identity
triax.goal = (-5e4, -5e4, -0.08)
triax.stressMask = 3
triax.maxStrainRate = (0.5, 0.5, 0.2)
triax.maxUnbalanced = 10
triax.relStressTol = 0.05
while not state['done'] and O.iter < 700000:
	O.run(2000, True)
print('sheared', O.iter, utils.unbalancedForce(), triax.stress, triax.strain)


def rows(m):
	return [[m[i, j] for j in range(3)] for i in range(3)]


# the forces are those of the last step, and so are the normals kept with them
whole = utils.fabricTensor(splitTensor=False)
strong, weak = utils.fabricTensor(splitTensor=True)
forces = [i.phys.normalForce.norm() for i in O.interactions if i.isReal]
found = {
        'contacts': len(forces),
        'mean_normal_force': sum(forces) / len(forces),
        'fabricTensor': rows(whole[0]),
        'fabricTensor_strong': rows(strong),
        'fabricTensor_weak': rows(weak),
        'getStress': rows(utils.getStress()),
        'volume': O.cell.volume,
}
json.dump(found, open(os.path.join(FOLDER, 'engine.json'), 'w'), indent=1)
O.save(os.path.join(FOLDER, 'forces.xml.bz2'))
out = export.VTKExporter(os.path.join(FOLDER, 'forces'))
out.exportSpheres(what=dict(id='b.id'))
out.exportInteractions(what=dict(id1='i.id1', id2='i.id2', normalForce='i.phys.normalForce', shearForce='i.phys.shearForce'))
out.exportPeriodicCell()
