"""What scan lines meet of a sample: all its grains, or those that reach into the RV."""

from __future__ import annotations

import numpy as np

from scanfab.base.typing import FloatArray
from scanfab.packing.sample import Sample
from scanfab.packing.window import Window, inner_ellipsoid
from scanfab.scan.edges import CLIP, ENDS, START
from scanfab.scan.kernels.periodic import CellGrains
from scanfab.scan.solids import Inner, Solids, margin_of


def solids_of(
    sample: Sample, window: Window | None = None, *, variants: str = "abcd", edge: str = CLIP
) -> Solids:
    """
    The spheres that scan lines may meet.

    Parameters
    ----------
    sample : Sample
        Its grains are the solids, boundary particles never; its rattlers are those that b and d
        remove.
    window : Window, optional
        The RV, which the lines of c and d are clipped to; without one these have no lines.
    variants : str, optional
        Which of a, b, c, d are to be scanned. Without a and b, grains outside the window are left
        out, and of a periodic packing the whole.
    edge : {"clip", "start", "ends"}, optional
        What counts at the window's surface.

    Returns
    -------
    Solids
        Positions relative to the window's centre; without one, to the mean of the grains' centres.
        ``origin`` is that point.

    Raises
    ------
    SettingsError
        If the window is wider than a period of the cell.
    PackingError
        If the contacts, which tell the rattlers, are not known.

    Examples
    --------
    A scan by hand, of a cubic lattice of touching spheres, whose fabric is isotropic:

    >>> import numpy as np
    >>> from scanfab import Packing, Sample, Window, direction_rule, find_contacts
    >>> from scanfab import scan_lines, solids_of, sphere, void_fabric
    >>> grid = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    >>> sample = Sample(find_contacts(Packing(grid, 0.5), 1e-4), boundary=grid[:, 2] < 0.5)
    >>> window = Window(np.full(3, 2.5), sphere(1.8))
    >>> solids = solids_of(sample, window, variants="c")
    >>> rule = direction_rule("lebedev:11")
    >>> sums = scan_lines(solids, rule, spacing=0.1, cutoff=0.5, variants="c")
    >>> fabric = void_fabric(sums.axes, rule.weights, *sums.kept("c"))
    >>> bool(fabric.tensor.alpha < 0.02)
    True
    """
    packing = sample.packing
    if window is not None:
        window.check_fits(packing)
    whole = "a" in variants or "b" in variants
    position, radius = packing.position[sample.grains], packing.radius[sample.grains]
    removed = sample.rattlers[sample.grains]
    origin = position.mean(axis=0) if window is None else window.center.copy()
    space = packing.space
    if space.across is not None:
        # exactly in the plane, as the mean would not be
        origin[space.across] = packing.place_across
    position = np.ascontiguousarray(position - origin)
    shape = None if window is None else window.shape
    reach = 0.0 if shape is None else shape.reach
    every = CellGrains(position, radius, removed, np.eye(3), np.zeros(3, bool))
    if packing.cell is not None and packing.is_periodic:
        vectors, periodic = packing.cell.short_vectors, np.array(packing.cell.periodic)
        if space.across is not None:
            # the one across the plane comes last, as long as discs are wide: then what is expected
            # of mean free paths in space holds here, too
            order = np.argsort(vectors[:, space.across] != 0.0, kind="stable")
            vectors, periodic = vectors[order], periodic[order]
            vectors[2] = 2.0 * float(radius.mean()) * space.normal
        every = every._replace(vectors=vectors, periodic=periodic)
    around = every if edge == START and shape is not None else None
    margin = 0.0 if around is None else margin_of(around)
    if packing.cell is not None and packing.is_periodic:
        medium = every if whole else None
        images, row = packing.cell.images_near_origin(position, radius + reach + margin)
        return Solids(
            images, radius[row], removed[row], shape, medium, origin, edge=edge, around=around,
            space=space,
        )  # fmt: skip
    if shape is not None and not whole:
        near = shape.may_meet(position, radius + margin)
        position, radius, removed = position[near], radius[near], removed[near]
    inner = _inner(sample, origin) if edge == ENDS and whole else None
    return Solids(
        position, radius, removed, shape, None, origin, edge=edge, around=around, inner=inner,
        space=space,
    )  # fmt: skip


def _inner(sample: Sample, origin: FloatArray) -> Inner | None:
    """Where all grains of an open sample are known."""
    packing, grains = sample.packing, sample.gathered
    largest = float(packing.radius[grains].max())
    found = inner_ellipsoid(packing.position[grains], largest, packing.space)
    return None if found is None else Inner(found.shape, found.center - origin)
