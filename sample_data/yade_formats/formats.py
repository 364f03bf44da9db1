# A small heap of spheres in a box, written at one moment in every form that YADE exports.
#
#     yade -n -x -j1 formats.py
#
# Writes into the folder of this script. Made so that body number and position in a file never agree:
# ten facets have the ids 0 ... 9, a box has an id in the middle, and one sphere is erased before the heap settles.
# SI units; gravity along -z; not periodic.
import csv
import gzip
import os
import random
import resource
import signal
import sys

from yade import export, geom, utils

FOLDER = os.path.dirname(os.path.abspath(sys.argv[0]))  # in a YADE script __file__ is the yade program itself
SIDE = 0.05
rng = random.Random(7)  # not the module's own generator: YADE seeds that one anew when it picks a colour

WALL = O.materials.append(FrictMat(young=1e6, poisson=0.3, density=2600, frictionAngle=0.2, label='wall'))
LIGHT = O.materials.append(FrictMat(young=1e6, poisson=0.3, density=1500, frictionAngle=0.4, label='light'))
HEAVY = O.materials.append(FrictMat(young=1e6, poisson=0.3, density=2600, frictionAngle=0.5, label='heavy'))

# ten facets, open at the top: ids 0 ... 9
O.bodies.append(geom.facetBox((SIDE / 2, SIDE / 2, SIDE), (SIDE / 2, SIDE / 2, SIDE), wallMask=31, material=WALL, color=(1, 1, 1)))


def throw(number):
	for _ in range(number):
		r = rng.choice((0.003, 0.004, 0.005)) * rng.uniform(0.9, 1.1)
		while True:
			c = Vector3(rng.uniform(r, SIDE - r), rng.uniform(r, SIDE - r), rng.uniform(0.02, 2 * SIDE - r))
			if all((c - b.state.pos).norm() > r + b.shape.radius for b in O.bodies if isinstance(b.shape, Sphere)):
				break
		O.bodies.append(utils.sphere(c, r, material=rng.choice((LIGHT, HEAVY)), mask=rng.choice((1, 5)), color=(1, 1, 1)))


throw(80)
O.bodies.append(utils.box((0.02, 0.03, 0.006), (0.01, 0.008, 0.006), fixed=True, material=WALL, color=(1, 1, 1)))  # a step on the floor
throw(75)
O.bodies.erase(40)

O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb(), Bo1_Box_Aabb()], verletDist=2e-4),
        InteractionLoop(
                [Ig2_Sphere_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
                [Ip2_FrictMat_FrictMat_FrictPhys()],
                [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=0.4, gravity=(0, 0, -9.81)),
]
O.dt = 0.5 * utils.PWaveTimeStep()
O.run(30000, True)
print('unbalanced force', utils.unbalancedForce(), 'iter', O.iter)


def path(name):
	return os.path.join(FOLDER, name)


def compress(name):
	with open(path(name), 'rb') as f:
		text = f.read()
	with open(path(name + '.gz'), 'wb') as f:
		with gzip.GzipFile(filename='', mode='wb', compresslevel=9, fileobj=f, mtime=0) as z:
			z.write(text)
	os.remove(path(name))


# ---------------------------------------------------------------- legacy VTK: yade.export.VTKExporter
plain = export.VTKExporter(path('noid'))  # nothing but positions and radii
plain.exportSpheres()
plain.exportInteractions()
named = export.VTKExporter(path('id'))
named.exportSpheres(what=dict(id='b.id', mask='b.mask', matId='b.material.id'))
named.exportInteractions(what=dict(id1='i.id1', id2='i.id2', kn='i.phys.kn', normalForce='i.phys.normalForce'))
for name in ('noid', 'id'):
	for kind in ('spheres', 'intrs'):
		compress('%s-%s-00000000.vtk' % (name, kind))

# ---------------------------------------------------------------- VTK XML: VTKRecorder


def record(prefix, what, **how):
	"""Run VTKRecorder in a process of its own that may not write more than 2 MB into one file: YADE 2023.02a of Debian
	writes a good file of interactions and then an endless second one, whichever the form."""
	child = os.fork()
	if child == 0:
		signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
		resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
		resource.setrlimit(resource.RLIMIT_FSIZE, (2000000, 2000000))
		VTKRecorder(fileName=path(prefix), recorders=what + ['id', 'mask', 'materialId'], **how)()
		os._exit(0)
	status = os.waitpid(child, 0)[1]
	print('VTKRecorder', prefix, what, how, 'ended', 'well' if status == 0 else 'with status %d' % status)
	for name in os.listdir(FOLDER):
		if name.startswith(prefix) and name.endswith('_0.vtp'):
			os.remove(path(name))


record('ascii_', ['spheres', 'facets', 'boxes'], ascii=True, compress=False)  # numbers as text
record('ascii_', ['intr'], ascii=True, compress=False)
record('zlib_', ['spheres', 'facets', 'boxes'])  # the default: compressed, appended
record('zlib_', ['intr'])

# ---------------------------------------------------------------- text
export.text(path('text.txt'))
export.textExt(path('x_y_z_r.txt'), format='x_y_z_r')
export.textExt(path('x_y_z_r_matId.txt'), format='x_y_z_r_matId')
export.textExt(path('id_x_y_z_r_matId.txt'), format='id_x_y_z_r_matId')
export.textExt(path('x_y_z_r_attrs.txt'), format='x_y_z_r_attrs', attrs=('b.id', 'b.mask', 'b.state.vel'), comment='id mask vx vy vz')

# ---------------------------------------------------------------- the whole simulation
for tag in ('author', 'isoTime', 'id', 'd.id', 'id.d'):  # YADE's own would name the machine and the hour
	O.tags[tag] = 'formats'
O.save(path('formats.xml.bz2'))

# ---------------------------------------------------------------- the same from memory, all digits


def table(name, header, rows):
	with open(path(name), 'w', newline='') as f:
		out = csv.writer(f, lineterminator='\n')
		out.writerow(header)
		for row in rows:
			out.writerow([repr(float(v)) if isinstance(v, float) else v for v in row])


def is_sphere(k):
	return isinstance(O.bodies[k].shape, Sphere)


bodies, contacts, walls = [], [], []
for b in O.bodies:
	if is_sphere(b.id):
		bodies.append([b.id] + [float(v) for v in b.state.pos] + [float(b.shape.radius)])
for i in O.interactions:
	if not i.isReal:
		continue
	force = i.phys.normalForce + i.phys.shearForce  # on id2
	if is_sphere(i.id1) and is_sphere(i.id2):
		n = (O.bodies[i.id2].state.pos - O.bodies[i.id1].state.pos).normalized()
		contacts.append([i.id1, i.id2] + [float(v) for v in n] + [float(v) for v in force])
	else:
		sphere, wall, sign = (i.id2, i.id1, 1) if is_sphere(i.id2) else (i.id1, i.id2, -1)
		walls.append([sphere, wall, type(O.bodies[wall].shape).__name__] + [float(v) for v in sign * force])
table('truth_bodies.csv', ['id', 'x', 'y', 'z', 'r'], bodies)
table('truth_contacts.csv', ['id1', 'id2', 'nx', 'ny', 'nz', 'fx', 'fy', 'fz'], contacts)
table('truth_walls.csv', ['sphere', 'wall', 'shape', 'fx', 'fy', 'fz'], walls)
print('spheres', len(bodies), 'contacts', len(contacts), 'with walls', len(walls))
