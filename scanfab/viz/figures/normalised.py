"""The figure normalised: the same curves, each divided by its own largest absolute value."""

from __future__ import annotations

from scanfab.viz.figures.strain_curves import StrainCurves


class Normalised(StrainCurves):
    """
    Void and contact anisotropy over the strain, each curve divided by its own largest value.

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
    """

    order = 2
    height = 2.7
    share = True
