"""Columns of every table: the fabrics of voids and contacts, their standard errors and axes."""

from __future__ import annotations

from typing import Any

from scanfab.base.column import LENGTH, numbers
from scanfab.fabric.errors import BLOCKS
from scanfab.fabric.measured import Measured
from scanfab.fabric.tensor import FABRICS, axial_error, of_both, tensor_columns, tensor_values

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


VOID_COLUMNS = (
    *numbers({"mean_length": "mean length of the kept segments, Σ w·sum / Σ w·count"}, LENGTH),
    *tensor_columns("vs", "void fabric"),
    *numbers({f"{VOID}_se": FROM_SCAN}),
)
"""Columns of the void fabric."""

CONTACT_COLUMNS = (
    *tensor_columns("c", "contact fabric"),
    *numbers({f"{CONTACT}_se": f"its standard error {INDEPENDENT}"}),
)
"""Columns of the contact fabric."""


class Usual:
    """Columns of both fabrics, of their errors and of their major axes."""

    columns = (
        *VOID_COLUMNS,
        *CONTACT_COLUMNS,
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
        """Values by column; None if a fabric, or a fabric without some block, is missing."""
        void, contact, axis = measured.void, measured.contact, measured.axis
        row: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        row[f"{CONTACT}_se"] = axial_error(measured.normals, axis, measured.space)
        if void is not None:
            row |= {"mean_length": void.mean_length, f"{VOID}_se": void.axial_error(axis)}
        for name, tensor, scatter in (
            ("vs", None if void is None else void.tensor, measured.void_scatter),
            ("c", contact, measured.contact_scatter),
        ):
            if tensor is None:
                continue
            along = zip("xyz", tensor.major_axis.tolist(), strict=True)
            row |= tensor_values(name, tensor, axis)
            row |= {f"g{name}_axis_{letter}": x for letter, x in along}
            if scatter is not None:
                signed = f"alpha_{name}_axial"
                without = enumerate((tensor.axial(axis) + scatter.shift).tolist(), start=1)
                row |= {f"{signed}_without_{k}": x for k, x in without}
                row[f"{signed}_sample_se"] = scatter.error
        if void is not None and contact is not None:
            row["coaxiality_deg"] = void.tensor.angle_to(contact)
        if void is not None and measured.void_scatter is not None:
            halves = enumerate(measured.void_scatter.half.tolist(), start=1)
            row |= {f"{VOID}_half_{k}": half for k, half in halves}
        return row
