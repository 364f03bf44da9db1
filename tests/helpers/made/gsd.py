"""Files of HOOMD, by its own library."""

import numpy as np
import pytest

CENTRES = np.array([[-0.5, 0, 0.25], [0.5, 0, 0.25], [1.25, 0, -1]], np.float32)
BOX = (4, 3, 2, 0.5, 0.25, -0.5)


def frame(step, *, count=3, diameter=(1, 1, 0.5), box=BOX, dimensions=3):
    hoomd = pytest.importorskip("gsd.hoomd")
    one = hoomd.Frame()
    one.configuration.step = step
    one.configuration.box = box
    one.configuration.dimensions = dimensions
    one.particles.N = count
    one.particles.position = CENTRES[:count]
    one.particles.body = np.array([-1, 4, 4][:count], np.int32)
    one.particles.types = ["A", "B"]
    one.particles.typeid = [0, 1, 0][:count]
    if diameter is not None:
        one.particles.diameter = np.array(diameter[:count], np.float32)
    return one


def gsd_file(path, *frames):
    hoomd = pytest.importorskip("gsd.hoomd")
    with hoomd.open(str(path), "w") as file:
        file.extend(frames)
    return path
