"""The figure evolution: void and contact anisotropy over the strain."""

from __future__ import annotations

from scanfab.viz.figures.strain_curves import StrainCurves


class Evolution(StrainCurves):
    """
    Void and contact anisotropy over the strain, or over the frames.

    Bands are total standard errors, bars the scan's part. Where the principal axes are not the
    loading axis, as in simple shear, intensities are drawn, and the angle between both major axes.

    Parameters
    ----------
    data : Table
        A fabric table; on one Axes of one source, or of one variant.
    of : str, optional
        ``"voids"`` or ``"contacts"``, to draw these alone; on one Axes voids by default.

    Raises
    ------
    SettingsError
        If there is nothing to draw, or too much for one Axes.

    Examples
    --------
    >>> import scanfab
    >>> from matplotlib.figure import Figure
    >>> table = scanfab.load("sample_data/yade_triaxial/engine.csv")
    >>> table = scanfab.Table(
    ...     dict(row, source="s", variant="c", alpha_vs_axial=0.001 * k, alpha_c_axial=0.01 * k)
    ...     for k, row in enumerate(table)
    ... )
    >>> ax = Figure().subplots()
    >>> table.plot.evolution(ax=ax, of="contacts") is ax
    True
    """

    order = 1
    height = 2.9
    share = False
