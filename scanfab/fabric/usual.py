"""Fabrics of every table: voids and contacts, their standard errors, and their major axes."""

from __future__ import annotations

from typing import Any

from scanfab.base.column import LENGTH, numbers
from scanfab.fabric.contact import axial_error
from scanfab.fabric.errors import BLOCKS
from scanfab.fabric.measured import Measured
from scanfab.fabric.tensor import FABRICS, of_both, tensor_columns, tensor_values

ORDER = (
    " (at -x, -y, -z; the numbers grow fastest along x; for an oblique loading axis the octants "
    "are turned so that one of their axes lies along it)"
)
FROM_SCAN = "its standard error due to the scan, from the scatter of the replicates"
# columns of the signed anisotropies
VOID, CONTACT = "alpha_vs_axial", "alpha_c_axial"
INDEPENDENT = "for independent contacts; too large by about half in relaxed dense packings"
SCATTER = "by a jackknife over eight octants, in a plane four quadrants"
ANGLE = "angle between the major axes of void and contact fabric, 0 to 90"
HALF = "half their difference, which shows compare the scan's noise in a slope"


class Void:
    """Columns of the void fabric."""

    columns = (
        *numbers({"mean_length": "mean length of the kept segments, Σ w·sum / Σ w·count"}, LENGTH),
        *tensor_columns("vs", "void fabric"),
        *numbers({f"{VOID}_se": FROM_SCAN}),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Values by column; all None if there is no void fabric."""
        fabric, axis = measured.void, measured.axis
        if fabric is None:
            return dict.fromkeys(column.name for column in self.columns)
        own = {"mean_length": fabric.mean_length, f"{VOID}_se": fabric.axial_error(axis)}
        return own | tensor_values("vs", fabric.tensor, axis)


class Contact:
    """Columns of the contact fabric."""

    columns = (
        *tensor_columns("c", "contact fabric"),
        *numbers({f"{CONTACT}_se": f"its standard error {INDEPENDENT}"}),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Values by column; all None without contacts."""
        error = axial_error(measured.normals, measured.axis, measured.space)
        return {**tensor_values("c", measured.contact, measured.axis), f"{CONTACT}_se": error}


class Scatter:
    """Columns of the error due to the sample, and of each anisotropy without each block."""

    columns = (
        *of_both(
            "alpha_{0}_axial_sample_se",
            f"standard error of alpha_{{0}}_axial due to the sample, {SCATTER}",
        ),
        *numbers(
            {
                f"{name}_without_{block}": f"{name} without the {what} of octant {block}"
                + (ORDER if block == 1 else "")
                for name, what in ((VOID, "segments"), (CONTACT, "contacts"))
                for block in range(1, BLOCKS + 1)
            }
        ),
        *numbers(
            {
                f"{VOID}_half_{k}": f"{VOID}_without_{k} is the mean of two replicates: {HALF}"
                for k in range(1, BLOCKS + 1)
            }
        ),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Values by column; None if the fabric, or the fabric without some block, is missing."""
        row: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        void, axis = measured.void.tensor if measured.void else None, measured.axis
        for name, tensor, scatter in (
            (VOID, void, measured.void_scatter),
            (CONTACT, measured.contact, measured.contact_scatter),
        ):
            if tensor is not None and scatter is not None:
                row[f"{name}_sample_se"] = scatter.error
                without = tensor.axial(axis) + scatter.shift
                row |= {f"{name}_without_{k}": float(x) for k, x in enumerate(without, start=1)}
        if measured.void_scatter is not None:
            halves = enumerate(measured.void_scatter.half.tolist(), start=1)
            row |= {f"{VOID}_half_{k}": half for k, half in halves}
        return row


class Orientation:
    """Columns of the major axes of both fabrics and of the angle between them."""

    columns = (
        *numbers(
            {
                f"g{name}_axis_{k}": f"{k} of the unit vector along the largest principal value of "
                f"the {what}"
                for name, what in FABRICS.items()
                for k in "xyz"
            }
        ),
        *numbers({"coaxiality_deg": ANGLE}, "degrees"),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Values by column; None for a missing fabric. The angle needs both fabrics."""
        void = measured.void.tensor if measured.void else None
        contact = measured.contact
        row: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        for prefix, tensor in (("gvs", void), ("gc", contact)):
            if tensor is not None:
                along = zip("xyz", tensor.major_axis.tolist(), strict=True)
                row |= {f"{prefix}_axis_{letter}": x for letter, x in along}
        if void is not None and contact is not None:
            row["coaxiality_deg"] = void.angle_to(contact)
        return row
