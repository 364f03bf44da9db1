# A small dense periodic sample of clumps and single spheres, compressed and then sheared, so that its cell is tilted.
#
#     yade -n -x -j1 clumps.py
#
# Writes into the folder of this script. SI units, no gravity.
import csv
import gzip
import os
import sys

from yade import export, pack, utils

FOLDER = os.path.dirname(os.path.abspath(sys.argv[0]))  # in a YADE script __file__ is the yade program itself
SIZE = (0.034, 0.034, 0.034)
SHAPES = [
        pack.SpherePack([((0, 0, 0), 0.0012), ((0.0013, 0, 0), 0.0012)]),
        pack.SpherePack([((0, 0, 0), 0.0012), ((0.0013, 0, 0), 0.0009), ((0.0004, 0.0011, 0), 0.0009), ((0.0004, 0.0002, 0.0012), 0.0008)]),
]

O.periodic = True
O.cell.setBox(*SIZE)
O.materials.append(FrictMat(young=1e7, poisson=0.3, density=2600, frictionAngle=0.3))
cloud = pack.SpherePack()
cloud.makeClumpCloud((0, 0, 0), SIZE, SHAPES, periodic=True, num=220, seed=5)
cloud.toSimulation(color=(1, 1, 1))
lone = pack.SpherePack()
lone.makeCloud((0, 0, 0), SIZE, rMean=0.0012, rRelFuzz=0.2, num=60, periodic=True, seed=7)
taken = [(b.state.pos, b.shape.radius) for b in O.bodies if isinstance(b.shape, Sphere)]


def free(c, r):
	"""Whether a sphere lies beside all that are there, also through the faces."""
	middle = 0.5 * Vector3(SIZE)
	return all((O.cell.wrap(c - x + middle) - middle).norm() > r + s for x, s in taken)


for c, r in lone:
	if free(c, r):
		O.bodies.append(utils.sphere(c, r))

O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()]),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()]),
        PeriTriaxController(goal=(-3e4, -3e4, -3e4), stressMask=7, maxStrainRate=(2, 2, 2), globUpdate=5, dynCell=True, mass=0.1, maxUnbalanced=1e-2, relStressTol=1e-2, doneHook='calm()', label='press'),
        NewtonIntegrator(damping=0.4),
]
O.dt = 0.3 * utils.PWaveTimeStep()
state = dict(done=False)


def calm():
	state['done'] = True


while not state['done'] and O.iter < 200000:
	O.run(500, True)


def path(name):
	return os.path.join(FOLDER, name)


def grain(b):
	"""The clump, or the sphere that stands alone."""
	return b.clumpId if b.clumpId >= 0 else b.id


COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def counts():
	real = [i for i in O.interactions if i.isReal]
	inside = [i for i in real if grain(O.bodies[i.id1]) == grain(O.bodies[i.id2])]
	assert not inside
	pairs = set(tuple(sorted((grain(O.bodies[i.id1]), grain(O.bodies[i.id2])))) for i in real)
	number = {grain(b): 0 for b in O.bodies if isinstance(b.shape, Sphere)}
	for one, two in pairs:
		number[one] += 1
		number[two] += 1
	tensor = Matrix3.Zero
	for i in real:
		tensor += i.geom.normal.outer(i.geom.normal)
	row = dict(step=O.iter, spheres=sum(isinstance(b.shape, Sphere) for b in O.bodies), clumps=sum(b.isClump for b in O.bodies), grains=len(number), contacts=len(real), neighbours=len(pairs))
	row['rattlers'] = sum(n < 2 for n in number.values())
	row['coordination'] = repr(sum(number.values()) / len(number))
	for (k, l), name in zip(COMPONENTS, 'xx yy zz xy xz yz'.split()):
		row['gc_' + name] = repr(tensor[k, l] / len(real))
	return row


rows, places = [], []
O.engines = [engine for engine in O.engines if not isinstance(engine, PeriTriaxController)]
for frame in range(2):
	if frame == 1:
		O.cell.velGrad = Matrix3(0, 0, 2, 0, 0, 0, 0, 0, 0)
		O.run(30000, True)
	for tag in ('author', 'isoTime', 'id', 'd.id', 'id.d'):  # YADE's own would name the machine and the hour
		O.tags[tag] = 'clumps'
	O.save(path('saved_%d.xml.bz2' % O.iter))
	rows.append(counts())
	for b in O.bodies:
		if b.isClump:
			places.append(dict(step=O.iter, clump=b.id, **{k: repr(v) for k, v in zip('xyz', b.state.pos)}))
exporter = export.VTKExporter(path('last'))
exporter.exportPeriodicCell()
exporter.exportSpheres(what=dict(id='b.id', clumpId='b.clumpId'))
exporter.exportInteractions(what=dict(id1='i.id1', id2='i.id2'))
for name in os.listdir(FOLDER):
	if name.endswith('.vtk'):
		with open(path(name), 'rb') as f, open(path(name + '.gz'), 'wb') as out:
			with gzip.GzipFile(filename='', mode='wb', compresslevel=9, fileobj=out, mtime=0) as z:
				z.write(f.read())
		os.remove(path(name))
for name, table in (('engine.csv', rows), ('places.csv', places)):
	with open(path(name), 'w', newline='') as f:
		out = csv.DictWriter(f, list(table[0]), lineterminator='\n')
		out.writeheader()
		out.writerows(table)
