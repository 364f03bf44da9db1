"""The fabrics of every table: of voids and contacts, with both errors, and their major axes."""

from __future__ import annotations

from itertools import zip_longest
from typing import Any

from scanfab.base.column import LENGTH, numbers
from scanfab.fabric.contact import axial_error
from scanfab.fabric.errors import BLOCKS
from scanfab.fabric.measured import Measured
from scanfab.fabric.tensor import FABRICS, of_both, tensor_columns, tensor_values

ORDER = (
    " (-x, -y, -z; x counts fastest; for an oblique loading axis the octants are turned so that "
    "one of their axes lies along it)"
)
FROM_SCAN = "its standard error from the scan, by the scatter of the replicates"
# the anisotropies, by the names of their columns
VOID, CONTACT = "alpha_vs_axial", "alpha_c_axial"
INDEPENDENT = "if contacts were independent; too large by about half in relaxed dense packings"
SCATTER = "by a jackknife over eight octants, in a plane four quadrants"
ANGLE = "angle between the major axes of void and contact fabric, 0 to 90"
HALF = "half their difference, which tells compare the scan's noise in a slope"


class Void:
    """The columns of the void fabric."""

    columns = (
        *numbers({"mean_length": "mean length of the kept segments, Σ w·sum / Σ w·count"}, LENGTH),
        *tensor_columns("vs", "void fabric"),
        *numbers({f"{VOID}_se": FROM_SCAN}),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None if there is no void fabric."""
        fabric, axis = measured.void, measured.axis
        if fabric is None:
            return dict.fromkeys(column.name for column in self.columns)
        own = {"mean_length": fabric.mean_length, f"{VOID}_se": fabric.axial_error(axis)}
        return own | tensor_values("vs", fabric.tensor, axis)


class Contact:
    """The columns of the contact fabric."""

    columns = (
        *tensor_columns("c", "contact fabric"),
        *numbers({f"{CONTACT}_se": f"its standard error {INDEPENDENT}"}),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None without contacts."""
        error = axial_error(measured.normals, measured.axis, measured.space)
        return {**tensor_values("c", measured.contact, measured.axis), f"{CONTACT}_se": error}


class Scatter:
    """The columns of the sample's own scatter: its error, and each anisotropy without a block."""

    columns = (
        *of_both(
            "alpha_{0}_axial_sample_se", f"the sample's own scatter of alpha_{{0}}_axial, {SCATTER}"
        ),
        *numbers(
            {
                f"{name}_without_{block}": f"{name} without the {what} of octant {block}"
                + (ORDER if block == 1 else "")
                for name, what in ((VOID, "segments"), (CONTACT, "contacts"))
                for block in range(1, BLOCKS + 1)
            }
        ),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None where there is no fabric, or none without some block."""
        found: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        void, axis = measured.void.tensor if measured.void else None, measured.axis
        for name, tensor, scatter in (
            (VOID, void, measured.void_scatter),
            (CONTACT, measured.contact, measured.contact_scatter),
        ):
            if tensor is not None and scatter is not None:
                found[f"{name}_sample_se"] = scatter.error
                without = tensor.axial(axis) + scatter.shift
                found |= {f"{name}_without_{k}": float(x) for k, x in enumerate(without, start=1)}
        return found


class Halves:
    """The columns of the scan's noise in the void fabric without each block."""

    columns = numbers(
        {
            f"{VOID}_half_{block}": f"{VOID}_without_{block} is the mean of two replicates: {HALF}"
            for block in range(1, BLOCKS + 1)
        }
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """All None where there is no void fabric, or none without some block."""
        scatter = measured.void_scatter
        halves = [] if scatter is None else scatter.half.tolist()
        # in a plane there are no blocks for the last columns
        return dict(zip_longest((column.name for column in self.columns), halves))


class Orientation:
    """The columns of the major axes of both fabrics, and of the angle: are they coaxial?"""

    columns = (
        *numbers(
            {
                f"g{one}_axis_{k}": f"{k} of the direction of the {what}'s largest principal "
                "value, a unit vector"
                for one, what in FABRICS.items()
                for k in "xyz"
            }
        ),
        *numbers({"coaxiality_deg": ANGLE}, "degrees"),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Of what there is: an angle needs both fabrics."""
        void = measured.void.tensor if measured.void else None
        contact = measured.contact
        found: dict[str, Any] = dict.fromkeys(column.name for column in self.columns)
        for prefix, tensor in (("gvs", void), ("gc", contact)):
            if tensor is not None:
                along = zip("xyz", tensor.major_axis.tolist(), strict=True)
                found |= {f"{prefix}_axis_{one}": x for one, x in along}
        if void is not None and contact is not None:
            found["coaxiality_deg"] = void.angle_to(contact)
        return found
