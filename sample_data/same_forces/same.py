# The grains of state.csv with springs of 2000 N/m at once: YADE 2023.02a.
# Run with:   yade -n -x -j1 same.py
import csv
import os
import sys

from yade import export, utils

FOLDER = os.path.dirname(os.path.abspath(sys.argv[0]))
cell = [(float(r['lo']), float(r['hi'])) for r in csv.DictReader(open(os.path.join(FOLDER, 'cell.csv')))]
O.periodic = True
O.cell.hSize = Matrix3(cell[0][1] - cell[0][0], 0, 0, 0, cell[1][1] - cell[1][0], 0, 0, 0, cell[2][1] - cell[2][0])
O.materials.append(FrictMat(young=1e7, poisson=0.3, density=2600, frictionAngle=0.38))
for r in csv.DictReader(open(os.path.join(FOLDER, 'state.csv'))):
	place = Vector3(*(float(r[n]) - lo for n, (lo, hi) in zip('xyz', cell)))
	O.bodies.append(utils.sphere(place, float(r['radius'])))
O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=0),
        InteractionLoop(
                [Ig2_Sphere_Sphere_ScGeom()],
                [Ip2_FrictMat_FrictMat_FrictPhys(kn=MatchMaker(algo='val', val=2000.), ks=MatchMaker(algo='val', val=1000.))],
                [Law2_ScGeom_FrictPhys_CundallStrack()],
        ),
]
O.dt = 1e-9
O.run(1, True)
O.save(os.path.join(FOLDER, 'yade.xml.bz2'))
out = export.VTKExporter(os.path.join(FOLDER, 'yade'))
out.exportSpheres(what=dict(id='b.id'))
out.exportInteractions(what=dict(id1='i.id1', id2='i.id2', normalForce='i.phys.normalForce', shearForce='i.phys.shearForce'))
out.exportPeriodicCell()
