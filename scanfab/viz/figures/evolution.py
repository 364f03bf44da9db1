"""The figures evolution and normalised: void and contact anisotropy over the strain."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from scanfab.table.curves import abscissa_words, is_turned
from scanfab.table.table import Table
from scanfab.viz.figures.curves import ROW, Curves, Quantity
from scanfab.viz.figures.figure import one_of
from scanfab.viz.figures.style import CONTACT, LABELS, NAMES, VOID, WIDTH

ANGLE = Quantity("coaxiality_deg", "coaxiality, degrees")


class Evolution(Curves):
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
    columns = ("variant", "alpha_vs_axial", "strain", "alpha_c_axial")
    height: ClassVar[float] = 2.9
    """Of a single row of panels, inches."""

    def __init__(self, data: Table, of: str | None = None) -> None:
        self.turned = is_turned(data)
        self.of = one_of(of, ("voids", "contacts"))
        chosen = [self._quantity(name) for name in self.of]
        self.has_angle = self.turned and not self.share and of is None
        super().__init__(data, [*chosen, ANGLE] if self.has_angle else chosen)

    def _quantity(self, name: str) -> Quantity:
        """Along the loading axis; where the principal axes are turned, the intensity."""
        voids = name == "voids"
        column = ("alpha_vs" if voids else "alpha_c") + ("" if self.turned else "_axial")
        label, factor = LABELS[column], 1e3 if voids else 1e2
        if self.share:
            label, factor = f"{NAMES[column]} / largest", 1.0
        bars = voids and not self.turned and not self.share
        return Quantity(column, label, factor, "" if self.turned else "total", bars)

    @property
    def size(self) -> tuple[float, float]:
        """A row of panels for each group, and as many lines of legend."""
        lines = -(-len(self.looks) // 2)
        return WIDTH, self.height + ROW * (len(self.groups) - 1) + 0.15 * max(lines - 2, 0)

    @property
    def caption(self) -> str:
        """With the abscissa, and with what has errors."""
        what = f"{' and '.join(one.removesuffix('s') for one in self.of)} anisotropy"
        drawn = f"{what.capitalize()} along the loading axis"
        if self.turned:
            angle = ", and the angle between their major axes" if self.has_angle else ""
            drawn = f"Intensity of {what}{angle}"
        divided = ", each curve divided by its own largest absolute value" if self.share else ""
        banded = [
            name
            for name, one in zip(self.of, self.quantities, strict=False)
            if one.errors and self._has_errors(one.column)
        ]
        errors = f"with total standard errors of {' and '.join(banded)}"
        return (
            f"{drawn}, over {abscissa_words(self.data)}{divided}; "
            f"{errors if banded else 'without total errors'}."
        )

    @property
    def note(self) -> str:
        """What bands and bars are."""
        if self.turned:
            return "without errors: the table has those of the axial values only"
        alone = any(curve.contact_alone for curve in self.curves)
        which = "contacts taken as independent" if alone else "the sample's"
        parts = [f"of {VOID} scan and sample together"] * self._has_errors("alpha_vs_axial")
        parts += [f"of {CONTACT} {which}"] * self._has_errors("alpha_c_axial")
        lines = [f"bands: one total standard error, {', '.join(parts)}"] if parts else []
        scan = np.concatenate([curve.errors("alpha_vs_axial_se") for curve in self.curves])
        if np.isfinite(scan).any() and not self.share:
            largest = f"{1e3 * np.nanmax(scan):.2g}"
            lines.append(rf"bars: the scan's part, at most ${largest}\times10^{{-3}}$")
        return "\n".join(lines)

    def _has_errors(self, column: str) -> bool:
        return any(np.isfinite(curve.total_errors(column)).any() for curve in self.curves)


class Normalised(Evolution):
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
