# A small dense sample of spheres in a periodic cell with three different lengths, isotropically compressed.
#
#     yade -n -x -j1 periodic.py
#
# Writes into the folder of this script. SI units, no gravity.
import csv
import gzip
import os
import sys

from yade import export, pack, utils

FOLDER = os.path.dirname(os.path.abspath(sys.argv[0]))  # in a YADE script __file__ is the yade program itself
SIZE = (0.040, 0.045, 0.050)

O.periodic = True
O.cell.setBox(*SIZE)
O.materials.append(FrictMat(young=1e7, poisson=0.3, density=2600, frictionAngle=0.3))
cloud = pack.SpherePack()
cloud.makeCloud((0, 0, 0), SIZE, rMean=0.0035, rRelFuzz=0.3, num=100, periodic=True, seed=3)
cloud.toSimulation(color=(1, 1, 1))

O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()]),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()]),
        PeriTriaxController(goal=(-5e4, -5e4, -5e4), stressMask=7, maxStrainRate=(1, 1, 1), globUpdate=5, dynCell=True, mass=0.1, maxUnbalanced=1e-3, relStressTol=1e-3, doneHook='calm()', label='press'),
        NewtonIntegrator(damping=0.3),
]
O.dt = 0.5 * utils.PWaveTimeStep()
state = dict(done=False)


def calm():
	state['done'] = True


while not state['done'] and O.iter < 200000:
	O.run(500, True)
print('iter', O.iter, 'stress', press.stress, 'unbalanced', utils.unbalancedForce(), 'cell', O.cell.hSize)


def path(name):
	return os.path.join(FOLDER, name)


def compress(name):
	with open(path(name), 'rb') as f:
		text = f.read()
	with open(path(name + '.gz'), 'wb') as f:
		with gzip.GzipFile(filename='', mode='wb', compresslevel=9, fileobj=f, mtime=0) as z:
			z.write(text)
	os.remove(path(name))


exporter = export.VTKExporter(path('periodic'))
exporter.exportSpheres(what=dict(id='b.id'))
exporter.exportInteractions(what=dict(id1='i.id1', id2='i.id2', force='i.phys.normalForce+i.phys.shearForce'))
exporter.exportPeriodicCell()
compress('periodic-spheres-00000000.vtk')
compress('periodic-intrs-00000000.vtk')
packing = pack.SpherePack()
packing.fromSimulation()
packing.save(path('periodic_pack.txt'))
export.textExt(path('periodic_x_y_z_r.txt'), format='x_y_z_r')
export.textExt(path('periodic_id_x_y_z_r_matId.txt'), format='id_x_y_z_r_matId')
for tag in ('author', 'isoTime', 'id', 'd.id', 'id.d'):  # YADE's own would name the machine and the hour
	O.tags[tag] = 'periodic'
O.save(path('periodic.xml.bz2'))

# the same from memory, all digits


def table(name, header, rows):
	with open(path(name), 'w', newline='') as f:
		out = csv.writer(f, lineterminator='\n')
		out.writerow(header)
		for row in rows:
			out.writerow([repr(float(v)) if isinstance(v, float) else v for v in row])


bodies, contacts = [], []
for b in O.bodies:
	bodies.append([b.id] + [float(v) for v in b.state.pos] + [float(b.shape.radius)])  # as they are, not wrapped into the cell
for i in O.interactions:
	if i.isReal:
		n = (O.bodies[i.id2].state.pos + O.cell.hSize * i.cellDist - O.bodies[i.id1].state.pos).normalized()
		force = i.phys.normalForce + i.phys.shearForce  # on id2
		contacts.append([i.id1, i.id2] + [float(v) for v in n] + [float(v) for v in force] + [int(v) for v in i.cellDist])
table('periodic_truth_bodies.csv', ['id', 'x', 'y', 'z', 'r'], bodies)
table('periodic_truth_contacts.csv', ['id1', 'id2', 'nx', 'ny', 'nz', 'fx', 'fy', 'fz', 'cell_x', 'cell_y', 'cell_z'], contacts)
table('periodic_truth_cell.csv', ['vector', 'x', 'y', 'z'], [[name] + [float(O.cell.hSize[k, c]) for k in range(3)] for c, name in enumerate('abc')])
print('spheres', len(bodies), 'contacts', len(contacts), 'across the cell', sum(1 for c in contacts if any(c[8:])))
