# The experiment of Theocharis, Vairaktaris and Dafalias (2017), "3D scan line method for identifying void fabric of
# granular materials", for YADE: a sphere of grains in a shell without friction, triaxial compression at constant mean stress.
#
#     yade -n -x -j1 triaxial.py                              800 grains
#     yade -n -x -j1 triaxial.py --grains 13723 --folder run  the size of the paper
#
# Writes into the folder, for each frame k:
#     triaxial-spheres-0000000k.vtk.gz, triaxial-intrs-0000000k.vtk.gz   by yade.export.VTKExporter, then compressed
# and engine.csv, what the simulation itself holds in memory at the moment the files are written.
# After each stage and frame, and in the long ones, the simulation is saved. The same command goes on from there, or does nothing if all frames are done;
# with --reversal it goes on beyond the last frame, in the opposite direction.
# SI units throughout. Stress and strain are positive in compression where the names p, q and strain are used.
import argparse
import glob
import gzip
import json
import math
import os
import random
import sys
import time

import numpy as np
from yade import export, utils

# ---------------------------------------------------------------- what is simulated
R_MIN, R_MAX = 0.5e-3, 1.5e-3  # radii uniform between these
DENSITY = 2600.0
STIFFNESS = 2.2e4  # k_n = k_s of every contact, N/m
FRICTION = 0.5  # coefficient between grains; none with the boundary
STRAIN_RATE = 1.5  # 1/s, of the strain 1 - L/L0 along z: inertial number 3.4e-4

R_SHELL = 1.0e-3  # of the boundary spheres
SHELL_COVER = 1.34  # cross sections of the boundary spheres over the area of the shell: no hole that a grain could leave by
START_SCALE = 0.6  # of the radii, when the grains are thrown into the shell
START_POROSITY = 0.44  # of the shell's inside when the radii are full grown
RV = 0.7  # radius of the RV over half the smallest extent of the grains' surfaces

DT = 2.4e-6  # s; sqrt(m/k) of the smallest grain is 7.9e-6 s
EVERY = 25  # steps between two corrections by the servo

AXES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
NAMES = ('xx', 'yy', 'zz', 'xy', 'xz', 'yz')
COLUMNS = (['frame', 'iter', 'time', 'strain', 'p', 'q', 'p_off', 'p_whole', 'q_whole', 'inertial_number', 'unbalanced_force',
            'porosity', 'overlap', 'grains', 'boundary', 'contacts', 'contacts_boundary', 'rattlers', 'coordination'] +
           ['gc_' + name for name in NAMES] + ['rv_radius', 'contacts_rv'] + ['gcrv_' + name for name in NAMES])

parser = argparse.ArgumentParser(prog='triaxial.py')
parser.add_argument('--grains', type=int, default=800)
parser.add_argument('--seed', type=int, default=1)
parser.add_argument('--compaction', type=float, default=FRICTION, help='friction between grains until the isotropic state is reached; lower is denser')
parser.add_argument('--shell-friction', type=float, default=0.0, help='friction between grains and boundary')
parser.add_argument('--pressure', type=float, default=200e3, help='mean stress, Pa')
parser.add_argument('--strain', type=float, default=0.2, help='axial strain of the last frame')
parser.add_argument('--frames', type=int, default=41)
parser.add_argument('--reversal', type=float, default=0.0, help='axial strain that is taken back at the end, by the same steps')
parser.add_argument('--folder', default='.')
ask = parser.parse_args(sys.argv[1:])

start = time.time()
state = {'done': 0}  # what the deck knows beside YADE's own scene; saved with it


def where(name):
    return os.path.join(ask.folder, name)


def run(steps):
    """O.run(steps, True) does the same, but each of its calls waits for 40 ms."""
    for _ in range(steps):
        O.step()


def say(*words):
    print('%7.0f s' % (time.time() - start), *words, flush=True)


# ---------------------------------------------------------------- bodies
def thrown(radii, inside, rng):
    """Places for spheres that touch neither each other nor the shell. Large ones first: they find one more easily."""
    order = np.argsort(radii)[::-1]
    places = np.empty((len(radii), 3))
    for k, i in enumerate(order):
        done = order[:k]
        while True:
            place = np.array([rng.uniform(-inside, inside) for _ in range(3)])
            if place.dot(place) < (inside - radii[i])**2 and (((places[done] - place)**2).sum(axis=1) > (radii[done] + radii[i])**2).all():
                break
        places[i] = place
    return places


def spiral(number):
    """Points about evenly over the unit sphere."""
    z = 1 - (2 * np.arange(number) + 1) / number
    angle = np.arange(number) * math.pi * (3 - math.sqrt(5))
    across = np.sqrt(1 - z * z)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), z])


def make_bodies():
    rng = random.Random(ask.seed)  # not the module's own generator: YADE seeds that one anew whenever it picks a colour
    grain = O.materials.append(
            FrictMat(young=1e7, poisson=0.3, density=DENSITY, frictionAngle=math.atan(ask.compaction), label='grain'))
    shell = O.materials.append(FrictMat(young=1e7, poisson=0.3, density=DENSITY, frictionAngle=math.atan(ask.shell_friction), label='shell'))
    radii = np.array([rng.uniform(R_MIN, R_MAX) for _ in range(ask.grains)])
    inside = ((radii**3).sum() / (1 - START_POROSITY))**(1 / 3.)  # radius of the ball that the shell leaves free
    radii *= START_SCALE
    for place, r in zip(thrown(radii, inside, rng).tolist(), radii.tolist()):
        O.bodies.append(utils.sphere(Vector3(*place), r, material=grain, mask=1))
    middle = inside + R_SHELL
    shell0 = middle * spiral(round(SHELL_COVER * 4 * (middle / R_SHELL)**2))
    for place in shell0.tolist():  # fixed: they move only as they are told to
        O.bodies.append(utils.sphere(Vector3(*place), R_SHELL, material=shell, mask=3, fixed=True))
    state.update(shell0=shell0, inside=inside, stretch=np.ones(3))


def make_engines():
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


def grains():
    return [O.bodies[i] for i in range(ask.grains)]


def shell():
    return [O.bodies[i] for i in range(ask.grains, len(O.bodies))]


# ---------------------------------------------------------------- the shell's affine motion and the stress
def move(rate):
    """Give the shell the velocities of the stretch rate `rate` (three numbers) for the coming steps, and its exact positions."""
    for b, pos, vel in zip(shell(), (state['shell0'] * state['stretch']).tolist(), (state['shell0'] * rate).tolist()):
        b.state.pos = Vector3(*pos)
        b.state.vel = Vector3(*vel)


def advance(rate, steps=EVERY):
    move(rate)
    run(steps)
    state['stretch'] = state['stretch'] + np.asarray(rate) * steps * O.dt


def semi_axes():
    """Of the ellipsoid that the shell leaves free."""
    return state['stretch'] * (state['inside'] + R_SHELL) - R_SHELL


def ball(radius):
    return 4 / 3. * math.pi * radius**3


def stresses():
    """Love-Weber stress, particle by particle, compression positive: of the grains with centres in the RV, and of all."""
    rv = state.get('rv', RV * min(semi_axes()))
    inner, total = Matrix3.Zero, Matrix3.Zero
    for g, s in zip(grains(), utils.bodyStressTensors()):  # each is for the volume of its own sphere
        s = s * ball(g.shape.radius)
        total += s
        if g.state.pos.norm() <= rv:
            inner += s
    return [np.array([[-m[i, j] / volume for j in range(3)] for i in range(3)])
            for m, volume in ((inner, ball(rv)), (total, ball(1) * np.prod(semi_axes())))]


def mean_stress():
    return np.trace(stresses()[0]) / 3


# ---------------------------------------------------------------- isotropic state
def settle():
    """The shell shrinks or widens until the mean stress in the RV is the one asked for and the grains rest."""
    calm = 0
    for k in range(20000):
        error = mean_stress() / ask.pressure - 1
        if k % 100 == 99:
            say('mean stress over its target', 1 + error, 'unbalanced force', utils.unbalancedForce())
            save()
        advance(np.ones(3) * max(-1.0, min(1.0, 15.0 * error)) * state['stretch'])
        calm = calm + 1 if abs(error) < 2e-3 and utils.unbalancedForce() < 2e-3 else 0
        if calm == 40:
            return
    raise RuntimeError('no isotropic equilibrium')


def grow():
    """The grains grow while the shell stands still."""
    make_bodies()
    make_engines()
    say(len(grains()), 'grains and', len(shell()), 'boundary spheres')
    factor = (1 / START_SCALE)**(1 / 400.)
    for _ in range(400):
        utils.growParticles(factor)
        run(20)
    say('grown: mean stress', mean_stress())


def compact():
    settle()
    low, high = surfaces()
    state['rv'] = RV * 0.5 * min(high - low)
    say('equilibrium with the friction of the compaction')


def isotropic():
    """The state that the compression starts from, with the friction that it has."""
    utils.setContactFriction(math.atan(FRICTION))  # of the grains and their contacts; fixed bodies keep theirs
    settle()
    for i in O.interactions:
        expected = min(ask.shell_friction, FRICTION) if max(i.id1, i.id2) >= ask.grains else FRICTION
        assert abs(i.phys.tangensOfFrictionAngle - expected) < 1e-9
    state.update(length=length(), height=state['stretch'][2], lateral=0.5 * STRAIN_RATE, p_off=0.0)
    say('isotropic: radius inside the shell', semi_axes()[0])
    frame(0, 0.0)


# ---------------------------------------------------------------- frames
def surfaces():
    position = np.array([b.state.pos for b in grains()])
    radius = np.array([[b.shape.radius] for b in grains()])
    return (position - radius).min(axis=0), (position + radius).max(axis=0)


def length():
    heights = [b.state.pos[2] for b in shell()]
    return max(heights) - min(heights)


def compress(name):
    with open(name, 'rb') as f:
        text = f.read()
    with open(name + '.gz', 'wb') as f:
        with gzip.GzipFile(filename='', mode='wb', compresslevel=6, fileobj=f, mtime=0) as z:
            z.write(text)
    os.remove(name)


def export_frame(k):
    exporter = export.VTKExporter(where('triaxial'), startSnap=k)
    exporter.exportSpheres(what=dict(id='b.id', mask='b.mask'))
    exporter.exportInteractions(what=dict(id1='i.id1', id2='i.id2', force='i.phys.normalForce+i.phys.shearForce'))
    for kind in ('spheres', 'intrs'):
        compress(where('triaxial-%s-%08d.vtk' % (kind, k)))


def contact_numbers():
    """Contacts, rattlers and contact fabric from memory. The positions are those after the last step, as in the files;
    the list of contacts is the one the forces of that step were computed from, as in the files."""
    n = ask.grains
    pairs = np.array([(i.id1, i.id2) for i in O.interactions if i.isReal])
    position = np.array([b.state.pos for b in O.bodies])
    radius = np.array([b.shape.radius for b in O.bodies])
    assert (pairs.min(axis=1) < n).all(), 'two boundary spheres interact'
    number = np.bincount(pairs.ravel(), minlength=len(position))[:n]
    first, second = pairs[pairs.max(axis=1) < n].T
    branch = position[second] - position[first]
    distance = np.sqrt((branch**2).sum(axis=1))
    normal = branch / distance[:, None]
    point = position[first] + (0.5 * (radius[first] + distance - radius[second]))[:, None] * normal  # middle of the overlap
    inner = (point**2).sum(axis=1) <= state['rv']**2
    numbers = dict(contacts=len(first), contacts_boundary=len(pairs) - len(first), rattlers=int((number < 2).sum()),
                   coordination=number.sum() / n, contacts_rv=int(inner.sum()), rv_radius=state['rv'],
                   overlap=np.mean(1 - distance / (radius[first] + radius[second])))
    for prefix, normals in (('gc_', normal), ('gcrv_', normal[inner])):
        tensor = normals.T.dot(normals) / max(len(normals), 1)
        numbers.update({prefix + name: tensor[a] for name, a in zip(NAMES, AXES)})
    return numbers


def numbers_of(k, rate):
    inner, whole = stresses()
    p, q = [np.trace(s) / 3 for s in (inner, whole)], [s[2, 2] - 0.5 * (s[0, 0] + s[1, 1]) for s in (inner, whole)]
    solid = sum(ball(g.shape.radius) for g in grains())
    numbers = dict(frame=k, iter=O.iter, time=O.time, strain=1 - length() / state['length'], p=p[0], q=q[0], p_off=state['p_off'],
                   p_whole=p[1], q_whole=q[1], unbalanced_force=utils.unbalancedForce(), grains=len(grains()), boundary=len(shell()),
                   inertial_number=abs(rate) * (R_MIN + R_MAX) * math.sqrt(DENSITY / p[0]),
                   porosity=1 - solid / (ball(1) * np.prod(semi_axes())))
    numbers.update(contact_numbers())
    return numbers


def spelt(value):
    return repr(int(value)) if isinstance(value, (int, np.integer)) else repr(float(value))


def frame(k, rate):
    """Files of the state, and its numbers."""
    move(np.zeros(3))  # the shell at its exact place
    export_frame(k)
    numbers = numbers_of(k, rate)
    with open(where('engine.csv'), 'w' if k == 0 else 'a') as table:
        if k == 0:
            table.write(','.join(COLUMNS) + '\n')
        table.write(','.join(spelt(numbers[name]) for name in COLUMNS) + '\n')
    state['p_off'] = 0.0
    say('frame', k, 'strain %.5f p %.0f q/p %.3f' % (numbers['strain'], numbers['p'], numbers['q'] / numbers['p']),
        'porosity %.4f coordination %.3f rattlers %d' % (numbers['porosity'], numbers['coordination'], numbers['rattlers']),
        'axial fabric %.4f %.4f' % tuple(1.5 * numbers[name] - 0.5 for name in ('gc_zz', 'gcrv_zz')))


def save():
    name = where('saved/%09d' % O.iter)
    O.save(name + '.yade.gz')
    with open(name + '.part', 'w') as f:
        json.dump({key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in state.items()}, f)
    os.rename(name + '.part', name + '.json')  # the last step: a save without it does not count
    for other in glob.glob(where('saved/*')):
        if not other.startswith(name):
            os.remove(other)


def go_on():
    """The state of the last save, if there is one, and engine.csv as it was then."""
    saves = sorted(glob.glob(where('saved/*.json')))
    if not saves:
        return
    with open(saves[-1]) as f:
        state.update({key: np.array(value) if isinstance(value, list) else value for key, value in json.load(f).items()})
    O.load(saves[-1].replace('.json', '.yade.gz'))
    say('goes on after stage', state['done'])
    if os.path.exists(where('engine.csv')):
        with open(where('engine.csv')) as f:
            lines = f.readlines()
        with open(where('engine.csv'), 'w') as f:
            f.writelines(lines[:state['done'] - len(STAGES) + 2])


# ---------------------------------------------------------------- compression
def compression(k):
    """To frame k: along z by one step of strain, beyond the last frame backwards, while the lateral motion holds the mean stress."""
    corrections = round(step / STRAIN_RATE / DT / EVERY)
    rate = step * state['height'] / (corrections * EVERY * DT)
    if k >= ask.frames:
        rate = -rate
    if k == ask.frames:
        state['lateral'] = -state['lateral']
    for _ in range(corrections):
        error = mean_stress() / ask.pressure - 1
        state['p_off'] = max(state['p_off'], abs(error))
        state['lateral'] += 2500.0 * error * EVERY * O.dt
        side = state['lateral'] + 25.0 * error
        stretch = state['stretch']
        advance(np.array([side * stretch[0], side * stretch[1], -rate]))
    frame(k, rate / state['stretch'][2])


def check():
    """Quasi-static, and the mean stress held: at the frames, and between them."""
    rows = np.genfromtxt(where('engine.csv'), delimiter=',', names=True)
    off = abs(rows['p'] / ask.pressure - 1).max()
    say('inertial number at most %.2g, p at the frames within %.2f %%, ever within %.2f %%' %
        (rows['inertial_number'].max(), 100 * off, 100 * rows['p_off'].max()))
    if off > 0.02 or rows['inertial_number'].max() > 1e-3:
        say('NOT HELD: the inertial number must be 1e-3 at most and p within 2 %')


STAGES = (grow, compact, isotropic)
os.makedirs(where('saved'), exist_ok=True)
go_on()
step = ask.strain / max(ask.frames - 1, 1)
last = ask.frames - 1 + (round(ask.reversal / step) if ask.reversal else 0)  # frame
for done in range(state['done'], len(STAGES) + last):
    if done < len(STAGES):
        STAGES[done]()
    else:
        compression(done - len(STAGES) + 1)
    state['done'] = done + 1
    save()
check()
