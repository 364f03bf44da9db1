"""LAMMPS' dump yaml and dump netcdf, as its source writes them."""

import numpy as np
import pytest

from tests.helpers.dumps import ROWS

# as lammps' source writes it; no build at hand does
YAML = """---
creator: LAMMPS
timestep: {step}
units: si
time: 0.5
natoms: 3
boundary: [ p, p, f, f, m, m, ]
thermo:
  - keywords: [ Step, Temp, ]
  - data: [ 100, 0, ]
box:
  - [ 0, 1.5 ]
  - [ 0, 1 ]
  - [ -1, 1 ]
  - [ 0.5, 0, 0 ]
keywords: [ id, type, x, y, z, radius, c_a[1],  ]
data:
{rows}...
"""


def yaml_text(step=100, radius="radius"):
    rows = "".join(f"  - [ {', '.join(map(str, row))}, -3, ]\n" for row in ROWS)
    return YAML.format(step=step, rows=rows).replace("radius", radius)


def netcdf(path, *, kind="f8", written=3, lengths=(1, 2, 0), name="coordinates", axes=3):
    """Two frames as dump netcdf writes them; of the second only some atoms."""
    netCDF4 = pytest.importorskip("netCDF4")  # noqa: N806
    with netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_DATA") as file:
        for dimension, size in (("frame", None), ("atom", 3), ("spatial", 3)):
            file.createDimension(dimension, size)
        file.Conventions, file.program = "AMBER", "LAMMPS"
        time = file.createVariable("time", kind, ("frame",))
        time.scale_factor = np.float32(0.5)
        triple = ("frame", "spatial")
        cell = [
            file.createVariable(f"cell_{one}", kind, triple)
            for one in ("origin", "lengths", "angles")
        ]
        id = file.createVariable("id", "i4", ("frame", "atom"))
        centre = file.createVariable(name, kind, ("frame", "atom", "spatial"))
        radius = file.createVariable("radius", kind, ("frame", "atom"))
        file.set_auto_maskandscale(False)
        for frame, count in enumerate((3, written)):
            time[frame] = 100 * frame
            for variable, values in zip(cell, ((0, -1, 0), lengths, (90, 90, 60)), strict=True):
                variable[frame] = values
            rows = np.array(ROWS)[:count]
            id[frame, :count] = rows[:, 0]
            centre[frame, :count, :axes] = rows[:, 2 : 2 + axes]
            radius[frame, :count] = rows[:, 5]
    return path
