# Triaxial compression of a spherical sample at constant mean stress, a small version of the test of
# Theocharis, Vairaktaris and Dafalias (2017), "3D scan line method for identifying void fabric of granular materials".
#
#     yade -n -x -j1 triaxial.py
#
# Writes into the folder of this script, for each frame k = 0 ... 6:
#     triaxial-spheres-0000000k.vtk.gz, triaxial-intrs-0000000k.vtk.gz   by yade.export.VTKExporter, then compressed
# and engine.csv, what the simulation itself holds in memory at the moment the files are written.
# On one thread the run repeats itself to the last digit (fixed seed).
# SI units throughout. Stress and strain are positive in compression where the names p, q and strain are used.
import gzip
import math
import os
import random
import sys
import time

import numpy as np
from yade import export, utils

FOLDER = os.path.dirname(os.path.abspath(sys.argv[0]))  # in a YADE script __file__ is the yade program itself

# ---------------------------------------------------------------- what is simulated
N_GRAINS = 800
R_MIN, R_MAX = 0.5e-3, 1.5e-3  # radii uniform between these
DENSITY = 2600.0
STIFFNESS = 2.2e4  # k_n = k_s of every contact, N/m
FRICTION = 0.5  # coefficient between grains; none with the boundary
FRICTION_COMPACTION = 0.1  # between grains, until the isotropic state is reached
P0 = 200e3  # Pa

N_SHELL = 1000  # boundary spheres
R_SHELL = 1.0e-3  # their radius
START_SCALE = 0.6  # of the radii, when the grains are thrown into the shell
START_POROSITY = 0.45  # of the shell's inside when the radii are full grown

STRAIN_RATE = 1.0  # d(strain)/dt, strain = 1 - L/L0 along z
STRAIN_STEP, FRAMES = 0.025, 7  # strain between two frames
STEPS = 10500  # time steps between two frames
EVERY = 25  # steps between two corrections by the servo; divides STEPS
DT = STRAIN_STEP / STRAIN_RATE / STEPS  # 2.4e-6 s; sqrt(m/k) of the smallest grain is 7.9e-6 s
SEED = 20170

start = time.time()
rng = random.Random(SEED)  # not the module's own generator: YADE seeds that one anew whenever it picks a colour for a body

# ---------------------------------------------------------------- bodies
GRAIN = O.materials.append(FrictMat(young=1e7, poisson=0.3, density=DENSITY, frictionAngle=math.atan(FRICTION_COMPACTION), label='grain'))
SHELL = O.materials.append(FrictMat(young=1e7, poisson=0.3, density=DENSITY, frictionAngle=0.0, label='shell'))

radii = [rng.uniform(R_MIN, R_MAX) for _ in range(N_GRAINS)]
inside = (sum(r**3 for r in radii) / (1 - START_POROSITY))**(1 / 3.)  # radius of the ball that the shell leaves free
placed = []
for r in sorted(radii, reverse=True):  # large ones first: they find a place more easily
	r *= START_SCALE
	while True:
		c = Vector3(*(rng.uniform(-inside, inside) for _ in range(3)))
		if c.norm() + r < inside and all((c - d).norm() > r + s for d, s in placed):
			break
	placed.append((c, r))
rng.shuffle(placed)
for c, r in placed:  # ids 0 ... N_GRAINS-1
	O.bodies.append(utils.sphere(c, r, material=GRAIN, mask=1))

# boundary: overlapping spheres on a spiral, about evenly over a sphere. fixed=True: they move only as they are told to
shell0 = np.empty((N_SHELL, 3))
for k in range(N_SHELL):
	z = 1 - (2 * k + 1) / N_SHELL
	a = k * math.pi * (3 - math.sqrt(5))
	shell0[k] = [math.sqrt(1 - z * z) * math.cos(a), math.sqrt(1 - z * z) * math.sin(a), z]
shell0 *= inside + R_SHELL
for c in shell0:
	O.bodies.append(utils.sphere(Vector3(*c), R_SHELL, material=SHELL, mask=3, fixed=True))
grains = [O.bodies[i] for i in range(N_GRAINS)]
shell = [O.bodies[i] for i in range(N_GRAINS, N_GRAINS + N_SHELL)]

# ---------------------------------------------------------------- engines
O.engines = [
        ForceResetter(),
        # bodies which have bit 2 of the mask in common (two boundary spheres) do not see each other
        InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=0.15 * R_MIN, avoidSelfInteractionMask=2),
        InteractionLoop(
                [Ig2_Sphere_Sphere_ScGeom()],
                [Ip2_FrictMat_FrictMat_FrictPhys(kn=MatchMaker(algo='val', val=STIFFNESS), ks=MatchMaker(algo='val', val=STIFFNESS))],
                [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
        NewtonIntegrator(damping=0.3, gravity=(0, 0, 0)),  # friction angle of a contact: the smaller one of the two materials
]
O.dt = DT

# ---------------------------------------------------------------- the shell's affine motion and the stress
stretch = np.ones(3)  # the shell's centres are at stretch * shell0


def move(rate):
	"""Give the shell the velocities of the stretch rate `rate` (three numbers) for the coming steps, and its exact positions."""
	for b, pos, vel in zip(shell, (shell0 * stretch).tolist(), (shell0 * rate).tolist()):
		b.state.pos = Vector3(*pos)
		b.state.vel = Vector3(*vel)


def advance(rate, steps=EVERY):
	global stretch
	move(rate)
	O.run(steps, True)
	stretch = stretch + np.asarray(rate) * steps * O.dt


def stress():
	"""Love-Weber stress of all grains, compression positive, over the volume of the ellipsoid that the shell leaves free."""
	volume = 4 / 3. * math.pi * np.prod(stretch * (inside + R_SHELL) - R_SHELL)
	total = Matrix3.Zero
	for g, s in zip(grains, utils.bodyStressTensors()):  # each is for the volume of its own sphere
		total += s * (4 / 3. * math.pi * g.shape.radius**3)
	total = -1 / volume * total
	return np.array([[total[i, j] for j in range(3)] for i in range(3)])


# ---------------------------------------------------------------- isotropic state
factor = (1 / START_SCALE)**(1 / 400.)
for k in range(400):  # the grains grow while the shell stands still
	utils.growParticles(factor)
	O.run(20, True)
print('grown: radii', min(g.shape.radius for g in grains), max(g.shape.radius for g in grains), 'p', np.trace(stress()) / 3)
O.run(2000, True)

calm = 0
for k in range(8000):  # the shell shrinks until the mean stress is P0
	error = np.trace(stress()) / 3 / P0 - 1
	advance(np.ones(3) * max(-1.0, min(1.0, 3.0 * error)) * stretch)
	calm = calm + 1 if abs(error) < 2e-3 and utils.unbalancedForce() < 2e-3 else 0
	if calm == 40:
		break
else:
	raise RuntimeError('no isotropic equilibrium')
print('equilibrium at P0 after', k + 1, 'steps of the servo')
utils.setContactFriction(math.atan(FRICTION))  # of the grains and their contacts; fixed bodies keep theirs
for k in range(400):
	error = np.trace(stress()) / 3 / P0 - 1
	advance(np.ones(3) * 3.0 * error * stretch)
stretch_iso = stretch.copy()
assert all(i.phys.tangensOfFrictionAngle == 0 for i in O.interactions if i.id2 >= N_GRAINS or i.id1 >= N_GRAINS)
assert all(abs(i.phys.tangensOfFrictionAngle - FRICTION) < 1e-9 for i in O.interactions if i.id2 < N_GRAINS and i.id1 < N_GRAINS)
volume = 4 / 3. * math.pi * np.prod(stretch * (inside + R_SHELL) - R_SHELL)
print('isotropic state: unbalanced force', utils.unbalancedForce(), 'radius inside the shell', stretch * (inside + R_SHELL) - R_SHELL,
      'porosity', 1 - sum(4 / 3. * math.pi * g.shape.radius**3 for g in grains) / volume,
      'mean overlap/diameter', np.mean([i.geom.penetrationDepth / (i.geom.refR1 + i.geom.refR2) for i in O.interactions if i.isReal]), 'seconds', time.time() - start)

# ---------------------------------------------------------------- frames
exporter = export.VTKExporter(os.path.join(FOLDER, 'triaxial'))
table = open(os.path.join(FOLDER, 'engine.csv'), 'w')
AXES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
NAMES = ('xx', 'yy', 'zz', 'xy', 'xz', 'yz')
first = {}


def compress(name):
	with open(name, 'rb') as f:
		text = f.read()
	with open(name + '.gz', 'wb') as f:
		with gzip.GzipFile(filename='', mode='wb', compresslevel=9, fileobj=f, mtime=0) as z:
			z.write(text)
	os.remove(name)


def frame(k):
	move(np.zeros(3))  # the shell at its exact place
	# 1. files
	exporter.exportSpheres(what=dict(id='b.id', mask='b.mask'))
	exporter.exportInteractions(what=dict(id1='i.id1', id2='i.id2', force='i.phys.normalForce+i.phys.shearForce'))
	for kind in ('spheres', 'intrs'):
		compress(os.path.join(FOLDER, 'triaxial-%s-%08d.vtk' % (kind, k)))
	# 2. the same state from memory. The positions are those after the last step, as in the files;
	#    the list of contacts is the one the forces of that step were computed from, as in the files
	pos = {b.id: np.array(b.state.pos, dtype=float) for b in O.bodies}
	rad = {b.id: b.shape.radius for b in O.bodies}
	low = np.array([pos[b.id] - rad[b.id] for b in grains]).min(axis=0)
	high = np.array([pos[b.id] + rad[b.id] for b in grains]).max(axis=0)
	length = max(pos[b.id][2] for b in shell) - min(pos[b.id][2] for b in shell)
	if k == 0:
		first.update(length=length, rv=0.7 * 0.5 * (high - low).min())
	rv = first['rv']
	number = {b.id: 0 for b in O.bodies}
	contacts = contacts_boundary = contacts_rv = 0
	gc, gcrv = np.zeros((3, 3)), np.zeros((3, 3))
	for i in O.interactions:
		if not i.isReal:
			continue
		number[i.id1] += 1
		number[i.id2] += 1
		if i.id1 >= N_GRAINS and i.id2 >= N_GRAINS:
			raise RuntimeError('two boundary spheres interact')
		if i.id1 >= N_GRAINS or i.id2 >= N_GRAINS:
			contacts_boundary += 1
			continue
		contacts += 1
		branch = pos[i.id2] - pos[i.id1]
		distance = math.sqrt(branch.dot(branch))
		n = branch / distance
		gc += np.outer(n, n)
		point = pos[i.id1] + 0.5 * (rad[i.id1] + distance - rad[i.id2]) * n  # middle of the overlap
		if point.dot(point) <= rv * rv:
			contacts_rv += 1
			gcrv += np.outer(n, n)
	gc, gcrv = gc / contacts, gcrv / contacts_rv
	s = stress()
	row = [
	        ('frame', k), ('iter', O.iter), ('time', O.time),
	        ('strain', 1 - length / first['length']),
	        ('p', np.trace(s) / 3), ('q', s[2, 2] - 0.5 * (s[0, 0] + s[1, 1])),
	        ('grains', len(grains)), ('boundary', len(shell)),
	        ('contacts', contacts), ('contacts_boundary', contacts_boundary),
	        ('rattlers', sum(1 for b in grains if number[b.id] < 2)),
	        ('coordination', (2 * contacts + contacts_boundary) / len(grains)),
	]
	row += [('gc_' + name, gc[a]) for name, a in zip(NAMES, AXES)]
	row += [('rv_radius', rv), ('contacts_rv', contacts_rv)]
	row += [('gcrv_' + name, gcrv[a]) for name, a in zip(NAMES, AXES)]
	if k == 0:
		table.write(','.join(name for name, _ in row) + '\n')
	table.write(','.join(repr(v) if isinstance(v, int) else repr(float(v)) for _, v in row) + '\n')
	table.flush()
	print('frame', k, 'strain %.5f' % row[3][1], 'p %.0f q/p %.3f' % (row[4][1], row[5][1] / row[4][1]),
	      'unbalanced %.1e' % utils.unbalancedForce(), 'stretch', stretch / stretch_iso, 'contacts', contacts, contacts_boundary,
	      'rattlers', row[10][1], 'gc', np.round(np.diag(gc), 4), 'rv', contacts_rv, np.round(np.diag(gcrv), 4), 'seconds %.0f' % (time.time() - start))


# ---------------------------------------------------------------- compression
frame(0)
lateral = 0.5 * STRAIN_RATE  # relative lateral stretch rate of the servo, corrected as it goes
for k in range(1, FRAMES):
	for _ in range(STEPS // EVERY):
		error = np.trace(stress()) / 3 / P0 - 1
		lateral += 1000.0 * error * EVERY * O.dt
		side = lateral + 10.0 * error
		advance(np.array([side * stretch[0], side * stretch[1], -STRAIN_RATE * stretch_iso[2]]))
	frame(k)
table.close()
print('inertial number', STRAIN_RATE * (R_MIN + R_MAX) * math.sqrt(DENSITY / P0), 'seconds', time.time() - start)
