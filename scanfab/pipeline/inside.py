"""Packings of other programs that run in the same Python: OVITO's data and YADE's live scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from scanfab.base.errors import PackingError, ScanfabError, SettingsError, note
from scanfab.base.typing import FloatArray
from scanfab.io.columns import first_of
from scanfab.packing.bodies import CLUMP_COLUMNS
from scanfab.packing.cell import Cell
from scanfab.packing.contacts import ContactList, WallForces
from scanfab.packing.packing import Packing, space_of, spelt_plane
from scanfab.pipeline.compute import compute
from scanfab.pipeline.settings import Settings
from scanfab.table.columns import FRAME_COLUMNS, JACKKNIFE
from scanfab.table.row import variant_of

# OVITO's names of properties, and the names that dumps give them
OVITO_COLUMNS = {"Particle Type": "type", "Molecule Identifier": "mol"}
NOT_COLUMNS = {"Position", "Radius", "Particle Identifier"}
# OVITO has single precision: if half axes differ by more than this fraction, it is no sphere
ROUNDED = 1e-5


def from_ovito(data: Any) -> Packing:
    """
    Make a packing of what OVITO has in memory.

    Radii are those of the particles, else those of their types. OVITO keeps them in single
    precision. Bonds are contacts; without bonds, contacts are found by geometry. The properties
    ``Particle Type`` and ``Molecule Identifier`` become the columns ``type`` and ``mol``, as in
    dumps; all others keep their names. Spheres with the same ``id_multisphere`` or ``clumpId`` are
    one grain.

    Parameters
    ----------
    data : ovito.data.DataCollection
        The result of ``pipeline.compute(frame)``, or what a modifier function gets.

    Returns
    -------
    Packing
        Lengths are in OVITO's unit, which is that of the file.

    Raises
    ------
    PackingError
        If there are no particles, or if they have no radii or are not spheres.

    Examples
    --------
    >>> import scanfab
    >>> from ovito.io import import_file  # doctest: +SKIP
    >>> pipeline = import_file("sample_data/liggghts_periodic/dump_*.txt.gz")  # doctest: +SKIP
    >>> scanfab.from_ovito(pipeline.compute(0))  # doctest: +SKIP
    Packing: 800 particles of radius 0.0007 to 0.0011, contacts not known, step 30000
      Cell: 0.01815 x 0.01815 x 0.01815 from (-0.009074, 0.006126, 0.01113), periodic
    """
    particles = data.particles
    if particles is None:
        raise PackingError("OVITO's data holds no particles")
    cell, position = None, np.array(particles["Position"])
    is_flat = data.cell is not None and bool(data.cell.is2D)
    if data.cell is not None:
        vectors, origin = np.array(data.cell[:, :3]).T, np.array(data.cell[:, 3])
        if is_flat:
            # OVITO ignores the third coordinates, and the third vector may be 0
            position[:, 2], vectors[:, 2], vectors[2] = origin[2], 0.0, (0.0, 0.0, 1.0)
        x, y, z = data.cell.pbc
        cell = Cell(vectors, (x, y, z and not is_flat), origin)
    columns = {
        OVITO_COLUMNS.get(name, name): np.array(values)
        for name, values in particles.items()
        if name not in NOT_COLUMNS
    }
    clumps = first_of(CLUMP_COLUMNS, columns)
    bonds, contacts = particles.bonds, None
    if bonds is not None and bonds.count:
        images = bonds.pbc_vectors
        contacts = ContactList(np.array(bonds.topology), None if images is None else images[...])
    return Packing(
        position,
        _ovito_radius(particles),
        id=particles.identifiers,
        columns=columns,
        bodies=None if clumps is None else columns[clumps],
        contacts=contacts,
        cell=cell,
        step=data.attributes.get("Timestep"),
        time=data.attributes.get("Time"),
        dim=2 if is_flat else _dimension("OVITO's data", position),
    )


def _ovito_radius(particles: Any) -> FloatArray:
    """The radii of particles, shape (N,), else of their types."""
    if "Aspherical Shape" in particles:
        shape = np.array(particles["Aspherical Shape"])
        if np.any(np.ptp(shape, axis=1) > ROUNDED * shape.max(axis=1)):
            raise PackingError("OVITO's particles have aspherical shapes: expected spheres")
    if "Radius" in particles:
        return np.array(particles["Radius"], np.float64)
    types = particles.particle_types
    radius = {} if types is None else {one.id: float(one.radius) for one in types.types}
    if not radius or min(radius.values()) <= 0:
        advice = "give particles the property Radius, or their types a radius"
        raise PackingError(f"OVITO's particles have no radii: {advice}")
    return np.array([radius[type] for type in types], np.float64)


def _dimension(name: str, position: FloatArray) -> int:
    """2 or 3, as for files: centres in one plane are those of discs."""
    space = space_of(position)
    if space.is_plane:
        where = spelt_plane(position, space)
        note(f"{name}: all centres lie in {space} ({where}): they are read as discs, in 2D")
    return space.dimension


def ovito_modifier(**options: Any) -> Callable[[int, Any], None]:
    """
    Make a function that adds the fabric of each frame to OVITO's attributes.

    The attributes are named by variant and column: ``scanfab.c.alpha_vs_axial``. Where there are
    several RVs, the size follows the variant. Each frame is computed alone, as OVITO asks for
    frames in any order: RV and cut-off come from the frame itself, unless they are given as
    lengths, and strains are left out. A missing value is no attribute.

    Parameters
    ----------
    **options
        Options of :func:`scanfab.compute` except `cutoffs`.

    Returns
    -------
    callable
        The function ``(frame, data)``, for ``pipeline.modifiers.append(...)``.

    Raises
    ------
    ScanfabError
        If an option has a value that cannot be used.
    TypeError
        If there is no such option; the message suggests the most similar name.

    Examples
    --------
    >>> import scanfab
    >>> modifier = scanfab.ovito_modifier(variants="cd", rv=0.6)
    >>> pipeline.modifiers.append(modifier)  # doctest: +SKIP
    >>> pipeline.compute(0).attributes["scanfab.c.alpha_vs_axial"]  # doctest: +SKIP
    0.0012
    """
    if Settings(**options).cutoffs:
        raise SettingsError("cutoffs: an attribute has one value: choose one `cutoff`")
    left_out = {column.name for column in FRAME_COLUMNS} | {"shear_strain", "volumetric_strain"}

    def add_fabric(frame: int, data: Any) -> None:
        for row in compute(from_ovito(data), **options):
            for name, value in row.items():
                is_shown = name not in left_out and not JACKKNIFE.search(name)
                if is_shown and isinstance(value, int | float | str):
                    data.attributes[f"scanfab.{variant_of(row)}.{name}"] = value

    return add_fabric


def from_yade() -> Packing:
    """
    Make a packing of YADE's live scene.

    It holds what ``O.save`` would write: spheres with ids, masks and clumps, the real interactions
    with their forces, contacts with walls and facets, the periodic cell, step and time.

    Returns
    -------
    Packing
        Lengths and forces are in the units of the scene.

    Raises
    ------
    ScanfabError
        If this Python does not run inside YADE.

    Examples
    --------
    >>> import scanfab
    >>> packings = []
    >>> def keep():
    ...     packings.append(scanfab.from_yade())
    >>> O.engines += [PyRunner(command="keep()", iterPeriod=1000)]  # doctest: +SKIP
    >>> O.run(10000, wait=True)  # doctest: +SKIP
    >>> table = scanfab.compute(packings)  # doctest: +SKIP
    """
    try:
        from yade import O  # type: ignore[import-not-found]
    except ImportError:
        advice = "run the script by `yade script.py`"
        raise ScanfabError(f"from_yade: this Python does not run inside YADE: {advice}") from None
    spheres = [body for body in O.bodies if type(body.shape).__name__ == "Sphere"]
    row = {body.id: number for number, body in enumerate(spheres)}
    touching = [one for one in O.interactions if one.isReal and (one.id1 in row or one.id2 in row)]
    # YADE lists interactions as they began; this is the order in which O.save writes them
    touching.sort(key=lambda one: sorted([one.id1, one.id2]))
    pairs = np.array([(row.get(one.id1, -1), row.get(one.id2, -1)) for one in touching], np.int64)
    pairs = pairs.reshape(-1, 2)
    image = np.array([one.cellDist for one in touching], np.int64).reshape(-1, 3)
    force = wall_forces = None
    is_inner = (pairs >= 0).all(axis=1)
    walls = np.flatnonzero(~is_inner)
    walled = pairs[walls].max(axis=1)
    if all(hasattr(one.phys, "shearForce") for one in touching):
        forces = [one.phys.normalForce + one.phys.shearForce for one in touching]
        force = np.array(forces, np.float64).reshape(-1, 3)
        # YADE's forces act on the second body; those of walls shall act on the grain
        sign = np.where(pairs[walls, 1:] >= 0, 1.0, -1.0)
        points = [touching[wall].geom.contactPoint for wall in walls]
        point = np.array(points, np.float64).reshape(-1, 3)
        wall_forces = WallForces(walled, point, sign * force[walls])
        force = force[is_inner]
    position = np.array([body.state.pos for body in spheres], np.float64).reshape(-1, 3)
    columns = {"mask": np.array([body.mask for body in spheres], np.int64)}
    clumps = np.array([body.clumpId for body in spheres], np.int64)
    if has_clumps := bool(np.any(clumps >= 0)):
        columns["clumpId"] = clumps
    return Packing(
        position,
        np.array([body.shape.radius for body in spheres], np.float64),
        id=np.array(list(row), np.int64),
        columns=columns,
        bodies=clumps if has_clumps else None,
        contacts=ContactList(pairs[is_inner], image[is_inner] if O.periodic else None, force),
        wall_contacts=np.bincount(walled, minlength=len(spheres)),
        wall_forces=wall_forces if len(walls) else None,
        # the vectors of the cell are the columns of hSize
        cell=Cell(np.array(O.cell.hSize).T) if O.periodic else None,
        step=O.iter,
        time=O.time,
        dim=_dimension("YADE's scene", position),
    )
