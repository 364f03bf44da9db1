# Thirty clumps of two spheres and thirty spheres alone: what O.save and VTKRecorder say of clumps.
#
#     yade -n -x -j1 clumps.py
import os, sys, random
from yade import utils
FOLDER = os.path.dirname(os.path.abspath(sys.argv[0]))
rng = random.Random(1)
for k in range(30):
	x, y, z = (k % 5) * 0.01, (k // 5 % 3) * 0.01, (k // 15) * 0.01
	O.bodies.appendClumped([utils.sphere((x, y, z), 0.002), utils.sphere((x + 0.0025, y, z), 0.002)])
for k in range(30):
	O.bodies.append(utils.sphere(((k % 5) * 0.01, (k // 5 % 3) * 0.01, 0.02 + (k // 15) * 0.01), 0.0025))
for tag in ('author', 'isoTime', 'id', 'd.id', 'id.d'):  # YADE's own would name the machine and the hour
	O.tags[tag] = 'clumps'
O.save(os.path.join(FOLDER, 'clumps.xml.bz2'))
VTKRecorder(fileName=os.path.join(FOLDER, 'clumps_'), recorders=['spheres', 'id', 'clumpId'])()
