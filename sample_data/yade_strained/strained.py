# A small dense periodic sample in simple shear, whose cell is another one in each frame, in every form that names the cell.
#
#     yade -n -x -j1 strained.py
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
O.engines = [engine for engine in O.engines if not isinstance(engine, PeriTriaxController)]
O.cell.velGrad = Matrix3(0, 0, 0.5, 0, 0, 0, 0, 0, 0)


def path(name):
	return os.path.join(FOLDER, name)


def compress():
	for name in os.listdir(FOLDER):
		if name.endswith('.vtk'):
			with open(path(name), 'rb') as f, open(path(name + '.gz'), 'wb') as out:
				with gzip.GzipFile(filename='', mode='wb', compresslevel=9, fileobj=out, mtime=0) as z:
					z.write(f.read())
			os.remove(path(name))


before, after, lone = (export.VTKExporter(path(name)) for name in ('before', 'after', 'lone'))
pairs = dict(id1='i.id1', id2='i.id2')
with open(path('truth.csv'), 'w', newline='') as f:
	out = csv.writer(f, lineterminator='\n')
	out.writerow(['step', 'lx', 'ly', 'lz', 'xy', 'xz', 'yz', 'contacts'])
	for frame in range(3):
		for exporter in (before, after, lone):
			exporter.exportSpheres(what=dict(id='b.id'))
		before.exportPeriodicCell()
		before.exportInteractions(what=pairs)
		after.exportInteractions(what=pairs)
		after.exportPeriodicCell()
		lone.exportPeriodicCell()
		VTKRecorder(fileName=path('rec_'), recorders=['spheres', 'id', 'pericell'])()
		VTKRecorder(fileName=path('saved_'), recorders=['spheres', 'id'])()
		for tag in ('author', 'isoTime', 'id', 'd.id', 'id.d'):  # YADE's own would name the machine and the hour
			O.tags[tag] = 'strained'
		O.save(path('saved_%d.xml.bz2' % O.iter))
		h = O.cell.hSize
		out.writerow([O.iter] + [repr(float(v)) for v in (h[0, 0], h[1, 1], h[2, 2], h[0, 1], h[0, 2], h[1, 2])] + [sum(1 for i in O.interactions if i.isReal)])
		if frame < 2:
			O.run(10000, True)
compress()
